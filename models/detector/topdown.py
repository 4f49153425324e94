"""From a network that looks into a part of the image to a detector: one person followed, or everybody in boxes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipeline.core.layouts import Layout
from .crops import fitted
from .looks import SeveralLooks
from .protocols import LOST, CropNetwork, Found, PersonNetwork

_FOUND = 0.5  # as sure as this of a second look, somebody was found
_HINT = 0.1  # as sure as this, a first look is worth a second
_LOOKS = 3  # more, each closer than the one before


class Follower:
    """Detector of one person: looks where the person was, and all over the image when there was none or it is lost.

    A person much smaller than the image is overlooked in all of it, so squares as wide as its shorter side are
    searched as well, with one look each. Whoever is found has to be seen as surely by a look more.
    """

    def __init__(self, network: CropNetwork, looks: int = 1) -> None:
        """looks: at the person, once it is found (looks.py)."""
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
            for _ in range(_LOOKS):
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
        """looks: at every person (looks.py)."""
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
