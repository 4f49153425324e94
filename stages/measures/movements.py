"""Movements as data, and the one counter of all of them: which repetitions of an angle are bends of both knees, raises
of an arm, or what the user asks for; how many these are, from when to when and how high, as rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from ...models.common.motion import Motion
from ...models.gait.gait import NOISE, SIDES, separation
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.measures import SD_90, Measure, Row, Side, side_of
from ...pipeline.core.rotations import known_median
from ...pipeline.signals.angles import ALL_ANGLES
from ...pipeline.signals.filters import nearest_row, rate
from .figures import mean_curve, moments, observable, spread, unknown_deg, unstated_deg, with_error
from .repetitions import Repetition, near_ends_s, repetitions

Spans = Sequence[tuple[float, float]]  # (begin, end) in seconds

# Degrees of knee flexion from which a knee bend is a squat: a half squat is 70 to 100, a deep one more (Schoenfeld,
# J Strength Cond Res 24(12), 2010, "Squatting kinematics and kinetics"); less is a partial one, or a duck.
SQUAT = 70.0
# Share of the rise that a repetition's own rise (Repetition.rise) must reach. Of 900 lifted ones of validation people
# 25 rise by less, and none of these by enough in the capture; 55 rise by 0.8 to 1 of it, of which 15 rise by enough in
# the capture and 31 by five sixths of it.
_OWN = 0.8
# Legs: by how much the ankles come apart or together in a bend in place at most; in walking both knees bend at every
# landing. In one as deep as a squat, which no step is, only while the knees are bent by more than half of it: people
# step to a stool, and away.
_STAYS = 0.4
# Legs: by how much a foot's place in the room changes while the knees are bent by more than half. In 57 bends of lifted
# validation takes 0.51 at most; in 20 of 25 in which the captured feet travel (side steps, runs) 0.61 and more.
_TRAVELS = 0.55
# Seconds that must be seen before the knees are bent most, in which a landing shows (`_lands`): jumps that were cut
# 0.2 s before the captured touchdown or later bend within 0.33 s of that, no labelled bend within 0.5 s.
_SHOWN_S = 0.5
# In so many seconds before the knees are bent most the lower ankle falls by more statures where somebody lands. Of 71
# bends of lifted takes (train and validation people) 13 follow a captured fall of 0.05 and more, which is a foot off
# its toes: twelve of these fall by 0.07 and more, the others by 0.046 at most, among them all that are labelled.
_FALLS_S, _FALLS = 0.5, 0.06
# Degrees that the trunk leans by at most where a movement begins and ends, and at its highest: labelled people who lift
# a box lean by up to 77 in between.
_UPRIGHT, _BOWED = 60.0, 120.0
_ANY, _SHARE = 20.0, 0.5  # degrees that any angle rises by at least, and of its largest change in the take
# Standard deviation of one lifted duration, however steeply the angle rises and returns: a few degrees decide whether a
# swing before a raise belongs to it. Of 208 raises of validation people two in three are off by less.
_EACH_S = 0.15
# Frames: the standard deviation of a duration that two frames bound, each of which is off by half of one at most.
_FRAME = np.sqrt(2 / 12)


@dataclass(frozen=True)
class Movement:
    """What is counted. group: of its figures. drivers: angles, the smallest of which is looked at. rise: degrees that
    it rises and returns by at least. joints: without which it cannot be judged. needs_up: whether the person is
    upright. in_place: whether the feet stay. share: of the largest change in the take, by which it rises at least.
    shown: angles over its cycle; curves: the group of these, where it is another one."""

    group: tuple[str, ...]
    drivers: tuple[str, ...]
    rise: float
    joints: tuple[str, ...]
    needs_up: bool = False
    in_place: bool = False
    share: float = 0.0
    shown: tuple[str, ...] = ()
    curves: tuple[str, ...] = ()

    @property
    def side(self) -> Side:
        """Whose side it is, of one angle."""
        return side_of(self.drivers[0]) if len(self.drivers) == 1 else ""


MOVEMENTS = (
    Movement(
        ("knee_bends",), ("r_knee_flexion", "l_knee_flexion"), 35.0,
        ("r_hip", "r_knee", "r_ankle", "l_hip", "l_knee", "l_ankle"), needs_up=True, in_place=True,
        shown=(
            "r_knee_flexion", "l_knee_flexion", "r_thigh_trunk_flexion", "l_thigh_trunk_flexion", "trunk_lean_sagittal",
        ),
    ),
    *(
        Movement(
            ("arm_raises", words), (f"{side}_shoulder_elevation",), 50.0, (f"{side}_shoulder", f"{side}_elbow"),
            needs_up=True, curves=("arm_raises",),
            shown=tuple(f"{side}_{part}" for part in ("shoulder_elevation", "shoulder_flexion", "elbow_flexion")),
        )
        for words, side in SIDES.items()
    ),
)  # fmt: skip


def repeated(angle: str) -> Movement:
    """The movement that any angle makes, such as "r_elbow_flexion"."""
    return Movement(("repetitions", angle), (angle,), _ANY, (), share=_SHARE, shown=(angle,))


@dataclass(frozen=True, eq=False)
class Counted:
    """What was counted of a movement. events: in order. observable: (T,) in which frames the movement could be judged.
    at_least: whether there may be more, for an end of the take or a gap cuts one. driver, sd: (T,) the angle and its
    standard deviation in degrees."""

    movement: Movement
    events: tuple[Repetition, ...]
    observable: np.ndarray
    at_least: bool
    driver: np.ndarray
    sd: np.ndarray


def count(motion: Motion, movement: Movement, busy: Spans = (), ankle: np.ndarray | None = None) -> Counted:
    """How often it was made. Of a movement in place busy: (begin, end) in seconds in which the feet do something else,
    as in steps and landings, and ankle: (T,) statures, the lower one's height, None where that is not known."""
    driver, sd = _driver(motion, movement)
    usual = known_median(sd)
    least = max(movement.rise, NOISE * usual if np.isfinite(usual) else 0.0)
    if np.isfinite(driver).any():
        least = max(least, movement.share * float(np.nanmax(driver) - np.nanmin(driver)))
    feet = _feet(motion) if movement.in_place else []
    candidates = [
        repetition
        for repetition in repetitions(driver, motion.times, least, motion.seams)
        if not repetition.is_hold
        and (any(repetition.cut) or repetition.rise >= _OWN * movement.rise)
        and (not movement.needs_up or _upright(motion, repetition))
        and (not movement.in_place or _in_place(motion, repetition, driver, feet, busy, ankle))
    ]
    events = tuple(repetition for repetition in candidates if min(repetition.seen) >= least)
    at_least = len(events) < len(candidates) or any(any(repetition.cut) for repetition in events)
    return Counted(movement, events, np.isfinite(driver), at_least, driver, sd)


