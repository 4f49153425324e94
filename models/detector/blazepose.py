"""BlazePose's landmark network: 33 landmarks in the image, with where to look in the next frame.

As MediaPipe's pose_landmark_*.tflite after conversion: input (1, 256, 256, 3) RGB 0 to 1; outputs (1, 195), 39 points
of x, y, z in pixels of the crop, visibility and presence before the sigmoid, of which 33 are landmarks and the next two
are the middle of the hips and a point on the circle around the whole body; and (1, 1), the probability of a person.
MediaPipe's crop is 1.25 times that circle; it also turns it with the body, which is not done here.
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.layouts import BLAZEPOSE33, Layout
from ..common.onnx import OnnxFile
from .crops import Crop, fitted
from .protocols import Found

_LANDMARKS, _POINTS = (None, 195), 39
_FLAG = (None, 1)
_CENTRE, _ON_CIRCLE = 33, 34


def is_blazepose(network: OnnxFile) -> bool:
    """Whether a network has BlazePose's input and outputs."""
    (image, *others), outputs = network.inputs.values(), _batchless(network)
    return not others and len(image) == 4 and image[3] == 3 and {_LANDMARKS, _FLAG} <= set(outputs.values())


class BlazePose:
    """CropNetwork with BlazePose's landmarks."""

    layout: Layout = BLAZEPOSE33
    aspect = 1.0
    room = 1.25

    def __init__(self, network: OnnxFile) -> None:
        self._network = network
        (shape,) = network.inputs.values()
        self._side = shape[1] or 256
        shapes = list(_batchless(network).values())
        self._landmarks, self._flag = shapes.index(_LANDMARKS), shapes.index(_FLAG)
        self.method = f"blazepose@{network.digest}"

    def look(self, image: np.ndarray, crop: Crop) -> Found:
        """As CropNetwork says."""
        cropped = crop.cut(image, (self._side, self._side)).astype(np.float32) / 255
        answers = self._network.run(cropped[None])
        points = answers[self._landmarks].reshape(_POINTS, 5)
        xy = crop.in_image(points[:, :2] / self._side)
        score = 1 / (1 + np.exp(-np.clip(points[: len(self.layout), 3], -30, 30)))
        radius = np.linalg.norm(xy[_ON_CIRCLE] - xy[_CENTRE])
        box = np.concatenate([xy[_CENTRE] - radius, xy[_CENTRE] + radius])
        sure = float(answers[self._flag].reshape(-1)[0])
        return Found(xy[: len(self.layout)], score, box, sure)

    def next_crop(self, found: Found) -> Crop:
        """As CropNetwork says."""
        return fitted(found.box, self.aspect, self.room)


def _batchless(network: OnnxFile) -> dict[str, tuple[int | None, ...]]:
    return {name: (None, *shape[1:]) for name, shape in network.outputs.items()}
