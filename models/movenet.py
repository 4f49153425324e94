"""MoveNet: 17 COCO joints straight from the picture; of one person, whom it follows, or of up to six.

Inputs and outputs as on Google's model cards (movenet/singlepose/lightning, /thunder, movenet/multipose/lightning):
(1, H, W, 3) RGB 0 to 255 -> (1, 1, 17, 3) y, x, score in shares of the input; or (1, 6, 56): 17 of those, then
ymin, xmin, ymax, xmax and score of the person. The crop that follows a person is the published recipe's: around the
hips, 1.9 times the reach of the torso or 1.2 times that of the body.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..pipeline.layouts import COCO17, Layout
from .crops import Crop, around, box_around, whole_square
from .detection import Found
from .onnx_file import OnnxFile

_SEEN = 0.2  # score from which a joint counts as seen, of the published recipe
_TORSO = COCO17.indices(("l_shoulder", "r_shoulder", "l_hip", "r_hip"))
_SHOULDERS, _HIPS = _TORSO[:2], _TORSO[2:]
_TORSO_ROOM, _BODY_ROOM = 1.9, 1.2
_MULTIPOSE_SIDE = 256  # pixels of the longer side, of the model card
_MULTIPOSE_STEP = 32


class MoveNet:
    """Detector of one person: looks around the person of the frame before, or at the whole picture."""

    layout: Layout = COCO17

    def __init__(self, network: OnnxFile) -> None:
        self._network = network
        (shape,) = network.inputs.values()
        self._side = shape[1] or 192
        self.method = f"movenet@{network.digest}"

    def people(self, picture: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says; the first of `before` is followed."""
        whole = whole_square(picture)
        crop = _following(before[0], whole) if before else whole
        found = self._look(picture, crop)
        if found is None and crop != whole:
            found = self._look(picture, whole)
        return () if found is None else (found,)

    def _look(self, picture: np.ndarray, crop: Crop) -> Found | None:
        image = crop.cut(picture, (self._side, self._side)).astype(self._network.input_dtype)
        (answer,) = self._network.run(image[None])
        return _person(crop, answer.reshape(17, 3))


class MultiMoveNet:
    """Detector of up to six people, each frame by itself."""

    layout: Layout = COCO17

    def __init__(self, network: OnnxFile) -> None:
        self._network = network
        self.method = f"movenet-multipose@{network.digest}"

    def people(self, picture: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says."""
        height, width = picture.shape[:2]
        scale = _MULTIPOSE_SIDE / max(height, width)
        size = tuple(-(-round(side * scale) // _MULTIPOSE_STEP) * _MULTIPOSE_STEP for side in (width, height))
        crop = Crop(0, 0, round(size[0] / scale), round(size[1] / scale))
        image = crop.cut(picture, size).astype(self._network.input_dtype)
        (answer,) = self._network.run(image[None])
        people = (_person(crop, row[:51].reshape(17, 3)) for row in answer[0] if row[55] > _SEEN)
        return tuple(person for person in people if person is not None)


def _person(crop: Crop, answer: np.ndarray) -> Found | None:
    """The person of an answer (17, 3): y, x in shares of the crop, score; None when no torso is seen."""
    xy, score = crop.in_picture(answer[:, 1::-1]), np.clip(answer[:, 2], 0, 1)
    if not _torso_seen(score):
        return None
    return Found(xy, score, box_around(xy[score > _SEEN]))


def _torso_seen(score: np.ndarray) -> bool:
    return bool((score[_SHOULDERS] > _SEEN).any() and (score[_HIPS] > _SEEN).any())


def _following(person: Found, whole: Crop) -> Crop:
    centre = person.xy[_HIPS].mean(axis=0)
    off = np.abs(person.xy - centre).max(axis=1)
    half = max(_TORSO_ROOM * off[_TORSO].max(), _BODY_ROOM * off[person.score > _SEEN].max())
    return whole if 2 * half >= whole.width else around(centre, 2 * half, 2 * half)
