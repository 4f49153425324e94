"""Figures of a take: ranges of motion, symmetry, repetitions, walking and paths, each with what it rests on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from ..pipeline.angles import ANGLES, MIDLINE
from ..pipeline.cycles import Repetition, Step, normalised, repetitions, steps, strides, symmetry_index
from ..pipeline.errors import InputError
from ..pipeline.options import did_you_mean
from ..pipeline.pose import PoseSequence, Rectified
from ..pipeline.rotations import rotate, transpose
from ..pipeline.signals import breaks
from ..pipeline.smoothness import path_length
from ..pipeline.take import Take
from ..pipeline.walking import lengths

_FEWEST = 10  # frames for a range
_NO_RANGE = 5.0  # degrees: below, noise makes the range, and a share of it says nothing
_SQUAT, _RAISE, _ANY = 35.0, 50.0, 20.0  # degrees that a repetition rises by at least
_STRIDE = 0.25  # legs: by how much the ankles' separation changes from step to step at least
_STAYS = 0.4  # legs: by how much it changes in a squat at most; in walking both knees bend at every landing
_HALF = 0.5  # and both by this part of the largest change in the take
_SIDES = {"right": "r", "left": "l"}
_IN_SQUATS = ("r_knee_flexion", "l_knee_flexion", "r_hip_flexion", "l_hip_flexion", "trunk_lean_sagittal")
_IN_RAISES = ("shoulder_elevation", "shoulder_flexion", "elbow_flexion")
_IN_STRIDES = ("hip_flexion", "knee_flexion", "shoulder_flexion", "elbow_flexion")


@dataclass(frozen=True)
class Measures:
    """The stage. repeated: further angles whose repetitions are counted, such as "r_elbow_flexion"."""

    repeated: tuple[str, ...] = ()

    name: ClassVar[str] = "measures"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified", "filtered", "kinematics")
    gives: ClassVar[tuple[str, ...]] = ("measures",)

    def __post_init__(self) -> None:
        for name in self.repeated:
            if name not in ANGLES:
                raise InputError(f"There is no angle '{name}' to count; {did_you_mean(name, ANGLES)}")

    def __call__(self, take: Take) -> Take:
        assert take.rectified is not None
        assert take.filtered is not None
        assert take.kinematics is not None
        return take.with_(measures=measures(take.filtered, take.rectified, take.kinematics, self.repeated))


def measures(
    filtered: PoseSequence,
    rectified: Rectified,
    kinematics: dict[str, np.ndarray],
    repeated: Sequence[str] = (),
) -> dict[str, Any]:
    """Nested figures, ready for JSON, units in the keys. What cannot be had is absent, and its group has a `reason`.

    filtered: joints in LEVEL after the low-pass; rectified: where BODY's axes are from; kinematics: columns (T,) with
    the angles (stages.angles.joint_angles) and paths (stages.trajectories.trajectory).

    range_of_motion: of each angle; p05_p95_deg leaves the highest and lowest twentieth of the frames out, which are
        noise's, and sd_deg is the middle of the stated standard deviations. symmetry: of the right and left
        p05_p95_deg. squats: both knees bend and straighten together while the feet stay (rising from a seat and
        sitting down again counts too). arm_raises: an arm goes up and down in whichever plane. repetitions: of the
        angles `repeated`. A repetition rises by 35 (squats), 50 (arms) or 20 degrees at least, and by half of the
        largest change in the take.
    walking: steps while the ankles pass each other; cadence is two steps in the middle one of the strides' durations.
        Speed and lengths are there where the source knows where the person is, else `lengths_reason`.
    paths: lengths from the pelvis, and of the pelvis (root) where its way is known.

    `frames` is how many frames a figure rests on, `nan_share` the share of the take's frames that have no value.
    Smoothness (pipeline/smoothness.py) is that of an angle's rate while it rises (up) and returns (down), the middle
    one of all repetitions. Cycles are curves of 101 points over 0 to 100 % of a repetition or stride, mean and standard
    deviation over those in which no frame is missing.
    """
    times, seams = filtered.times, breaks(filtered)
    take = _Columns(kinematics, times, seams)
    separation = _separation(filtered, rectified)
    walks = _walks(take, separation)

    def in_place(one: Repetition) -> bool:
        if any(step.start_s < one.stop_s and one.start_s < step.stop_s for walk in walks for step in walk):
            return False
        apart = separation[(times >= one.start_s) & (times <= one.stop_s)]
        apart = apart[np.isfinite(apart)]
        return not len(apart) or float(np.ptp(apart)) <= _STAYS

    ranges = {name: _range(take, name) for name in ANGLES}
    knees = np.minimum(take("r_knee_flexion"), take("l_knee_flexion"))
    result: dict[str, Any] = {
        "range_of_motion": ranges,
        "symmetry": _symmetry(ranges),
        "squats": _repeats(take, knees, _SQUAT, _IN_SQUATS, in_place),
    }
    arms = {
        words: _repeats(
            take,
            take(f"{side}_shoulder_elevation"),
            _RAISE,
            [f"{side}_{part}" for part in _IN_RAISES],
        )
        for words, side in _SIDES.items()
    }
    cycles = {name: curve for arm in arms.values() for name, curve in arm.pop("cycles", {}).items()}
    result["arm_raises"] = {**arms, "cycles": cycles} if cycles else arms
    if repeated:
        result["repetitions"] = {name: _repeats(take, take(name), _ANY, [name]) for name in repeated}
    result["walking"] = _walking(take, separation, walks, filtered, rectified)
    result["paths"] = _paths(take, rectified)
    return result


@dataclass(frozen=True)
class _Columns:
    """The take's columns (T,) and its clock; an angle is NaN throughout where it is not among them."""

    columns: dict[str, np.ndarray]
    times: np.ndarray
    seams: tuple[int, ...]

    def __call__(self, angle: str) -> np.ndarray:
        return self.columns.get(f"{angle}_deg", np.full(len(self.times), np.nan))

    def cycles(self, angle: str, spans: np.ndarray) -> dict[str, Any]:
        """Mean and standard deviation of an angle over spans (N, 2) in seconds; empty when none is whole."""
        curves = normalised(self(angle), self.times, spans, self.seams)
        if not len(curves):
            return {}
        spread = {"sd_deg": _figures(curves.std(axis=0, ddof=1))} if len(curves) > 1 else {}
        return {"count": len(curves), "mean_deg": _figures(curves.mean(axis=0)), **spread}


