"""Right and left compared, and why that cannot be told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...models.angle_error.repeatability import same_part
from ...models.gait.of_take import SIDES
from ...pipeline.core.measures import (
    CANNOT_BE_TOLD,
    Measure,
    Remark,
    Row,
    grouped,
    measure,
    subgroup,
    within,
)
from ...pipeline.core.take import Take
from ...pipeline.signals.angles import ANGLES, MIDLINE, continuous, of_both
from ...pipeline.signals.foot_angles import ALL_ANGLES
from ...pipeline.signals.reprojection import limb_scores
from ...pipeline.signals.visibility import SURE_SCORE
from .columns import Columns
from .figures import symmetry
from .outcomes import BRIEFEST_S

_NO_RANGE = 5.0  # degrees: below, noise makes the range, and a share of it says nothing
# Of the frames, in which the detector may be unsure of a limb. In profile it guesses the far leg: of a cyclist who
# pedals evenly it was unsure of one leg in 43 to 55 % of the frames, and the ranges of his thighs differed by twice
# their ±; of two people who walk, in up to 3 %.
_UNSURE = 0.2
_LOST = 0.1  # of a side's range, that the frames with both sides may lack
_DOUBTFUL = (
    "left-and-right",
    "legs-against-arms",
    "limbs-copied",
    "mirrored",
    "sides-doubtful",
    "sides-wrong-as-asked",
)
# What is compared, the limb that it is of, and how many of that limb's two outer joints it rests on.
_PARTS = {"leg": ("leg", 2), "upper arm": ("arm", 1), "forearm": ("arm", 2)}


def sides_untold(take: Take) -> dict[str, str]:
    """{one of _PARTS: in words, why its right is not compared with its left}: which is which is doubtful, or the
    detector is unsure of one of them too often."""
    if any(each.code in _DOUBTFUL for each in take.said):
        return dict.fromkeys(_PARTS, "left and right are doubtful")
    untold, scores = {}, limb_scores(take)
    for part, (limb, joints) in _PARTS.items() if scores else ():
        least = [scores[f"{side}_{limb}"][:, :joints].min(axis=1) for side in "rl"]
        shares = [
            float((each[np.isfinite(each)] < SURE_SCORE).mean()) for each in least if np.isfinite(each).any()
        ]
        if max(shares, default=0.0) > _UNSURE:
            untold[part] = f"the detector is unsure of one {part} in {100 * max(shares):.0f} % of the frames"
    return untold


def ranges_compared(
    take: Columns, ranges: Sequence[Row], angles: Sequence[str], lasts_s: float, untold: Mapping[str, str]
) -> list[Row]:
    """The group `symmetry`, of the rows of the ranges of these angles. lasts_s: the take's length; in less than a
    stride of each leg the sides show different parts of the movement. untold: of `sides_untold`."""
    if lasts_s < BRIEFEST_S["walking"]:
        return [Remark("reason", "the take is too short: each side shows another part of a movement")]
    formula = (
        "100 (right - left) / ((right + left) / 2) of the ranges between the 5th and 95th percentile; "
        "positive when the right is larger"
    )
    by_angle = grouped(ranges)
    result: list[Row] = [Remark("formula", formula)]
    for name in dict.fromkeys(of_both(angle) for angle in angles if angle not in MIDLINE):
        sides = [subgroup(by_angle, f"{side}_{name}") for side in SIDES.values()]
        right, left = (measure(side, "p05_p95") for side in sides)
        if right is None or left is None:
            result += within(name, [Remark("reason", "one side has no range")])
            continue
        result += within(
            name,
            [
                Measure("right", right.value, "deg", side="right"),
                Measure("left", left.value, "deg", side="left"),
            ],
        )
        why = untold.get(_part(name), "")
        if not why and not (same_part(*sides) and _same_moments(take, name, right, left)):
            why = "each side was seen in another part of the movement"
        if max(right.value, left.value) < _NO_RANGE:
            result += within(name, [Remark("reason", f"both ranges are below {_NO_RANGE:g} degrees")])
        elif why:
            result += within(name, [Remark("symmetry_outcome", CANNOT_BE_TOLD), Remark("reason", why)])
        else:
            errors = (right.error or np.nan, left.error or np.nan)
            error = take.difference_sd(f"range_of_motion.{name}", errors, "sides")
            result += within(name, symmetry(right.value, left.value, error))
    return result


def _same_moments(take: Columns, both: str, right: Measure, left: Measure) -> bool:
    """Whether the frames that have both sides of an angle show about the whole range of each: one of them may have
    missed a part of the movement that the other shows."""
    names = [f"{side}_{both}" for side in SIDES.values()]
    sides = [continuous(take(name), ALL_ANGLES[name].centre_deg) for name in names]
    shared = np.isfinite(sides).all(axis=0)
    if not shared.any():
        return False
    return all(
        of.value - float(np.ptp(np.percentile(values[shared], [5, 95])))
        <= max(_LOST * of.value, of.error or 0.0)
        for values, of in zip(sides, (right, left), strict=True)
    )


def _part(both: str) -> str:
    """Of which of _PARTS an angle of both sides is."""
    joints = ANGLES[f"r_{both}"].joints if f"r_{both}" in ANGLES else ()
    if not {"r_elbow", "r_wrist"} & set(joints):
        return "leg"
    return "forearm" if "r_wrist" in joints else "upper arm"


def steps_compared(rows: Sequence[Row], untold: Mapping[str, str]) -> list[Row]:
    """The rows of a walk, its steps without a symmetry where the legs' is not told. untold: of `sides_untold`."""
    why = untold.get("leg")
    if why is None:
        return list(rows)
    result: list[Row] = []
    for row in rows:
        of = row.name.removesuffix("symmetry_index") if isinstance(row, Measure) else ""
        if not of or of == row.name:
            result.append(row)
        else:
            result += [Remark(f"{of}symmetry_outcome", CANNOT_BE_TOLD), Remark(f"{of}symmetry_reason", why)]
    return result
