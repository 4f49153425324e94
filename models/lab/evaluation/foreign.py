"""Poses of the test bed's takes by other lifters than the built-in one: a user's own, which are files, or simulated.

`Answers` are what a lifter made of the keypoints that `pcnet3d lab testbed --keypoints` wrote. `Simulated` ones do what
other lifters are known to do: depth that is squeezed, a body that leans, noise in every frame, smoothing, answers that
lag behind, and joints that are wrong in a way of their own. All but the last begin with the built-in lifter's answer to
other keypoints of the same images, so that they share its errors, as networks do that saw the same training data; the
last begins with the truth and shares none.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import torch

from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import CAMERA
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.messages import how_many
from ....pipeline.core.pose import MadeBy, PoseSequence
from ....pipeline.core.rotations import rotate
from ....pipeline.reading.load import read
from ....pipeline.signals.filters import each_path
from ...common.metrics import relative
from ...lifter.builtin import lift
from ..synthetic.draw import NumpyDraw
from ..synthetic.keypoint_noise import detect
from .testbed import BEDS, Bed, SeenTake, file_name

Kind = Literal["squeezed", "tilted", "noisy", "smoothed", "lagged", "own"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_SQUEEZED = (0.6, 0.9)  # of depth, from take to take
_TILT_DEG = 10.0  # standard deviation from take to take, to the front and to the side
_NOISE_M = (0.015, 0.015, 0.04)  # standard deviation in every frame, each joint: right, down, away
_SLOW_S = 0.25  # standard deviation of the smoothing's window
_LAG_S = 0.1
# Slow errors of each joint, and how long they last; half of it all the take.
_OWN_M, _OWN_S = ((0.02, 0.02, 0.06), 0.5)


@dataclass(frozen=True)
class Answers:
    """A user's lifter. folder: its answers, for the file TAKE.npz of `testbed --keypoints` TAKE.npy or .npz with
    (frames, 17, 3) joints, H36M17 in CAMERA axes, in any unit. The lifter has the folder's name."""

    folder: Path

    @property
    def name(self) -> str:
        return self.folder.resolve().name

    def beds(self, seed: int) -> list[Bed]:
        """Those before whose cameras the takes are that it has answers to. InputError for a folder without any."""
        beds: list[Bed] = [
            bed for bed in BEDS if any(self.folder.glob(file_name("*", bed, seed) + ".np[yz]"))
        ]
        if not beds:
            raise InputError(
                "cannot-open",
                f"Expected answers to takes of seed {seed} in {self.folder}, such as "
                f"{file_name('TAKE', 'wild', seed)}.npy, named as pcnet3d lab testbed --keypoints names the takes.",
            )
        return beds

    def poses(self, truth: SeenTake, bed: Bed, seed: int) -> PoseSequence:
        """(T, 17, 3) of a take that `testbed.see` gives for that seed, before cameras of that bed, in CAMERA axes from
        the pelvis. InputError for a take without an answer, or with one of other frames."""
        take = file_name(truth.clip, bed, seed)
        found = [path for ending in ("npy", "npz") if (path := self.folder / f"{take}.{ending}").exists()]
        if not found:
            raise InputError(
                "cannot-open",
                f"Expected the lifter's answer {take}.npy or .npz in {self.folder}; lift what pcnet3d lab testbed "
                f"--keypoints --bed {bed} --seed {seed} writes.",
            )
        poses = answer(found[0], len(truth.keypoints))
        timed = {"time_s": truth.keypoints.time_s, "frame_index": truth.keypoints.frame_index}
        return poses.with_(made_by=MadeBy("estimated", self.name), **timed)


def answer(path: Path, frames: int) -> PoseSequence:
    """A lifter's poses of a take, (T, 17, 3) in CAMERA axes from the pelvis, NaN where it has none. InputError for a
    file of anything else, or of other frames than the take has."""
    of: dict[str, Any] = {"layout": "H36M17", "frame": "CAMERA", "unit": "arbitrary"}
    poses = read(path, "arrays", gives="poses", handedness="ignore", missing="gap", **of)
    if len(poses) != frames:
        raise InputError(
            "files-apart",
            f"Expected {how_many(frames, 'frame')} in {path}, as in the take; got {len(poses)}.",
        )
    return poses


@dataclass(frozen=True)
class Simulated:
    """kinds: each lifts some of the takes, all about as many."""

    kinds: tuple[Kind, ...] = KINDS

    @property
    def name(self) -> str:
        return f"simulated ({', '.join(self.kinds)})"

    def poses(self, truth: SeenTake, bed: Bed, seed: int) -> PoseSequence:
        """As `Answers` gives them."""
        number = zlib.crc32(truth.clip.encode())
        kind = self.kinds[number % len(self.kinds)]
        rng = np.random.default_rng([seed, number, 5])
        made_by = MadeBy("estimated", f"simulated ({kind})")
        seen = truth.keypoints
        if kind == "own":
            joints = _own(truth.truth, seen.fps, rng)
            frame = CAMERA.with_(origin="pelvis", unit="arbitrary")
            return seen.with_(joints=relative(joints), frame=frame, confidence=None, made_by=made_by)
        at = truth.joints_camera[None]
        exact = truth.focal_px * at[..., :2] / at[..., 2:] + np.array(truth.image_size) / 2
        pixels, confidence = detect(torch.from_numpy(exact), torch.from_numpy(at), NumpyDraw(rng), seen.fps)
        found = seen.with_(joints=pixels[0].numpy(), confidence=confidence[0].numpy())
        poses = lift(found, truth.image_size)
        joints = _changed(poses.joints.astype(np.float64), kind, poses.fps, rng)
        return poses.with_(joints=relative(joints), covariance=None, made_by=made_by)


Foreign = Answers | Simulated


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
