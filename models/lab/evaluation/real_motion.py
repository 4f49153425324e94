"""Velocities and accelerations of wrists and ankles on real recordings:  pcnet3d evaluate real-motion -o DIR

"clips": how far lifters of one video agree; nobody knows the truth. "take": against a man who is known from four
cameras, of whom each is judged by itself. Every lift is levelled with one gravity for the take, brought to the other
side's size (one factor) and heading (one angle), smoothed, and then both sides go through the same 6 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.frames import turned_covariance
from ....pipeline.core.layouts import H36M17, remap
from ....pipeline.core.lifted import ToLift
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import is_finite, rotate
from ....pipeline.files.video_frames import shown_size
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.reading.take import read_video
from ...common.metrics import SD_90, relative
from ...common.spread import stated_spread
from ...gravity import Seen, level_static
from ...lifter.load import load_lifter
from ...smoother import LIFTED, LIFTED_UNSTATED, Motion, known_noise
from ..mocap.clips import data_folder
from ..synthetic.bodies import STANDARD_SIZE_M, size_m
from .acceleration import NO_MOTION, PARTS, accelerations, agreement, filtered, velocities
from .real_data import LIMBS, found_keypoints, read_moving
from .real_rectified import real_poses
from .real_take import about_hips, same_heading
from .sets import Question
from .tables import Page, Table

_ROWS = sorted(row for part in PARTS.values() for row in part)
_JOINTS = [H36M17.joints[row] for row in _ROWS]
_AT = {name: [_ROWS.index(row) for row in part] for name, part in PARTS.items()}
_QUANTITIES = {"velocity": velocities, "acceleration": accelerations}
_CUTOFFS = {"Butterworth 6 Hz": 6.0, "Butterworth 3 Hz": 3.0}
_KNOWN = "known noise"
_BLAZEPOSE = Path("models") / "pose_landmark_lite.onnx"
_SIGNALS = {
    name: f"{{{name}[0]:.2f}}; {{{name}[1]:.2f}}"
    for name in (f"{part}, {of}" for part in PARTS for of in _QUANTITIES)
}
PAGE = Page(
    "Real recordings",
    ". RMSE in m/s and m/s^2 of one axis, and r; all three axes together.",
    [
        Table("", "clips/*/*", ["lifters of one video", "smoother"], _SIGNALS),
        Table("", "take/*/*", ["against the truth", "smoother"], _SIGNALS),
        Table(
            "",
            "inside/*",
            ["lifters of one video"],
            {name: f"{{{name}:.0%}}" for name in _QUANTITIES},
            "Differences between two lifters within both 90 % bars.",
        ),
    ],
)
Row = dict[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class _Lift:
    """Wrists and ankles of a lift, levelled: paths (T, 4, 3) and their errors' covariance (T, 4, 3, 3), or None."""

    paths: np.ndarray
    covariance: np.ndarray | None
    time_s: np.ndarray

    def turned_to(self, truth: np.ndarray) -> _Lift:
        """With the heading of truth (T, 4, 3)."""
        R = same_heading(self.paths, truth)
        return _Lift(rotate(R, self.paths), turned_covariance(self.covariance, R), self.time_s)

    @property
    def motion(self) -> Motion:
        """What a run writes by default."""
        motion = known_noise(self.paths, self.time_s, self.covariance, lifted=True)
        return motion.widened(LIFTED_UNSTATED if self.covariance is None else LIFTED)

    @property
    def smoothed(self) -> dict[str, np.ndarray]:
        """{smoother: paths}."""
        classical = {name: filtered(self.paths, self.time_s, hz) for name, hz in _CUTOFFS.items()}
        return classical | {_KNOWN: self.motion.values[0]}


