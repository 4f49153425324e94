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

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import ClassVar, Literal

import numpy as np

from ..models.angle_error.joint_noise import made_by_the_built_in
from ..models.gait.clock import clock_doubts
from ..models.smoother import LIFTED, Motion, known_noise
from ..pipeline.core.errors import InputError
from ..pipeline.core.measures import UNITS
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.core.rotations import is_finite
from ..pipeline.core.take import Take, in_single
from ..pipeline.signals.filters import (
    CUTOFF_HZ,
    ORDER,
    breaks,
    check_cutoff,
    derivative,
    each_path,
    evenly_spaced,
    lowpass,
    piecewise,
    rate,
    runs,
)
from ..pipeline.signals.norms import FINE, MISSING, UNCERTAIN

Filter = Literal["butterworth", "savgol", "none"]
Smoother = Literal["auto", "butterworth", "savgol", "none"]
Cutoff = float | Literal["auto"] | None

# Prefix of the axes' columns, name of the norm's, unit for a unit of length. Names are the same whatever the unit is.
_QUANTITIES = (("", "distance", "{}"), ("v", "speed", "{}/s"), ("a", "acceleration", "{}/s2"))
# Of a column whose name ends so; {} is the unit of length.
_UNITS = {unit.ending.removeprefix("_"): unit.table for unit in UNITS.values() if unit.ending} | {"sd": "{}"}
_HALF_POWER = np.sqrt(0.5)  # gain at the cut-off
# Of a Savitzky-Golay filter the usual order, and the rows that it does not fit exactly.
_CUBIC, _SHORTEST = 3, 5


@dataclass(frozen=True)
class Trajectories:
    """The stage. joints: those whose paths are written. `filtered` has all 17 joints after the low-pass of `smooth`,
    for angles; its history says which columns come from the smoother instead.

    smoother: "auto" uses the error of the paths and states that of its answers (`known_motions`); the others are the
    filters of `smooth`. cutoff_hz: as in `smooth`; given with "auto", the paths are those of "butterworth".
    If the source knows where the person is and the camera stands still, the pelvis's own path in LEVEL is written
    too, as `root`, from the camera or the world's origin.
    """

    joints: tuple[str, ...] = ("r_wrist", "l_wrist", "r_ankle", "l_ankle")
    smoother: Smoother = "auto"
    cutoff_hz: Cutoff = None

    name: ClassVar[str] = "trajectories"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified")
    gives: ClassVar[tuple[str, ...]] = ("kinematics", "filtered")

    def __call__(self, take: Take) -> Take:
        rectified = take.need("rectified")
        refused = ~rectified.turned  # missing, so that nothing is taken across them
        level = rectified.level.mapped(
            lambda points: np.where(refused[:, None, None], np.nan, points),
            covariance=rectified.level.covariance,
        )
        known_error = self.smoother == "auto" and self.cutoff_hz is None
        path, lowpass = smooth(level, self.classical, self.cutoff_hz, self.joints)
        filtered = _notices(path, lowpass, known_error)
        lifted, judged = take.need("poses").lifted, made_by_the_built_in(take.need("poses"))
        motions = known_motions(level, self.joints, lifted, judged) if known_error else {}
        if motions:  # whose columns hold something else than this path, which angles are taken from
            errors = "estimated" if level.covariance is None else "stated"
            path = path.noted("smoother", columns_of=list(motions), joint_errors=errors)
        columns = dict(take.kinematics or {})
        for joint in (*self.joints, *(["root"] if path.root is not None else [])):
            motion = motions.pop(joint, None)
            columns |= in_single(trajectory(path if motion is None else level, joint, motion))
        if path.root_sd is not None:  # the body's size and the focal length included
            columns |= in_single({f"root_{axis}_sd": path.root_sd[:, i] for i, axis in enumerate("xyz")})
        notices = [notice("relative-to-camera")] if rectified.camera == "moving" else []
        smoothed = known_error and len(level) > 1  # a single frame has no path
        if smoothed and level.covariance is None:
            reason = "those of the joints were estimated from the paths, which do not show slow errors"
            notices.append(notice("path-errors-unknown", reason=reason))
        elif smoothed and not judged:
            reason = "those of the joints, which the lifter states, were not checked"
            notices.append(notice("path-errors-unknown", reason=reason))
        return take.with_(kinematics=columns, filtered=path, cutoff_hz=lowpass.cutoff_hz).saying(
            *notices, *filtered, *clock_doubts(level)
        )

    def check_rate(self, fps: float) -> None:
        """InputError for a cut-off that is given and that the filter does not have at that frame rate."""
        if isinstance(self.cutoff_hz, int | float) and self.classical != "none" and np.isfinite(fps):
            check = check_savgol_cutoff if self.classical == "savgol" else check_cutoff
            check(self.cutoff_hz, fps)

    @property
    def classical(self) -> Filter:
        """The filter of the joints that angles are taken from."""
        return "butterworth" if self.smoother == "auto" else self.smoother


