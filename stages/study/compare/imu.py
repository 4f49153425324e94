"""A run against inertial sensors that were strapped to the person: the 3DPCNet paper's figure 5, with its numbers.

A video shows motion relative to the pelvis only; an IMU feels all of it, and in walking the pelvis makes a third or
more of a wrist's acceleration. So the acceleration of a pelvis IMU in the same world is taken from the others', where
there is one.

Both sides are low-passed alike. Lag and heading are those at which both correlate best over the three axes at once. For
a given lag the best heading has a closed form: with the horizontal parts as complex numbers it is the angle of
sum(conj(imu) video), and the correlation's horizontal part its length. Both clocks are taken to run alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from ....adapters.imu_csv import SEGMENTS, Imu, point_on
from ....pipeline.core.errors import InputError, naming
from ....pipeline.core.figures import label_of
from ....pipeline.core.messages import how_many
from ....pipeline.core.notices import Notice, notice
from ....pipeline.core.rotations import is_finite, turn_deg, turned
from ....pipeline.core.take import Take
from ....pipeline.plugins.options import did_you_mean
from ....pipeline.reading.load import find_adapter
from ....pipeline.signals.filters import (
    CUTOFF_HZ,
    breaks,
    check_cutoff,
    derivative,
    holes,
    lowpass,
    rate,
    resample,
    runs,
)  # fmt: skip
from ...drawing.charts import Curve, over_time
from ...drawing.page import Cell, Number, answer, box, charts, figure, page, small, table
from ...drawing.palette import GREEN, PURPLE, as_hex
from .align import AMBIGUOUS, NARROW, WEAK, best_shift, correlation, files_apart
from .side import doubts_of_level

_GRID_HZ = 120.0  # of all comparisons; lags are found between its points
_LEAST_MPS2 = 1e-6  # that an IMU's acceleration changes by; any real one's noise is more
_AXES = {"x": "back", "y": "right", "z": "up", "norm": "norm"}


@dataclass(frozen=True, eq=False)
class Sensed:
    """One sensor against the run.

    means: how the pelvis' own motion was dealt with, in words. lag_s: by how much the IMU's stamps are later than the
    video's. heading_deg: the video's heading less the IMU's. r_three_axes: the correlation over three axes at that lag,
    runner_up: at the best lag elsewhere. compared_s: of motion known to both. metres_per_unit: of the run. video, imu:
    accelerations (N, 3), m/s², at time_s (N,) of the video's clock, in LEVEL (back, right, up) about their means, NaN
    where unknown. agreement: by axis "r" and "rmse_mps2".
    """

    segment: str
    means: str
    lag_s: float
    heading_deg: float
    r_three_axes: float
    runner_up: float
    imu_hz: float
    compared_s: float
    metres_per_unit: float
    time_s: np.ndarray
    video: np.ndarray
    imu: np.ndarray
    agreement: dict[str, dict[str, float]]
    notices: tuple[Notice, ...]

    def figures(self) -> dict[str, Any]:
        """Everything but the curves."""
        kept = {name: value for name, value in vars(self).items() if name not in ("time_s", "video", "imu")}
        return kept | {"notices": [each.as_dict() for each in self.notices]}

    def __str__(self) -> str:
        r, rmse = (
            ", ".join(f"{_AXES[axis]} {agreed[key]:{form}}" for axis, agreed in self.agreement.items())
            for key, form in (("r", ".3f"), ("rmse_mps2", ".2f"))
        )
        return (
            f"{self.segment}: the sensor is {1000 * self.lag_s:.0f} ms late; {self.compared_s:.1f} s compared, "
            f"low-passed at {CUTOFF_HZ:g} Hz; {self.means}; r {r}; RMSE (m/s²) {rmse}"
        )


def read_sensors(files: Sequence[Path], segments: Sequence[str], offset_s: float = 0.0) -> dict[str, Imu]:
    """By segment, the sensor of each file, to whose times offset_s is added. InputError when they do not fit."""
    for name in segments:
        if name not in SEGMENTS:
            raise InputError("name-unknown", f"There is no segment '{name}'; {did_you_mean(name, SEGMENTS)}")
    if len(segments) != len(files):
        raise InputError(
            "needs-input",
            f"Expected one --segment for each --imu, in their order, got {len(segments)} for "
            f"{how_many(len(files), 'file')}; segments are {', '.join(SEGMENTS)}.",
        )
    if len(set(segments)) < len(segments):
        raise InputError("option-conflict", "Expected one IMU for each segment, got two for the same.")
    if set(segments) == {"pelvis"}:
        raise InputError(
            "needs-input",
            "A video shows motion relative to the pelvis, so a pelvis IMU alone cannot be compared; add one on "
            "another segment.",
        )
    sensors = {}
    for segment, file in zip(segments, files, strict=True):
        chosen = find_adapter(file, gives="imu")
        with naming(file):
            (sensor,) = chosen.read(file)
        sensors[segment] = replace(sensor, time_s=sensor.time_s + offset_s)
    return sensors


def compared_with(run: Take, sensors: Mapping[str, Imu], search_s: float = 5.0) -> list[Sensed]:
    """Each sensor against the run, but the pelvis', which is subtracted from the others. search_s: the largest lag that
    is searched for. InputError when there is too little to compare."""
    return [_compared(run, name, sensors, search_s) for name in sensors if name != "pelvis"]


def _compared(run: Take, segment: str, sensors: Mapping[str, Imu], search_s: float) -> Sensed:
    poses, sensor, pelvis = run.need("poses"), sensors[segment], sensors.get("pelvis")
    check_cutoff(CUTOFF_HZ, rate(poses.times))
    check_cutoff(CUTOFF_HZ, sensor.rate_hz)
    path = point_on(segment, run.need("rectified").level.joints.astype(np.float64))
    grid = even_times(poses.times)
    video, values = path_acceleration(path, poses.times, breaks(poses), grid), low_passed(sensor)
    means = "without a pelvis IMU the pelvis' own motion counts as error"
    if pelvis is not None:
        means = "the pelvis IMU is subtracted from the IMU, in their common world"
        values = values - resampled(low_passed(pelvis), pelvis.time_s, sensor.time_s)
    lag_s, heading_deg, r, second = aligned(grid, video, sensor.time_s, values, search_s)
    imu = turned(resampled(values, sensor.time_s, grid + lag_s), heading_deg)
    both, scale = is_finite(video) & is_finite(imu), 1.0
    notices = list(sensor.notices)
    if not poses.frame.metric:
        scale = float(np.sqrt(imu[both].var(axis=0).sum() / video[both].var(axis=0).sum()))
        notices.append(notice("imu-scale-fitted", metres=scale))
    notices += doubts_of_level(run, run.name)
    if r < WEAK:
        notices.append(notice("imu-weak", r=r))
    elif second > AMBIGUOUS * r:
        so = f"Another lag may be the right one: {NARROW}."
        notices.append(notice("shift-ambiguous", run=run.name, r=r, runner_up=second, so=so))
    video, imu = (np.where(both[:, None], a - a[both].mean(axis=0), np.nan) for a in (scale * video, imu))
    columns = [np.column_stack([a, np.linalg.norm(a, axis=-1)]).T for a in (video[both], imu[both])]
    agreement = {
        axis: {
            "r": correlation(of_run, of_sensor, _LEAST_MPS2),
            "rmse_mps2": float(np.sqrt(((of_run - of_sensor) ** 2).mean())),
        }
        for axis, of_run, of_sensor in zip(_AXES, *columns, strict=True)
    }
    return Sensed(
        segment=segment,
        means=means,
        lag_s=lag_s,
        heading_deg=heading_deg,
        r_three_axes=r,
        runner_up=second,
        imu_hz=sensor.rate_hz,
        compared_s=float(both.sum() / _GRID_HZ),
        metres_per_unit=scale,
        time_s=grid,
        video=video,
        imu=imu,
        agreement=agreement,
        notices=tuple(notices),
    )


def aligned(
    grid: np.ndarray, video: np.ndarray, time_s: np.ndarray, imu: np.ndarray, search_s: float
) -> tuple[float, float, float, float]:
    """The lag in seconds, the heading in degrees, the correlation over three axes and that of the best other lag, of
    video accelerations (N, 3) at even times (N,) and an IMU's (T, 3) at times (T,) of its own clock.

    InputError when less than a second of motion is known to both, or when the IMU feels none."""
    felt = imu[is_finite(imu)]
    if len(felt) and float(np.ptp(felt, axis=0).max()) < _LEAST_MPS2:
        raise InputError(
            "nothing-usable",
            "Expected an IMU whose acceleration changes, got one that stays the same throughout: it did not move, or "
            "its file was given for two segments, of which one is subtracted from the other.",
        )
    best = best_shift(grid, video, lambda at_s: resampled(imu, time_s, at_s), _score, 0.0, search_s)
    if best is None:
        raise files_apart({"the IMU": time_s, "the video": grid}, f"lags up to {search_s:g} s")
    lag_s, score, runner_up = best
    heading_deg = turn_deg(*reversed(_about_means(video, resampled(imu, time_s, grid + lag_s))))
    return lag_s, heading_deg, score, runner_up


def _score(video: np.ndarray, imu: np.ndarray) -> tuple[float, float]:
    """Correlation of accelerations (N, 3) over three axes at the best heading, and of how many rows."""
    a, b = _about_means(video, imu)
    turn = np.vdot(b[:, 0] + 1j * b[:, 1], a[:, 0] + 1j * a[:, 1])  # horizontal parts as complex numbers
    energy = float(np.sqrt((a**2).sum() * (b**2).sum()))
    score = (abs(turn) + (a[:, 2] * b[:, 2]).sum()) / max(energy, 1e-12)
    return float(score), len(a)


def _about_means(video: np.ndarray, imu: np.ndarray) -> list[np.ndarray]:
    """Of accelerations (N, 3) the rows (M, 3) that are known to both, less their means."""
    both = is_finite(video) & is_finite(imu)
    return [a[both] - a[both].sum(axis=0) / max(both.sum(), 1) for a in (video, imu)]


def even_times(time_s: np.ndarray) -> np.ndarray:
    """(N,) evenly spaced times from the first to the last of time_s (T,)."""
    return time_s[0] + np.arange(int((time_s[-1] - time_s[0]) * _GRID_HZ) + 1) / _GRID_HZ


def resampled(values: np.ndarray, time_s: np.ndarray, at_s: np.ndarray) -> np.ndarray:
    """values (T, 3) at other times (N,), NaN in gaps, short ones too: an acceleration says little about the one 0.2 s
    later."""
    return resample(values, time_s, at_s, holes(time_s).tolist())


def low_passed(imu: Imu) -> np.ndarray:
    """(T, 3) the sensor's acceleration in its world without gravity, on its clock."""
    return lowpass(imu.acceleration_mps2, imu.time_s, CUTOFF_HZ, holes(imu.time_s).tolist())


