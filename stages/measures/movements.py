"""Knee bends and arm raises: which repetitions of an angle are one of these, and which may be something else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...models.angle_error.neutral import KNEES_HIPS_TRUNK
from ...models.angle_error.repeatability import known_median
from ...models.gait.gait import Gait
from ...models.gait.of_take import SIDES
from ...pipeline.core.measures import (
    SD_90,
    Curve,
    Curves,
    Measure,
    Remark,
    Row,
    grouped,
    numbered,
    side_of,
    text,
    value,
    within,
)
from ...pipeline.core.messages import spans_in_words
from ...pipeline.signals.filters import stretches
from ...pipeline.signals.flights import Flight
from .columns import Columns
from .cycles import Repetition
from .jumps import absorbs, lands
from .off_keypoints import Spans, contradicts
from .outcomes import BRIEFEST_S
from .repeats import COUNTS, OTHER, holds, repeats
from .upright import NOT_UPRIGHT, is_upright

BEND, RAISE = 35.0, 50.0  # degrees that a repetition rises by at least
# Degrees of knee flexion from which a knee bend is a squat: a half squat is 70 to 100, a deep one more (Schoenfeld,
# J Strength Cond Res 24(12), 2010, "Squatting kinematics and kinetics"); less is a partial one, or a duck.
_SQUAT = 70.0
# Legs: by how much it changes in a knee bend at most; in walking both knees bend at every landing. In one as deep as a
# squat, which no step is, only while the knees are bent by more than half of it: people step to a stool, and away.
_STAYS = 0.4
_A_LITTLE = 0.8  # less than in a step: nobody can say then that there was no bend (a boxer's duck, 0.41)
# Legs: by how much a foot's place in the room changes while the knees are bent by more than half. In 57 bends of lifted
# validation takes 0.51 at most; in 20 of 25 in which the captured feet travel (side steps, runs) 0.61 and more.
_TRAVELS = 0.55
_UP = 90.0  # degrees: an arm above the horizontal of somebody who stands
# Seconds that must be seen before the knees are bent most, in which a landing shows (jumps.lands): jumps that were cut
# 0.2 s before the captured touchdown or later bend within 0.33 s of that, no labelled bend within 0.5 s.
_SHOWN_S = 0.5
_FEET_MOVE = "what is seen from {} may be a bend in place, but the feet seem to move"
_LANDS = "what is seen from {} may be a landing, not a bend"
_IN_RAISES = ("shoulder_elevation", "shoulder_flexion", "elbow_flexion")


def knee_bends(
    take: Columns,
    gait: Gait,
    jumped: Sequence[Flight],
    ankle: np.ndarray | None,
    apart: np.ndarray,
    steps_told: bool,
    against: Mapping[str, Spans],
    leans: np.ndarray | None = None,
) -> tuple[list[Row], Spans]:
    """Rows, and the (begin, end) of bends that may be landings: with which a clip begins, or behind a fall of ankle,
    (T,) of Airborne. apart: (T,) how far the ankles are apart, in lengths of a leg. steps_told: False where steps
    cannot be counted: a bend in which the feet seem to move may be one in place then. against: of
    off_keypoints.not_shown. leans: (T,) degrees of the trunk from upright, where up is known."""
    feet_move, doubts = set[tuple[float, float]](), dict[str, set[tuple[float, float]]]()
    flights, briefest_s = [(flight.off_s, flight.land_s) for flight in jumped], BRIEFEST_S["knee_bends"]

    def straightens(bend: Repetition) -> bool:
        """Whether one knee is straighter at the peak than where the bend begins or ends: weight is shifted."""
        rows = np.searchsorted(take.times, [bend.start_s, bend.peak_s, bend.stop_s])
        return any(knee[rows[1]] < max(knee[rows[0]], knee[rows[2]]) for knee in (right, left))

    def begins(bend: Repetition) -> bool:
        """Whether the bend is the first that is seen of the clip, too early to show that it is no landing."""
        clip = max((seam for seam in take.seams if take.times[seam] <= bend.peak_s), default=0)
        seen = clip + int(np.argmax(np.isfinite(bent[clip:])))
        return bend.peak_s - take.times[seen] < _SHOWN_S

    def steps(begin_s: float, end_s: float) -> bool:
        return any(step.start_s < end_s and begin_s < step.stop_s for step in gait.steps)

    def moves(rows: np.ndarray) -> float:
        """By how much the feet do, in the rows that show them."""
        seen = apart[rows & np.isfinite(apart)]
        return float(np.ptp(seen)) if len(seen) else 0.0

    def travels(rows: np.ndarray) -> bool:
        """Whether a foot does over the floor, as in steps to the side, where its place is known."""
        ways = (foot[rows & np.isfinite(foot).all(axis=1)] for foot in feet)
        return any(len(way) and np.linalg.norm(np.ptp(way, axis=0)) > _TRAVELS for way in ways)

    def error_at(at_s: float) -> float:
        """Half the width of the 90 % bar of the less bent knee."""
        own = sd[np.searchsorted(take.times, at_s)]
        return SD_90 * float(own if np.isfinite(own) else take.unstated_deg)

    def in_place(bend: Repetition) -> str:
        lasts = (take.times >= bend.start_s) & (take.times <= bend.stop_s)
        bent_s = take.times[deepest := lasts & (bent > bend.peak - bend.rise / 2)]
        deep = len(bent_s) > 0 and bend.peak >= _SQUAT
        lasting = bend.stop_s - bend.start_s >= briefest_s
        may_be_deep = deep or (lasting and len(bent_s) > 0 and bend.peak + error_at(bend.peak_s) >= _SQUAT)
        still = not steps(bend.start_s, bend.stop_s)
        stays_deep = may_be_deep and not steps(bent_s[0], bent_s[-1])
        if not (still or stays_deep) or absorbs(flights, bend.peak_s) or straightens(bend):
            return OTHER
        in_depth = stays_deep and bend.whole and moves(deepest) <= _STAYS
        if not (still and moves(lasts) <= _STAYS) and not (deep and in_depth):
            if deep or in_depth or (still and moves(lasts) <= _A_LITTLE):
                return _FEET_MOVE
            seen_s = take.times[lasts & np.isfinite(bent)]
            feet_move.add(
                (float(seen_s[0]), float(seen_s[-1])) if len(seen_s) else (bend.start_s, bend.stop_s)
            )
            return OTHER
        if travels(deepest):
            return _FEET_MOVE
        if leans is not None and not is_upright(leans, take.times, bend):
            return NOT_UPRIGHT
        if begins(bend) or (ankle is not None and lands(ankle, take.times, bend.peak_s)):
            return _LANDS
        if contradicts(bend.peak_s, against, "r_leg", "l_leg"):
            return "a leg does not fit its keypoints from {}"
        return COUNTS

    right, left = take("r_knee_flexion"), take("l_knee_flexion")
    bent = np.minimum(right, left)
    feet = [_foot(take, "r", right), _foot(take, "l", left)]
    sd = np.where(right < left, take.sd("r_knee_flexion"), take.sd("l_knee_flexion"))
    bends = repeats(
        take,
        "knee_flexion",
        bent,
        sd,
        BEND,
        KNEES_HIPS_TRUNK,
        in_place,
        briefest_s,
        doubts=doubts,
    )
    if peaks := numbered(grouped(bends), "peak"):
        errors = [SD_90 * (peak.error or take.unstated_deg) for peak in peaks]
        least, most = (
            sum(peak.value + sign * error >= _SQUAT for peak, error in zip(peaks, errors, strict=True))
            for sign in (-1, 1)
        )
        why = f"it is uncertain whether a bend reaches the {_SQUAT:g} degrees of a squat"
        bends += [Measure("squats", least)] if least == most else []
        unseen = len(peaks) < (value(grouped(bends), "count") or 0)
        bends += [Remark("squats_reason", why)] if unseen or least < most else []
    if not peaks and feet_move and not steps_told and not text(grouped(bends), "reason"):
        when = spans_in_words(sorted(feet_move))
        bends.append(
            Remark("reason", f"it is not seen whether the feet stay while the knees bend from {when}")
        )
    return bends, sorted(doubts.get(_LANDS, ()))


def _foot(take: Columns, side: str, knee: np.ndarray) -> np.ndarray:
    """(T, 2) where an ankle is over the floor, in lengths of its leg, which the knee's flexion (T,) makes shorter."""
    nowhere = np.full(len(take.times), np.nan)
    ankle, root = (
        np.stack([take.columns.get(f"{joint}_{axis}", nowhere) for axis in "xyz"], axis=-1)
        for joint in (f"{side}_ankle", "root")
    )
    lengths = np.linalg.norm(ankle, axis=1) / np.cos(np.radians(knee) / 2)
    return (ankle + root)[:, :2] / known_median(lengths)


