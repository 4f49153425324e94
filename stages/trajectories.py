"""Paths, velocities and accelerations in LEVEL, relative to the pelvis, from smoothed positions.

The paths that are written are the smoothed ones, so that velocity and acceleration are their derivatives; what was
smoothed is `level` in poses.npz. They come from a smoother that knows the error of the joints and states that of its
answers (models/smoother.py), or from a low-pass filter with one cut-off for all, as is usual in the field
(Pose2Sim and Sports2D filter positions at 6 Hz by default and go on from there). Angles always rest on the filter:
they need positions only, for which it is as good.

With a panning camera each frame's LEVEL has the true vertical and the camera's own heading, so a pan looks like the
person turning the other way. Heights z, their velocity vz, horizontal distances hypot(x, y), distances from the pelvis
and joint angles do not depend on the heading: they hold. The directions of x and y do not hold; nor do vx, vy, ax, ay,
speed and acceleration, which contain the pan's rate times the horizontal distance (30 degrees a second at 0.5 m:
0.26 m/s).

A constant rotation changes no norm. With a static camera distance, speed and acceleration do not depend on how well up
is known, and hold even where a take could not be levelled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..models.angle_error.joint_noise import made_by_the_built_in
from ..models.angle_error.take_angles import smoothed
from ..models.gait.clock import clock_doubts
from ..models.smoother import LIFTED, Motion, known_noise
from ..pipeline.core.errors import InputError
from ..pipeline.core.figures import UNITS
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.core.rotations import is_finite
from ..pipeline.core.take import Take, in_single
from ..pipeline.signals.filters import (
    CUTOFF_HZ,
    breaks,
    check_cutoff,
    derivative,
    lowpass,
    rate,
)

# Codes of `<joint>_distance_reason`, `<joint>_speed_reason` and `<joint>_acceleration_reason`: there is a value; the
# joint is missing, and too long for a value in between; the standard deviation is larger than all that the take has.
FINE, MISSING, UNCERTAIN = range(3)
# Prefix of the axes' columns, name of the norm's, unit for a unit of length. Names are the same whatever the unit is.
_QUANTITIES = (("", "distance", "{}"), ("v", "speed", "{}/s"), ("a", "acceleration", "{}/s2"))
# Of a column whose name ends so; {} is the unit of length.
_UNITS = {unit.ending.removeprefix("_"): unit.table for unit in UNITS.values() if unit.ending} | {"sd": "{}"}


@dataclass(frozen=True)
class Trajectories:
    """The stage. joints: those whose paths are written. `filtered` has all 17 joints after the low-pass of `smooth`,
    for angles; its history says which columns come from the smoother instead, which uses the error of the paths and
    states that of its answers (`known_motions`). cutoff_hz: as in `smooth`; where it is given, the paths are filtered
    too.
    If the source knows where the person is and the camera stands still, the pelvis's own path in LEVEL is written
    too, as `root`, from the camera or the world's origin.
    """

    joints: tuple[str, ...] = ("r_wrist", "l_wrist", "r_ankle", "l_ankle")
    cutoff_hz: float | None = None

    name: ClassVar[str] = "trajectories"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified")
    gives: ClassVar[tuple[str, ...]] = ("kinematics", "filtered")

    def __call__(self, take: Take) -> Take:
        rectified = take.need("rectified")
        refused = ~rectified.turned  # missing, so that nothing is taken across them
        level = rectified.level.with_(
            joints=np.where(refused[:, None, None], np.nan, rectified.level.joints),
            covariance=rectified.level.covariance,
        )
        known_error = self.cutoff_hz is None
        path, cutoff_hz, filtered = smooth(level, self.cutoff_hz)
        lifted, judged = take.need("poses").lifted, made_by_the_built_in(take.need("poses"))
        motions = known_motions(level, self.joints, lifted, judged) if known_error else {}
        if motions:  # whose columns hold something else than this path, which angles are taken from
            errors = "estimated" if level.covariance is None else "stated"
            path = path.noted("smoother", columns_of=list(motions), joint_errors=errors)
        columns = dict(take.kinematics or {})
        for joint in (*self.joints, *(["root"] if path.root is not None else [])):
            motion = motions.pop(joint, None)
            columns |= in_single(trajectory(path if motion is None else level, joint, motion))
        if (
            path.path is not None and (sd := path.path.sd) is not None
        ):  # body's size and focal length included
            columns |= in_single({f"root_{axis}_sd": sd[:, i] for i, axis in enumerate("xyz")})
        notices = [notice("relative-to-camera")] if rectified.camera == "moving" else []
        by_errors = known_error and len(level) > 1  # a single frame has no path
        if by_errors and level.covariance is None:
            notices.append(_unknown("were estimated from the paths, which do not show slow errors"))
        elif by_errors and not judged:
            notices.append(_unknown("are stated by the lifter, and were not checked"))
        return take.with_(kinematics=columns, filtered=path, cutoff_hz=cutoff_hz).saying(
            *notices, *filtered, *clock_doubts(level)
        )

    def check_rate(self, fps: float) -> None:
        """InputError for a cut-off that is given and that the filter does not have at that frame rate."""
        if self.cutoff_hz is not None and np.isfinite(fps):
            check_cutoff(self.cutoff_hz, fps)


def _unknown(why: str) -> Notice:
    """That paths have no stated errors, by why those of the joints are not known."""
    reason = f"those of the joints {why}"
    return notice("errors-unknown", what="paths, velocities and accelerations", reason=reason)


def known_motions(
    level: PoseSequence, joints: tuple[str, ...], lifted: bool, judged: bool
) -> dict[str, Motion]:
    """The motion of these joints, and of the root if there is one, smoothed by their errors: a path for each name.

    The error is the poses' covariance. Without one it is estimated from the paths, which do not show slow errors. An
    estimated error smooths the paths but is not stated, and neither is that of a lifter that was not measured. The
    root's error is always estimated.
    Missing joints are interpolated, with the error of that, but not across frames in which nobody was seen.
    """
    points = level.joints[:, level.layout.indices(joints)].astype(np.float64)
    somebody = np.asarray(is_finite(level.without_feet.joints)).any(axis=1)
    lost = np.flatnonzero(np.diff(somebody)) + 1  # behind a frame without anybody everything may be new
    cuts = tuple(sorted({*breaks(level), *lost.tolist()}))
    stated = level.covariance
    errors = None if stated is None else stated[:, level.layout.indices(joints)]
    motion = known_noise(points, level.times, errors, cuts, lifted)
    # What a path tells of its errors is not what a lifter errs by: one that smooths or lags does not shake.
    states = stated is not None and (judged or not lifted)
    motion = motion.widened(LIFTED) if states and lifted else motion if states else motion.unstated()
    motions = {joint: motion.of(i) for i, joint in enumerate(joints)}
    if level.root is not None:
        motions["root"] = known_noise(level.root[:, None], level.times, None, cuts).unstated()
    return motions


def smooth(
    level: PoseSequence, cutoff_hz: float | None = None
) -> tuple[PoseSequence, float | None, list[Notice]]:
    """The same poses with the paths of every joint and the root through a Butterworth filter (two passes, order 4
    together, no phase shift), inside their unbroken pieces (pipeline/signals/filters.py); its cut-off, None where
    nothing was filtered; and that this is so, or how many values of joints were lost, as the history says too.

    cutoff_hz: where half the power is left; None is 6 Hz, or no filter if the frame rate is too low for 6 Hz. One frame
    is not filtered.

    A joint is NaN in pieces too short for the filter. InputError for a given cut-off that the filter does not have at
    that frame rate.
    """
    times, seams = level.times, breaks(level)
    fps = rate(times)
    if np.isnan(fps) or (cutoff_hz is None and fps <= 2 * CUTOFF_HZ):
        said = [] if np.isnan(fps) else [notice("not-filtered", fps=fps, cutoff_hz=CUTOFF_HZ)]
        return level.noted("low-pass filter", filter="none", unfiltered=True), None, said
    cutoff = CUTOFF_HZ if cutoff_hz is None else cutoff_hz
    joints = smoothed(level.joints, times, cutoff, seams)
    path = level.path and replace(level.path, points=lowpass(level.path.points, times, cutoff, seams))
    lost = int((is_finite(level.joints) & ~is_finite(joints)).sum())
    filtered = level.with_(joints=joints, path=path)
    noted = filtered.noted("low-pass filter", filter="butterworth", cutoff_hz=cutoff, values_lost=lost)
    said = [notice("pieces-too-short", values=lost, cutoff_hz=cutoff)] if lost else []
    return noted, cutoff, said


def trajectory(path: PoseSequence, joint: str, motion: Motion | None = None) -> dict[str, np.ndarray]:
    """Columns (T,) `<joint>_x`, `<joint>_vx`, `<joint>_ax` for x, y and z, and their norms `<joint>_distance` (from the
    pelvis), `<joint>_speed` and `<joint>_acceleration`; in m, m/s and m/s2, or in the source's unit without a scale.

    joint: a name, or "root" for poses that have one; the root's distance is that from its origin.
    path: poses in LEVEL, filtered (`smooth`) unless derivatives of noise are wanted. Derivatives are those of a cubic
    spline, never taken across a gap, a clip boundary or dropped frames; NaN where there is none.
    motion: that of this path (`known_motions`). Its values are then taken, each with its standard deviation
    (`..._sd`), and each norm with a reason (int8, FINE, MISSING or UNCERTAIN); where that is MISSING the values are
    NaN. InputError for a unit that is neither metres nor arbitrary.
    """
    if path.frame.unit not in ("m", "arbitrary"):
        raise InputError(
            "wrong-axes", f"Expected poses in metres or in arbitrary units, got {path.frame.unit}."
        )
    points = path.root if joint == "root" else None
    position = path.joint(joint).astype(np.float64) if points is None else points
    if motion is not None:
        return _with_errors(joint, motion, np.asarray(is_finite(position)))
    velocity, acceleration = (derivative(position, path.times, breaks(path), order) for order in (1, 2))
    columns = {}
    for (prefix, norm, _), values in zip(_QUANTITIES, (position, velocity, acceleration), strict=True):
        columns |= {f"{joint}_{prefix}{axis}": values[:, i] for i, axis in enumerate("xyz")}
        columns[f"{joint}_{norm}"] = np.linalg.norm(values, axis=-1)
    return columns


def _with_errors(joint: str, motion: Motion, visible: np.ndarray) -> dict[str, np.ndarray]:
    """The columns of `trajectory` with their errors, of the one path of `motion`, which was seen (T,) or not."""
    columns = {}
    for (prefix, norm, _), values, covariance in zip(
        _QUANTITIES, motion.values[:, :, 0], motion.covariance[:, :, 0], strict=True
    ):
        reason = _reasons(values, covariance, visible, about_mean=norm == "distance")
        values, covariance = values.copy(), covariance.copy()
        values[reason == MISSING], covariance[reason == MISSING] = np.nan, np.nan
        size = np.linalg.norm(values, axis=-1)
        outward = values / np.maximum(size, 1e-12)[:, None]
        sd = np.sqrt(np.einsum("tii->ti", covariance))
        for i, axis in enumerate("xyz"):
            columns |= {f"{joint}_{prefix}{axis}": values[:, i], f"{joint}_{prefix}{axis}_sd": sd[:, i]}
        columns[f"{joint}_{norm}"] = size
        columns[f"{joint}_{norm}_sd"] = np.sqrt(np.einsum("ti,tij,tj->t", outward, covariance, outward))
        columns[f"{joint}_{norm}_reason"] = reason
    return columns


def _reasons(values: np.ndarray, covariance: np.ndarray, visible: np.ndarray, about_mean: bool) -> np.ndarray:
    """(T,) int8 of values (T, 3) and their covariance (T, 3, 3). What is less certain than the take's root mean square
    (about its mean) is marked, and counts as missing where it was not seen either."""
    present = np.isfinite(values).all(axis=1)
    if not present.any():
        return np.full(len(values), MISSING, np.int8)
    moved = values[present] - (values[present].mean(axis=0) if about_mean else 0.0)
    spread = np.einsum("tii->t", covariance)  # NaN where nobody states it: then nothing is made up in between
    uncertain = spread > (moved**2).sum(axis=1).mean()
    missing = ~present | ((uncertain | np.isnan(spread)) & ~visible)
    return np.select([missing, uncertain], [MISSING, UNCERTAIN], FINE).astype(np.int8)


def unit_of(column: str, length: str) -> str:
    """The unit of a column of kinematics by the end of its name, such as "m/s"; "" for none, and for an end that is not
    among ours. length: the paths' unit."""
    last = column.removesuffix("_sd").rpartition("_")[2]
    for prefix, norm, unit in _QUANTITIES:
        if last == norm or last in {prefix + axis for axis in "xyz"}:
            return unit.format(length)
    return _UNITS.get(last, "").format(length)
