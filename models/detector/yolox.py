"""Networks that find people's boxes: YOLOX and RTMDet as MMDetection, MMDeploy and rtmlib export them.

Inputs (1, 3, H, W). With overlapping boxes removed in the network: `dets` (1, N, 5) left, top, right, bottom, score in
pixels of the input, and `labels` (1, N), 0 for a person. Without: (1, N, 5 + classes), the centre and the logarithm of
the size of each cell of the grids of 8, 16 and 32 pixels, the score of any object and those of the classes, the first
of which is a person (YOLOX's own export). YOLOX takes BGR 0 to 255, RTMDet BGR less mean over deviation.
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.messages import how_many
from ...pipeline.reading.tracker import overlap
from ..common.onnx import OnnxFile
from .crops import Crop

_SIDE = 640  # pixels, where the network takes any
_GREY = 114  # beyond the image, as both were trained
_MEAN = np.array([103.53, 116.28, 123.675], dtype=np.float32)
_DEVIATION = np.array([57.375, 57.12, 58.395], dtype=np.float32)
_STRIDES = (8, 16, 32)
_SURE = 0.3  # score of a person, rtmlib's
_OVERLAP = 0.45  # of two boxes over their union, beyond which they are one person; rtmlib's


class PersonBoxes:
    """PersonNetwork of YOLOX or RTMDet."""

    def __init__(self, network: OnnxFile, normalised: bool) -> None:
        """normalised: the input is less mean over deviation (RTMDet), not 0 to 255 (YOLOX)."""
        (image,), shapes = network.inputs.values(), list(network.outputs.values())
        boxes = [i for i, shape in enumerate(shapes) if len(shape) == 3 and (shape[2] or 5) >= 5]
        labels = [i for i, shape in enumerate(shapes) if len(shape) == 2]
        if len(image) != 4 or image[1] != 3 or len(boxes) != 1 or len(boxes) + len(labels) != len(shapes):
            raise InputError(
                "wrong-network", f"{network.path} is not a network that finds people: {network.looks}."
            )
        self._network, self._normalised = network, normalised
        self._size = (image[3] or _SIDE, image[2] or _SIDE)
        self._boxes, self._labels = boxes[0], labels[0] if labels else None
        self._raw = not labels and (shapes[boxes[0]][2] or 5) > 5
        self.method = f"people@{network.digest}"

    def boxes(self, image: np.ndarray) -> np.ndarray:
        """As PersonNetwork says, best first."""
        width, height = self._size
        scale = min(width / image.shape[1], height / image.shape[0])
        crop = Crop(0, 0, round(width / scale), round(height / scale))
        cropped = crop.cut(image, self._size, _GREY)[..., ::-1].astype(np.float32)
        if self._normalised:
            cropped = (cropped - _MEAN) / _DEVIATION
        answers = self._network.run(np.ascontiguousarray(cropped.transpose(2, 0, 1)[None]))
        boxes, score = self._decoded(answers)
        boxes, score = boxes[score > _SURE], score[score > _SURE]
        corners = boxes.reshape(-1, 2, 2) / self._size
        return _apart(crop.in_image(corners).reshape(-1, 4), score)

    def _decoded(self, answers: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        rows = answers[self._boxes][0].astype(np.float64)
        if not self._raw:
            people = np.ones(len(rows), dtype=bool) if self._labels is None else answers[self._labels][0] == 0
            return rows[people, :4], rows[people, 4]
        corner, stride = _grid(self._size)
        if len(rows) != len(corner):
            raise InputError(
                "wrong-network",
                f"{self._network.path}: expected {how_many(len(corner), 'cell')} of 8, 16 and 32 pixels, "
                f"got {len(rows)}.",
            )
        centre = (rows[:, :2] + corner) * stride[:, None]
        half = np.exp(rows[:, 2:4]) * stride[:, None] / 2
        return np.concatenate([centre - half, centre + half], axis=1), rows[:, 4] * rows[:, 5]


def _grid(size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) column and row of each cell, and (N,) its pixels."""
    corners, strides = [], []
    for stride in _STRIDES:
        columns, rows = np.meshgrid(np.arange(size[0] // stride), np.arange(size[1] // stride))
        corners.append(np.stack([columns.ravel(), rows.ravel()], axis=1))
        strides.append(np.full(columns.size, stride))
    return np.concatenate(corners), np.concatenate(strides)


def _apart(boxes: np.ndarray, score: np.ndarray) -> np.ndarray:
    """Of boxes that overlap much the best alone (non-maximum suppression)."""
    kept: list[np.ndarray] = []
    for box in boxes[np.argsort(-score, kind="stable")]:
        if all(overlap(box, other) < _OVERLAP for other in kept):
            kept.append(box)
    return np.array(kept).reshape(-1, 4)