def _range(take: _Columns, name: str) -> dict[str, Any]:
    values = take(name)
    known = values[np.isfinite(values)]
    if len(known) < _FEWEST:
        return {"reason": f"fewer than {_FEWEST} frames have this angle", **_basis(values)}
    low, high = np.percentile(known, [5, 95])
    spread = take.columns.get(f"{name}_sd_deg", np.full(1, np.nan))
    return {
        "lowest_deg": _figure(known.min()),
        "highest_deg": _figure(known.max()),
        "full_range_deg": _figure(known.max() - known.min()),
        "p05_deg": _figure(low),
        "p95_deg": _figure(high),
        "p05_p95_deg": _figure(high - low),
        **_middle("sd_deg", spread[np.isfinite(spread)]),
        **_basis(values),
    }


def _symmetry(ranges: dict[str, dict[str, Any]]) -> dict[str, Any]:
    formula = (
        "100 (right - left) / ((right + left) / 2) of the ranges between the 5th and 95th percentile; "
        "positive when the right is larger"
    )
    result: dict[str, Any] = {"formula": formula}
    for name in dict.fromkeys(name[2:] for name in ANGLES if name not in MIDLINE):
        right, left = (ranges[f"{side}_{name}"].get("p05_p95_deg") for side in _SIDES.values())
        if right is None or left is None:
            result[name] = {"reason": "one side has no range"}
            continue
        result[name] = {"right_deg": right, "left_deg": left}
        if max(right, left) < _NO_RANGE:
            result[name]["reason"] = f"both ranges are below {_NO_RANGE:g} degrees"
        else:
            result[name]["symmetry_index_percent"] = _figure(symmetry_index(right, left))
    return result


