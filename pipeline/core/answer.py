"""What was seen in a take, in plain words: what its measures and angles come to, each figure with its error."""

from __future__ import annotations

from collections.abc import Sequence

from .measures import (
    CANNOT_BE_TOLD,
    NONE,
    NOT_LOOKED_FOR,
    Group,
    Measure,
    grouped,
    measure,
    moments,
    numbered,
    subgroup,
    text,
    value,
    why_untold,
    with_bar,
    without_error,
)
from .messages import how_many
from .take import Take

_AT_ONCE = 0.25  # of a raise, from which the arms' highest points are apart: half of the way up or down
_MOST = 4  # depths that are told one by one
_SIDES = ("right", "left")
_MOVEMENTS = {
    "walking": "walking", "knee_bends": "bends of both knees", "arm_raises": "arm raises", "jumps": "jumps",
    "punches": "punches", "kicks": "kicks",
}  # fmt: skip
_TIMES = ("never", "once", "twice")
# What is told of the joints: where movements were recognised, and where none were.
_MOVED = ("knee_flexion",)
_RAISED = ("shoulder_elevation",)
_ALL = ("knee_flexion", "thigh_trunk_flexion", "shoulder_elevation", "elbow_flexion", "trunk_lean_sagittal")
_JOINTS = {
    "knee_flexion": "knees", "thigh_trunk_flexion": "thighs against trunk", "elbow_flexion": "elbows",
    "shoulder_elevation": "arms from hanging", "trunk_lean_sagittal": "trunk forward",
}  # fmt: skip


def answer(take: Take) -> list[str]:
    """Sentences about a take's movements: steps, knee bends, raised arms, jumps, and the range of the main joints; then
    what of these was not there, what cannot be told and why, and what was not looked for. Nothing of a take without
    measures."""
    if not take.measures:
        return []
    measures = grouped(take.measures)
    poses = take.need("poses")
    metric = poses.frame.unit == "m"
    walking, bends = subgroup(measures, "walking"), subgroup(measures, "knee_bends")
    limbs = subgroup(measures, "off_keypoints")
    legs = [*_walked(walking, metric), *_bent(bends, limbs)]
    arms = _raised(subgroup(measures, "arm_raises"), limbs)
    done = [*legs, *arms, *_jumped(subgroup(measures, "jumps"))]
    done += [*_struck(measures, "punches", "punched"), *_struck(measures, "kicks", "kicked")]
    shown = (*(_MOVED if legs or not arms else ()), *(_RAISED if arms else ())) if done else _ALL
    joints = [words for name in shown if (words := _range(subgroup(measures, "range_of_motion"), name))]
    seconds = poses.times[-1] - poses.times[0]
    of_ends = " (± for each end)" * any("±" in words for words in joints)
    ranges = f"in nine of ten frames, in degrees{of_ends}: {'; '.join(joints)}" if joints else ""
    sentences = ("; ".join(done), ranges, *_not_seen(measures, seconds))
    said = sentences if done else (*sentences[2:], sentences[1])
    return [f"{words[:1].upper()}{words[1:]}." for words in said if words]


def _not_seen(measures: Group, seconds: float) -> list[str]:
    """A sentence on what was not there, one on what cannot be told, one on what was not looked for, where there is
    any."""
    by: dict[str, dict[str, list[str]]] = {NONE: {}, CANNOT_BE_TOLD: {}, NOT_LOOKED_FOR: {}}
    for name, words in _MOVEMENTS.items():
        group = subgroup(measures, name)
        if (code := text(group, "outcome")) not in by:
            continue
        reason = "" if code == NONE else why_untold(group)
        by[code].setdefault(reason, []).append(words)
    said = {code: [_because(words, why) for why, words in of.items()] for code, of in by.items()}
    sentences = [f"no {_and(by[NONE][''], 'or')} in {seconds:.1f} s"] if by[NONE] else []
    sentences += [f"cannot be told: {', '.join(said[CANNOT_BE_TOLD])}"] if by[CANNOT_BE_TOLD] else []
    return sentences + ([f"not looked for: {', '.join(said[NOT_LOOKED_FOR])}"] if by[NOT_LOOKED_FOR] else [])


