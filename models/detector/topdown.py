"""From a network that looks into a part of the image to a detector: one person followed, or everybody in boxes.

A person may be looked at several times, mirrored and a little closer. What a network is off by changes with where the
joints fall on its grid and with which side is which, so the mean of several looks is off by less, and trembles less
from frame to frame (docs/video.md). Mirrored looks are the usual "flip test" of 2D pose estimation (e.g. Newell et al.,
"Stacked Hourglass Networks", ECCV 2016).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipeline.core.layouts import Layout
from .crops import Crop, around, fitted
from .protocols import LOST, CropNetwork, Found, PersonNetwork

_FOUND = 0.5  # as sure as this of a second look, somebody was found
_HINT = 0.1  # as sure as this, a first look is worth a second
_CLOSER = 3  # looks more, each closer than the one before
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


class Follower:
    """Detector of one person: looks where the person was, and all over the image when there was none or it is lost.

    A person much smaller than the image is overlooked in all of it, so squares as wide as its shorter side are
    searched as well, with one look each. Whoever is found has to be seen as surely by a look more.
    """

    def __init__(self, network: CropNetwork, looks: int = 1) -> None:
        """looks: at the person, once it is found."""
        self._one, self._network = network, SeveralLooks(network, looks) if looks > 1 else network
        self.method = self._network.method
        self.layout: Layout = network.layout

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says; the first of `before` is followed."""
        for person in before[:1]:
            person_now = self._network.look(image, self._network.next_crop(person))
            if person_now.sure >= LOST and _middle_inside(person_now, image):
                return (person_now,)
        person_now = self._search(image)
        if person_now is None:
            return ()
        # A tree that passes for somebody in one look seldom does so in another, where the next frame looks.
        again = self._network.look(image, self._one.next_crop(person_now))
        if again.sure < _FOUND:
            return ()
        return (person_now if self._network is self._one else again,)

    def _search(self, image: np.ndarray) -> Found | None:
        best = None
        for window in _windows(image):
            person = self._one.look(image, fitted(window, self._one.aspect))
            for _ in range(_CLOSER):
                if person.sure >= _HINT:
                    person = self._one.look(image, self._one.next_crop(person))
            if person.sure < _FOUND or not _middle_inside(person, image):
                continue
            if (
                best is None or person.sure > best.sure
            ):  # of equals that of the larger window, which shows all of it
                best = person
        return best


class TopDown:
    """Detector of everybody whom a network of people finds."""

    def __init__(self, network: CropNetwork, persons: PersonNetwork, looks: int = 1) -> None:
        """looks: at every person."""
        self._network = SeveralLooks(network, looks) if looks > 1 else network
        self._persons = persons
        self.method = f"{self._network.method}+{persons.method}"
        self.layout: Layout = network.layout

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says."""
        network = self._network
        crops = (fitted(box, network.aspect, network.room) for box in self._persons.boxes(image))
        everybody = (network.look(image, crop) for crop in crops)
        return tuple(person for person in everybody if person.sure >= LOST)


def _windows(image: np.ndarray) -> list[np.ndarray]:
    """Boxes (4,): the whole image; and, unless it is square, squares along its longer side that half overlap."""
    size = np.array(image.shape[1::-1], dtype=float)
    side, long = size.min(), int(size.argmax())
    windows = [np.array([0, 0, *size])]
    steps = int(np.ceil(2 * (size.max() / side - 1)))
    for start in np.linspace(0, size.max() - side, steps + 1) if steps else ():
        corner = np.zeros(2)
        corner[long] = start
        windows.append(np.concatenate([corner, corner + side]))
    return windows


def _middle_inside(person: Found, image: np.ndarray) -> bool:
    middle = (person.box[:2] + person.box[2:]) / 2
    return bool((middle >= 0).all() and (middle < image.shape[1::-1]).all())