def known_motions(
    level: PoseSequence, joints: tuple[str, ...], lifted: bool = True, judged: bool = True
) -> dict[str, Motion]:
    """The motion of these joints, and of the root if there is one, smoothed by their errors: a path for each name.

    The error is the poses' covariance. Without one it is estimated from the paths, which do not show slow errors. An
    estimated error smooths the paths but is not stated, and neither is that of a lifter that was not measured. The
    root's error is always estimated.
    Missing joints are interpolated, with the error of that, but not across frames in which nobody was seen.
    """
    points = level.joints[:, level.layout.indices(joints)].astype(np.float64)
    seen = np.asarray(is_finite(level.joints)).any(axis=1)
    lost = np.flatnonzero(np.diff(seen)) + 1  # behind a frame without anybody everything may be new
    cuts = tuple(sorted({*breaks(level), *lost.tolist()}))
    stated = level.covariance
    errors = None if stated is None else stated[:, level.layout.indices(joints)]
    motion = known_noise(points, level.times, errors, cuts, lifted)
    # What a path tells of its errors is not what a lifter errs by: one that smooths or lags does not shake.
    known = stated is not None and (judged or not lifted)
    motion = motion.widened(LIFTED) if known and lifted else motion if known else motion.unstated()
    motions = {joint: motion.of(i) for i, joint in enumerate(joints)}
    if level.root is not None:
        motions["root"] = known_noise(level.root[:, None], level.times, None, cuts).unstated()
    return motions


@dataclass(frozen=True)
class Lowpass:
    """What `smooth` did. cutoff_hz: None if it filtered nothing; too_slow: because the frame rate is too low for it.
    lowered_from_hz: the cut-off asked for, which a Savitzky-Golay filter does not have here. rows_resampled: rows moved
    to even times. values_lost: values of joints in pieces too short for the filter."""

    cutoff_hz: float | None = None
    too_slow: bool = False
    lowered_from_hz: float | None = None
    rows_resampled: int = 0
    values_lost: int = 0


def smooth(
    level: PoseSequence,
    filter: Filter = "butterworth",
    cutoff_hz: Cutoff = None,
    moving: tuple[str, ...] = ("r_wrist", "l_wrist", "r_ankle", "l_ankle"),
) -> tuple[PoseSequence, Lowpass]:
    """The same poses with the paths of every joint, the feet and the root low-pass filtered, inside their unbroken
    pieces (pipeline/signals/filters.py); and what was done, as the history says too.

    filter: "butterworth" (two passes, order 4 together, no phase shift), "savgol" (Savitzky-Golay, order 3), "none".
    cutoff_hz: where half the power is left; None is 6 Hz, or no filter if the frame rate is too low for 6 Hz;
        "auto" is the highest that residual analysis finds for any of the joints `moving`. Below 25.3 frames a second a
        Savitzky-Golay filter cannot have 6 Hz: without a number it takes the highest that it can.

    A joint is NaN in pieces too short for the filter. InputError for a given cut-off that the filter
    does not have at that frame rate, and for a take too short to choose one from.
    """
    times, seams = level.times, breaks(level)
    if filter == "none":
        return level.noted("low-pass filter", filter=filter), Lowpass()
    if cutoff_hz is None and not rate(times) > 2 * CUTOFF_HZ:
        return level.noted("low-pass filter", filter="none", unfiltered=True), Lowpass(too_slow=True)
    given = cutoff_hz not in (None, "auto")
    if cutoff_hz == "auto":
        cutoff_hz = _chosen(level, moving)
    cutoff = CUTOFF_HZ if cutoff_hz is None else cutoff_hz
    lowered_from_hz = None
    if filter == "savgol" and not given and cutoff > (highest := highest_savgol_cutoff(rate(times))):
        cutoff, lowered_from_hz = highest, cutoff
    joints = level.joints

    def smoothed(path: np.ndarray) -> np.ndarray:
        return _FILTERS[filter](path, times, cutoff, seams)

    result = each_path(smoothed, joints)
    root = None if level.root is None else smoothed(level.root)
    feet = None if level.feet is None else each_path(smoothed, level.feet)
    done = Lowpass(
        cutoff,
        lowered_from_hz=lowered_from_hz,
        rows_resampled=uneven_rows(np.asarray(is_finite(joints).any(axis=1)), times, seams),
        values_lost=int((is_finite(joints) & ~is_finite(result)).sum()),
    )
    said = {name: value for name, value in asdict(done).items() if name != "too_slow" and value is not None}
    return level.with_(joints=result, root=root, feet=feet).noted(
        "low-pass filter", filter=filter, **said
    ), done


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


