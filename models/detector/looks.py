"""Several looks at one person: a network's answers for the same part of the image, mirrored and a little closer.

What a network is off by changes with where the joints fall on its grid and with which side is which, so the mean of
several looks is off by less, and trembles less from frame to frame (docs/video.md). Mirrored looks are the usual
"flip test" of 2D pose estimation (e.g. Newell et al., "Stacked Hourglass Networks", ECCV 2016).
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.layouts import Layout
from .crops import Crop, around
from .protocols import LOST, CropNetwork, Found

# The crop's size as a share of what the network asks for, and whether it is mirrored: the first look, the second ...
_LOOKS = ((1.0, False), (0.88, True), (1.0, True), (0.88, False))
MOST_LOOKS = len(_LOOKS)
_SAME = 0.06  # of the person's size: answers nearer to each other than this mean the same point


class SeveralLooks:
    """CropNetwork whose every look is `count` looks of another one, 2 to MOST_LOOKS.

    Of each joint the answer that most others agree with counts, and with it those that do: their mean by their scores.
    """

    def __init__(self, network: CropNetwork, count: int) -> None:
        self._network, self._further = network, _LOOKS[1:count]
        self.aspect, self.room = network.aspect, network.room
        self.layout: Layout = network.layout
        self.method = f"{network.method}, {count} looks"

    def look(self, image: np.ndarray, crop: Crop) -> Found:
        """As CropNetwork says."""
        first = self._network.look(image, crop)
        if first.sure < LOST:
            return first  # nor will further looks see anybody
        further = (self._again(image, crop, *how) for how in self._further)
        xy, score = (np.stack(parts) for parts in zip((first.xy, first.score), *further, strict=True))
        size = np.ptp(first.box.reshape(2, 2), axis=0).max()
        near = np.linalg.norm(xy[:, None] - xy[None], axis=-1) <= _SAME * size  # (looks, looks, J)
        chosen = (near * score).sum(axis=1).argmax(axis=0)  # (J,) a row of looks; of equals the earlier look
        agree = np.take_along_axis(near, chosen[None, None], axis=0)[0]  # (looks, J)
        weights = agree * np.maximum(score, 1e-6)
        mean = (weights[..., None] * xy).sum(axis=0) / weights.sum(axis=0)[:, None]
        return Found(mean, (agree * score).sum(axis=0) / agree.sum(axis=0), first.box, first.sure)

    def next_crop(self, person: Found) -> Crop:
        """As CropNetwork says."""
        return self._network.next_crop(person)

    def _again(
        self, image: np.ndarray, crop: Crop, size: float, mirrored: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """(J, 2) joints and (J,) scores of a look at a part of that size about the same middle."""
        centre = np.array([crop.left + crop.width / 2, crop.top + crop.height / 2])
        part = around(centre, size * crop.width, size * crop.height)
        if not mirrored:
            person = self._network.look(image, part)
            return person.xy, person.score
        width, other = image.shape[1], self.layout.mirror
        mirrored_part = Crop(width - part.left - part.width, part.top, part.width, part.height)
        person = self._network.look(image[:, ::-1], mirrored_part)
        return np.array([width, 0]) + person.xy[other] * (-1, 1), person.score[other]
