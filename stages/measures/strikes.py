"""Punches and kicks: fast movements of a limb that reach out and come back, each with its side and reach.

Straight punches (jab, cross) are told, not hooks and uppercuts, in which the elbow stays bent: to the joints these are
the same as waving. Kicks are told from the height of the other leg's knee on; lower ones are steps to the joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...models.gait.of_take import SIDES
from ...pipeline.core.measures import Measure, Remark, Row, side_of, within
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.filters import breaks, derivative
from .cycles import Repetition, hiding, repetitions
from .figures import basis, figure, moments
from .walking import FEWEST

# Chosen on 14 takes of single punches and 21 of single kicks of ACCAD m2 (train), beside its walks, runs, blocks and
# ducks: lengths of the limb, and those a second.
_PUNCH_RISES, _PUNCH_REACH, _PUNCH_SPEED = (
    0.25,
    0.75,
    4.0,
)  # punches: 0.41 and more, 0.9, 5.4; lifted ones are shorter
_PUNCH_HEIGHT = (-0.6, 0.6)  # arms, of the wrist over the shoulder: from the body's middle to over the head
_KICK_HEIGHT, _KICK_SPEED = 0.8, 2.5  # kicks: 1.08 and more, 4.4 (lifted 3.2); a runner's foot rises to 0.61
_LIMBS = {"punches": ("shoulder", "elbow", "wrist"), "kicks": ("hip", "knee", "ankle")}
UNJUDGED = "what these figures are off by has not been measured"


@dataclass(frozen=True, eq=False)
class _Limb:
    """Of a side: reach (T,) the distance of the outermost joint from the innermost, and height (T,) of it over the
    innermost one (an arm) or over the other ankle (a leg), in lengths of the limb, and its speed (T,) about the trunk,
    those a second. length: of the limb, in the take's unit."""

    reach: np.ndarray
    height: np.ndarray
    speed: np.ndarray
    length: float


def strikes(level: PoseSequence, rectified: Rectified) -> list[Row]:
    """The groups `punches` and `kicks`, each side by itself: how many, when they begin and end, and how far the limb
    reaches, `reach_percent` of its length; a kick's `height_percent` of the leg's over the other ankle. No count where
    heights are not known, and why. level: filtered joints in LEVEL."""
    rows: list[Row] = []
    for movement in _LIMBS:
        if not rectified.level_ok:
            rows += within(
                movement, [Remark("reason", f"the take is not levelled: {rectified.level_reason}")]
            )
            continue
        for words, side in SIDES.items():
            rows += within(movement, within(words, _of_side(level, movement, side), side_of(f"{side}_")))
    return rows


def _of_side(level: PoseSequence, movement: str, side: str) -> list[Row]:
    limb = _limb(level, movement, side)
    driver = limb.reach if movement == "punches" else limb.height
    if is_finite(driver[:, None]).sum() < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have the limb"), *basis(driver)]
    least = _PUNCH_RISES if movement == "punches" else _KICK_HEIGHT
    counts = _punches if movement == "punches" else _kicks
    found = [
        one
        for one in repetitions(driver, level.times, least, breaks(level))
        if counts(
            limb, _rows(level.times, one.start_s, one.stop_s), int(level.times.searchsorted(one.peak_s))
        )
    ]
    gaps = hiding(driver, level.times, least, breaks(level))
    unseen = "count_reason" if found else "reason"
    said = [Remark(unseen, f"not seen from {spans_in_words(gaps)}")] if gaps else []
    rows: list[Row] = [Measure("count", len(found)), *said, *basis(driver)]
    if not found:
        return rows
    rows += [Remark("error_reason", UNJUDGED), moments("start", (one.start_s for one in found))]
    rows.append(moments("stop", (one.stop_s for one in found)))
    rows += _numbered("reach", [_largest(limb.reach, level.times, one) for one in found])
    if movement == "kicks":
        rows += _numbered("height", [one.peak for one in found])
    return rows


def _limb(level: PoseSequence, movement: str, side: str) -> _Limb:
    inner, middle, outer = (level.joint(f"{side}_{part}").astype(np.float64) for part in _LIMBS[movement])
    bones = np.linalg.norm(middle - inner, axis=-1) + np.linalg.norm(outer - middle, axis=-1)
    known = bones[np.isfinite(bones)]
    length = float(np.median(known)) if len(known) else np.nan
    legs = movement == "kicks"
    trunk = level.joint("pelvis" if legs else "thorax").astype(np.float64)
    below = level.joint("l_ankle" if side == "r" else "r_ankle") if legs else inner
    speed = np.linalg.norm(derivative((outer - trunk) / length, level.times, breaks(level)), axis=-1)
    return _Limb(
        np.linalg.norm(outer - inner, axis=-1) / length,
        (outer - below)[:, 2] / length,
        speed,
        length,
    )


def _punches(limb: _Limb, rows: slice, peak: int) -> bool:
    low, high = _PUNCH_HEIGHT
    return bool(
        limb.reach[peak] >= _PUNCH_REACH
        and low <= limb.height[peak] <= high
        and np.nanmax(limb.speed[rows.start : peak + 1], initial=0.0) >= _PUNCH_SPEED
    )


def _kicks(limb: _Limb, rows: slice, peak: int) -> bool:
    return bool(np.nanmax(limb.speed[rows], initial=0.0) >= _KICK_SPEED)


def _largest(values: np.ndarray, times: np.ndarray, one: Repetition) -> float:
    return float(np.nanmax(values[_rows(times, one.start_s, one.stop_s)]))


def _rows(times: np.ndarray, start_s: float, stop_s: float) -> slice:
    return slice(int(times.searchsorted(start_s)), int(times.searchsorted(stop_s, "right")))


def _numbered(name: str, shares: Sequence[float]) -> list[Measure]:
    return [Measure(name, figure(100 * share), "percent", number=i) for i, share in enumerate(shares)]