def _with_errors(joint: str, motion: Motion, seen: np.ndarray) -> dict[str, np.ndarray]:
    """The columns of `trajectory` with their errors, of the one path of `motion`, which was seen (T,) or not."""
    columns = {}
    for (prefix, norm, _), values, covariance in zip(
        _QUANTITIES, motion.values[:, :, 0], motion.covariance[:, :, 0], strict=True
    ):
        reason = _reasons(values, covariance, seen, about_mean=norm == "distance")
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


def _reasons(values: np.ndarray, covariance: np.ndarray, seen: np.ndarray, about_mean: bool) -> np.ndarray:
    """(T,) int8 of values (T, 3) and their covariance (T, 3, 3). What is less certain than the take's root mean square
    (about its mean) is marked, and counts as missing where it was not seen either."""
    present = np.isfinite(values).all(axis=1)
    if not present.any():
        return np.full(len(values), MISSING, np.int8)
    moved = values[present] - (values[present].mean(axis=0) if about_mean else 0.0)
    spread = np.einsum("tii->t", covariance)  # NaN where nobody states it: then nothing is made up in between
    uncertain = spread > (moved**2).sum(axis=1).mean()
    missing = ~present | ((uncertain | np.isnan(spread)) & ~seen)
    return np.select([missing, uncertain], [MISSING, UNCERTAIN], FINE).astype(np.int8)


def unit_of(column: str, length: str) -> str:
    """The unit of a column of kinematics by the end of its name, such as "m/s"; "" for none, and for an end that is not
    among ours. length: the paths' unit."""
    last = column.removesuffix("_sd").rpartition("_")[2]
    for prefix, norm, unit in _QUANTITIES:
        if last == norm or last in {prefix + axis for axis in "xyz"}:
            return unit.format(length)
    return _UNITS.get(last, "").format(length)


def savitzky_golay(
    x: np.ndarray, time_s: np.ndarray, cutoff_hz: float = CUTOFF_HZ, seams: Sequence[int] = ()
) -> np.ndarray:
    """x (T,) or (T, D), each row the value there of the polynomial of order 3 fitted to its window.

    The window is the widest whose power at cutoff_hz is not yet below a half (Schafer, "What Is a Savitzky-Golay
    Filter?", IEEE Signal Processing Magazine 28(4), 2011). Missing rows stay NaN, as do pieces
    shorter than the window. InputError for a cut-off that no window has.
    """
    from scipy.signal import savgol_filter

    fps = rate(time_s)
    check_savgol_cutoff(cutoff_hz, fps)
    window = _SHORTEST
    while _savgol_gain(window + 2, cutoff_hz / fps) >= _HALF_POWER:
        window += 2
    return piecewise(
        x, time_s, seams, fps, window, lambda piece: np.asarray(savgol_filter(piece, window, _CUBIC, axis=0))
    )


def highest_savgol_cutoff(fps: float) -> float:
    """The highest cut-off in Hz that `savitzky_golay` has at a frame rate, that of its shortest window, rounded down to
    a hundredth."""
    # The weights of its five rows are (-3, 12, 17, 12, -3) / 35, so the gain is 1 - 12 (1 - cos)^2 / 35 of the angle by
    # which a sine goes on from row to row.
    angle = np.arccos(1 - np.sqrt(35 / 12 * (1 - _HALF_POWER)))
    return float(np.floor(100 * fps * angle / (2 * np.pi)) / 100)


def check_savgol_cutoff(cutoff_hz: float, fps: float) -> None:
    """InputError unless `savitzky_golay` has a window for the cut-off at that frame rate."""
    check_cutoff(cutoff_hz, fps)
    if _savgol_gain(_SHORTEST, cutoff_hz / fps) < _HALF_POWER:
        raise InputError(
            "bad-value",
            f"A Savitzky-Golay filter of order {_CUBIC} has no window for a cut-off of {cutoff_hz:g} Hz at {fps:.4g} "
            f"frames a second; choose one of at most {highest_savgol_cutoff(fps):g} Hz, or the Butterworth filter.",
        )