def _driver(motion: Motion, movement: Movement) -> tuple[np.ndarray, np.ndarray]:
    """(T,) the smallest of its angles where all its joints are known, and (T,) the standard deviation of that."""
    joints = movement.joints or ALL_ANGLES[movement.drivers[0]].joints
    visible = motion.has([joint for joint in joints if joint in H36M17])
    angles = np.array([motion.angle(name) for name in movement.drivers])
    which = np.argmin(np.nan_to_num(angles, nan=np.inf), axis=0)[None]
    sds = np.array([motion.sd(name) for name in movement.drivers])
    driver = np.where(visible & np.isfinite(angles).all(axis=0), angles.min(axis=0), np.nan)
    return driver, np.take_along_axis(sds, which, axis=0)[0]


def _upright(motion: Motion, repetition: Repetition) -> bool:
    """Whether somebody is where it begins, is highest and ends; true too where that is not known."""
    begins, highest, ends = motion.lean_deg[
        nearest_row(motion.times, np.array([repetition.start_s, repetition.peak_s, repetition.stop_s]))
    ]
    return not (begins > _UPRIGHT or ends > _UPRIGHT or highest > _BOWED)


def _in_place(
    motion: Motion,
    bend: Repetition,
    bent: np.ndarray,
    feet: Sequence[np.ndarray],
    busy: Spans,
    ankle: np.ndarray | None,
) -> bool:
    """Whether the feet stay, and the bend is no step, landing or shift of weight. bent: (T,) degrees; feet: of
    `_feet`."""
    time_s = motion.times
    lasts = (time_s >= bend.start_s) & (time_s <= bend.stop_s)
    highest = bend.peak if np.isfinite(bend.peak) else float(np.nanmax(bent[lasts], initial=-np.inf))
    deep = lasts & (bent > highest - bend.rise / 2)
    if not deep.any():
        return False
    apart, *ways = feet
    rows, seconds = (deep, time_s[deep]) if highest >= SQUAT and bend.whole else (lasts, time_s[lasts])
    stays = _range(apart[rows]) <= _STAYS and not any(a < seconds[-1] and seconds[0] < b for a, b in busy)
    travels = any(_range(foot[deep]) > _TRAVELS for foot in ways)
    return stays and not travels and not _shifts(motion, bend) and not _lands(motion, bend, bent, ankle)


def _range(points: np.ndarray) -> float:
    """How far points (N,) or (N, D) lie apart, of those that are known; 0 of none."""
    points = points.reshape(len(points), -1)
    points = points[np.isfinite(points).all(axis=1)]
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def _shifts(motion: Motion, bend: Repetition) -> bool:
    """Whether one knee is straighter at the peak than where the bend begins or ends: weight is shifted."""
    rows = nearest_row(motion.times, np.array([bend.start_s, bend.peak_s, bend.stop_s]))
    knees = (motion.angle(f"{side}_knee_flexion")[rows] for side in SIDES.values())
    return any(peak < max(begins, ends) for begins, peak, ends in knees)


