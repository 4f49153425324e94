"""Ranges of motion, and right compared with left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...models.angle_error.repeatability import ends, same_shares
from ...models.common.motion import Motion
from ...models.common.residuals import limb_scores
from ...models.gait.gait import SIDES
from ...pipeline.core.measures import SD_90, Measure, Row, side_of, withheld, within
from ...pipeline.core.take import Take
from ...pipeline.signals.angles import (
    ALL_ANGLES,
    ANGLES,
    EXCHANGED,
    MIDLINE,
    UNDEFINED,
    UNTRUSTED,
    continuous,
    of_both,
)
from ...pipeline.signals.filters import stretches
from ...pipeline.signals.visibility import SURE_SCORE
from .figures import error_of_range, error_of_sides, symmetry, unstated_deg, with_error

FEWEST = 10  # frames
_OUTERMOST = 0.05  # of the frames: what the 5th to the 95th percentile leaves out at either end
_UNSURE = (
    0.5  # of the frames, in which the detector is unsure of a joint: the others do not show what it does
)
# Gaps, and standard deviations of the mean of so many uniform ranks, from which frames are not missing at random. Of
# 4,872 ranges of takes whose simulated detector loses limbs at any time, 595 with gaps, none is withheld for it.
_FEWEST_GAPS, _SURE = 3, 2.58
_NO_RANGE = 5.0  # degrees: below, noise makes the range, and a share of it says nothing
# Of the frames, in which the detector may be unsure of a limb. In profile it guesses the far leg: of a cyclist who
# pedals evenly it was unsure of one leg in 43 to 55 % of the frames, and the ranges of his thighs differed by twice
# their ±; of two people who walk, in up to 3 %.
_UNSURE_SIDE = 0.2
_LOST = 0.1  # of a side's range, that the frames with both sides may lack
_BRIEF_S = 1.5  # less than a stride of each leg: the sides show different parts of a movement
_DOUBTFUL = (
    "left-and-right",
    "legs-against-arms",
    "limbs-copied",
    "mirrored",
    "sides-wrong-as-asked",
)
# What is compared, the limb that it is of, and how many of that limb's two outer joints it rests on.
_PARTS = {"leg": ("leg", 2), "upper arm": ("arm", 1), "forearm": ("arm", 2)}


@dataclass(frozen=True, eq=False)
class Range:
    """An angle's range in a take. values: (T,) degrees in the frames that count. deg: from the 5th to the 95th
    percentile, sd_deg: its standard deviation, NaN where not known. why: a code of WITHHELD, "" where there is one."""

    angle: str
    values: np.ndarray
    why: str = ""
    low: tuple[float, float] = (np.nan, np.nan)
    high: tuple[float, float] = (np.nan, np.nan)
    sd_deg: float = np.nan

    @property
    def deg(self) -> float:
        """From the 5th to the 95th percentile."""
        return self.high[0] - self.low[0]


def ranges(motion: Motion) -> dict[str, Range]:
    """Of every angle of the body, and of the feet where the take has them."""
    named = [name for name in ALL_ANGLES if name in ANGLES or f"{name}_deg" in motion.columns]
    return {name: _range(motion, name) for name in named}


def _range(motion: Motion, name: str) -> Range:
    """By the frames in which the detector is sure of the angle's joints; none where the others may have shown more."""
    every, sd = continuous(motion.angle(name), ALL_ANGLES[name].centre_deg), motion.sd(name)
    joints = ANGLES[name].joints if name in ANGLES else ()
    guessed = np.any(
        [motion.unsure[joint] for joint in joints if joint in motion.unsure] or [[False]], axis=0
    )
    values = np.where(guessed, np.nan, every)
    if guessed.mean() > _UNSURE:
        return Range(name, values, "detector-unsure")
    if np.isfinite(values).sum() < FEWEST:
        return Range(name, values, "few-frames")
    lifted = motion.unjudged or np.isfinite(sd).any()
    # Where joints were seen, and the angle is not known all the same: near the axis that it turns about, by an error
    # that is too large, or by limbs that may be exchanged. A lift's frames near the axis are the outermost, of an arm
    # raised sideways; which they are differs by camera.
    reason = motion.columns.get(f"{name}_reason", np.zeros(0))
    untold = np.isin(reason, (UNDEFINED, UNTRUSTED, EXCHANGED))
    if (lifted and untold.sum() > _OUTERMOST * len(untold)) or _missing_at_an_end(values):
        return Range(name, values, "frames-missing")
    (low, high), (at_low, at_high) = ends(values, sd)
    lowest, highest = np.percentile(every[np.isfinite(every)], [5, 95])
    error = SD_90 * float(np.nanmax([at_low, at_high, unstated_deg(motion)]))
    if guessed.any() and max(low - lowest, highest - high) > error:
        return Range(name, values, "detector-unsure")
    own_sd = error_of_range(motion, name, high - low, (at_low, at_high))
    return Range(name, values, "", (low, at_low), (high, at_high), own_sd)


