"""MoveNet: 17 COCO joints of one person straight from the image.

Inputs and outputs as on Google's model cards (movenet/singlepose/lightning, /thunder): (1, H, W, 3) RGB 0 to 255 ->
(1, 1, 17, 3) y, x, score in shares of the input. The crop that follows a person is the published recipe's: around the
hips, 1.9 times the reach of the torso or 1.2 times that of the body.
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.layouts import COCO17, Layout
from ..common.onnx import OnnxFile
from .crops import Crop, around, box_around
from .protocols import Found

_SEEN = 0.2  # score from which a joint counts as seen, of the published recipe
_HIPS = COCO17.indices(("l_hip", "r_hip"))
_TORSO = COCO17.indices(("l_shoulder", "r_shoulder", "l_hip", "r_hip"))
_TORSO_ROOM, _BODY_ROOM = 1.9, 1.2


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
        answer = self._network.run(cropped[None])[0].reshape(17, 3)
        xy, score = crop.in_image(answer[:, 1::-1]), np.clip(answer[:, 2], 0, 1)
        seen = score > _SEEN
        return Found(xy, score, box_around(xy[seen] if seen.any() else xy), float(score[_TORSO].mean()))

    def next_crop(self, person: Found) -> Crop:
        """As CropNetwork says."""
        centre = person.xy[_HIPS].mean(axis=0)
        off = np.abs(person.xy - centre).max(axis=1)
        body = off[person.score > _SEEN].max(initial=0)
        side = 2 * max(_TORSO_ROOM * off[_TORSO].max(), _BODY_ROOM * body)
        return around(centre, side, side)
