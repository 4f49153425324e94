"""From a network that looks into a part of the image to a detector: one person followed, or everybody in boxes.

A person may be looked at twice, the second time mirrored and a little closer. What a network is off by changes with
where the joints fall on its grid and with which side is which, so the mean of both looks is off by less, and trembles
less from frame to frame (docs/video.md). Mirrored looks are the usual "flip test" of 2D pose estimation (e.g. Newell et
al., "Stacked Hourglass Networks", ECCV 2016).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...pipeline.core.layouts import Layout
from .protocols import LOST, Crop, CropNetwork, Found, PersonNetwork, around, fitted

_FOUND = 0.5  # as sure as this of a second look, somebody was found
_HINT = 0.1  # as sure as this, a first look is worth a second
_CLOSER = 3  # looks more, each closer than the one before
_SECOND = 0.88  # the crop's size at the second look, as a share of what the network asks for
_SAME = 0.06  # of the person's size: answers nearer to each other than this mean the same point


def looked_twice(network: CropNetwork, image: np.ndarray, crop: Crop) -> Found:
    """As CropNetwork.look at an image (H, W, 3), by two looks. Of a joint on which both agree the answer is their mean
    by their scores, of others that of the surer look."""
    first = network.look(image, crop)
    if first.sure < LOST:
        return first  # nor will another look see anybody
    # A smaller part about the same middle, of the mirrored image.
    centre = np.array([crop.left + crop.width / 2, crop.top + crop.height / 2])
    part = around(centre, _SECOND * crop.width, _SECOND * crop.height)
    width, other = image.shape[1], network.layout.mirror
    again = network.look(
        image[:, ::-1], Crop(width - part.left - part.width, part.top, part.width, part.height)
    )
    xy = np.stack([first.xy, np.array([width, 0]) + again.xy[other] * (-1, 1)])
    score = np.stack([first.score, again.score[other]])
    size = np.ptp(first.box.reshape(2, 2), axis=0).max()
    near = np.linalg.norm(xy[0] - xy[1], axis=-1) <= _SAME * size
    surer = np.array([score[0] >= score[1], score[0] < score[1]])
    counts = np.where(near, True, surer)  # (looks, J)
    weights = counts * np.maximum(score, 1e-6)
    mean = (weights[..., None] * xy).sum(axis=0) / weights.sum(axis=0)[:, None]
    return Found(mean, (counts * score).sum(axis=0) / counts.sum(axis=0), first.box, first.sure)


class Follower:
    """Detector of one person: looks where the person was, and all over the image when there was none or it is lost.

    A person much smaller than the image is overlooked in all of it, so squares as wide as its shorter side are
    searched as well, with one look each. Whoever is found has to be seen as surely by a look more.
    """

    def __init__(self, network: CropNetwork, twice: bool = False) -> None:
        """twice: whether a person who was found is looked at twice."""
        self._network, self._twice = network, twice
        self._look = partial(looked_twice, network) if twice else network.look
        self.method = f"{network.method}{', 2 looks' * twice}"
        self.layout: Layout = network.layout

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says; the first of `before` is followed."""
        for person in before[:1]:
            person_now = self._look(image, self._network.next_crop(person))
            if person_now.sure >= LOST and _middle_inside(person_now, image):
                return (person_now,)
        person_now = self._search(image)
        if person_now is None:
            return ()
        # A tree that passes for somebody in one look seldom does so in another, where the next frame looks.
        again = self._look(image, self._network.next_crop(person_now))
        if again.sure < _FOUND:
            return ()
        return (again if self._twice else person_now,)

    def _search(self, image: np.ndarray) -> Found | None:
        best = None
        for window in _windows(image):
            person = self._network.look(image, fitted(window, self._network.aspect))
            for _ in range(_CLOSER):
                if person.sure >= _HINT:
                    person = self._network.look(image, self._network.next_crop(person))
            if person.sure < _FOUND or not _middle_inside(person, image):
                continue
            # Of equals that of the larger window, which shows all of it.
            if best is None or person.sure > best.sure:
                best = person
        return best


class TopDown:
    """Detector of everybody whom a network of people finds."""

    def __init__(self, network: CropNetwork, persons: PersonNetwork, twice: bool = False) -> None:
        """twice: whether every person is looked at twice."""
        self._network, self._persons = network, persons
        self._look = partial(looked_twice, network) if twice else network.look
        self.method = f"{network.method}{', 2 looks' * twice}+{persons.method}"
        self.layout: Layout = network.layout

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says."""
        network = self._network
        crops = (fitted(box, network.aspect, network.room) for box in self._persons.boxes(image))
        everybody = (self._look(image, crop) for crop in crops)
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
