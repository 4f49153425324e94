"""RTMW3D of MMPose: 133 joints of a crop in 3D, each coordinate the peak of a row of bins (SimCC).

As rtmlib and MMPose's projects/rtmpose3d run it: input (N, 3, 384, 288), RGB less mean over deviation, an upright crop
1.25 times the person's box; outputs, in this order and under any name, x, y and z as (N, 133, bins), the bins twice as
fine as 288 x 384 pixels and 288 steps of depth. Half the steps of depth are 2.1744869 m, away from the camera, counted
from the middle of the hips (`simcc_3d_label.py`; rtmlib divides by another axis, formats.md section 4). A joint's score
is the lower of its peaks in x and y (MMPose get_simcc_maximum); it is no probability.

The network sees pixels and metres of depth, but not how many metres a pixel is. MMPose takes the depth of the hips from
the user's data; here it is the one at which the limbs are as long as those of a person 1.7 m tall, on a straight line
over a second around each frame. So bodies have no scale of their own, and keep their size when the person comes nearer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...pipeline.core.anthropometry import LIMBS
from ...pipeline.core.layouts import COCO23
from ...pipeline.core.rotations import rotate, transpose
from ..common import download
from ..common.onnx import OnnxFile
from ..detector.rtmpose import DEVIATION, MEAN
from .crop_rays import from_ray
from .features import ASSUMED_FOCAL, ray_rotation
from .images import Crops, Seen, View, upright_crops

_JOINTS = 133  # COCO-WholeBody, of which the body's and the feet's come first
_BOX, _ROOM = 1.25, 1.25  # person over joints, as rtmlib's pose_to_bbox has it; crop over person
_DEPTH_M = 2.1744869
_STATURE_M = 1.7
_HALF_SECOND = 15  # frames
_STARTS, _ENDS = (COCO23.indices([bone[end] for bone in LIMBS]) for end in (0, 1))
_LENGTHS = _STATURE_M * np.array(list(LIMBS.values()))


@dataclass(frozen=True, eq=False)
class RTMW3D:
    """An ImageNetwork. Its points are x and y in the crop, which reaches from -1 to 1, and metres behind the hips."""

    network: OnnxFile
    kind = "rtmw3d"
    licence = download.RTMW3D.licence
    layout = COCO23
    unit = "arbitrary"
    mirror = COCO23.mirror
    enough = 0.3  # mean score, as of the SimCC detectors

    @property
    def size(self) -> tuple[int, int]:
        _, _, height, width = self.network.only_input
        return width or 288, height or 384

    def crops(self, pixels: np.ndarray, confidence: np.ndarray, rows: np.ndarray) -> Crops:
        """As ImageNetwork says."""
        width, height = self.size
        return upright_crops(pixels, confidence, rows, _BOX * _ROOM, width / height)

    def conditions(self, crops: Crops, view: View) -> np.ndarray:
        """None."""
        return np.zeros((len(crops.centre), 0))

    def look(self, crop: np.ndarray, condition: np.ndarray) -> Seen:
        """As ImageNetwork says; joints whose peaks are not above 0 are missing."""
        image = ((crop - MEAN) / DEVIATION).transpose(2, 0, 1)[None].astype(self.network.input_dtype)
        rows = [bins[0, : len(self.layout)].astype(np.float64) for bins in self.network.run(image)]
        points = np.stack([2 * row.argmax(axis=1) / row.shape[1] - 1 for row in rows], axis=1)
        score = np.minimum(rows[0].max(axis=1), rows[1].max(axis=1))
        points = np.where((score > 0)[:, None], points * (1, 1, _DEPTH_M), np.nan)
        score = np.clip(score, 0, 1)
        return Seen(points, score, float(score.mean()))

    def bodies(
        self, points: np.ndarray, crops: Crops, view: View
    ) -> tuple[np.ndarray, np.ndarray | None, dict[str, Any]]:
        """As ImageNetwork says; how far away they are follows from a stature that is assumed, and is not told."""
        centre = view.straight(crops.centre)
        pixels = view.straight(crops.pixels(points[..., :2]))
        focal = view.focal_px or ASSUMED_FOCAL * float(view.image_size.max())
        rays, ray = ((each - view.image_size / 2) / focal for each in (pixels, centre))
        rays = np.concatenate([rays, np.ones_like(rays[..., :1])], axis=-1)
        rays = rotate(transpose(ray_rotation(ray)), rays)
        across, away = rays[..., :2] / rays[..., 2:], points[..., 2:]
        distance = _distance(across, away)
        joints = np.concatenate([across * (distance[:, None, None] + away), away], axis=-1)
        joints, said = from_ray(joints, centre, view.image_size, view.focal_px)
        lost = np.isnan(distance) & np.isfinite(points).any(axis=(1, 2))
        return joints, None, {**said, "stature_m": _STATURE_M, "frames_without_scale": int(lost.sum())}


def is_rtmw3d(network: OnnxFile) -> bool:
    """Whether an opened network has RTMW3D's input and outputs."""
    image, outputs = network.only_input, list(network.outputs.values())
    if len(image) != 4 or image[1] != 3 or len(outputs) != 3:
        return False
    return all(len(shape) == 3 and shape[1] == _JOINTS for shape in outputs)


def _distance(across: np.ndarray, away: np.ndarray) -> np.ndarray:
    """(T,) of the hips from the camera, at which the limbs are as long as the table has them; NaN where they are longer
    in depth alone. across: (T, 23, 2) tangents in the ray frame; away: (T, 23, 1) metres behind the hips.

    A limb from a to b is (d (t_b - t_a) + t_b z_b - t_a z_a, z_b - z_a) at the distance d, so that the sum of squares
    is a quadratic in d.
    """
    slope = across[:, _ENDS] - across[:, _STARTS]
    rest = (across * away)[:, _ENDS] - (across * away)[:, _STARTS]
    depth = (away[:, _ENDS] - away[:, _STARTS])[..., 0]
    terms = np.stack(
        [
            (slope**2).sum(axis=-1),
            (slope * rest).sum(axis=-1),
            (rest**2).sum(axis=-1) + depth**2 - _LENGTHS**2,
        ]
    )
    a, b, c = np.where(np.isfinite(terms).all(axis=0), terms, 0.0).sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        distance = (np.sqrt(b**2 - a * c) - b) / a
    return _straightened(np.where(distance > 0, distance, np.nan))


def _straightened(distance: np.ndarray) -> np.ndarray:
    """(T,) by a straight line of its logarithm through the frames around each; NaN stays NaN."""
    from scipy.signal import savgol_filter

    seen, frame = np.isfinite(distance), np.arange(len(distance))
    window = min(2 * _HALF_SECOND + 1, len(distance) - (len(distance) + 1) % 2)
    if window < 3 or not seen.any():
        return distance
    filled = np.interp(frame, frame[seen], np.log(distance[seen]))
    return np.where(seen, np.exp(np.asarray(savgol_filter(filled, window, 1))), np.nan)
