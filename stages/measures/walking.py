"""Walking: steps, cadence, times and lengths, each with its error, or why steps cannot be counted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ...pipeline.frames import Frame
from ...pipeline.messages import how_many
from ...pipeline.motion.cycles import Step, landings, steps, strides
from ...pipeline.motion.signals import breaks, rate
from ...pipeline.motion.walking import lengths
from ...pipeline.pose import PoseSequence, Rectified
from ...pipeline.rotations import rotate, transpose
from .figures import basis, figures, spread, symmetry, time_resolution, with_error

FEWEST = 10  # frames
NOISE = 2.0 * float(np.sqrt(2))  # standard deviations of a frame's value: twice that of a difference of two
SIDES = {"right": "r", "left": "l"}
_STRIDE = 0.25  # legs: by how much the ankles' separation changes from step to step at least
_HALF = 0.5  # and by this part of the largest change in the take
_STRIDES = 3  # for a cadence
_SIGHT_DEG = 30.0  # off the line of sight: nearer to it, cos 30 = 87 % of a step and more is depth
_SLOW_HZ = 12.0  # a quick step of 0.4 s has fewer than five frames below this
_MEDIAN = float(np.sqrt(np.pi / 2))  # standard error of a median over that of a mean
_IN_STRIDES = ("hip_flexion", "knee_flexion", "shoulder_flexion", "elbow_flexion")


def separation(filtered: PoseSequence, rectified: Rectified) -> np.ndarray:
    """(T, 2) how far the right ankle is in front of the left one and to its right, along BODY's axes, in lengths of a
    leg: no turn of the path and no pan of the camera changes that."""
    R_body_from_level = transpose(rectified.R_source_from_body) @ rectified.R_source_from_level
    body = rotate(R_body_from_level, filtered.joints.astype(np.float64))
    at = {name: body[:, i] for i, name in enumerate(filtered.layout.joints)}
    bones = [(f"{side}_{a}", f"{side}_{b}") for side in "rl" for a, b in pairwise(("hip", "knee", "ankle"))]
    legs = np.sum([np.linalg.norm(at[b] - at[a], axis=-1) for a, b in bones], axis=0)
    known = legs[np.isfinite(legs)]
    leg = np.median(known) / 2 if len(known) else np.nan
    between = (at["r_ankle"] - at["l_ankle"])[:, :2] / leg
    return between * (-1, 1)  # BODY's x is back, its y is right


def separation_sd(columns: Mapping[str, np.ndarray]) -> float:
    """Median standard deviation of the separation, in lengths of a leg, by those that the columns (T,) state for thighs
    and shanks in degrees; 0 where none is stated. Both bones are half of a leg, and the four errors are taken for
    independent."""
    parts = [
        0.5 * np.cos(np.radians(columns[f"{name}_deg"])) * np.radians(columns[f"{name}_sd_deg"])
        for name in (f"{side}_{bone}_sagittal" for side in "rl" for bone in ("thigh", "shank"))
        if f"{name}_deg" in columns and f"{name}_sd_deg" in columns
    ]
    if len(parts) < 4:
        return 0.0
    sd = np.sqrt(np.sum(np.square(parts), axis=0))
    known = sd[np.isfinite(sd)]
    return float(np.median(known)) if len(known) else 0.0


def least_step(apart: np.ndarray, sd: float) -> float:
    """By how much the separation changes from step to step at least. apart: (T,) the separation, sd: its standard
    deviation; all in lengths of a leg. Infinite where too few frames are known."""
    if np.isfinite(apart).sum() < FEWEST:
        return float("inf")
    return max(_STRIDE, NOISE * sd, _HALF * float(np.nanmax(apart) - np.nanmin(apart)))


def walks_in(
    between: np.ndarray, time_s: np.ndarray, seams: Sequence[int], columns: Mapping[str, np.ndarray]
) -> list[list[Step]]:
    """Of the separation (T, 2), with the noise that the columns state."""
    (apart, aside), sd = between.T, separation_sd(columns)
    return steps(apart, time_s, least_step(apart, sd), seams, sd, aside)


def walking(
    apart: np.ndarray,
    walks: list[list[Step]],
    columns: Mapping[str, np.ndarray],
    curves: Callable[[str, np.ndarray], dict[str, Any]],
    filtered: PoseSequence,
    rectified: Rectified,
    source: Frame,
) -> dict[str, Any]:
    """The group `walking` (stages/measures/stage.py). apart: the separation in front (T,). curves: of an angle over
    spans (N, 2). source: the frame of the poses that were rectified."""
    if not rectified.level_ok:
        return {"reason": f"the take is not levelled: {rectified.level_reason}"}
    if np.isfinite(apart).sum() < FEWEST:
        return {"reason": f"fewer than {FEWEST} frames have both legs", **basis(apart)}
    if not walks:
        if why := uncountable(apart, columns, filtered, rectified, source):
            return {"reason": f"steps cannot be counted: {'; '.join(why)}", **basis(apart)}
        return {"steps": 0, "reason": "no three steps in a row", **basis(apart)}
    every = [step for walk in walks for step in walk]
    spans = {side: strides(walks, side) for side in SIDES.values()}
    durations = np.concatenate([np.diff(span, axis=1)[:, 0] for span in spans.values()])
    resolution = time_resolution(rate(filtered.times))
    step_times = np.array([step.stop_s - step.start_s for step in every])
    of_side = {side: _times(every, side) for side in SIDES.values()}
    over_floor, of_sides = _lengths(filtered, walks, rectified)
    landing = _landing_error(
        apart, walks, filtered.times, float(np.median(durations)), separation_sd(columns)
    )
    sides = [
        (of_side[side].mean(), np.hypot(_error(of_side, side, resolution), np.sqrt(2) * landing))
        for side in SIDES.values()
    ]
    few = min(map(len, of_side.values())) < 2
    cycles = {
        f"{side}_{part}": curves(f"{side}_{part}", spans[side])
        for part in _IN_STRIDES
        for side in SIDES.values()
    }
    landed = len(every) + len(walks)
    return {
        "walks": len(walks),
        "steps": len(every),
        "counted": f"{how_many(len(every), 'step')} between {how_many(landed, 'landing')}"
        + (f" in {len(walks)} walks" if len(walks) > 1 else ""),
        **_cadence(durations, resolution),
        **spread("step_time_s", step_times, resolution),
        **spread("stride_time_s", durations, resolution),
        **({} if few else symmetry(*sides, of="step_time_")),
        **over_floor,
        **basis(apart),
        **{
            words: {
                "steps": len(of_side[side]),
                "strides": len(spans[side]),
                **spread("step_time_s", of_side[side], resolution, np.sqrt(2) * landing),
                "landings_s": figures(landings(walks, side)),
            }
            | of_sides[side]
            for words, side in SIDES.items()
        },
        "cycles": {name: curve for name, curve in cycles.items() if curve},
    }


def uncountable(
    apart: np.ndarray,
    columns: Mapping[str, np.ndarray],
    filtered: PoseSequence,
    rectified: Rectified,
    source: Frame,
) -> list[str]:
    """Why steps would not be seen if there were any; empty when they would. apart: (T,) the separation in lengths of a
    leg. columns: (T,) of the take's kinematics. source: the frame that the poses came in."""
    why = []
    off = sight_deg(rectified, source)
    if off < _SIGHT_DEG:
        why.append(
            f"the person faces along the camera's line of sight ({off:.0f} degrees off it), so the feet pass each "
            "other in depth, which one camera sees worst; film the walk from the side"
        )
    change, sd = float(np.nanmax(apart) - np.nanmin(apart)), separation_sd(columns)
    if _STRIDE < change < NOISE * sd:
        why.append(
            f"the ankles' separation changes by {change:.1f} leg lengths, which lies within its error "
            f"({NOISE * sd:.1f})"
        )
    fps = rate(filtered.times)
    if fps < _SLOW_HZ:
        why.append(f"at {fps:.3g} frames per second a quick step of 0.4 s has {0.4 * fps:.2g} frames")
    return why


