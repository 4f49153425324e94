"""A function of the user's own as a detector: an RGB image (H, W, 3) uint8 -> keypoints of everybody (people, K, 3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import COCO17, Layout
from ...pipeline.core.rotations import is_finite
from ...pipeline.reading.given import layout_in_2d, numbers
from ..common.function import failed, name_of
from .protocols import Found


class FunctionDetector:
    """A Detector (protocols.py) whose `people` asks the function.

    function: image (H, W, 3) uint8 RGB -> (people, K, 3): x and y in pixels of the image, and a score in [0, 1]; a
        joint that is NaN or at 0, 0 was not found. None or an empty list where nobody is. Also torch tensors and lists.
    joints: a layout by name; without it the usual one of K joints, of a body with face and hands its first joints.
    """

    def __init__(self, function: Callable[..., Any], joints: str | None = None) -> None:
        self._function, self._joints = function, joints
        self._count: int | None = None  # of joints, which the first person tells
        self.method = f"{name_of(function)} (a function)"
        self.layout: Layout = COCO17

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says. InputError where the function raises, or answers something else."""
        try:
            answer = self._function(image)
        except Exception as error:
            raise failed("detect", self._function, error) from error
        if answer is None:
            return ()
        try:
            points = numbers(answer, "keypoints")
            if points.ndim and not len(points):
                return ()
            if points.ndim != 3 or points.shape[2] != 3 or self._count not in (None, points.shape[1]):
                count = "K" if self._count is None else self._count
                raise InputError(
                    "wrong-content", f"expected the shape (people, {count}, 3), got {points.shape}."
                )
            if self._count is None:
                self.layout = layout_in_2d(points.shape[1], self._joints, "its keypoints")
                self._count = points.shape[1]
        except InputError as error:
            raise failed("detect", self._function, str(error)) from None
        people = (_found(person) for person in points[:, : len(self.layout)])
        return tuple(person for person in people if person is not None)


def _found(points: np.ndarray) -> Found | None:
    """One person of keypoints (K, 3); None where there is no joint."""
    visible = np.asarray(is_finite(points[:, :2])) & points[:, :2].any(axis=-1)
    if not visible.any():
        return None
    score = np.where(visible, np.clip(np.nan_to_num(points[:, 2]), 0, 1), 0)
    low, high = points[visible, :2].min(axis=0), points[visible, :2].max(axis=0)
    xy = np.where(visible[:, None], points[:, :2], (low + high) / 2)  # what has no score counts for nothing
    return Found(xy, score, np.concatenate([low, high]), float(score[visible].mean()))
