"""BlazePose's landmark network, which gives world landmarks in metres.

Inputs and outputs as the MediaPipe repository's pose_landmark models have them: (1, 256, 256, 3) RGB 0 to 1 -> 33
landmarks and 6 helpers as (1, 195): x, y, z in crop pixels, logits of visibility and presence; (1, 1) probability that
a person is there; (1, 117) world landmarks. The crop is that of its pose tracking (pose_landmarks_to_roi.pbtxt): a
square around the middle of the hips, 1.25 times as large as the circle around the body, turned until the trunk is
upright; the landmarks are turned back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...pipeline.core.layouts import BLAZEPOSE33, H36M17
from ...pipeline.core.rotations import is_finite, rotate
from ..common.onnx import OnnxFile
from ..detector.blazepose import is_blazepose
from .crop_rays import from_ray
from .images import SEEN, Crops, Seen, View
from .scaling import filled

_ROOM = 1.25
_SIDE = 256  # of the crop for a network that leaves it open
_COUNT = len(BLAZEPOSE33)
_HELPERS = 6
_HEAD = H36M17.index("head")  # detectors put it between the ears or at the top
_VISIBILITY = 3


@dataclass(frozen=True, eq=False)
class BlazePose:
    """An ImageNetwork; visibility becomes the confidence."""

    network: OnnxFile
    kind = "blazepose"
    licence = "Apache-2.0 (MediaPipe)"
    layout = BLAZEPOSE33
    unit = "m"
    mirror = BLAZEPOSE33.mirror
    enough = 0.5  # probability from which the answer counts, as in MediaPipe

    @property
    def size(self) -> tuple[int, int]:
        side = self.network.only_input[1] or _SIDE
        return side, side

    def crops(self, pixels: np.ndarray, confidence: np.ndarray, rows: np.ndarray) -> Crops:
        """As ImageNetwork says."""
        return crops_around(pixels, confidence, rows)

    def conditions(self, crops: Crops, view: View) -> np.ndarray:
        """None."""
        return np.zeros((len(crops.centre), 0))

    def look(self, crop: np.ndarray, condition: np.ndarray) -> Seen:
        """World landmarks in the axes of the crop."""
        by_size = {answer.size: answer for answer in self.network.run(crop[None] / 255)}
        points = _COUNT + _HELPERS
        logit = by_size[5 * points].reshape(points, 5)[:_COUNT, _VISIBILITY].astype(np.float64)
        world = by_size[3 * points].reshape(points, 3)[:_COUNT].astype(np.float64)
        return Seen(world, 1 / (1 + np.exp(-logit)), float(by_size[1].item()))

    def bodies(
        self, points: np.ndarray, crops: Crops, view: View
    ) -> tuple[np.ndarray, np.ndarray | None, dict[str, Any]]:
        """As ImageNetwork says; where they are is not known."""
        turn = np.tile(np.eye(3), (len(points), 1, 1))
        turn[:, :2, :2] = crops.R_image_from_crop
        joints, said = from_ray(
            rotate(turn, points), view.straight(crops.centre), view.image_size, view.focal_px
        )
        return joints, None, said


def is_blazepose_lifter(network: OnnxFile) -> bool:
    """Whether an opened network is BlazePose's with world landmarks."""
    world = 3 * (_COUNT + _HELPERS)
    return is_blazepose(network) and any(shape[1:] == (world,) for shape in network.outputs.values())


def crops_around(pixels: np.ndarray, confidence: np.ndarray, rows: np.ndarray) -> Crops:
    """Where the person of H36M17 keypoints (N, 17, 2) and confidence (N, 17) is, at these rows."""
    sure = is_finite(pixels) & ~(confidence < SEEN)
    sure[:, _HEAD] = False
    points = filled(pixels)
    hips, shoulders = (
        points[:, H36M17.indices((f"l_{part}", f"r_{part}"))].mean(axis=1) for part in ("hip", "shoulder")
    )
    reach = np.where(sure, np.linalg.norm(points - hips[:, None], axis=-1), 0.0).max(axis=1)
    reach = np.where(reach > 0, reach, np.nan)
    frame, seen = np.arange(len(reach)), np.isfinite(reach)
    reach = np.interp(frame, frame[seen], reach[seen]) if seen.any() else np.ones(len(reach))
    right, up = (shoulders - hips)[rows].T * np.array([[1], [-1]])
    lean = np.arctan2(right, up)  # of the trunk, clockwise in the image
    R = np.stack(
        [np.stack([np.cos(lean), -np.sin(lean)], -1), np.stack([np.sin(lean), np.cos(lean)], -1)], axis=-2
    )
    return Crops(hips[rows], np.repeat(2 * _ROOM * reach[rows, None], 2, axis=1), R)