def sight_deg(rectified: Rectified, source: Frame) -> float:
    """Median angle, 0 to 90 degrees, between where the person faces (or faces away from) and the camera's axis; NaN
    where the source is no camera."""
    if source.family != "camera":
        return float("nan")
    ahead = -rectified.R_source_from_body[:, :, 0]  # BODY's x is back
    along = np.abs(ahead @ source.basis[:, 2])  # CAMERA's z is away
    known = along[np.isfinite(along)]
    return float(np.degrees(np.arccos(min(1.0, np.median(known))))) if len(known) else float("nan")


def _cadence(durations: np.ndarray, resolution: float) -> dict[str, Any]:
    """Two steps in the middle one of the strides' durations."""
    if len(durations) < _STRIDES:
        return {"cadence_reason": f"fewer than {_STRIDES} strides"}
    median = float(np.median(durations))
    # Strides of both feet overlap: half of them are independent.
    error = _MEDIAN * max(float(durations.std(ddof=1)), resolution) / np.sqrt(len(durations) / 2)
    return with_error("cadence_spm", 120 / median, 120 / median**2 * error)


def _times(every: Sequence[Step], side: str) -> np.ndarray:
    """Durations of the steps that end when this foot lands."""
    return np.array([step.stop_s - step.start_s for step in every if step.side == side])


