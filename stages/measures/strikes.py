"""Punches and kicks: fast movements of a limb that reach out and come back, each with its side and reach.

Straight punches (jab, cross) are told, not hooks and uppercuts, in which the elbow stays bent: to the joints these are
the same as waving. Kicks are told from 0.7 of the leg's length over the other ankle on; lower ones are steps to the
joints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ...models.gait.of_take import SIDES
from ...pipeline.core.measures import SD_90, Measure, Remark, Row, side_of, within
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite, unit
from ...pipeline.signals.filters import breaks, derivative, on_lines, rate, stretches
from .cycles import Repetition, comes_near, hiding, repetitions
from .figures import basis, moments
from .outcomes import BRIEFEST_S
from .upright import NOT_UPRIGHT, is_upright, leans
from .walking import FEWEST

# Chosen on 14 takes of single punches and 21 of single kicks of ACCAD m2 (train), beside its walks, runs, blocks and
# ducks, and on 36 tennis strokes (validation): lengths of the limb, and those a second.
_PUNCH_RISES, _PUNCH_REACH = 0.25, 0.75  # punches: 0.41 and more, 0.9
# Away from the shoulder, and faster than across: punches 5.6 and more; tennis strokes up to 3.9; dancers 5.1, but
# faster across.
_PUNCH_SPEED = 4.5
_PUNCH_HEIGHT = (-0.6, 0.6)  # arms, of the wrist over the shoulder: from the body's middle to over the head
# A lifter smooths punches away; the image shows them. Of 21 labelled punches lifted before cameras 9 are found so, and
# none in 141 series without one (a rise of 0.4 in the image: 7 and none, of 0.27: 10 and one). Lifted punches reach out
# at 1.98 arm lengths a second and more (12 of 14), tennis strokes mostly slower; who runs swings the arms as fast.
_LIFTED_RISES, _LIFTED_REACH, _LIFTED_SPEED, _IMAGE_RISES = 0.12, 0.7, 1.9, 0.33
_IMAGE_STRAIGHT = 0.75  # a straight arm is straight in every image: 0.78 to 1 in 22 of 23 punches
# An arm that stays lower or slower does not punch, however little a lifter shows: 28 labelled punches and 28 others,
# lifted, come to -0.56 or higher, at 1.0 arm lengths a second or more. Of 1790 arms (few punch) 46 % stay below.
_ANY_HEIGHT, _ANY_SPEED = -0.75, 0.7
_SOON_S, _AT_ONCE_S = 1 / 3, 0.13  # within which they rise and return; which the image and the lift are apart
_STEADY_S = 0.1  # median of the image's: keypoints jump for a frame
_KICK_RISES, _KICK_SPEED = 0.8, 2.5  # kicks: 1.08 and more, 4.4 (lifted 3.2); a runner's foot rises to 0.61
# While the foot is within _HIGH of its highest: lifted kicks 0.97 and more over the other ankle, 0.81 from the hip,
# 0.73 beside the pelvis. A foot that is flicked up behind comes to 0.59, 0.80 and 0.28, in a leap to 0.61, 0.80, 0.71.
_KICK_HEIGHT, _KICK_REACH, _KICK_OUT, _HIGH = 0.7, 0.75, 0.5, 0.25
# Leg lengths a second of an ankle about the pelvis from one unfiltered frame to the next, 21 m/s: kicks of taekwondo
# reach 15 (Serina & Lieu, J Biomech 24(10), 1991). Where a lifter loses a leg its ankle leaps, and through the filter
# that looks like a kick.
_LEAP_SPEED = 25.0
# What is no punch for its speed alone, or no kick for its height alone, is not denied: straight punches of CMU 02_05 go
# at 1.6 to 2.0; the foot that kicks a ball in 11_01 rises by 0.58, at 12.
_SLOW_PUNCH, _LOW_KICK, _FAST_FOOT = 1.5, 0.5, 8.0
_SLOW_STRIKE = f"what is seen from {{}} may be a punch, slower than {_PUNCH_SPEED:g} arm lengths a second"
_LOW_STRIKE = f"what is seen from {{}} may be a kick, lower than {_KICK_RISES:g} leg lengths"
_SLOW = 0.1  # of the largest rate of a punch's reach: where it begins and ends
_LIMBS = {"punches": ("shoulder", "elbow", "wrist"), "kicks": ("hip", "knee", "ankle")}
HIDES_PUNCHES = "lifted poses do not show every punch"
NO_IMAGE = (
    "lifted poses show them only beside keypoints in an image of known size: a video, or --set "
    "read.image_size=WIDTHxHEIGHT"
)
Spans = Sequence[tuple[float, float]]
UNJUDGED = "the errors of these figures were not measured"


@dataclass(frozen=True, eq=False)
class _Limb:
    """Of a side: reach (T,) the distance of the outermost joint from the innermost, and height (T,) of it over the
    innermost one (an arm) or over the other ankle (a leg), in lengths of the limb. speed (T,) of it about the trunk,
    away (T,) from the innermost joint and across (T,), those a second. driver: what rises and returns, reach or height.
    image (T,): how straight the limb is in the image, of lifted poses; None of measured ones. out (T,): how far a foot
    is from the pelvis over the floor, in lengths of the leg."""

    reach: np.ndarray
    height: np.ndarray
    speed: np.ndarray
    away: np.ndarray
    across: np.ndarray
    driver: np.ndarray
    image: np.ndarray | None = None
    out: np.ndarray | None = None


def strikes(
    level: PoseSequence,
    rectified: Rectified,
    lifted: bool,
    in_image: Mapping[str, np.ndarray] | None = None,
    runs: Spans = (),
    flies: Spans = (),
    unfiltered: PoseSequence | None = None,
    apart_sd: float = 0.0,
    elbows: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> dict[str, list[Row]]:
    """The rows of `punches` and `kicks`, each side by itself: how many, when they begin and end, and how far the limb
    reaches, `reach_percent` of its length; a kick's `height_percent` of the leg's over the other ankle. No count where
    heights are not known, and why. level: filtered joints (T, 17, 3) in LEVEL. lifted: whether a lifter made the poses,
    which hides most punches: they are told by in_image too, {limb: (T,)} of signals.reprojection.straight_in_image, and
    not without. runs, flies: (begin, end) in seconds of the steps of a run, and of flights: a leg that swings there
    does not kick, for in a kick the other foot stands, and arms that swing in a flight, or lifted ones in a run, do not
    punch. unfiltered: the
    poses before the filter, which show a leg that leaps; no kick is told there. apart_sd: of a foot's distance from the
    other, in lengths of a leg; where a foot rises by all but this error nobody can say that there was no kick. elbows:
    {side: (T,)} their flexion, in which a lifted punch must be known."""
    if not rectified.level_ok:
        why = Remark("reason", f"the take is not levelled: {rectified.level_reason}")
        return {movement: [why] for movement in _LIMBS}
    limbs = {(movement, side): _limb(level, movement, side) for movement in _LIMBS for side in SIDES.values()}
    if lifted:
        for side in SIDES.values():
            none = np.full(len(level), np.nan)
            image = none if in_image is None else _steady(in_image[f"{side}_arm"], level.times)
            image = np.where(np.isfinite(elbows.get(side, image)), image, np.nan)
            limbs["punches", side] = replace(limbs["punches", side], image=image)
    lean, times, seams = leans(level), level.times, breaks(level)
    error = SD_90 * np.sqrt(2) * apart_sd
    near: dict[tuple[str, str], list[str]] = {}

    def upright(key: tuple[str, str]) -> list[Repetition]:
        """What is found, and in near when it is not counted."""
        every = _found(level, limbs[key], key[0])
        counted = [one for one in every if is_upright(lean, times, one)]
        near[key] = _when(NOT_UPRIGHT, [one for one in every if one not in counted])
        return counted

    found = {key: upright(key) for key in limbs}
    for side in SIDES.values():

        def stands(one: Repetition, side: str = side) -> bool:
            leaps = unfiltered is not None and _leaps(unfiltered, side, one)
            return not _during([*runs, *flies], one) and not leaps and is_upright(lean, times, one)

        def almost(one: Repetition, side: str = side) -> bool:
            return _kicks(limbs["kicks", side], times, one, error) and stands(one, side)

        found["kicks", side] = [*filter(stands, found["kicks", side])]
        leg, words = limbs["kicks", side], near["kicks", side]
        low = [one for one in repetitions(leg.driver, times, _LOW_KICK, seams) if _low_kick(leg, times, one)]
        if comes_near(leg.driver, times, _KICK_RISES, error, seams, almost, cut=False):
            words.append(f"it is uncertain whether a foot rises by {_KICK_RISES:g} leg lengths")
        words += _when(_LOW_STRIKE, [*filter(stands, low)])
    kicks = [(kick.start_s, kick.stop_s) for side in SIDES.values() for kick in found["kicks", side]]
    # In a kick the arms swing for balance, before and in a flight for height.
    swings = [*kicks, *((off_s - _SOON_S, land_s) for off_s, land_s in flies)]
    for side in SIDES.values():
        arm, key = limbs["punches", side], ("punches", side)
        others = swings if arm.image is None else [*swings, *runs]
        found[key] = [_trimmed(arm, times, one) for one in found[key] if not _during(others, one)]
        if arm.image is None:
            slow = repetitions(arm.driver, times, _PUNCH_RISES, seams)
            slow = [
                one
                for one in slow
                if _punches(arm, times, one, _SLOW_PUNCH) and not _during([*swings, *runs], one)
            ]
            near[key] += _when(_SLOW_STRIKE, slow)
    return {
        movement: [
            row
            for words, side in SIDES.items()
            for row in within(
                words,
                _told(
                    level,
                    limbs[movement, side],
                    movement,
                    found[movement, side],
                    near[movement, side],
                    movement == "punches" and lifted and in_image is None,
                ),
                side_of(f"{side}_"),
            )
        ]
        for movement in _LIMBS
    }


def _when(why: str, of: Sequence[Repetition]) -> list[str]:
    return [why.format(spans_in_words([(one.start_s, one.stop_s) for one in of]))] if of else []


def _during(spans: Spans, one: Repetition) -> bool:
    return any(begin <= one.peak_s <= end for begin, end in spans)


def _least(limb: _Limb, movement: str) -> float:
    """By how much the driver rises and returns at least."""
    if movement == "kicks":
        return _KICK_RISES
    return _PUNCH_RISES if limb.image is None else _LIFTED_RISES


def _found(level: PoseSequence, limb: _Limb, movement: str) -> list[Repetition]:
    counts = _punches if movement == "punches" else _kicks
    found = [
        one
        for one in repetitions(limb.driver, level.times, _least(limb, movement), breaks(level))
        if counts(limb, level.times, one)
    ]
    return found if limb.image is None else _once(limb.image, level.times, found)


def _once(image: np.ndarray, times: np.ndarray, found: Sequence[Repetition]) -> list[Repetition]:
    """The lifted punches; those between which the arm does not bend in the image (T,) are one, with the farthest
    reach."""
    result: list[Repetition] = []
    for one in found:
        if result and not _bends(image, times, result[-1].peak_s, one.peak_s):
            last = result.pop()
            farthest = max(last, one, key=lambda each: each.peak)
            result.append(replace(farthest, start_s=last.start_s, stop_s=one.stop_s))
        else:
            result.append(one)
    return result


def _bends(image: np.ndarray, times: np.ndarray, first_s: float, second_s: float) -> bool:
    """Whether an arm that is straight in the image (T,) at about two moments bends between them."""
    near = [_rows(times, at_s - _AT_ONCE_S, at_s + _AT_ONCE_S) for at_s in (first_s, second_s)]
    first, second = (rows.start + int(np.nanargmax(image[rows])) for rows in near)
    between = np.nanmin(image[first : second + 1], initial=np.inf)
    return bool(min(image[first], image[second]) - between >= _IMAGE_RISES)


def _leaps(poses: PoseSequence, side: str, one: Repetition) -> bool:
    """Whether the ankle of a side goes faster than people kick, from a frame to the next within a repetition."""
    rows = _rows(poses.times, one.start_s, one.stop_s)
    hip, knee, ankle = (poses.joint(f"{side}_{part}")[rows].astype(np.float64) for part in _LIMBS["kicks"])
    length = np.nanmedian(np.linalg.norm(knee - hip, axis=-1) + np.linalg.norm(ankle - knee, axis=-1))
    went = np.linalg.norm(np.diff(ankle - poses.joint("pelvis")[rows], axis=0), axis=-1)
    return bool((went > _LEAP_SPEED * length * np.diff(poses.times[rows])).any())


def _trimmed(limb: _Limb, times: np.ndarray, one: Repetition) -> Repetition:
    """A punch from when to when it is one: between the last moment before it shoots out, and the first one after it
    shoots back, at which the reach changes by less than _SLOW of its largest rate. A guard that is moved before is no
    part."""
    rows = _rows(times, one.start_s, one.stop_s)
    reach = limb.reach if limb.image is None or np.isnan(limb.image[rows]).any() else limb.image
    moves, at_s = derivative(reach[rows], times[rows]), times[rows]
    near = _rows(at_s, one.peak_s - _AT_ONCE_S, one.peak_s + _AT_ONCE_S)
    peak = near.start + int(np.argmax(reach[rows][near]))
    out, back = moves[: peak + 1], -moves[peak:]
    # Where it rises and returns about the peak: keypoints that tremble are fast elsewhere too.
    low = np.flatnonzero(reach[rows] < reach[rows][peak] - _IMAGE_RISES / 2)
    rises, falls = low[low < peak].max(initial=0), low[low > peak].min(initial=len(moves) - 1) - peak
    apart = max(round(_AT_ONCE_S * rate(times)), 1)
    fastest = max(rises - apart, 0) + int(np.argmax(out[max(rises - apart, 0) : rises + apart + 1]))
    returns = max(falls - apart, 0) + int(np.argmax(back[max(falls - apart, 0) : falls + apart + 1]))
    before = np.flatnonzero(out[:fastest] <= _SLOW * out[fastest])
    behind = np.flatnonzero(back[returns:] <= _SLOW * back[returns])
    start_s = float(at_s[before[-1]]) if len(before) else one.start_s
    stop_s = float(at_s[peak + returns + behind[0]]) if len(behind) else one.stop_s
    return replace(one, start_s=start_s, stop_s=stop_s)


def _told(
    level: PoseSequence,
    limb: _Limb,
    movement: str,
    found: Sequence[Repetition],
    near: Sequence[str],
    blind: bool,
) -> list[Row]:
    if is_finite(limb.driver[:, None]).sum() < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have the limb"), *basis(limb.driver)]
    if blind:
        return [Remark("reason", NO_IMAGE), *basis(limb.driver)]
    gaps = hiding(
        limb.driver, level.times, _least(limb, movement), breaks(level), briefest_s=BRIEFEST_S[movement]
    )
    unseen = "count_reason" if found else "reason"
    hides = [f"not seen from {spans_in_words(gaps)}"] if gaps else []
    hides += [] if found else near
    if limb.image is not None and (found or _hides(limb, limb.image, level.times)):
        hides.append(HIDES_PUNCHES)
    said = [Remark(unseen, "; ".join(hides))] if hides else []
    rows: list[Row] = [Measure("count", len(found)), *said, *basis(limb.driver)]
    if not found:
        return rows
    rows += [Remark("error_reason", UNJUDGED), moments("start", (one.start_s for one in found))]
    rows.append(moments("stop", (one.stop_s for one in found)))
    rows += _numbered(
        "reach", [float(np.nanmax(limb.reach[_rows(level.times, one.start_s, one.stop_s)])) for one in found]
    )
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
    moves = derivative((outer - inner) / length, level.times, breaks(level))
    along = unit(outer - inner)
    away = (moves * along).sum(axis=-1)
    across = np.linalg.norm(moves - away[:, None] * along, axis=-1)
    # By the bones of each frame: a lifter's bones vary, and an arm reaches no farther than it is long.
    reach = np.linalg.norm(outer - inner, axis=-1) / np.where(np.isfinite(bones), bones, length)
    height = (outer - below)[:, 2] / length
    out = np.linalg.norm((outer - trunk)[:, :2], axis=-1) / length
    return _Limb(
        reach, height, speed, away, across, driver=height if legs else reach, out=out if legs else None
    )


def _steady(straight: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Without what lasts for a moment; NaN where it is not known."""
    from scipy.ndimage import median_filter

    known = np.isfinite(straight)
    if not known.any():
        return straight
    filled = on_lines(straight, times)
    frames = 2 * round(_STEADY_S * rate(times) / 2 - 0.5) + 1
    return np.where(known, median_filter(filled, max(frames, 1), mode="nearest"), np.nan)


