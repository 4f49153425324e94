"""What was seen in a take, in plain words: what its measures and angles come to, each figure with its error."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .measures import Group, Measure, grouped, measure, moments, numbered, subgroup, text, value
from .messages import how_many
from .take import Take

_MOST = 4  # depths that are told one by one
_SIDES = ("right", "left")
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
    """Sentences about a take's movements: steps, knee bends, raised arms, jumps, and the range of the main joints. What
    was not recognised is not told, but that nothing was, or why steps cannot be counted; nothing of a take without
    measures."""
    if not take.measures:
        return []
    measures = grouped(take.measures)
    poses = take.need("poses")
    metric = poses.frame.unit == "m"
    walking, bends = subgroup(measures, "walking"), subgroup(measures, "knee_bends")
    legs = [*_walked(walking, metric), *_bent(bends)]
    arms = _raised(subgroup(measures, "arm_raises"))
    jumps = subgroup(measures, "jumps")
    done = [*legs, *arms, *_jumped(jumps)]
    shown = (*(_MOVED if legs or not arms else ()), *(_RAISED if arms else ())) if done else _ALL
    joints = [words for name in shown if (words := _range(subgroup(measures, "range_of_motion"), name))]
    if not done:
        seconds = poses.times[-1] - poses.times[0]
        untold = text(jumps, "reason")
        looked_for = "knee bends or raised arms" if untold else "knee bends, raised arms or jumps"
        done = [f"no walking, {looked_for} were recognised in {seconds:.1f} s"]
        done += [f"jumps cannot be told: {untold}"] if untold else []
    why = text(walking, "reason")
    unseen = [why] if why.startswith("steps cannot be counted") else []
    return [
        f"{words[:1].upper()}{words[1:]}." for words in ("; ".join(done), "; ".join(joints), *unseen) if words
    ]


def _walked(walking: Group, metric: bool) -> list[str]:
    steps = _count(walking, "steps")
    if not steps:
        return []
    words = f"{'ran' if text(walking, 'gait') == 'running' else 'walked'} {how_many(steps, 'step')}"
    landed = [at for side in _SIDES for at in moments(subgroup(walking, side), "landings")]
    if _count(walking, "walks") == 1 and landed:
        words += f" in {max(landed) - min(landed):.1f} s"
    if cadence := measure(walking, "cadence"):
        words += f", {_figure(cadence)} a minute"
    if metric and (speed := measure(walking, "walking_speed")):
        words += f", at {_figure(speed)} m/s"
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
    """Such as " to 102 ± 7 degrees"; of several their lowest and highest, and the largest error."""
    found = [peak for of in groups for peak in numbered(of, "peak")]
    peaks = [round(peak.value) for peak in found]
    errors = [peak.bar for peak in found if peak.bar is not None]
    if not peaks:
        return ""
    ends = f"to {peaks[0]}" if min(peaks) == max(peaks) else f"to between {min(peaks)} and {max(peaks)}"
    return f" {ends} degrees{f' (± {max(errors):.0f})' if errors else ''}"


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
    """Such as "knees 3 to 58 (right) and 2 to 68 degrees (left), each within 9"; empty where no side is to be
    believed."""
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
    within = f", {'each ' * (len(parts) > 1)}within {max(errors):.0f}" if errors else ""
    return f"{_JOINTS[name]} {' and '.join(parts)} degrees{within}"


def _figure(of: Measure) -> str:
    return f"{of.value:g}" + ("" if of.bar is None else f" ± {of.bar:g}")


def _count(of: Group, name: str = "count") -> int:
    return int(value(of, name) or 0)


def _often(count: int) -> str:
    return _TIMES[count] if count < len(_TIMES) else f"{count} times"


def _and(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
