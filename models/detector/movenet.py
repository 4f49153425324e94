"""MoveNet: 17 COCO joints straight from the image; of one person, whom it follows, or of up to six.

Inputs and outputs as on Google's model cards (movenet/singlepose/lightning, /thunder, movenet/multipose/lightning):
(1, H, W, 3) RGB 0 to 255 -> (1, 1, 17, 3) y, x, score in shares of the input; or (1, 6, 56): 17 of those, then
ymin, xmin, ymax, xmax and score of the person. The crop that follows a person is the published recipe's: around the
hips, 1.9 times the reach of the torso or 1.2 times that of the body.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipeline.core.layouts import COCO17, Layout
from ..common.onnx import OnnxFile
from .crops import Crop, around, box_around
from .protocols import Found

_SEEN = 0.2  # score from which a joint counts as seen, of the published recipe
_HIPS = COCO17.indices(("l_hip", "r_hip"))
_TORSO = COCO17.indices(("l_shoulder", "r_shoulder", "l_hip", "r_hip"))
_TORSO_ROOM, _BODY_ROOM = 1.9, 1.2
_MULTIPOSE_SIDE = 256  # pixels of the longer side, of the model card
_MULTIPOSE_STEP = 32


class MoveNet:
    """CropNetwork of one person."""

    layout: Layout = COCO17
    aspect = 1.0
    room = 1.25

    def __init__(self, network: OnnxFile) -> None:
        self._network = network
        (shape,) = network.inputs.values()
        self._side = shape[1] or 192
        self.method = f"movenet@{network.digest}"

    def look(self, image: np.ndarray, crop: Crop) -> Found:
        """As CropNetwork says."""
        cropped = crop.cut(image, (self._side, self._side)).astype(self._network.input_dtype)
        return _person(crop, self._network.run(cropped[None])[0].reshape(17, 3))

    def next_crop(self, person: Found) -> Crop:
        """As CropNetwork says."""
        centre = person.xy[_HIPS].mean(axis=0)
        off = np.abs(person.xy - centre).max(axis=1)
        body = off[person.score > _SEEN].max(initial=0)
        side = 2 * max(_TORSO_ROOM * off[_TORSO].max(), _BODY_ROOM * body)
        return around(centre, side, side)


class MultiMoveNet:
    """Detector of up to six people, each frame by itself."""

    layout: Layout = COCO17

    def __init__(self, network: OnnxFile) -> None:
        self._network = network
        self.method = f"movenet-multipose@{network.digest}"

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says."""
        height, width = image.shape[:2]
        scale = _MULTIPOSE_SIDE / max(height, width)
        size = (_stepped(width * scale), _stepped(height * scale))
        crop = Crop(0, 0, round(size[0] / scale), round(size[1] / scale))
        cropped = crop.cut(image, size).astype(self._network.input_dtype)
        rows = self._network.run(cropped[None])[0][0]
        return tuple(_person(crop, row[:51].reshape(17, 3)) for row in rows if row[55] > _SEEN)


def _stepped(side: float) -> int:
    return max(-(-round(side) // _MULTIPOSE_STEP), 1) * _MULTIPOSE_STEP


def _person(crop: Crop, answer: np.ndarray) -> Found:
    """The person of an answer (17, 3): y, x in shares of the crop, score."""
    xy, score = crop.in_image(answer[:, 1::-1]), np.clip(answer[:, 2], 0, 1)
    seen = score > _SEEN
    return Found(xy, score, box_around(xy[seen] if seen.any() else xy), float(score[_TORSO].mean()))