def _lands(motion: Motion, bend: Repetition, bent: np.ndarray, ankle: np.ndarray | None) -> bool:
    """Whether the bend may take up a landing: it comes right after the knees come into view, or after a fall."""
    time_s = motion.times
    clip = max((seam for seam in motion.seams if time_s[seam] <= bend.peak_s), default=0)
    first = clip + int(np.argmax(np.isfinite(bent[clip:])))
    if bend.peak_s - time_s[first] < _SHOWN_S:
        return True
    if ankle is None:
        return False
    before = ankle[(time_s >= bend.peak_s - _FALLS_S) & (time_s <= bend.peak_s) & np.isfinite(ankle)]
    return bool(len(before) and before.max() - before[-1] > _FALLS)


def _feet(motion: Motion) -> list[np.ndarray]:
    """(T,) how far the right ankle is ahead of the left one; and where the place in the room is known, (T, 2) where
    each is over the floor. In lengths of the leg, which the knee's flexion shortens."""
    feet, root = [separation(motion.body, motion.times, motion.seams)[:, 0]], motion.filtered.root
    if root is None or motion.moving_camera:
        return feet
    for side in SIDES.values():
        ankle = motion.filtered.joint(f"{side}_ankle").astype(np.float64)
        bent = np.cos(np.radians(motion.angle(f"{side}_knee_flexion")) / 2)
        feet.append((ankle + root)[:, :2] / known_median(np.linalg.norm(ankle, axis=1) / bent))
    return feet


def counted_rows(motion: Motion, every: Sequence[Counted]) -> list[Row]:
    """The groups of all movements, curves of both sides in one."""
    rows: list[Row] = []
    for place, movements in groupby(every, lambda counted: counted.movement.curves or counted.movement.group):
        curves: list[Row] = []
        for counted in movements:
            movement = counted.movement
            figures = [observable(counted.observable), *_figures(motion, counted)]
            rows += [replace(row, group=movement.group, side=movement.side) for row in figures]
            spans = [
                (repetition.start_s, repetition.stop_s) for repetition in counted.events if repetition.whole
            ]
            for angle in movement.shown:
                curves += mean_curve(motion, angle, np.reshape(spans, (-1, 2)))
        rows += [replace(curve, group=place) for curve in curves]
    return rows


def _figures(motion: Motion, counted: Counted) -> list[Row]:
    """When repetitions were and how high; of those seen whole also how long."""
    events, driver, sd = counted.events, counted.driver, counted.sd
    if not events:
        return []
    result: list[Row] = [
        Measure("count", len(events), at_least=counted.at_least),
        moments("start", (repetition.start_s for repetition in events)),
        moments("stop", (repetition.stop_s for repetition in events)),
        moments("peak_at", (repetition.peak_s for repetition in events)),
        *_peaks(motion, events, sd),
    ]
    if counted.movement.in_place:
        result.append(_squats(motion, counted))
    if not (whole := [repetition for repetition in events if repetition.whole]):
        return result
    usual = known_median(sd)
    # Of a height above the valley, as of the whole rise. What a lifter has wrong of the posture in which a repetition
    # begins it has wrong of the same one at its end and in the next, so that all are too long, or all too short.
    height_sd = np.sqrt(2) * (usual if np.isfinite(usual) else unknown_deg(motion))
    ends_s = float(
        np.mean([near_ends_s(driver, motion.times, repetition, height_sd) for repetition in whole])
    )
    each_s = float(np.hypot(_FRAME / rate(motion.times), _EACH_S * np.isfinite(usual)))
    durations_s = np.array([repetition.stop_s - repetition.start_s for repetition in whole])
    return [
        *result,
        *spread("duration", durations_s, each_s, shared=ends_s),
        *spread("rise", np.array([repetition.rise for repetition in whole]), shared=height_sd),
    ]


def _peaks(motion: Motion, events: Sequence[Repetition], sd: np.ndarray) -> list[Measure]:
    """Those that were seen, with their errors, if all have one."""
    with_peak = [i for i, repetition in enumerate(events) if np.isfinite(repetition.peak)]
    errors = [float(sd[np.searchsorted(motion.times, events[i].peak_s)]) for i in with_peak]
    all_known = bool(np.isfinite(errors).all())
    return [
        replace(with_error("peak", events[i].peak, error if all_known else np.nan), number=i)
        for i, error in zip(with_peak, errors, strict=True)
    ]


def _squats(motion: Motion, counted: Counted) -> Measure:
    """How many knee bends surely reach SQUAT, and whether there may be more."""
    peaks = np.array([bend.peak for bend in counted.events])
    sd = counted.sd[np.searchsorted(motion.times, [bend.peak_s for bend in counted.events])]
    bars = SD_90 * np.where(np.isfinite(sd), sd, unstated_deg(motion))
    sure, may = (int((peaks + sign * bars >= SQUAT).sum()) for sign in (-1, 1))
    return Measure("squats", sure, at_least=counted.at_least or may > sure or bool(np.isnan(peaks).any()))