def path_acceleration(
    path: np.ndarray, time_s: np.ndarray, seams: Sequence[int], grid: np.ndarray
) -> np.ndarray:
    """(N, 3) accelerations at even times grid (N,) of a path (T, 3) at time_s (T,), by a spline of fifth order and
    low-passed, never across a gap or a clip boundary. Half a cycle of the cut-off at each piece's ends, where the
    filter has only one side, is NaN."""
    from scipy.interpolate import make_interp_spline

    fine, begins = np.full((len(grid), 3), np.nan), []
    for piece in runs(is_finite(path), time_s, [*seams, *holes(time_s)]):  # unfiltered, a hole is not bridged
        if piece.stop - piece.start > 5:
            times = time_s[piece]
            start, stop = np.searchsorted(grid, [times[0] - 1e-9, times[-1] + 1e-9])
            fine[start:stop] = make_interp_spline(times, path[piece], k=5)(grid[start:stop])
            begins += [int(start)] if start else []
    acceleration = derivative(lowpass(fine, grid, CUTOFF_HZ, begins), grid, begins, order=2)
    edge, inner = round(0.5 / CUTOFF_HZ * _GRID_HZ), np.zeros(len(grid), dtype=bool)
    for piece in runs(is_finite(acceleration), np.arange(len(grid), dtype=float), begins):
        inner[piece.start + edge : max(piece.stop - edge, piece.start)] = True
    return np.where(inner[:, None], acceleration, np.nan)


