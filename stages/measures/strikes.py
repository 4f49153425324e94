"""Punches and kicks: fast movements of a limb that reach out and come back, each with its side and reach.

Straight punches (jab, cross) are told, not hooks and uppercuts, in which the elbow stays bent: to the joints these are
the same as waving. Kicks are told from the height of the other leg's knee on; lower ones are steps to the joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...models.gait.of_take import SIDES
from ...pipeline.core.measures import Measure, Remark, Row, side_of, within
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.filters import breaks, derivative
from .cycles import Repetition, hiding, repetitions
from .figures import basis, moments
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
_SLOW = 0.1  # of the largest rate of a punch's reach: where it begins and ends
_LIMBS = {"punches": ("shoulder", "elbow", "wrist"), "kicks": ("hip", "knee", "ankle")}
# Of seven labelled punches one is found on lifted poses (`pcnet3d evaluate repetitions`).
HIDES_PUNCHES = "lifted poses show few of them"
UNJUDGED = "what these figures are off by has not been measured"


@dataclass(frozen=True, eq=False)
class _Limb:
    """Of a side: reach (T,) the distance of the outermost joint from the innermost, and height (T,) of it over the
    innermost one (an arm) or over the other ankle (a leg), in lengths of the limb, and its speed (T,) about the trunk,
    those a second. length: of the limb, in the take's unit. driver: what rises and returns, reach or height."""

    reach: np.ndarray
    height: np.ndarray
    speed: np.ndarray
    length: float
    driver: np.ndarray


def strikes(level: PoseSequence, rectified: Rectified, lifted: bool) -> dict[str, list[Row]]:
    """The rows of `punches` and `kicks`, each side by itself: how many, when they begin and end, and how far the limb
    reaches, `reach_percent` of its length; a kick's `height_percent` of the leg's over the other ankle. No count where
    heights are not known, and why. level: filtered joints in LEVEL. lifted: whether a lifter made the poses, which
    hides most punches."""
    if not rectified.level_ok:
        why = Remark("reason", f"the take is not levelled: {rectified.level_reason}")
        return {movement: [why] for movement in _LIMBS}
    limbs = {(movement, side): _limb(level, movement, side) for movement in _LIMBS for side in SIDES.values()}
    found = {key: _found(level, limb, key[0]) for key, limb in limbs.items()}
    kicks = [kick for side in SIDES.values() for kick in found["kicks", side]]
    for side in SIDES.values():  # in a kick the arms swing for balance
        found["punches", side] = [
            _trimmed(limbs["punches", side], level.times, one)
            for one in found["punches", side]
            if not any(kick.start_s <= one.peak_s <= kick.stop_s for kick in kicks)
        ]
    return {
        movement: [
            row
            for words, side in SIDES.items()
            for row in within(
                words,
                _told(level, limbs[movement, side], movement, found[movement, side], lifted),
                side_of(f"{side}_"),
            )
        ]
        for movement in _LIMBS
    }


def _found(level: PoseSequence, limb: _Limb, movement: str) -> list[Repetition]:
    least = _PUNCH_RISES if movement == "punches" else _KICK_HEIGHT
    counts = _punches if movement == "punches" else _kicks
    return [
        one
        for one in repetitions(limb.driver, level.times, least, breaks(level))
        if counts(
            limb, _rows(level.times, one.start_s, one.stop_s), int(level.times.searchsorted(one.peak_s))
        )
    ]


def _trimmed(limb: _Limb, times: np.ndarray, one: Repetition) -> Repetition:
    """A punch from when to when it is one: between the last moment before it shoots out, and the first one after it
    shoots back, at which the reach changes by less than _SLOW of its largest rate. A guard that is moved before is no
    part."""
    rows = _rows(times, one.start_s, one.stop_s)
    rate, at_s = derivative(limb.reach[rows], times[rows]), times[rows]
    peak = int(at_s.searchsorted(one.peak_s))
    out, back = rate[: peak + 1], -rate[peak:]
    fastest, returns = int(np.argmax(out)), int(np.argmax(back))
    before = np.flatnonzero(out[:fastest] <= _SLOW * out[fastest])
    behind = np.flatnonzero(back[returns:] <= _SLOW * back[returns])
    start_s = float(at_s[before[-1]]) if len(before) else one.start_s
    stop_s = float(at_s[peak + returns + behind[0]]) if len(behind) else one.stop_s
    return replace(one, start_s=start_s, stop_s=stop_s)


def _told(
    level: PoseSequence, limb: _Limb, movement: str, found: Sequence[Repetition], lifted: bool
) -> list[Row]:
    if is_finite(limb.driver[:, None]).sum() < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have the limb"), *basis(limb.driver)]
    least = _PUNCH_RISES if movement == "punches" else _KICK_HEIGHT
    gaps = hiding(limb.driver, level.times, least, breaks(level))
    unseen = "count_reason" if found else "reason"
    hides = [f"not seen from {spans_in_words(gaps)}"] if gaps else []
    hides += [HIDES_PUNCHES] if lifted and movement == "punches" else []
    said = [Remark(unseen, "; ".join(hides))] if hides else []
    rows: list[Row] = [Measure("count", len(found)), *said, *basis(limb.driver)]
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
    # By the bones of each frame: a lifter's bones vary, and an arm reaches no farther than it is long.
    reach = np.linalg.norm(outer - inner, axis=-1) / np.where(np.isfinite(bones), bones, length)
    height = (outer - below)[:, 2] / length
    return _Limb(reach, height, speed, length, driver=height if legs else reach)


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
    return [Measure(name, 100 * float(share), "percent", number=i) for i, share in enumerate(shares)]
