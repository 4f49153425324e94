"""2D keypoints as detectors see them: exact projections in, noisy keypoints with confidences out.

The formula, for a person whose box has a longer side of s pixels (the height of a standing person's box):

- position: Gaussian with a standard deviation of 1.5 % of s on x and on y, times 1.5 at wrists and ankles, times
  2 while the joint is hidden behind the body; an AR(1) process in time with coefficient 0.8 at 30 fps;
- outliers: 0.3 % of the joints of a frame lie another 10 to 30 % of s away;
- left and right: in profile, legs or arms are exchanged for runs of frames;
- missing: single joints for runs of frames, hidden ones three times as often; rarely the whole person;
- confidence: falls with the joint's error and when hidden; 0 and NaN coordinates when missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.core.layouts import H36M17
from ...common.vectors import Array, dot, length, picked
from .bodies import vector

# What draws nothing is of models/lab/synthetic/on_device/keypoint_noise.py too, the same formula in torch.
FAR_JOINTS = ("l_wrist", "r_wrist", "l_ankle", "r_ankle")
HIDDEN_MISSING = 3.0  # times as often missing when hidden
# What hides joints: thick lines between joints, with their radius in trunk lengths.
SOLIDS = (
    ("pelvis", "thorax", 0.28), ("thorax", "head", 0.18),
    ("l_hip", "l_knee", 0.14), ("r_hip", "r_knee", 0.14), ("l_knee", "l_ankle", 0.10), ("r_knee", "r_ankle", 0.10),
)  # fmt: skip
HEAD_HEIGHT = (0.4, 1.0)  # from the middle of the ears to the top, over nose to top


def _exchanged(*parts: str) -> list[int]:
    order = list(range(len(H36M17)))
    for part in parts:
        left, right = H36M17.index(f"l_{part}"), H36M17.index(f"r_{part}")
        order[left], order[right] = right, left
    return order


# Orders of joints.
EXCHANGED_LIMBS = (_exchanged("hip", "knee", "ankle"), _exchanged("shoulder", "elbow", "wrist"))


def confidence_of(miss: Any, hidden: Any, gaussian: Any) -> Any:
    """A detector's score (..., J), before it is cut to [0.05, 1]; arrays of numpy or torch. miss: how far the joint is
    off, in shares of the box. hidden: where it is. gaussian: of unit variance."""
    return 0.9 - 5.0 * miss - 0.2 * hidden + 0.06 * gaussian


@dataclass(frozen=True)
class Noise:
    """Constants of the formula at the head of this file. Lengths are shares of the box's longer side; rates are
    per frame at 30 fps; runs are mean lengths in frames at 30 fps.

    derived: share of windows in which pelvis, thorax and spine are made from shoulders and hips, as layouts.remap
    does for detectors that have none, and the head lies between the ears' middle and its top.
    """

    std: float = 0.015
    correlation: float = 0.8
    far_joints: float = 1.5
    hidden: float = 2.0
    outliers: float = 0.003
    outlier_size: tuple[float, float] = (0.10, 0.30)
    swap_rate: float = 0.02
    swap_run: float = 8.0
    profile_cosine: float = 0.85
    missing_rate: float = 0.001
    missing_run: float = 10.0
    absent_rate: float = 0.0003
    absent_run: float = 8.0
    derived: float = 0.0


# A detector without error.
EXACT_KEYPOINTS = Noise(std=0.0, outliers=0.0, swap_rate=0.0, missing_rate=0.0, absent_rate=0.0)
# As good detectors have it: OpenPose's keypoints of a real take lie 1.0 to 1.7 % from the truth at wrists and ankles as
# at other joints, where its cameras are known best (docs/research.md, "Does the noise look like detectors?").
GOOD = Noise(
    std=0.012, far_joints=1.0, outliers=0.001, swap_rate=0.005, missing_rate=0.0003, absent_rate=0.0001
)


def hidden_joints(joints_camera: Array) -> Array:
    """(..., J) True where the trunk, the head or a leg is between the camera and the joint.

    joints_camera: (..., 17, 3) metres, origin at the camera. Trunk, head and legs are thick lines; a joint at an
    end of a line is not hidden by it.
    """
    depth = 1 * joints_camera[..., 2]  # a copy, whose rows lie together
    rays = [joints_camera[..., i] / depth for i in (0, 1)]
    trunk = length(vector(joints_camera, "pelvis", "thorax"))
    hidden: Any = False
    for start, end, radius in SOLIDS:
        a, b = H36M17.index(start), H36M17.index(end)
        (x, line_x), (y, line_y) = (
            (ray - ray[..., a, None], (ray[..., b] - ray[..., a])[..., None]) for ray in rays
        )
        along = ((x * line_x + y * line_y) / (line_x**2 + line_y**2).clip(1e-9)).clip(0, 1)
        apart = (x - along * line_x) ** 2 + (y - along * line_y) ** 2
        here = depth[..., a, None] * (1 - along) + depth[..., b, None] * along
        reach = (radius * trunk)[..., None]
        behind = (apart < (reach / here) ** 2) & (depth > here + reach)
        behind[..., [a, b]] = False
        hidden = hidden | behind
    return hidden


def detect(
    pixels: np.ndarray,
    joints_camera: np.ndarray,
    rng: np.random.Generator,
    noise: Noise | None = None,
    fps: float = 30.0,
) -> tuple[np.ndarray, np.ndarray]:
    """What a detector would answer.

    pixels: (..., T, 17, 2) exact projections of joints_camera (..., T, 17, 3), H36M17, metres, origin at the
    camera. -> keypoints (..., T, 17, 2) pixels, NaN where missing, and confidence (..., T, 17) in [0, 1].
    """
    noise = noise or Noise()
    lead, frames = pixels.shape[:-3], pixels.shape[-3]
    size = np.ptp(pixels, axis=-2).max(axis=-1)[..., None, None]
    hidden = hidden_joints(joints_camera)

    std = np.where(hidden, noise.hidden, 1.0)
    std[..., H36M17.indices(FAR_JOINTS)] *= noise.far_joints
    error = std[..., None] * _ar1(rng, pixels.shape, noise.correlation ** (30 / fps))
    error *= noise.std
    far = rng.uniform(size=hidden.shape) < noise.outliers
    angle = rng.uniform(0, 2 * np.pi, hidden.shape)
    jump = np.where(far, rng.uniform(*noise.outlier_size, hidden.shape), 0.0)
    error += jump[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    keypoints = pixels + error * size

    confidence = confidence_of(np.linalg.norm(error, axis=-1), hidden, rng.standard_normal(hidden.shape))
    confidence = np.clip(confidence, 0.05, 1.0)

    swapped = in_profile(joints_camera, noise.profile_cosine)
    for order in EXCHANGED_LIMBS:
        rate = noise.swap_rate * swapped * 30 / fps
        swap = _runs(rng, rate, noise.swap_run * fps / 30)[..., None]
        keypoints = np.where(swap[..., None], keypoints[..., order, :], keypoints)
        confidence = np.where(swap, confidence[..., order], confidence)

    if noise.derived:
        derived = rng.uniform(size=lead) < noise.derived
        height = rng.uniform(*HEAD_HEIGHT, lead)
        made = derive(keypoints, height[..., None, None])
        keypoints = np.where(derived[..., None, None, None], made, keypoints)

    rate = noise.missing_rate * np.where(hidden, HIDDEN_MISSING, 1.0) * 30 / fps
    lost = _runs(rng, rate, noise.missing_run * fps / 30, axis=-2)
    absent = _runs(rng, np.full((*lead, frames), noise.absent_rate * 30 / fps), noise.absent_run * fps / 30)
    lost |= absent[..., None]
    return np.where(lost[..., None], np.nan, keypoints), np.where(lost, 0.0, confidence)


def in_profile(joints_camera: Array, cosine: float = Noise.profile_cosine) -> Array:
    """(..., T) True where hips and shoulders together point along the view: |cos| of the angle above `cosine`."""
    aside: Any = vector(joints_camera, "r_hip", "l_hip") + vector(joints_camera, "r_shoulder", "l_shoulder")
    view = joints_camera[..., H36M17.index("pelvis"), :]
    return abs(dot(aside, view)) > cosine * length(aside) * length(view)


def derive(keypoints: Array, head_height: Array) -> Array:
    """keypoints (..., 17, 2) with pelvis and thorax in the middle of hips and shoulders, the spine between, the head
    between nose and top, head_height (...,) of the way."""
    out: Any = 1 * keypoints
    shoulders, pelvis = (
        picked(keypoints, H36M17.indices((f"l_{part}", f"r_{part}"))).mean(-2) for part in ("shoulder", "hip")
    )
    nose, top = keypoints[..., H36M17.index("nose"), :], keypoints[..., H36M17.index("head"), :]
    out[..., H36M17.index("head"), :] = nose + head_height * (top - nose)
    for joint, place in (("pelvis", pelvis), ("spine", (shoulders + pelvis) / 2), ("thorax", shoulders)):
        out[..., H36M17.index(joint), :] = place
    return out


def _ar1(rng: np.random.Generator, shape: tuple[int, ...], coefficient: float) -> np.ndarray:
    """Stationary AR(1) noise of unit variance along the time axis of (..., T, J, 2)."""
    from scipy.signal import lfilter

    white = rng.standard_normal(shape, dtype=np.float32)
    white[..., 1:, :, :] *= np.sqrt(1 - coefficient**2)
    return np.asarray(lfilter([1.0], [1.0, -coefficient], white, axis=-3))


def _runs(rng: np.random.Generator, rate: np.ndarray, mean_length: float, axis: int = -1) -> np.ndarray:
    """Booleans of rate's shape: runs that start with that probability a frame and last geometrically long."""
    rate = np.moveaxis(rate, axis, -1)
    start = rng.uniform(size=rate.shape) < rate
    frame = np.arange(rate.shape[-1])
    ends = np.where(start, frame + rng.geometric(1 / mean_length, rate.shape), 0)
    return np.moveaxis(np.maximum.accumulate(ends, axis=-1) > frame, -1, axis)