def _because(words: Sequence[str], reason: str) -> str:
    return f"{_and(words)} ({reason})" if reason else ", ".join(words)


def _walked(walking: Group, metric: bool) -> list[str]:
    steps = _count(walking, "steps")
    if not steps:
        return []
    words = f"{'ran' if text(walking, 'gait') == 'running' else 'walked'}"
    words += f" {'at least ' * bool(unseen := text(walking, 'count_reason'))}{how_many(steps, 'step')}"
    landed = [at for side in _SIDES for at in moments(subgroup(walking, side), "landings")]
    if _count(walking, "walks") == 1 and landed:
        words += f" in {max(landed) - min(landed):.1f} s"
    words += f" ({unseen})" * bool(unseen)
    if cadence := measure(walking, "cadence"):
        words += f", {_figure(cadence, 'a minute')}"
    if metric and (speed := measure(walking, "walking_speed")):
        words += f", at {_figure(speed, 'm/s')}"
    return [words]


def _bent(bends: Group, limbs: Group) -> list[str]:
    count, squats = _count(bends), _count(bends, "squats")
    among = f", {how_many(squats, 'squat')} among them" if 0 < squats < count else ""
    did = "squatted" if squats == count else "bent the knees"
    legs = [subgroup(limbs, leg) for leg in ("r_leg", "l_leg")]
    return [
        *([f"{did} {_counted([(bends, legs)])}{among}"] if count else []),
        *_held("held the knees bent", bends),
    ]


def _raised(arms: Group, limbs: Group) -> list[str]:
    sides = {side: (subgroup(arms, side), [subgroup(limbs, f"{side[0]}_arm")]) for side in _SIDES}
    right, left = ((_count(of), text(of, "count_reason")) for of, _ in sides.values())
    held = [words for side, (of, _) in sides.items() for words in _held(f"held the {side} arm up", of)]
    if right == left and right[0] and _together(*(of for of, _ in sides.values())):
        return [f"raised both arms {_counted(list(sides.values()))}", *held]
    raised = (f"raised the {side} arm {_counted([arm])}" for side, arm in sides.items() if _count(arm[0]))
    return [*raised, *held]


def _together(one: Group, other: Group) -> bool:
    """Whether the repetitions of both are at their highest at the same times, within a part of the shorter one: arms
    that swing to and fro are not raised together."""
    each = [
        list(zip(*(moments(of, name) for name in ("start", "peak_at", "stop")), strict=True))
        for of in (one, other)
    ]
    return all(
        abs(a[1] - b[1]) <= _AT_ONCE * min(a[2] - a[0], b[2] - b[0]) for a, b in zip(*each, strict=False)
    )


def _held(what: str, of: Group) -> list[str]:
    """Such as "held the knees bent once, for 5.4 s"; of several the longest."""
    holds = subgroup(of, "holds")
    count, longest = _count(holds), value(holds, "longest")
    if not count or longest is None:
        return []
    least = "at least " * bool(text(holds, "longest_reason"))
    return [f"{what} {_often(count)}, {'' if count == 1 else 'the longest '}for {least}{longest:.1f} s"]


def _struck(measures: Group, movement: str, did: str) -> list[str]:
    """Such as "punched 5 times with the right arm and at least twice with the left (why there may be more)"."""
    limb = "arm" if movement == "punches" else "leg"
    found = {side: of for side in _SIDES if _count(of := subgroup(measures, movement, side))}
    unseen = {side: text(of, "count_reason") for side, of in found.items()}
    once = len(found) > 1 and len({*unseen.values()}) == 1  # one reason behind both
    parts = [
        f"{'at least ' * bool(unseen[side])}{_often(_count(of))} with the {side} {limb}"
        f"{f' ({unseen[side]})' * bool(unseen[side] and not once)}"
        for side, of in found.items()
    ]
    behind = f" ({next(iter(unseen.values()))})" if once and any(unseen.values()) else ""
    return [f"{did} {_and(parts)}{behind}"] if parts else []