def _repeats(
    take: _Columns,
    driver: np.ndarray,
    least: float,
    shown: Iterable[str],
    counts: Callable[[Repetition], bool] = lambda one: True,
) -> dict[str, Any]:
    """Of an angle (T,) that drives a movement, and of those shown over the cycles of repetitions that count."""
    if np.isfinite(driver).sum() < _FEWEST:
        return {"reason": f"fewer than {_FEWEST} frames have the angle", **_basis(driver)}
    whole = float(np.nanmax(driver) - np.nanmin(driver))
    found = [
        one for one in repetitions(driver, take.times, max(least, _HALF * whole), take.seams) if counts(one)
    ]
    result: dict[str, Any] = {"count": len(found), **_basis(driver)}
    if not found:
        return result
    spans = np.array([(one.start_s, one.stop_s) for one in found])
    result |= {
        "start_s": _figures(spans[:, 0]),
        "stop_s": _figures(spans[:, 1]),
        "peak_deg": _figures(one.peak for one in found),
        **_spread("duration_s", spans[:, 1] - spans[:, 0]),
        **_spread("rise_deg", np.array([one.rise for one in found])),
        **_smoothness(found),
    }
    cycles = {name: take.cycles(name, spans) for name in shown}
    return {**result, "cycles": {name: curve for name, curve in cycles.items() if curve}}


def _smoothness(found: list[Repetition]) -> dict[str, float]:
    result: dict[str, float] = {}
    for way in ("up", "down"):
        for i, name in enumerate(("sparc", "log_dimensionless_jerk")):
            values = np.array([getattr(one, way)[i] for one in found])
            result |= _middle(f"{name}_{way}", values[np.isfinite(values)])
    return result


def _separation(filtered: PoseSequence, rectified: Rectified) -> np.ndarray:
    """(T,) how far the right ankle is in front of the left one along BODY's x, in lengths of a leg: no turn of the path
    and no pan of the camera changes that."""
    R_body_from_level = transpose(rectified.R_source_from_body) @ rectified.R_source_from_level
    body = rotate(R_body_from_level, filtered.joints.astype(np.float64))
    at = {name: body[:, i] for i, name in enumerate(filtered.layout.joints)}
    bones = [(f"{side}_{a}", f"{side}_{b}") for side in "rl" for a, b in pairwise(("hip", "knee", "ankle"))]
    legs = np.sum([np.linalg.norm(at[b] - at[a], axis=-1) for a, b in bones], axis=0)
    known = legs[np.isfinite(legs)]
    leg = np.median(known) / 2 if len(known) else np.nan
    return (at["l_ankle"] - at["r_ankle"])[:, 0] / leg  # x is back


def _walks(take: _Columns, separation: np.ndarray) -> list[list[Step]]:
    if np.isfinite(separation).sum() < _FEWEST:
        return []
    whole = float(np.nanmax(separation) - np.nanmin(separation))
    return steps(separation, take.times, max(_STRIDE, _HALF * whole), take.seams)


def _walking(
    take: _Columns,
    separation: np.ndarray,
    walks: list[list[Step]],
    filtered: PoseSequence,
    rectified: Rectified,
) -> dict[str, Any]:
    if not rectified.level_ok:
        return {"reason": f"the take is not levelled: {rectified.level_reason}"}
    if np.isfinite(separation).sum() < _FEWEST:
        return {"reason": f"fewer than {_FEWEST} frames have both legs", **_basis(separation)}
    if not walks:
        return {"steps": 0, "reason": "no three steps in a row", **_basis(separation)}
    every = [step for walk in walks for step in walk]
    spans = {side: strides(walks, side) for side in _SIDES.values()}
    durations = np.concatenate([np.diff(span, axis=1)[:, 0] for span in spans.values()])
    over_floor, of_sides = _lengths(filtered, walks)
    sides = {words: _side(every, spans[side], side) | of_sides[side] for words, side in _SIDES.items()}
    right, left = (side.get("mean_step_time_s", np.nan) for side in sides.values())
    cycles = {
        f"{side}_{part}": take.cycles(f"{side}_{part}", spans[side])
        for part in _IN_STRIDES
        for side in _SIDES.values()
    }
    return {
        "walks": len(walks),
        "steps": len(every),
        "cadence_spm": _figure(120 / np.median(durations)),
        **_spread("step_time_s", np.array([step.stop_s - step.start_s for step in every])),
        **_spread("stride_time_s", durations),
        "step_time_symmetry_index_percent": _figure(symmetry_index(right, left)),
        **over_floor,
        **_basis(separation),
        **sides,
        "cycles": {name: curve for name, curve in cycles.items() if curve},
    }