def tables(question: Question) -> dict[str, Any]:
    """{"clips": {"CLIP: one, other": {"PAIR'S SMOOTHER": {"PART, QUANTITY": (RMSE, r)}}}, "inside": {"CLIP: one,
    other": {quantity: share of the differences within both 90 % bars}}, "take": {lifter: {smoother: {"PART, QUANTITY":
    (RMSE, r)}}}}. m/s and m/s^2 of a standard body, or of the man; all axes together; the take: mean over cameras.
    InputError where the data is not."""
    (rectifier,) = question.rectifiers
    clips: dict[str, dict[str, _Lift]] = {}
    for clip, name, poses in real_poses(question):
        size = STANDARD_SIZE_M / size_m(poses.joints[is_finite(poses.joints).all(axis=1)])
        clips.setdefault(clip, {})[name] = _levelled(rectifier, poses, float(size))
    pairs, inside = {}, {}
    for clip, lifts in clips.items():
        for (one, a), (other, b) in combinations(lifts.items(), 2):
            b = b.turned_to(a.paths)
            smoothed = zip(a.smoothed.items(), b.smoothed.values(), strict=True)
            pairs[f"{clip}: {one}, {other}"] = {name: _row(p, q, a.time_s) for (name, p), q in smoothed}
            inside[f"{clip}: {one}, {other}"] = _inside(a.motion, b.motion)
    return {**question.heading(), "clips": pairs, "inside": inside, "take": _against_truth(question)}


def _against_truth(question: Question) -> dict[str, dict[str, Row]]:
    (rectifier,) = question.rectifiers
    cameras, truth = read_moving()
    limbs = about_hips(truth.limbs)
    lifters = {"pcnet3d": load_lifter(question.lifter), "BlazePose": load_lifter(data_folder() / _BLAZEPOSE)}
    rows: dict[str, dict[str, list[Row]]] = {name: {} for name in lifters}
    for camera in cameras.values():
        video = read_video(camera.video)
        keypoints = remap(found_keypoints(video), H36M17)
        for name, own in lifters.items():
            poses = own.lift(ToLift(keypoints, shown_size(video), flip=question.flip, video=video)).poses
            true = limbs[poses.frame_index]
            found = relative(poses.joints)[:, H36M17.indices(LIMBS)]
            size = np.median(np.linalg.norm(true, axis=-1)) / np.median(np.linalg.norm(found, axis=-1))
            true = true[:, [LIMBS.index(joint) for joint in _JOINTS]]
            lifted = _levelled(rectifier, poses, float(size)).turned_to(true)
            for smoother, path in {NO_MOTION: 0 * true, **lifted.smoothed}.items():
                rows[name].setdefault(smoother, []).append(_row(path, true, poses.times))
    return {
        name: {smoother: _mean(each) for smoother, each in smoothers.items()}
        for name, smoothers in rows.items()
    }


def _levelled(rectifier: Rectifier, poses: PoseSequence, size: float) -> _Lift:
    """Wrists and ankles of poses (T, 17, 3) in CAMERA, times a size, upright by one gravity for the take."""
    joints = relative(poses.joints.astype(np.float64))
    seen = Seen(joints, *rectifier.rotation(joints), poses.times, spread=stated_spread(poses))
    R_camera_from_level = level_static(seen).R_camera_from_level
    assert R_camera_from_level is not None
    R_level_from_camera = R_camera_from_level.T
    covariance = turned_covariance(poses.covariance, R_level_from_camera, size)
    return _Lift(
        rotate(R_level_from_camera, size * joints[:, _ROWS]),
        None if covariance is None else covariance[:, _ROWS],
        poses.times,
    )


def _row(one: np.ndarray, other: np.ndarray, time_s: np.ndarray) -> Row:
    signals = {name: (of(one, time_s), of(other, time_s)) for name, of in _QUANTITIES.items()}
    return {
        f"{part}, {name}": agreement(a[:, at], b[:, at])
        for part, at in _AT.items()
        for name, (a, b) in signals.items()
    }


def _inside(one: Motion, other: Motion) -> dict[str, float]:
    """Shares of differences of velocities and accelerations that their 90 % bars hold, taken for independent."""
    variance = np.einsum("dtnii->dtni", one.covariance + other.covariance)
    within = np.abs(one.values - other.values) <= SD_90 * np.sqrt(variance)
    return {name: float(within[i].mean()) for i, name in enumerate(_QUANTITIES, start=1)}


def _mean(rows: list[Row]) -> Row:
    """RMSE and r of each, mean over rows."""
    return {key: tuple(np.mean([row[key] for row in rows], axis=0).tolist()) for key in rows[0]}