# A movement, and the groups of the limbs that make it in `off_keypoints`.
_Moved = tuple[Group, Sequence[Group]]


def _counted(moved: Sequence[_Moved]) -> str:
    """Such as "3 times to 102 ± 7 degrees"; and when there may have been more that nobody saw. moved: of one count."""
    often, unseen = _often(_count(moved[0][0])), text(moved[0][0], "count_reason")
    return f"{f'at least {often} ({unseen})' if unseen else often}{_peaks(moved)}"


def _peaks(moved: Sequence[_Moved]) -> str:
    """Such as " to 102 degrees (± 7)", " to between 98 and 104 degrees (± 7)"; of both arms each side's own, and the
    largest error. Without peaks whose limbs contradict their keypoints, which are counted behind."""
    parts, errors, left_out = [], [], 0
    for of, limbs in moved:
        every = numbered(of, "peak")
        agrees = _agree(of, limbs)
        peaks = [peak for peak in every if agrees[peak.number or 0]]
        left_out += len(every) - len(peaks)
        if not peaks:
            continue
        values, side = [round(peak.value) for peak in peaks], f" ({peaks[0].side})" if len(moved) > 1 else ""
        low, high = min(values), max(values)
        parts.append((f"{low}" if low == high else f"between {low} and {high}") + side)
        errors += [peak.bar for peak in peaks if peak.bar is not None]
    against = f" ({how_many(left_out, 'angle')} left out: off the keypoints)" if left_out else ""
    if not parts:
        return against
    return f" to {' and '.join(parts)} degrees{f' (± {max(errors):.0f})' if errors else ''}{against}"


def _agree(of: Group, limbs: Sequence[Group]) -> list[bool]:
    """Of each repetition, by number, whether all limbs agree with their keypoints at its peak."""
    at_s, peaks = moments(of, "peak_at"), numbered(of, "peak")
    spans = [
        span for limb in limbs for span in zip(moments(limb, "start"), moments(limb, "stop"), strict=True)
    ]
    return [not any(a <= at <= b for a, b in spans) for at in at_s] or [True] * len(peaks)


def _jumped(jumps: Group) -> list[str]:
    count = _count(jumps)
    if not count:
        return []
    found = numbered(jumps, "height_by_flight_time")
    errors = [height.bar for height in found if height.bar is not None]
    within = f" (± {max(errors):.0f})" if errors else ""
    heights = f", {_and([f'{height.value:.0f}' for height in found])} cm high by the time in the air{within}"
    unseen = text(jumps, "count_reason")
    often = f"at least {_often(count)} ({unseen})" if unseen else _often(count)
    return [f"jumped {often}{heights if 0 < len(found) <= _MOST else ''}"]


def _range(ranges: Group, name: str) -> str:
    """Such as "knees 3 to 58 (right) and 2 to 68 (left) ± 9"; empty where no side is to be believed."""
    sides = {"": name} if name in ranges else {side: f"{side[0]}_{name}" for side in _SIDES}
    parts, errors = [], []
    for side, angle in sides.items():
        of = subgroup(ranges, angle)
        ends = [end for figure in ("p05", "p95") if (end := measure(of, figure))]
        if len(ends) < 2 or value(of, "beyond_anatomy_frames"):
            continue
        told = dict.fromkeys(f"{end.value:z.0f}" for end in ends)
        parts.append(f"{' to '.join(told)}{f' ({side})' * bool(side)}")
        errors += [end.bar for end in ends if end.bar is not None]
    if not parts:
        return ""
    within = f" ± {max(errors):.0f}" if errors else ""
    return f"{_JOINTS[name]} {' and '.join(parts)}{within}"


def _figure(of: Measure, unit: str) -> str:
    """With the words of its unit, and its error or that this is not known."""
    if of.error is None:
        return f"about {without_error(of.value)} {unit} (error not known)"
    return f"{with_bar(of.value, of.error)} {unit}"


def _count(of: Group, name: str = "count") -> int:
    return int(value(of, name) or 0)


def _often(count: int) -> str:
    return _TIMES[count] if count < len(_TIMES) else f"{count} times"


def _and(words: Sequence[str], last: str = "and") -> str:
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
