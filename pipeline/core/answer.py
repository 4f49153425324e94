"""What was seen in a take, in plain words: what its measures and angles come to, each figure with its error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .measures import Group, Measure, grouped, measure, moments, numbered, subgroup, text, value
from .messages import how_many
from .take import Take

_AT_ONCE = 0.25  # of a raise, from which the arms' highest points are apart: half of the way up or down
_MOST = 4  # depths that are told one by one
_SIDES = ("right", "left")
_TIMES = ("never", "once", "twice")
_Told = tuple[int, str]  # how often it was done, and the words
_JOINTS = {  # each joint once: its other angles move along
    "knee_flexion": "knees", "thigh_trunk_flexion": "thighs against trunk", "elbow_flexion": "elbows",
    "shoulder_elevation": "upper arms from the trunk", "trunk_lean_sagittal": "trunk leaned",
    "trunk_lean_frontal": "trunk leaned", "thorax_pelvis_rotation": "chest turned",
}  # fmt: skip
_WAYS = {  # below and above 0
    "trunk_lean_sagittal": ("back", "forward"), "trunk_lean_frontal": ("left", "right"),
    "thorax_pelvis_rotation": ("right", "left"),
}  # fmt: skip
_JOINTS_TOLD = 4
_JOINTS_SAID = 2  # of those, in a sentence
_UNSEEN = 0.5  # of the frames: the range of the rest is not that of the take
_UNSTATED = 13.0  # degrees: the usual ± of a lifted range, for one without


@dataclass(frozen=True)
class JointRange:
    """Where the angles of a joint lie in nine of ten frames. sides: such as {"right": "3 to 58"}, degrees; of the trunk
    {"": "4 left to 6 right"}. bar: the widest ± of an end, None where none is known. times: how many errors it ranges.
    """

    joint: str
    sides: Mapping[str, str]
    bar: float | None
    times: float

    def __str__(self) -> str:
        """Such as "knees 3 to 58 (right) and 2 to 68 (left) ± 9"."""
        parts = " and ".join(f"{ends}{f' ({side})' * bool(side)}" for side, ends in self.sides.items())
        return f"{self.joint} {parts}" + ("" if self.bar is None else f" ± {self.bar:.0f}")


def answer(take: Take, with_ranges: bool = True) -> list[str]:
    """Sentences about a take's movements, the most frequent first, and the joints that range furthest for their error.
    Nothing of a take without measures. with_ranges: in a sentence, where no movement was found and no
    table shows `joint_ranges`."""
    if not take.measures:
        return []
    measures, metric = grouped(take.measures), take.need("poses").frame.metric
    done = [
        *_walked(subgroup(measures, "walking"), metric),
        *_bent(subgroup(measures, "knee_bends")),
        *_raised(subgroup(measures, "arm_raises")),
        *_jumped(subgroup(measures, "jumps")),
    ]
    moved = [words for _, words in sorted(done, key=lambda told: -told[0])]
    ranges = "" if done or not with_ranges else _ranges(subgroup(measures, "range_of_motion"))
    return [f"{words[:1].upper()}{words[1:]}." for words in ("; ".join(moved), ranges) if words]


def _walked(walking: Group, metric: bool) -> list[_Told]:
    steps = _count(walking, "steps")
    if not steps:
        return []
    words = {"running": "ran", "walking or running": "walked or ran"}.get(text(walking, "gait"), "walked")
    words += f" {_least(walking, 'steps')}{how_many(steps, 'step')}"
    if back := _count(walking, "backward_steps"):
        words += " backwards" if back == steps else f", {back} of them backwards"
    if _count(walking, "walks") == 1 and (lasts := measure(walking, "walked")):
        words += f" in {lasts.value:.1f} s"
    if ends := text(walking, "not_visible"):
        words += f" ({ends} not visible)"
    if cadence := measure(walking, "cadence"):
        words += f", {_figure(cadence, 'a minute')}"
    if metric and (speed := measure(walking, "walking_speed")):
        words += f", at {_figure(speed, 'm/s')}"
    return [(steps, words)]


def _bent(bends: Group) -> list[_Told]:
    count, squats = _count(bends), _count(bends, "squats")
    among = f", {_least(bends, 'squats')}{how_many(squats, 'squat')} among them" if 0 < squats < count else ""
    did = "squatted" if squats == count else "bent the knees"
    return [
        *([(count, f"{did} {_counted([bends], ', the less bent knee to')}{among}")] if count else []),
        *_held("held the knees bent", bends),
    ]


def _raised(arms: Group) -> list[_Told]:
    sides = {side: subgroup(arms, side) for side in _SIDES}
    counts = {side: _count(of) for side, of in sides.items()}
    held = [told for side, of in sides.items() for told in _held(f"held the {side} arm up", of)]
    alike = len({(counts[side], _least(of)) for side, of in sides.items()}) == 1
    if alike and counts["right"] and _together(*sides.values()):
        return [(counts["right"], f"raised both arms {_counted(list(sides.values()))}"), *held]
    raised = [
        (counts[side], f"raised the {side} arm {_counted([of])}")
        for side, of in sides.items()
        if counts[side]
    ]
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


def _held(what: str, of: Group) -> list[_Told]:
    """Such as "held the knees bent once, for 5.4 s"; of several the longest."""
    holds = subgroup(of, "holds")
    count, longest = _count(holds), value(holds, "longest")
    if not count or longest is None:
        return []
    words = f"{what} {_often(count)}, {'' if count == 1 else 'the longest '}for {_least(holds, 'longest')}"
    return [(count, f"{words}{longest:.1f} s")]


def _counted(moved: Sequence[Group], to: str = " to") -> str:
    """Such as "at least 3 times to 102 ± 7 degrees". moved: of one count."""
    return f"{_least(moved[0])}{_often(_count(moved[0]))}{_peaks(moved, to)}"


def _least(of: Group, name: str = "count") -> str:
    """ "at least " of a figure that may be more."""
    figure = measure(of, name)
    return "at least " if figure and figure.at_least else ""


def _peaks(moved: Sequence[Group], to: str) -> str:
    """Such as " to 102 degrees (± 7)", " to between 98 and 104 degrees (± 7)"; of both arms each side's own, and the
    largest error."""
    parts, errors = [], []
    for of in moved:
        if not (peaks := numbered(of, "peak")):
            continue
        values = [round(peak.value) for peak in peaks]
        some = f"{len(peaks)} of them" if len(peaks) < _count(of) else ""
        alone = len(moved) == 1
        to = f", {some}{to}" if alone and some else to
        side = "" if alone else f" ({', '.join(filter(None, (peaks[0].side, some)))})"
        low, high = min(values), max(values)
        parts.append((f"{low}" if low == high else f"between {low} and {high}") + side)
        errors += [peak.bar for peak in peaks if peak.bar is not None]
    if not parts:
        return ""
    return f"{to} {' and '.join(parts)} degrees{f' (± {max(errors):.0f})' if errors else ''}"


def _jumped(jumps: Group) -> list[_Told]:
    count = _count(jumps)
    if not count:
        return []
    found = numbered(jumps, "height_by_flight_time")
    errors = [height.bar for height in found if height.bar is not None]
    within = f" (± {max(errors):.0f})" if errors else " (error not known)"
    told = [f"{height.value:.0f}" for height in found]
    each = f"each {told[0]} cm" if 1 < len(told) == told.count(told[0]) else f"{_and(told)} cm"
    heights = f", {each} high by the time in the air{within}"
    often = f"{_least(jumps)}{_often(count)}"
    return [(count, f"jumped {often}{heights if 0 < len(found) <= _MOST else ''}")]


def _ranges(ranges: Group) -> str:
    """A sentence; empty where no joint moves by more than its error."""
    if not (told := joint_ranges(ranges)):
        return ""
    of_ends = " (± for each end)" if any(one.bar is not None for one in told) else " (errors not known)"
    return f"in nine of ten frames, in degrees{of_ends}: {'; '.join(map(str, told[:_JOINTS_SAID]))}"


def joint_ranges(ranges: Group) -> list[JointRange]:
    """The joints whose range is the most times its error, by that of the side that moves more; empty where none moves
    by more, and all have an error, on both sides, or where none is known."""
    known = [one for name in _JOINTS if (one := _range(ranges, name)).sides]
    moving = [one for one in known if one.times > 1]
    whole = all(one.bar is not None and set(one.sides) in ({""}, set(_SIDES)) for one in known)
    if not moving and whole and len(known) == len(_JOINTS):
        return []
    return sorted(moving or known, key=lambda one: -one.times)[:_JOINTS_TOLD]


def _range(ranges: Group, name: str) -> JointRange:
    """Without sides where none is to be believed."""
    angles = {"": name} if name in ranges else {side: f"{side[0]}_{name}" for side in _SIDES}
    sides, errors, times = {}, [], 0.0
    for side, angle in angles.items():
        of = subgroup(ranges, angle)
        ends = [end for figure in ("p05", "p95") if (end := measure(of, figure))]
        if len(ends) < 2 or value(of, "beyond_anatomy_frames") or (value(of, "nan_share") or 0.0) > _UNSEEN:
            continue
        if full := measure(of, "p05_p95"):
            times = max(times, full.value / (full.bar or _UNSTATED))
        sides[side] = _between(ends[0].value, ends[1].value, _WAYS.get(name))
        errors += [end.bar for end in ends if end.bar is not None]
    return JointRange(_JOINTS[name], sides, max(errors, default=None), times)


def _between(low: float, high: float, ways: tuple[str, str] | None) -> str:
    """Such as "3 to 58"; of a joint that goes two ways "4 left to 6 right", "6 to 2 left", "0 to 6 right"."""
    ends = [round(end) for end in (low, high)]
    if ways is None or ends == [0, 0]:
        return " to ".join(dict.fromkeys(map(str, ends)))
    if ends[0] < 0 < ends[1]:
        return f"{-ends[0]} {ways[0]} to {ends[1]} {ways[1]}"
    return f"{' to '.join(dict.fromkeys(str(abs(end)) for end in ends))} {ways[ends[1] > 0 or ends[0] == 0]}"


def _figure(of: Measure, unit: str) -> str:
    """With the words of its unit, and its error or that this is not known."""
    return of.in_words(unit) if of.error is not None else f"about {of.in_words(unit)} (error not known)"


def _count(of: Group, name: str = "count") -> int:
    return int(value(of, name) or 0)


def _often(count: int) -> str:
    return _TIMES[count] if count < len(_TIMES) else f"{count} times"


def _and(words: Sequence[str], last: str = "and") -> str:
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