def _savgol_gain(window: int, hz: float) -> float:
    """What a Savitzky-Golay filter leaves of a sine. hz: its frequency over the frame rate."""
    from scipy.signal import savgol_coeffs

    offset = np.arange(window) - window // 2
    return float(savgol_coeffs(window, _CUBIC) @ np.cos(2 * np.pi * hz * offset))


def uneven_rows(valid: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> int:
    """How many of T rows, valid (T,) bool at time_s (T,), lie in pieces whose time stamps are not evenly
    spaced, so that filters resample them."""
    fps = rate(time_s)
    pieces = runs(valid, time_s, seams)
    return sum(piece.stop - piece.start for piece in pieces if not evenly_spaced(time_s[piece], fps))


_FILTERS: dict[str, Callable[..., np.ndarray]] = {"butterworth": lowpass, "savgol": savitzky_golay}


def _chosen(level: PoseSequence, moving: tuple[str, ...]) -> float:
    """The highest cut-off that any of these joints asks for, so that none is smoothed too much."""
    asked = [residual_cutoff(level.joint(joint), level.times, breaks(level)) for joint in moving]
    if np.isnan(asked).all():
        raise InputError(
            "nothing-usable",
            "The take is too short, or has too many gaps, to choose a cut-off; give cutoff_hz.",
        )
    return float(np.nanmax(asked))


def residual_cutoff(x: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> float:
    """The cut-off in Hz that x (T,) or (T, D) asks for by residual analysis (Winter, Biomechanics and Motor Control of
    Human Movement, 4th ed. 2009, chapter 3); NaN when no piece is long enough.

    What `lowpass` takes away at some cut-off is noise and, when that is low, motion. Winter draws a line through the
    part of the residual that is noise alone, back to 0 Hz. Here the residual that white noise leaves, which is known
    for every cut-off, is fitted to the observed one from half of Nyquist on, where no motion is expected; what the
    residual has besides is motion lost. The cut-off is the one with the least mean square of motion lost and noise
    kept.
    """
    x = np.asarray(x, dtype=np.float64)
    fps = rate(time_s)
    if not np.isfinite(fps):
        return float("nan")
    cutoffs = np.geomspace(min(1.0, fps / 20), 0.46 * fps, 45)
    compared = np.isfinite(lowpass(x, time_s, cutoffs[0], seams))
    while not compared.any() and cutoffs[0] < fps / 8:  # a short take settles from a higher cut-off on only
        cutoffs = cutoffs[1:]
        compared = np.isfinite(lowpass(x, time_s, cutoffs[0], seams))
    if not compared.any():
        return float("nan")
    residual = np.array([np.mean((x - lowpass(x, time_s, hz, seams))[compared] ** 2) for hz in cutoffs])
    taken, kept = _white_noise(cutoffs, fps)
    upper = cutoffs >= fps / 4
    noise = (residual[upper] @ taken[upper]) / (taken[upper] @ taken[upper])
    return float(cutoffs[np.argmin(residual - noise * taken + noise * kept)])


def _white_noise(cutoffs: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Shares (N,) of white noise's power that `lowpass` takes away, and keeps, at each of the cut-offs (N,)."""
    hz = np.linspace(0, 0.4999, 2000) * fps
    ratio = np.tan(np.pi * hz / fps) / np.tan(np.pi * cutoffs[:, None] / fps)
    gain = 1 / (1 + (np.sqrt(2) - 1) * ratio**ORDER)  # of two passes, a half of the order each
    return ((1 - gain) ** 2).mean(axis=1), (gain**2).mean(axis=1)


def _notices(path: PoseSequence, done: Lowpass, known_error: bool) -> list[Notice]:
    """What the filter did that a reader of the columns must know; known_error: only angles rest on it."""
    fps, cutoff_hz = rate(path.times), done.cutoff_hz
    if len(path) == 1:
        return []
    if done.too_slow:
        return [notice("not-filtered", fps=fps, cutoff_hz=CUTOFF_HZ)]
    notices = []
    if (asked := done.lowered_from_hz) is not None:
        notices.append(notice("cutoff-lowered", cutoff_hz=cutoff_hz, asked_hz=asked, fps=fps))
    if done.values_lost:
        missing = "angles" if known_error else "paths, velocities and accelerations"
        lost = done.values_lost
        notices.append(notice("pieces-too-short", values=lost, cutoff_hz=cutoff_hz, missing=missing))
    return notices