def may_punch(level: PoseSequence, side: str) -> Callable[[Repetition], bool]:
    """Whether a raise of a lifted arm may be a punch: all but the image says so, which does not show every punch."""
    limb = _limb(level, "punches", side)
    return lambda one: _may_punch(limb, level.times, one)


def _may_punch(limb: _Limb, times: np.ndarray, one: Repetition) -> bool:
    peak, (low, high) = int(times.searchsorted(one.peak_s)), _PUNCH_HEIGHT
    reaches = low <= limb.height[peak] <= high and limb.reach[peak] >= _LIFTED_REACH
    return bool(reaches and _shoots(limb.reach, times, one.peak_s, _LIFTED_RISES))


def _hides(limb: _Limb, image: np.ndarray, times: np.ndarray) -> bool:
    """Whether a lifted arm may punch unseen: it reaches out not far below the shoulder, or is not known for a while.
    image (T,): of the limb."""
    out = (limb.height > _ANY_HEIGHT) & (derivative(limb.reach, times) > _ANY_SPEED)
    unknown = stretches(~np.isfinite(image))
    return bool(out.any()) or any(times[b - 1] - times[a] >= BRIEFEST_S["punches"] for a, b in unknown)


def _punches(limb: _Limb, times: np.ndarray, one: Repetition, least: float = _PUNCH_SPEED) -> bool:
    if limb.image is not None:
        out = _rows(times, one.peak_s - _SOON_S, one.peak_s)
        fast = np.nanmax(derivative(limb.reach, times)[out], initial=0.0) >= _LIFTED_SPEED
        shoots = _shoots(limb.image, times, one.peak_s, _IMAGE_RISES, _IMAGE_STRAIGHT)
        return bool(fast and shoots and _may_punch(limb, times, one))
    peak, (low, high) = int(times.searchsorted(one.peak_s)), _PUNCH_HEIGHT
    if not low <= limb.height[peak] <= high:
        return False
    out = _rows(times, one.start_s, one.peak_s)
    away, across = limb.away[out], limb.across[out]
    if limb.reach[peak] < _PUNCH_REACH or not np.isfinite(away).any():
        return False
    fastest = int(np.nanargmax(away))
    return bool(away[fastest] >= least and away[fastest] > across[fastest])


