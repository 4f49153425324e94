"""What was seen in a take, in plain words: what its measures and angles come to, each figure with its error."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

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
    without_error,
)
from .messages import how_many
from .take import Take

_MOST = 4  # depths that are told one by one
_SIDES = ("right", "left")
_MOVEMENTS = {
    "walking": "walking", "knee_bends": "knee bends", "arm_raises": "raised arms", "jumps": "jumps",
    "sitting": "sitting",
}  # fmt: skip
_TIMES = ("never", "once", "twice")
# What is told of the joints: where movements were recognised, and where none were.
_MOVED = ("knee_flexion",)
_RAISED = ("shoulder_elevation",)
_ALL = ("knee_flexion", "hip_flexion", "shoulder_elevation", "elbow_flexion", "trunk_lean_sagittal")
_JOINTS = {
    "knee_flexion": "knees", "hip_flexion": "hips", "elbow_flexion": "elbows",
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
    legs = [*_walked(walking, metric), *_bent(bends)]
    arms = _raised(subgroup(measures, "arm_raises"))
    done = [*legs, *arms, *_jumped(subgroup(measures, "jumps"))]
    shown = (*(_MOVED if legs or not arms else ()), *(_RAISED if arms else ())) if done else _ALL
    joints = [words for name in shown if (words := _range(subgroup(measures, "range_of_motion"), name))]
    seconds = poses.times[-1] - poses.times[0]
    sentences = ("; ".join(done), "; ".join(joints), *_not_seen(measures, seconds))
    said = sentences if done else (*sentences[2:], sentences[1])
    return [f"{words[:1].upper()}{words[1:]}." for words in said if words]


def _not_seen(measures: Group, seconds: float) -> list[str]:
    """A sentence on what was not there, one on what cannot be told, one on what was not looked for, where there is
    any."""
    by: dict[str, list[str]] = {NONE: [], CANNOT_BE_TOLD: [], NOT_LOOKED_FOR: []}
    for name, words in _MOVEMENTS.items():
        group = subgroup(measures, name)
        if (code := text(group, "outcome")) not in by:
            continue
        why = [text(group, "reason"), *(text(subgroup(group, side), "reason") for side in _SIDES)]
        reason = next(filter(None, why), "")
        by[code].append(words if code == NONE or not reason else f"{words} ({reason})")
    sentences = [f"no {_and(by[NONE], 'or')} in {seconds:.1f} s"] if by[NONE] else []
    sentences += [f"cannot be told: {', '.join(by[CANNOT_BE_TOLD])}"] if by[CANNOT_BE_TOLD] else []
    return sentences + ([f"not looked for: {', '.join(by[NOT_LOOKED_FOR])}"] if by[NOT_LOOKED_FOR] else [])


def _walked(walking: Group, metric: bool) -> list[str]:
    steps = _count(walking, "steps")
    if not steps:
        return []
    words = f"{'ran' if text(walking, 'gait') == 'running' else 'walked'} {how_many(steps, 'step')}"
    landed = [at for side in _SIDES for at in moments(subgroup(walking, side), "landings")]
    if _count(walking, "walks") == 1 and landed:
        words += f" in {max(landed) - min(landed):.1f} s"
    if cadence := measure(walking, "cadence"):
        words += f", {_figure(cadence, 'a minute')}"
    if metric and (speed := measure(walking, "walking_speed")):
        words += f", at {_figure(speed, 'm/s')}"
    return [words]


def _bent(bends: Group) -> list[str]:
    count, squats = _count(bends), _count(bends, "squats")
    if not count:
        return []
    if squats == count:
        return [f"squatted {_counted([bends])}"]
    among = f", {how_many(squats, 'squat')} among them" if squats else ""
    return [f"bent the knees {_counted([bends])}{among}"]


def _raised(arms: Group) -> list[str]:
    sides = {side: subgroup(arms, side) for side in _SIDES}
    right, left = ((_count(of), text(of, "count_reason")) for of in sides.values())
    if right == left and right[0]:
        return [f"raised both arms {_counted(sides.values())}"]
    return [f"raised the {side} arm {_counted([of])}" for side, of in sides.items() if _count(of)]


def _counted(groups: Iterable[Group]) -> str:
    """Such as "3 times to 102 ± 7 degrees"; and when there may have been more that nobody saw. groups: of one count."""
    groups = list(groups)
    often, unseen = _often(_count(groups[0])), text(groups[0], "count_reason")
    return f"{f'at least {often} ({unseen})' if unseen else often}{_peaks(groups)}"


def _peaks(groups: Sequence[Group]) -> str:
    """Such as " to 102 degrees (± 7)", " to between 98 and 104 degrees (± 7)"; of both arms each side's own, and the
    largest error."""
    found = [(of, numbered(of, "peak")) for of in groups]
    parts, errors = [], []
    for _, peaks in found:
        if not peaks:
            continue
        values, side = [round(peak.value) for peak in peaks], f" ({peaks[0].side})" if len(found) > 1 else ""
        low, high = min(values), max(values)
        parts.append((f"{low}" if low == high else f"between {low} and {high}") + side)
        errors += [peak.bar for peak in peaks if peak.bar is not None]
    if not parts:
        return ""
    return f" to {' and '.join(parts)} degrees{f' (± {max(errors):.0f})' if errors else ''}"


def _jumped(jumps: Group) -> list[str]:
    count = _count(jumps)
    if not count:
        return []
    found = numbered(jumps, "height_by_flight_time")
    errors = [height.error for height in found if height.error is not None]
    within = f" (± {max(errors):.0f})" if errors else ""
    heights = f", {_and([f'{height.value:.0f}' for height in found])} cm high by the time in the air{within}"
    return [f"jumped {_often(count)}{heights if 0 < len(found) <= _MOST else ''}"]


def _range(ranges: Group, name: str) -> str:
    """Such as "knees 3 to 58 (right) and 2 to 68 (left) degrees, each end of the range ± 9"; empty where no side is
    to be believed."""
    sides = {"": name} if name in ranges else {side: f"{side[0]}_{name}" for side in _SIDES}
    parts, errors = [], []
    for side, angle in sides.items():
        of = subgroup(ranges, angle)
        ends = [end for figure in ("p05", "p95") if (end := measure(of, figure))]
        if len(ends) < 2 or value(of, "beyond_anatomy_frames"):
            continue
        parts.append(f"{' to '.join(f'{end.value:z.0f}' for end in ends)}{f' ({side})' * bool(side)}")
        errors += [end.bar for end in ends if end.bar is not None]
    if not parts:
        return ""
    within = f", each end of the range ± {max(errors):.0f}" if errors else ""
    return f"{_JOINTS[name]} {' and '.join(parts)} degrees{within}"


def _figure(of: Measure, unit: str) -> str:
    """With the words of its unit, and its error or that this is not known."""
    if of.bar is None:
        return f"about {without_error(of.value)} {unit} (error not known)"
    return f"{of.value:g} ± {of.bar:g} {unit}"


def _count(of: Group, name: str = "count") -> int:
    return int(value(of, name) or 0)


def _often(count: int) -> str:
    return _TIMES[count] if count < len(_TIMES) else f"{count} times"


def _and(words: Sequence[str], last: str = "and") -> str:
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