def _side(every: list[Step], spans: np.ndarray, side: str) -> dict[str, Any]:
    """Of the steps that end when this foot lands."""
    own = [step for step in every if step.side == side]
    return {
        "steps": len(own),
        "strides": len(spans),
        **_spread("step_time_s", np.array([step.stop_s - step.start_s for step in own])),
        "landings_s": _figures(step.stop_s for step in own),
    }


def _lengths(filtered: PoseSequence, walks: list[list[Step]]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Of the whole walk, and of each side by its letter; a reason where the person's place is not known."""
    nothing: dict[str, Any] = {side: {} for side in _SIDES.values()}
    if filtered.root is None:
        return {
            "lengths_reason": "where the person is in the room is not known, or the camera moves"
        }, nothing
    root = filtered.root[:, :2]
    ankles = {side: root + filtered.joint(f"{side}_ankle")[:, :2] for side in _SIDES.values()}
    found = lengths(root, ankles, filtered.times, walks, breaks(filtered))
    if np.isnan(found.speed):
        return {"lengths_reason": "the person's place is missing in every stride"}, nothing
    length = "m" if filtered.frame.metric else "au"
    steps_of = {side: values[np.isfinite(values)] for side, values in found.step.items()}
    return {
        f"walking_speed_{length}ps": _figure(found.speed),
        **_spread(f"stride_length_{length}", found.stride[np.isfinite(found.stride)]),
        **_spread(f"step_length_{length}", np.concatenate(list(steps_of.values()))),
    }, {side: _spread(f"step_length_{length}", values) for side, values in steps_of.items()}


def _paths(take: _Columns, rectified: Rectified) -> dict[str, Any]:
    if rectified.camera == "moving":
        return {"reason": "the camera moves, and its turning about the vertical would be part of the way"}
    result: dict[str, Any] = {}
    for column in take.columns:
        joint, x, unit = column.rpartition("_x_")
        if not x or unit not in ("m", "au"):
            continue
        points = np.stack([take.columns[f"{joint}_{axis}_{unit}"] for axis in "xyz"], axis=-1)
        length, duration = path_length(points, take.times, take.seams)
        basis = _basis(points.sum(axis=-1))
        if duration == 0:
            result[joint] = {"reason": "no two frames in a row have this joint", **basis}
            continue
        per_second = {"m": "mean_speed_mps", "au": "mean_speed_aups"}[unit]
        result[joint] = {
            f"path_length_{unit}": _figure(length),
            per_second: _figure(length / duration),
            "duration_s": _figure(duration),
            **basis,
        }
    return result or {"reason": "no paths were written; run trajectories first"}


def _basis(values: np.ndarray) -> dict[str, Any]:
    known = np.isfinite(values)
    return {"frames": int(known.sum()), "nan_share": _figure(1 - known.mean())}


def _spread(name: str, values: np.ndarray) -> dict[str, float]:
    """Mean, and standard deviation of two or more; nothing of none."""
    if not len(values):
        return {}
    spread = {f"sd_{name}": _figure(values.std(ddof=1))} if len(values) > 1 else {}
    return {f"mean_{name}": _figure(values.mean()), **spread}


def _middle(name: str, values: np.ndarray) -> dict[str, float]:
    return {name: _figure(np.median(values))} if len(values) else {}


def _figures(values: Iterable[Any]) -> list[float]:
    return [_figure(value) for value in values]


def _figure(value: Any) -> float:
    """As a Python number of six digits, which is more than any of them deserves."""
    return float(f"{value:.6g}")
