"""What 3DPCNet is trained and judged on: bodies seen from random views, in CAMERA axes, one frame at a time, and lifted
takes of the test bed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ....pipeline.core.frames import CAMERA, PC_CAMERA
from ....pipeline.core.rotations import is_finite, rotate, transpose
from ...common.canonical import R_world_from_body
from ...common.metrics import relative
from ..mocap.clips import read_rows

View = Literal["paper", "wide"]
# What R leads to: "body", gravity and the body's own heading (design.md section 4), or "axes", the data set's own fixed
# axes, as in the paper; these make sense where everybody was recorded facing -x.
Targets = Literal["body", "axes"]

CAMERA_FROM_SOURCE = CAMERA.basis @ PC_CAMERA.basis.T  # the paper's axes: x away, y left, z up


def paper_angles(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch, yaw (count,) in degrees of the published mixture."""
    kind = rng.choice(3, size=count, p=(0.75, 0.15, 0.10))  # front, profile, back
    normal = rng.standard_normal((3, count))
    side = rng.choice((-90.0, 90.0), size=count)
    yaw = np.choose(kind, [rng.uniform(-70, 70, count), side + 10 * normal[0], 180 + 20 * normal[0]])
    # Of each kind the standard deviation of pitch, its limit, and roll's; the back views' are not given there, and are
    # those of the front.
    std, most, roll_std, roll_most = np.array([[12, 20, 4, 8], [8, 15, 3, 6], [12, 20, 4, 8]])[kind].T
    pitch = np.clip(std * normal[1], -most, most)
    return np.clip(roll_std * normal[2], -roll_most, roll_most), pitch, yaw


def wide_angles(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch, yaw (count,) in degrees of a camera that is really pitched and rolled."""
    return rng.uniform(-20, 20, count), rng.uniform(-60, 60, count), rng.uniform(-180, 180, count)


def views(view: View, rng: np.random.Generator, count: int) -> np.ndarray:
    """R_camera_from_body (count, 3, 3) of random views: "paper" = Rz(yaw) Ry(pitch) Rx(roll) and "wide" = Rx(roll)
    Ry(pitch) Rz(yaw), in the paper's axes."""
    order, angles = ("xyz", paper_angles) if view == "paper" else ("XYZ", wide_angles)
    R = Rotation.from_euler(order, np.stack(angles(rng, count), axis=-1), degrees=True)
    return CAMERA_FROM_SOURCE @ R.as_matrix()


def seen(
    joints_world: np.ndarray, R_camera_from_body: np.ndarray, targets: Targets = "body"
) -> tuple[np.ndarray, np.ndarray]:
    """joints (B, 17, 3), +Z up, turned so that their R_camera_from_body is the one given -> (B, 17, 3) relative to
    the pelvis, and (B,) whether the frame has a heading at all. With targets "axes" the world's axes are the body's."""
    R = R_camera_from_body
    if targets == "body":
        R = R @ transpose(R_world_from_body(joints_world))
    return rotate(R, relative(joints_world.astype(np.float64))), np.asarray(is_finite(R).all(axis=-1))


class Lifted(NamedTuple):
    """Lifted frames: joints and truth (N, 17, 3), CAMERA axes relative to the pelvis, the truth at the lift's scale;
    R (N, 3, 3) R_camera_from_body; lying (N,), of mocap.clips.lying; clips, the takes' names."""

    joints: np.ndarray
    truth: np.ndarray
    R: np.ndarray
    lying: np.ndarray
    clips: tuple[str, ...]


def read_lifted(paths: Iterable[Path]) -> Lifted:
    """The frames of `pcnet3d lab testbed` files that were lifted and have a truth. InputError for anything else."""
    parts, clips = [], []
    floats = {
        "lifted": (("frames", 17, 3), "f"),
        "truth": (("frames", 17, 3), "f"),
        "R_camera_from_body": (("frames", 3, 3), "f"),
    }
    others = {"lying": (("frames",), "fiub"), "clip": (("clips",), "U")}
    for path in paths:
        held = read_rows(path, "takes as `pcnet3d lab testbed` writes them", "take_start", **floats, **others)
        lifted, truth, R = (held[name].astype(np.float32) for name in floats)
        scale = (lifted * truth).sum((-2, -1)) / np.maximum((truth * truth).sum((-2, -1)), 1e-9)
        fine = is_finite(lifted).all(-1) & is_finite(R).all(-1)
        frames = lifted, truth * scale[:, None, None], R, held["lying"].astype(bool)
        parts.append([array[fine] for array in frames])
        clips += map(str, held["clip"])
    return Lifted(*map(np.concatenate, zip(*parts, strict=True)), clips=tuple(clips))
