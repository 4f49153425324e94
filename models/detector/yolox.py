"""YOLOX as MMDeploy and rtmlib export it: people's boxes.

Input (1, 3, H, W), BGR 0 to 255; outputs `dets` (1, N, 5) left, top, right, bottom, score in pixels of the input, boxes
that overlap removed in the network, and `labels` (1, N), 0 for a person, unless it finds nothing else.
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.errors import InputError
from ..common.onnx import OnnxFile
from .crops import Crop

_SIDE = 640  # pixels, where the network takes any
_GREY = 114  # beyond the image, as it was trained
_SURE = 0.3  # score of a person, rtmlib's
_OVERLAP = 0.45  # of two boxes over their union, beyond which they are one person; rtmlib's


class PersonBoxes:
    """PersonNetwork of YOLOX."""

    def __init__(self, network: OnnxFile) -> None:
        images, shapes = list(network.inputs.values()), list(network.outputs.values())
        boxes = [i for i, shape in enumerate(shapes) if len(shape) == 3 and (shape[2] or 5) == 5]
        labels = [i for i, shape in enumerate(shapes) if len(shape) == 2]
        takes_one = len(images) == 1 and len(images[0]) == 4 and images[0][1] == 3
        if not takes_one or len(boxes) != 1 or len(boxes) + len(labels) != len(shapes):
            raise InputError(
                "wrong-network", f"{network.path} is not a network that finds people: {network.looks}."
            )
        self._network = network
        self._size = (images[0][3] or _SIDE, images[0][2] or _SIDE)
        self._boxes, self._labels = boxes[0], labels[0] if labels else None
        self.method = f"people@{network.digest}"

    def boxes(self, image: np.ndarray) -> np.ndarray:
        """As PersonNetwork says, best first."""
        import cv2

        width, height = self._size
        scale = min(width / image.shape[1], height / image.shape[0])
        crop = Crop(0, 0, round(width / scale), round(height / scale))
        cropped = crop.cut(image, self._size, _GREY)[..., ::-1].astype(np.float32)
        answers = self._network.run(np.ascontiguousarray(cropped.transpose(2, 0, 1)[None]))
        rows = answers[self._boxes][0].astype(np.float64)
        if self._labels is not None:
            rows = rows[answers[self._labels][0] == 0]
        left_top, right_bottom, score = rows[:, :2], rows[:, 2:4], rows[:, 4]
        sized = np.hstack([left_top, right_bottom - left_top])
        # Of boxes that overlap much the best alone.
        kept = np.array(cv2.dnn.NMSBoxes(sized.tolist(), score.tolist(), _SURE, _OVERLAP), dtype=int).ravel()
        return crop.in_image(rows[kept, :4].reshape(-1, 2, 2) / self._size).reshape(-1, 4)
