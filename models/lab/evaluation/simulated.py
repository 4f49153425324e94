"""Lifters that do what others are known to do, for errors by their disagreement with the built-in one."""

from __future__ import annotations

import zlib
from typing import Literal, get_args

import numpy as np
import torch

from ....pipeline.core.frames import CAMERA
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import MadeBy, PoseSequence
from ....pipeline.core.rotations import rotate
from ....pipeline.signals.filters import each_path
from ...common.metrics import relative
from ...lifter.builtin import lift
from ..synthetic.draw import NumpyDraw
from ..synthetic.keypoint_noise import detect
from .testbed import SeenTake

Kind = Literal["squeezed", "tilted", "noisy", "smoothed", "lagged", "own"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_SQUEEZED = (0.6, 0.9)  # of depth, from take to take
_TILT_DEG = 10.0  # standard deviation from take to take, to the front and to the side
_NOISE_M = (0.015, 0.015, 0.04)  # standard deviation in every frame, each joint: right, down, away
_SLOW_S = 0.25  # standard deviation of the smoothing's window
_LAG_S = 0.1
# Slow errors of each joint, and how long they last; half of it all the take.
_OWN_M, _OWN_S = ((0.02, 0.02, 0.06), 0.5)


def simulated(truth: SeenTake, seed: int, kind: Kind | None = None) -> PoseSequence:
    """(T, 17, 3) of a take that `see` gives for that seed, in CAMERA axes from the pelvis. kind: None leaves it to the
    clip's name, so that each lifts about as many takes.

    Depth that is squeezed, a body that leans, noise in every frame, smoothing, answers that lag behind, and joints that
    are wrong in a way of their own. All but the last begin with the built-in lifter's answer to other keypoints of the
    same images, so that they share its errors, as networks do that saw the same training data; the last begins with the
    truth and shares none."""
    number, seen = zlib.crc32(truth.clip.encode()), truth.keypoints
    kind = kind or KINDS[number % len(KINDS)]
    rng = np.random.default_rng([seed, number, 5])
    made_by = MadeBy("estimated", f"simulated ({kind})")
    if kind == "own":
        joints = _own(truth.truth, seen.fps, rng)
        frame = CAMERA.with_(origin="pelvis", unit="arbitrary")
        return seen.with_(joints=relative(joints), frame=frame, confidence=None, made_by=made_by)
    at = truth.joints_camera[None]
    exact = truth.focal_px * at[..., :2] / at[..., 2:] + np.array(truth.image_size) / 2
    pixels, confidence = detect(torch.from_numpy(exact), torch.from_numpy(at), NumpyDraw(rng), seen.fps)
    poses = lift(seen.with_(joints=pixels[0].numpy(), confidence=confidence[0].numpy()), truth.image_size)
    joints = _changed(poses.joints.astype(np.float64), kind, poses.fps, rng)
    return poses.with_(joints=relative(joints), covariance=None, made_by=made_by)


def _changed(joints: np.ndarray, kind: Kind, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Lifted joints (T, 17, 3) as that lifter would have them."""
    from scipy.ndimage import gaussian_filter1d
    from scipy.spatial.transform import Rotation

    if kind == "squeezed":
        return joints * [1.0, 1.0, rng.uniform(*_SQUEEZED)]
    if kind == "tilted":
        turn = np.radians(_TILT_DEG) * rng.standard_normal(2)
        return rotate(Rotation.from_rotvec([turn[0], 0.0, turn[1]]).as_matrix(), joints)
    if kind == "noisy":
        return joints + _NOISE_M * rng.standard_normal(joints.shape)
    if kind == "smoothed":
        return each_path(lambda path: gaussian_filter1d(path, _SLOW_S * fps, axis=0, mode="nearest"), joints)
    rows = np.arange(len(joints)) - round(_LAG_S * fps)
    return joints[np.maximum(rows, 0)]


def _own(truth: np.ndarray, fps: float, rng: np.random.Generator) -> np.ndarray:
    """The truth (T, 17, 3) with slow errors of each joint."""
    from scipy.ndimage import gaussian_filter1d

    slow = gaussian_filter1d(rng.standard_normal(truth.shape), _OWN_S * fps, axis=0, mode="wrap")
    slow /= max(float(slow.std()), 1e-9)
    always = rng.standard_normal((1, len(H36M17), 3))
    return truth + _OWN_M * (slow + always) / np.sqrt(2)