def _missing_at_an_end(values: np.ndarray) -> bool:
    """Whether frames (T,) are missing where the angle is large, or where it is small, as in every swing of a leg that
    is not seen: the others do not show how far it goes. By the ranks of the values beside the gaps, whose mean would be
    a half if they lay anywhere; of few gaps nobody knows."""
    has_value = np.isfinite(values)
    gaps = [(a, b) for a, b in stretches(~has_value) if a > 0 or b < len(values)]
    if has_value.mean() >= 1 - _OUTERMOST or len(gaps) < _FEWEST_GAPS:
        return False
    order = np.sort(values[has_value])
    beside = np.array(
        [np.mean([values[row] for row in (a - 1, b) if 0 <= row < len(values)]) for a, b in gaps]
    )
    ranks = np.searchsorted(order, beside) / len(order)
    return bool(abs(ranks.mean() - 0.5) > _SURE * np.sqrt(1 / 12 / len(gaps)))


def range_rows(angles: Mapping[str, Range]) -> list[Row]:
    """The group `range_of_motion`."""
    return [row for name, angle in angles.items() for row in within(name, _rows(angle), side_of(name))]


def _rows(range_: Range) -> list[Row]:
    has_value = np.isfinite(range_.values)
    lacking = Measure("nan_share", float(1 - has_value.mean()))
    if range_.why:
        return [withheld(range_.why), lacking]
    values = range_.values[has_value]
    least, most = ALL_ANGLES[range_.angle].anatomy_deg
    beyond = int(((values < least) | (values > most)).sum())
    return [
        with_error("lowest", values.min(), range_.low[1]),
        with_error("highest", values.max(), range_.high[1]),
        with_error("p05", *range_.low),
        with_error("p95", *range_.high),
        with_error("p05_p95", range_.deg, range_.sd_deg),
        *([Measure("beyond_anatomy_frames", beyond)] if beyond else []),
        lacking,
    ]


def sides_withheld(take: Take) -> dict[str, str]:
    """{one of "leg", "upper arm", "forearm": a code of WITHHELD} of what is not compared: which is which is doubtful,
    or the detector is unsure of one of them too often."""
    if any(each.code in _DOUBTFUL for each in take.said):
        return dict.fromkeys(_PARTS, "sides-doubtful")
    why, scores = {}, limb_scores(take)
    for part, (limb, joints) in _PARTS.items() if scores else ():
        least = [scores[f"{side}_{limb}"][:, :joints].min(axis=1) for side in "rl"]
        shares = [
            float((each[np.isfinite(each)] < SURE_SCORE).mean()) for each in least if np.isfinite(each).any()
        ]
        if max(shares, default=0.0) > _UNSURE_SIDE:
            why[part] = "detector-unsure"
    return why


def symmetry_rows(motion: Motion, angles: Mapping[str, Range], why: Mapping[str, str]) -> list[Row]:
    """The group `symmetry`, of ranges of both sides. why: of `sides_withheld`."""
    if motion.duration_s < _BRIEF_S:
        return [withheld("take-too-short")]
    pairs = dict.fromkeys(of_both(name) for name in angles if name not in MIDLINE)
    return [row for name in pairs for row in within(name, _compared(motion, name, angles, why))]


def _compared(
    motion: Motion, both: str, angles: Mapping[str, Range], why: Mapping[str, str]
) -> Sequence[Row]:
    right, left = (angles[f"{side}_{both}"] for side in SIDES.values())
    if right.why or left.why:
        return [withheld("side-missing")]
    code = why.get(_part(both), "")
    if max(right.deg, left.deg) < _NO_RANGE:
        code = "range-too-small"
    elif not code and not _alike(right, left):
        code = "sides-unlike"
    if code:
        return [withheld(code, "symmetry_index")]
    error = error_of_sides(motion, f"range_of_motion.{both}", (right.sd_deg, left.sd_deg))
    return symmetry(right.deg, left.deg, error)


def _alike(right: Range, left: Range) -> bool:
    """Whether each side was seen in as much of the take, and the frames that have both show about the whole range of
    each: one of them may have missed a part of the movement that the other shows."""
    has_value = [np.isfinite(side.values) for side in (right, left)]
    shared = has_value[0] & has_value[1]
    if not shared.any() or not same_shares(*(1 - float(rows.mean()) for rows in has_value)):
        return False
    return all(
        side.deg - float(np.ptp(np.percentile(side.values[shared], [5, 95])))
        <= max(_LOST * side.deg, float(np.nan_to_num(side.sd_deg)))
        for side in (right, left)
    )


def _part(both: str) -> str:
    """Of which of _PARTS an angle of both sides is."""
    joints = ANGLES[f"r_{both}"].joints if f"r_{both}" in ANGLES else ()
    if not {"r_elbow", "r_wrist"} & set(joints):
        return "leg"
    return "forearm" if "r_wrist" in joints else "upper arm"