def sensed_page(name: str, results: Sequence[Sensed]) -> str:
    """One HTML page of a run's name: a table, and the norm over time, the sensor beside the run."""
    rows: list[list[Cell]] = [
        [
            label_of(result.segment),
            _AXES[axis],
            Number(f"{agreed['r']:.3f}"),
            Number(f"{agreed['rmse_mps2']:.2f}"),
        ]
        for result in results
        for axis, agreed in result.agreement.items()
    ]
    about = (
        "Axes of the run's LEVEL, to whose heading the sensor's world was turned; the means over the compared time, "
        "which are errors of tilt or bias, are taken out on both sides."
    )
    warnings = [each.text for result in results for each in result.notices]
    head = answer([f"{result}." for result in results]) + box("Warnings", warnings, "warning")
    sections = [
        ("Agreement", table(("segment", "axis", "r", "RMSE (m/s²)"), rows) + small(about)),
        ("Over time", charts([_over_time(result) for result in results])),
    ]
    return page(f"{name} against inertial sensors", head, sections)


def _over_time(result: Sensed) -> Markup:
    of_sensor, of_run = (np.linalg.norm(values, axis=-1) for values in (result.imu, result.video))
    title = f"{label_of(result.segment).capitalize()}: norm of the acceleration (m/s²)"
    curves = [  # neither has the colour of a body's side
        Curve("sensor", of_sensor, as_hex(GREEN), width=2.4),
        Curve("run", of_run, as_hex(PURPLE)),
    ]
    return figure(over_time(curves, result.time_s, f"{title} of both over time"), title)