def _landing_error(
    apart: np.ndarray, walks: Sequence[Sequence[Step]], time_s: np.ndarray, stride_s: float, sd: float
) -> float:
    """Seconds by which the separation's noise moves the landings of one foot against those of the other: noise of the
    walk's own rhythm shifts the turning point of a sine by its share of the amplitude, in radians. It is the same in
    every step, so that strides keep their length and no number of steps makes it smaller."""
    inside = np.any([(time_s >= walk[0].start_s) & (time_s <= walk[-1].stop_s) for walk in walks], axis=0)
    low, high = np.nanpercentile(apart[inside], [5, 95])
    return float(sd / ((high - low) / 2) * stride_s / (2 * np.pi))


def _error(times: Mapping[str, np.ndarray], side: str, resolution: float) -> float:
    """Standard error of a side's mean step time; the spread within the sides is shared, for steps are few."""
    free = sum(len(values) - 1 for values in times.values())
    squares = sum(float(((values - values.mean()) ** 2).sum()) for values in times.values())
    sd = np.sqrt(squares / free) if free else 0.0
    return float(max(sd, resolution) / np.sqrt(len(times[side])))


def _lengths(
    filtered: PoseSequence, walks: list[list[Step]], rectified: Rectified
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Of the whole walk, and of each side by its letter; a reason where the person's place is not known."""
    nothing: dict[str, Any] = {side: {} for side in SIDES.values()}
    if filtered.root is None:
        return {
            "lengths_reason": "where the person is in the room is not known, or the camera moves"
        }, nothing
    root = filtered.root[:, :2]
    ankles = {side: root + filtered.joint(f"{side}_ankle")[:, :2] for side in SIDES.values()}
    found = lengths(root, ankles, filtered.times, walks, breaks(filtered))
    if np.isnan(found.speed):
        return {"lengths_reason": "the person's place is missing in every stride"}, nothing
    steps_of = {side: values[np.isfinite(values)] for side, values in found.step.items()}
    shared = found.speed * _shared_error(filtered, walks, rectified)
    return {
        **with_error("walking_speed", found.speed, float(np.hypot(found.speed_error, shared))),
        **spread("stride_length", found.stride[np.isfinite(found.stride)]),
        **spread("step_length", np.concatenate(list(steps_of.values()))),
    }, {side: spread("step_length", values) for side, values in steps_of.items()}


def _shared_error(filtered: PoseSequence, walks: list[list[Step]], rectified: Rectified) -> float:
    """The share of a speed that may be wrong in all strides alike, where the pelvis's path was estimated: by the body's
    size, and by the focal length as far as the person walks along the camera's axis; 0 for a measured path."""
    told = [step.options for step in filtered.history if step.name == "place"]
    if filtered.root is None or not told:
        return 0.0
    inside = np.any(
        [(filtered.times >= walk[0].start_s) & (filtered.times <= walk[-1].stop_s) for walk in walks], axis=0
    )
    velocity = np.gradient(filtered.root, filtered.times, axis=0)[inside]
    velocity = velocity[np.isfinite(velocity).all(axis=1)]
    depth = velocity @ rectified.R_source_from_level[2]
    along = (depth**2).sum() / max((velocity**2).sum(), 1e-12)
    return float(np.hypot(told[-1]["scale_sd"], told[-1]["focal_sd"] * along))