def arm_raises(take: Columns, against: Mapping[str, Spans], leans: np.ndarray | None = None) -> list[Row]:
    """Arms that rise. against, leans (T,): of `knee_bends`."""
    rows: list[Row] = []
    curves: list[Curve] = []
    for words, side in SIDES.items():
        arm = _arm(take, side, against, leans)
        curves += [curve for row in arm if isinstance(row, Curves) for curve in row.of]
        of_arm = side_of(f"{side}_shoulder_elevation")
        rows += within(words, [row for row in arm if not isinstance(row, Curves)], of_arm)
    return [*rows, *([Curves(tuple(curves))] if curves else [])]


def _arm(take: Columns, side: str, against: Mapping[str, Spans], leans: np.ndarray | None) -> list[Row]:
    angle, shown = f"{side}_shoulder_elevation", [f"{side}_{part}" for part in _IN_RAISES]
    driver = take(angle)
    unsure = np.array([contradicts(at_s, against, f"{side}_elbow") for at_s in take.times], dtype=bool)
    known = np.flatnonzero(np.isfinite(driver) & ~unsure)
    first_s, last_s = take.times[known[[0, -1]]] if len(known) else (0.0, 0.0)

    def rises(begin_s: float, end_s: float) -> bool:
        """Whether the arm moves by enough while the detector is sure of it."""
        rows = np.isfinite(driver) & ~unsure & (take.times >= begin_s) & (take.times <= end_s)
        return bool(rows.any() and np.ptp(driver[rows]) >= RAISE)

    def raises(one: Repetition) -> str:
        if leans is not None and not is_upright(leans, take.times, one):
            return NOT_UPRIGHT
        if contradicts(one.peak_s, against, f"{side}_arm"):
            return "what is seen from {} may be no raise: the arm does not fit its keypoints"
        sure = rises(one.start_s, one.peak_s), rises(one.peak_s, one.stop_s)
        enough = any(sure) if one.start_s <= first_s or one.stop_s >= last_s else all(sure)
        if not enough and contradicts(one.peak_s, against, f"{side}_elbow"):
            return "what is seen from {} may be no raise: the detector is unsure of the elbow"
        return COUNTS

    briefest_s, sd = BRIEFEST_S["arm_raises"], take.sd(angle)
    rows = repeats(take, angle, driver, sd, RAISE, shown, raises, briefest_s, unsure=unsure)
    lowest = driver - SD_90 * np.where(np.isfinite(sd), sd, take.unstated_deg)
    up, told = (lowest > _UP) & ~unsure, grouped(rows)
    seldom = 2 * up.sum() <= np.isfinite(driver).sum()
    if seldom or value(told, "count") or text(told, "reason") or "holds" in told:
        return rows
    held = _held_up(up, take.times)
    lies = leans is not None and not is_upright(leans, take.times, held)
    return rows if lies else [*rows, *holds([held])]


def _held_up(up: np.ndarray, times: np.ndarray) -> Repetition:
    """Of an arm that neither rises nor returns, the longest time that it is surely up. up: (T,), at times (T,) in
    seconds; some are."""
    first, behind = max(stretches(up), key=lambda rows: rows[1] - rows[0])
    begin_s, end_s, nan = float(times[first]), float(times[behind - 1]), float("nan")
    return Repetition(begin_s, begin_s, end_s, nan, nan, whole=False, held=(begin_s, end_s), cut=(True, True))