def _shoots(x: np.ndarray, times: np.ndarray, peak_s: float, least: float, highest: float = 0.0) -> bool:
    """Whether x (T,) rises to its highest about then, which is `highest` at least, and returns by `least`, each within
    a third of a second, in most of which it is seen."""
    top = np.nanmax(x[_rows(times, peak_s - _AT_ONCE_S, peak_s + _AT_ONCE_S)], initial=-np.inf)
    sides = x[_rows(times, peak_s - _SOON_S, peak_s)], x[_rows(times, peak_s, peak_s + _SOON_S)]
    return top >= highest and all(
        np.isfinite(of).mean() > 0.5 and top - np.nanmin(of) >= least for of in sides
    )


def _kicks(limb: _Limb, times: np.ndarray, one: Repetition, short: float = 0.0) -> bool:
    """Whether the foot is fast on the way, and high and away from the body with the leg stretched where it is highest:
    before, beside or behind the body. short: lengths of a leg that it may lack in height."""
    rows = _rows(times, one.start_s, one.stop_s)
    height = limb.height[rows]
    high = height >= one.peak - _HIGH
    reach, out = (
        np.nanmax(x[rows][high], initial=0.0) if x is not None else 0.0 for x in (limb.reach, limb.out)
    )
    fast = np.nanmax(limb.speed[rows], initial=0.0) >= _KICK_SPEED
    return bool(fast and one.peak >= _KICK_HEIGHT - short and reach >= _KICK_REACH and out >= _KICK_OUT)


def _low_kick(limb: _Limb, times: np.ndarray, one: Repetition) -> bool:
    """Whether it is like a kick but for the height, and faster than a foot that steps."""
    fast = np.nanmax(limb.speed[_rows(times, one.start_s, one.stop_s)], initial=0.0) >= _FAST_FOOT
    return bool(fast and _kicks(limb, times, one, _KICK_HEIGHT))


def _rows(times: np.ndarray, start_s: float, stop_s: float) -> slice:
    return slice(int(times.searchsorted(start_s)), int(times.searchsorted(stop_s, "right")))


def _numbered(name: str, shares: Sequence[float]) -> list[Measure]:
    return [Measure(name, 100 * float(share), "percent", number=i) for i, share in enumerate(shares)]
