"""A take in at most 40 words and six figures: the first lines of a page and of the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from .figures import OF_LENGTH, UNITS, label_of
from .measures import Measure, Measures
from .messages import how_many
from .take import Take

_MOST_WORDS, _MOST_FIGURES = 40, 6
_AT_ONCE = 0.25  # of a raise, from which the arms' highest points are apart: half of the way up or down
_SIDES = ("right", "left")
# Each joint once: its other angles move along.
_JOINTS = (
    "knee_flexion", "thigh_trunk_flexion", "elbow_flexion", "shoulder_elevation", "trunk_lean_sagittal",
    "trunk_lean_frontal", "thorax_pelvis_rotation",
)  # fmt: skip
_WAYS = {  # below and above 0
    "trunk_lean_sagittal": ("back", "forward"), "trunk_lean_frontal": ("left", "right"),
    "thorax_pelvis_rotation": ("right", "left"),
}  # fmt: skip
_UNSEEN = 0.5  # of the frames: the range of the rest is not that of the take
_UNSTATED = 13.0  # degrees: the usual ± of a lifted range, for one without
_GAITS = {"running": "Ran", "walking or running": "Walked or ran"}


@dataclass(frozen=True)
class Headline:
    """A figure of the first screen: its label, and its value with unit and error. error_missing: whether it should have
    one, and none is known."""

    label: str
    value: str
    error_missing: bool = False


def answer(take: Take, further: Iterable[str] = ()) -> list[str]:
    """Sentences about a take's movements, the most frequent first; where none was found, about the joints that range
    furthest for their error; then `further` ones, as far as there is room. Nothing of a take without measures."""
    if not take.measures:
        return []
    metric = take.need("poses").frame.metric
    moved = sorted(_movements(take.measures, metric), key=lambda counted: -counted[0])
    sentences, room = [], _MOST_WORDS
    for sentence in [*(words for _, words in moved), *([] if moved else _ranges(take.measures)), *further]:
        if len(sentence.split()) <= room:
            sentences.append(sentence)
            room -= len(sentence.split())
    return sentences


def headlines(take: Take) -> list[Headline]:
    """The figures of the first screen: of the movements that were found, then the joints that range furthest for their
    error. No length or speed without a scale."""
    measures = take.figures
    figures = [
        *_of(measures.group("walking"), "", ("steps", "cadence", "walking_speed", "mean_step_length")),
        *_of(measures.group("jumps"), "jumps", ("count", "height_by_flight_time")),
        *_of(measures.group("knee_bends"), "knee bends", ("count", "peak")),
        *(
            row
            for side in _SIDES
            for row in _of(measures.group("arm_raises", side), f"raises of the {side} arm", ("count", "peak"))
        ),
    ]
    metric = take.poses is not None and take.poses.frame.metric
    kept = [headline for unit, headline in figures if metric or unit not in OF_LENGTH]
    joints = [
        Headline(f"{label_of(each.angle)}{f', {side}' * bool(side)}", each.words(side), each.bar is None)
        for each in joint_ranges(measures.group("range_of_motion"))
        for side in each.ends
    ]
    return [*kept, *joints][:_MOST_FIGURES]


def _of(group: Measures, what: str, names: Sequence[str]) -> Iterator[tuple[str, Headline]]:
    for name in names:
        rows = group.repetitions(name) or ([row] if (row := group.figure(name)) else [])
        if rows:
            label = (
                what if name == "count" else f"{what}, {rows[0].about.label}" if what else rows[0].about.label
            )
            unknown = rows[0].unit != "" and all(row.error is None for row in rows)
            yield rows[0].unit, Headline(label, _spread(rows), unknown)


def _spread(rows: Sequence[Measure]) -> str:
    """One figure, or the lowest and highest of several, such as "95 to 102 ± 11°"."""
    unit = UNITS[rows[0].unit].page.format("m")
    gap = "" if unit.startswith("°") else " "
    if len(rows) == 1 and rows[0].number is None:
        return f"{'at least ' * rows[0].at_least}{rows[0].in_words()}{gap}{unit}".rstrip()
    ends = dict.fromkeys(f"{of(row.value for row in rows):z.0f}" for of in (min, max))
    bars = [row.bar for row in rows if row.bar is not None]
    return f"{' to '.join(ends)}{f' ± {max(bars):.0f}' if bars else ''}{gap}{unit}"


def _movements(measures: Measures, metric: bool) -> Iterator[tuple[int, str]]:
    """How often each movement was made, and a sentence about it."""
    yield from _walked(measures.group("walking"), metric)
    yield from _bent(measures.group("knee_bends"))
    yield from _raised(measures.group("arm_raises"))
    yield from _jumped(measures.group("jumps"))


def _walked(walking: Measures, metric: bool) -> Iterator[tuple[int, str]]:
    steps = walking.figure("steps")
    if steps is None:
        return
    back = walking.count("backward_steps")
    sentence = f"{_GAITS.get(walking.text('gait'), 'Walked')} {_many(steps, 'step')}"
    sentence += f" ({back} backwards)" if back else ""
    if walking.count("walks") == 1 and (lasts_s := walking.value("walked")):
        sentence += f" in {lasts_s:.1f} s"
    if ends := walking.text("not_visible"):
        sentence += f" ({ends} not visible)"
    figures = [walking.figure(name) for name in ("cadence", "walking_speed")[: 1 + metric]]
    clauses = [f"{row.about.label} {_stated(row)}" for row in figures if row]
    yield (
        int(steps.value),
        " ".join([f"{sentence}.", f"{', '.join(clauses).capitalize()}." * bool(clauses)]).rstrip(),
    )


def _bent(bends: Measures) -> Iterator[tuple[int, str]]:
    count, squats = bends.figure("count"), bends.figure("squats")
    if count:
        every = squats is not None and squats.value == count.value
        some = f" ({_many(squats, 'squat')})" if squats and squats.value and not every else ""
        what = _many(count, "squat" if every else "knee bend")
        peaks = f"{_peaks(bends, ' of the less bent knee')}{_unknown(bends.repetitions('peak'))}"
        yield int(count.value), f"{what}{some}{peaks}."
    yield from _held(bends, "Knees held bent")


def _raised(arms: Measures) -> Iterator[tuple[int, str]]:
    sides = [arms.group(side) for side in _SIDES]
    counts = [of.figure("count") for of in sides]
    right, left = counts
    if right and left and _many(right, "") == _many(left, "") and _together(*sides):
        peaks = "".join(_peaks(of, f" of the {side}") for of, side in zip(sides, _SIDES, strict=True))
        unknown = _unknown([row for of in sides for row in of.repetitions("peak")])
        yield int(right.value), f"{_many(right, 'raise')} of both arms{peaks}{unknown}."
    else:
        for side, of, count in zip(_SIDES, sides, counts, strict=True):
            if count:
                unknown = _unknown(of.repetitions("peak"))
                yield int(count.value), f"{_many(count, 'raise')} of the {side} arm{_peaks(of)}{unknown}."
    for side, of in zip(_SIDES, sides, strict=True):
        yield from _held(of, f"{side.capitalize()} arm held up")


def _together(right: Measures, left: Measures) -> bool:
    """Whether the repetitions of both are at their highest at the same times, within a part of the shorter one: arms
    that swing to and fro are not raised together."""
    pairs = zip(right.spans, right.times("peak_at"), left.spans, left.times("peak_at"), strict=False)
    return all(abs(at - at_other) <= _AT_ONCE * min(b - a, d - c) for (a, b), at, (c, d), at_other in pairs)


def _held(of: Measures, what: str) -> Iterator[tuple[int, str]]:
    holds = of.group("holds")
    if longest := holds.figure("longest"):
        count = holds.count()
        often, most = (f" {count} times", " at most") if count > 1 else ("", "")
        more = " or more" * longest.at_least
        yield count, f"{what}{often} for {longest.value:.1f} s{more}{most}."


def _jumped(jumps: Measures) -> Iterator[tuple[int, str]]:
    if count := jumps.figure("count"):
        heights = jumps.repetitions("height_by_flight_time")
        high = f", {_spread(heights)} high by time in the air{_unknown(heights)}" if heights else ""
        yield int(count.value), f"{_many(count, 'jump')}{high}."


def _peaks(of: Measures, what: str = "") -> str:
    """Such as ", peaks 95 to 102 ± 11°", of those that are known. what: whose, where that is not said before."""
    peaks = of.repetitions("peak")
    if not peaks:
        return ""
    some = f" ({len(peaks)} of them)" if len(peaks) < of.count() else ""
    return f", peak{'s' * (len(peaks) > 1)}{what}{some} {_spread(peaks)}"


def _unknown(rows: Sequence[Measure]) -> str:
    """ " (error not known)" behind figures of which none has an error."""
    if not rows or any(row.error is not None for row in rows):
        return ""
    return f" (error{'s' * (len(rows) > 1)} not known)"


def _many(count: Measure, what: str) -> str:
    """Such as "4 or more steps"."""
    if not count.at_least:
        return how_many(int(count.value), what)
    return f"{count.value:.0f} or more {what}s"


def _stated(row: Measure) -> str:
    """A figure with its unit, and its error or that this is not known."""
    unit = UNITS[row.unit].page.format("m")
    return row.in_words(unit) if row.error is not None else f"about {row.in_words(unit)} (error not known)"


@dataclass(frozen=True)
class JointRange:
    """Where an angle of a joint lies in nine of ten frames. angle: without a side; ends: low and high by side ("right",
    "left"; "" of the trunk), degrees; bar: the widest ± of an end, None where none is known; times: how many errors it
    ranges."""

    angle: str
    ends: dict[str, tuple[float, float]]
    bar: float | None
    times: float

    def words(self, side: str) -> str:
        """Such as "3 to 58 ± 9°"; of a joint that goes two ways "4° left to 6° right ± 9°"."""
        ends, bar = self.ends[side], "" if self.bar is None else f" ± {self.bar:.0f}"
        if ways := _WAYS.get(self.angle):
            return f"{_between_ways(*ends, ways)}{bar}{'°' * bool(bar)}"
        return f"{_span(*ends)}{bar}°"


def _ranges(measures: Measures) -> Iterator[str]:
    """A sentence; none where no joint moves by more than its error."""
    for each in joint_ranges(measures.group("range_of_motion"))[:1]:
        parts = [f"{each.words(side)}{f' ({side})' * bool(side)}" for side in each.ends]
        unknown = " (errors not known)" if each.bar is None else ""
        yield f"In nine of ten frames: {label_of(each.angle)} {', '.join(parts)}{unknown}."


def joint_ranges(ranges: Measures) -> list[JointRange]:
    """The joints whose range is the most times its error, by that of the side that moves more; empty where none moves
    by more, and all have an error, on both sides, or where none is known. ranges: that group."""
    with_range = [each for name in _JOINTS if (each := _range(ranges, name)).ends]
    moving = [each for each in with_range if each.times > 1]
    whole = all(each.bar is not None and set(each.ends) in ({""}, set(_SIDES)) for each in with_range)
    if not moving and whole and len(with_range) == len(_JOINTS):
        return []
    return sorted(moving or with_range, key=lambda each: -each.times)


def _range(ranges: Measures, name: str) -> JointRange:
    """Without ends if neither side's can be trusted."""
    angles = {"": name} if name in ranges.groups else {side: f"{side[0]}_{name}" for side in _SIDES}
    ends, bars, times = {}, [], 0.0
    for side, angle in angles.items():
        of = ranges.group(angle)
        low, high = (of.figure(figure) for figure in ("p05", "p95"))
        if (
            not low
            or not high
            or of.value("beyond_anatomy_frames")
            or (of.value("nan_share") or 0.0) > _UNSEEN
        ):
            continue
        if whole := of.figure("p05_p95"):
            times = max(times, whole.value / (whole.bar or _UNSTATED))
        ends[side] = low.value, high.value
        bars += [end.bar for end in (low, high) if end.bar is not None]
    return JointRange(name, ends, max(bars, default=None), times)


def _span(low: float, high: float, unit: str = "") -> str:
    """Such as "3 to 58", or "3" where both are it."""
    return " to ".join(dict.fromkeys(f"{round(end)}{unit}" for end in (low, high)))


def _between_ways(low: float, high: float, ways: tuple[str, str]) -> str:
    """Such as "4° left to 6° right", "6° to 2° left", "0° to 6° right", "0°"."""
    ends = [round(end) for end in (low, high)]
    if ends == [0, 0]:
        return "0°"
    if ends[0] < 0 < ends[1]:
        return f"{-ends[0]}° {ways[0]} to {ends[1]}° {ways[1]}"
    return f"{_span(*map(abs, ends), unit='°')} {ways[ends[1] > 0 or ends[0] == 0]}"
