"""What a take says to people, in sentences: how long it is, what moved, how the camera stands, which way is up and how
far all of it can be trusted; and what a command says of finished runs.

The terminal, the report, the study's page and other files print what is made here, so that all say the same.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.camera import pitch_roll_deg
from ..core.figures import UNITS, label_of
from ..core.measures import Measure, Measures
from ..core.messages import bound_in_words, how_many, is_verbose, rate_in_words, say
from ..core.notices import Notice, grave
from ..core.pose import Rectified
from ..core.rotations import rotate
from ..core.system import quoted
from ..core.take import AngleErrors, Take
from ..files.names import RECORDING, find_page
from ..reading.take import Person
from ..signals.checks import nobody_upright, whole_rows

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

NINE_IN_TEN = (
    'On this page ±, "within" and 90 % mean the same: the true value lies in that range in nine of ten cases.'
)
ERRORS_OF_ANGLES: dict[AngleErrors, str] = {
    "judged": "as measured for the built-in lifter",
    "disagreement": "from disagreement with the built-in lifter",
    "file": "from the given file",
    "none": "not known",
}
# What can be said of poses, by `judgement`.
POSES_ARE = {
    "good": "The poses are good",
    "joints-missing": "What was seen of the poses is good",
    "error-unknown": "No fault was found in the poses",
    "too-few-frames": "The poses cannot be judged",
    "suspicious": "The poses are suspicious",
    "unusable": "The poses are unusable",
}
# What up may rest on, by the name of the evidence.
_SOURCES = {
    "frames": "the body's posture", "image": "the image's straight lines", "feet": "the feet's places",
    "floor": "the floor under the feet",
}  # fmt: skip
_OTHERS = ("person-chosen", "joined-again")  # without them there is one person
_MOSTLY = 0.5  # share of the frames that have all joints


def length_of(take: Take) -> str:
    """How much of the video the take shows, how long that is, and of whom where there are several: such as "98 frames,
    3.3 s at 30 a second"."""
    rows = take.rows
    if rows is None:
        return "Nobody was seen"
    length = how_many(len(rows), "frame")
    if take.video is not None:
        first, last = take.video.span
        if len(rows) < (whole := last + 1 - first):
            part = "this part of " * (take.video.part is not None)
            length = f"{len(rows)} of the {whole} frames of {part}the video ({100 * len(rows) // whole} %)"
    if rows.time_s is not None and len(rows) > 1:
        length += f", {rows.duration_s:.1f} s{rate_in_words(rows.fps, ' at ')}"
    return length + f", person {rows.person}" * any(each.code in _OTHERS for each in take.notices)


@dataclass(frozen=True)
class _Movement:
    """A movement that was made `count` times: what was done, and how its sentence goes on with its figures."""

    count: Measure
    what: str
    figures: str = ""

    @property
    def words_of_figures(self) -> int:
        return len((self.what + self.figures).split()) - len(self.what.split())


def answer(take: Take, further: Iterable[str] = ()) -> list[str]:
    """Sentences about a take's movements, the most frequent first, each with its figures if every movement is named
    then; where none was found, about the joints that range furthest for their error; then `further` ones, as far as
    there is room. Nothing of a take without measures."""
    if not take.measures:
        return []
    movements = sorted(
        _movements(take.measures, take.need("poses").frame.metric), key=lambda each: -each.count.value
    )
    spare = _MOST_WORDS - sum(len(each.what.split()) for each in movements)
    moved = []
    for each in movements:
        fits = each.words_of_figures <= spare
        spare -= each.words_of_figures * fits
        moved.append(f"{each.what}{each.figures * fits}.")
    sentences, room = [], _MOST_WORDS
    for sentence in [*(moved or _ranges(take.measures)), *further]:
        if len(sentence.split()) <= room:
            sentences.append(f"{sentence[0].upper()}{sentence[1:]}")
            room -= len(sentence.split())
    return sentences


def headlines(take: Take) -> list[tuple[str, str]]:
    """The joints that range furthest for their error, and how far, as the first screen shows them beside the answer."""
    return [
        (f"{label_of(each.angle)}{f', {side}' * bool(side)}", each.in_words(side))
        for each in joint_ranges(take.figures.group("range_of_motion"))
        for side in each.ends
    ][:_MOST_FIGURES]


def _movements(measures: Measures, metric: bool) -> Iterator[_Movement]:
    walking, bends, jumps = (measures.group(name) for name in ("walking", "knee_bends", "jumps"))
    if steps := walking.figure("steps"):
        yield _walked(walking, steps, metric)
    count, squats = bends.figure("count"), bends.figure("squats")
    if count:
        every = squats is not None and squats.value == count.value
        some = f" ({_many(squats, 'squat')})" if squats and squats.value and not every else ""
        what = f"{_many(count, 'squat' if every else 'knee bend')}{some}"
        yield _counted(count, what, [bends], "peak", " of both knees")
    yield from _raised(measures.group("arm_raises"))
    if count := jumps.figure("count"):
        yield _counted(count, _many(count, "jump"), [jumps], "height_by_flight_time")


def _walked(walking: Measures, steps: Measure, metric: bool) -> _Movement:
    what = f"{_GAITS.get(walking.text('gait'), 'Walked')} {_many(steps, 'step')}"
    if walking.count("walks") == 1 and (lasts_s := walking.value("walked")):
        what += f" in {lasts_s:.1f} s"
    if ends := walking.text("not_visible"):
        what += f" ({ends} not visible)"
    figures = [row for name in ("cadence", "walking_speed")[: 1 + metric] if (row := walking.figure(name))]
    none_stated = all(row.error is None for row in figures)
    clauses = [
        f"{row.about.label} {row.in_words(UNITS[row.unit].page.format('m'))}{'' if none_stated else _unknown([row])}"
        for row in figures
    ]
    told = f". {', '.join(clauses).capitalize()}{_unknown(figures) if none_stated else ''}"
    return _Movement(steps, what, told if clauses else "")


def _raised(arms: Measures) -> Iterator[_Movement]:
    sides = {side: arms.group(side) for side in _SIDES}
    counts = {side: count for side, arm in sides.items() if (count := arm.figure("count"))}
    alike = len(counts) == 2 and len({_many(count, "") for count in counts.values()}) == 1
    if alike and _together(*sides.values()):
        count = counts["right"]
        yield _counted(count, f"{_many(count, 'raise')} of both arms", [*sides.values()], "peak")
    else:
        for side, count in counts.items():
            what = f"{_many(count, 'raise')} of the {side} arm"
            yield _counted(count, what, [sides[side]], "peak")


def _together(right: Measures, left: Measures) -> bool:
    """Whether the repetitions of both are at their highest at the same times, within a part of the shorter one: arms
    that swing to and fro are not raised together."""
    pairs = zip(right.spans, right.times("peak_at"), left.spans, left.times("peak_at"), strict=False)
    return all(abs(at - at_other) <= _AT_ONCE * min(b - a, d - c) for (a, b), at, (c, d), at_other in pairs)


def _counted(
    count: Measure, what: str, groups: Sequence[Measures], figure: str, whose: str = ""
) -> _Movement:
    """Such as "3 squats, peak of both knees 95 to 102 ± 11°", with that figure of all repetitions that have it."""
    rows = [row for group in groups for row in group.repetitions(figure)]
    if not rows:
        return _Movement(count, what)
    some = f" ({len(rows)} of them)" if len(rows) < sum(group.count() for group in groups) else ""
    return _Movement(count, what, f", {rows[0].about.label}{whose}{some} {spread(rows)}{_unknown(rows)}")


def _many(count: Measure, what: str) -> str:
    """Such as "at least 4 steps"."""
    return f"{'at least ' * count.at_least}{how_many(int(count.value), what)}"


def _unknown(rows: Sequence[Measure]) -> str:
    """ " (error not known)" behind figures of which none has an error."""
    return f" (error{'s' * (len(rows) > 1)} not known)" * all(row.error is None for row in rows)


def spread(rows: Sequence[Measure], unit: bool = True) -> str:
    """A figure, or the lowest and the highest of several, and the widest of their bars: "95 to 102 ± 11°"."""
    behind = UNITS[rows[0].unit].page.format("m") if unit else ""
    ends = dict.fromkeys(f"{end(row.value for row in rows):z.0f}" for end in (min, max))
    return f"{' to '.join(ends)}{_bar(rows)}{' ' * (unit and behind != '°')}{behind}"


def _bar(rows: Sequence[Measure]) -> str:
    bars = [row.bar for row in rows if row.bar is not None]
    return f" ± {max(bars):.0f}" if bars else ""


@dataclass(frozen=True)
class JointRange:
    """Where an angle of a joint lies in nine of ten frames. angle: without a side; ends: low and high by side ("right",
    "left"; "" of the trunk), degrees; times: how many errors it ranges."""

    angle: str
    ends: dict[str, tuple[Measure, Measure]]
    times: float

    @property
    def has_error(self) -> bool:
        """Whether the error of an end is known."""
        return any(end.error is not None for ends in self.ends.values() for end in ends)

    def in_words(self, side: str) -> str:
        """Such as "3 to 58 ± 9°"; of a joint that goes two ways "4° left to 6° right ± 9°"."""
        ways, ends = _WAYS.get(self.angle), self.ends[side]
        return _between_ways(ends, ways) if ways else spread(ends)


def _between_ways(ends: tuple[Measure, Measure], ways: tuple[str, str]) -> str:
    """Such as "4° left to 6° right", "6° to 2° left ± 3°", "0° to 6° right", "0°"."""
    low, high = (round(end.value) for end in ends)
    if low < 0 < high:
        span = f"{-low}° {ways[0]} to {high}° {ways[1]}"
    else:
        way = f" {ways[high > 0]}" if low or high else ""
        span = " to ".join(dict.fromkeys(f"{abs(end)}°" for end in (low, high))) + way
    bar = _bar(ends)
    return f"{span}{bar}{'°' * bool(bar)}"


def _ranges(measures: Measures) -> Iterator[str]:
    """A sentence; none where no joint moves by more than its error."""
    for each in joint_ranges(measures.group("range_of_motion"))[:1]:
        parts = [f"{each.in_words(side)}{f' ({side})' * bool(side)}" for side in each.ends]
        unknown = " (errors not known)" * (not each.has_error)
        yield f"In nine of ten frames that show it: {label_of(each.angle)} {', '.join(parts)}{unknown}."


def joint_ranges(ranges: Measures) -> list[JointRange]:
    """The joints whose range is the most times its error, by that of the side that moves more; empty where none moves
    by more, and all have an error, on both sides, or where none is known. ranges: that group."""
    with_range = [each for name in _JOINTS if (each := _range(ranges, name)).ends]
    moving = [each for each in with_range if each.times > 1]
    whole = all(each.has_error and set(each.ends) in ({""}, set(_SIDES)) for each in with_range)
    if not moving and whole and len(with_range) == len(_JOINTS):
        return []
    return sorted(moving or with_range, key=lambda each: -each.times)


def _range(ranges: Measures, name: str) -> JointRange:
    """Without ends if neither side's can be trusted."""
    angles = {"": name} if name in ranges.groups else {side: f"{side[0]}_{name}" for side in _SIDES}
    ends, times = {}, 0.0
    for side, angle in angles.items():
        group = ranges.group(angle)
        low, high = group.figure("p05"), group.figure("p95")
        doubtful = group.value("beyond_anatomy_frames") or (group.value("nan_share") or 0.0) > _UNSEEN
        if low and high and not doubtful:
            ends[side] = low, high
            if whole := group.figure("p05_p95"):
                times = max(times, whole.value / (whole.bar or _UNSTATED))
    return JointRange(name, ends, times)


def trusted(take: Take) -> str:
    """How far a take can be trusted, in short: how its poses are and why, and how well up is known."""
    return " ".join([*poses_are(take), *([up_words(take)] if take.rectified is not None else [])])


def judgement(take: Take) -> str | None:
    """What can be said of a take's poses, one of POSES_ARE: their verdict; of poses without a fault that lack joints in
    most frames, or whose error nothing tells, and of too few of them, that. None where nothing looked at them."""
    faults = grave(take.judged)
    if [fault.code for fault in faults] == ["too-few-frames"]:
        return "too-few-frames"
    if take.verdict == "good" and take.error_unknown:
        return "error-unknown"
    if take.verdict == "good" and whole_rows(take.need("poses")).mean() < _MOSTLY:
        return "joints-missing"
    return take.verdict


def poses_are(take: Take) -> list[str]:
    """`judgement` in a sentence, and others on why it is no better; none where nothing looked at the poses."""
    code = judgement(take)
    if code is None:
        return []
    why = [f"{fault.text.rstrip('.')}." for fault in grave(take.judged)]
    unknown = ["How far they are off cannot be judged."] * (code == "error-unknown")
    return [f"{POSES_ARE[code]}.", *why, *unknown]


def up_bound(rectified: Rectified) -> tuple[float, float] | None:
    """Degrees that up is known to within, 90 %: the least and the most of the frames; None where that is not known."""
    bound = rectified.up_bound_deg[rectified.turned & np.isfinite(rectified.up_bound_deg)]
    return (float(bound.min()), float(bound.max())) if rectified.level_ok and len(bound) else None


def up_words(take: Take) -> str:
    """Whether up was found and how well it is known, in a sentence."""
    rectified = take.need("rectified")
    bound = up_bound(rectified)
    if not rectified.level_ok:
        return f"The take could not be levelled: {rectified.level_reason}."
    if rectified.in_world:
        return "The source knows its own up." if bound else "Up comes from the file; its error is not known."
    if bound is None:
        why = ", because up rests on poses that are unusable" if take.verdict == "unusable" else ""
        return f"The error of up is not known{why}."
    within = "° to ".join(dict.fromkeys(map(bound_in_words, bound)))
    return f"Up is known to within {within}° (90 %){', unless the image is turned' * bool(nobody_upright(rectified))}."


def up_rests_on(rectified: Rectified) -> str:
    """What up rests on, in a sentence; empty where nothing was estimated."""
    largest = sorted(rectified.up_shares.items(), key=lambda share: -share[1])
    parts = [f"{_SOURCES.get(name, name)} ({100 * part:.0f} %)" for name, part in largest if part >= 0.005]
    return f"It is based on {', '.join(parts)}." if parts else ""


def camera_motion(take: Take) -> str:
    """How the camera moves and who says so, behind "the camera"; empty of poses in a world's axes."""
    if take.need("rectified").camera is None:
        return ""
    if take.told.moving or take.told.standing:
        return f"{'moves' if take.moving else 'stands still'}, as you stated"
    if take.camera is not None and take.camera.background is not None:
        return f"{take.camera.background.in_words}, judging by the background"
    return "is assumed to stand still (nothing shows whether it does)"


def camera_words(take: Take) -> str:
    """How the camera moves, or stands and looks, behind "the camera"."""
    rectified, motion = take.need("rectified"), camera_motion(take)
    if rectified.camera == "moving":
        return f"{motion}, and up moves with it"
    if rectified.camera is None or not rectified.level_ok:
        return motion
    up = rotate(take.need("poses").frame.basis.T, rectified.R_source_from_level[None, :, 2])
    within = up_bound(rectified)
    bound = f" ± {bound_in_words(within[1])}" if within else ""
    digits = 1 if "." in bound else 0
    pitch, roll = (f"{float(angle):z.{digits}f}{bound}°" for angle in pitch_roll_deg(up[0]))
    return (
        f"{motion}; pitch {pitch} (positive: it looks down), roll {roll} (positive: its image is turned "
        "counter-clockwise)"
    )


_MOST = 3  # notices of a command; the rest is in the report
_FIRST = "person-chosen"  # who was visible and left out comes before the result
_SAID_BEFORE = (_FIRST, "not-levelled")  # or in the verdict
# Graver ones are in the verdict, and a mark is a place in the recording.
_SAID = ("note", "repair", "warning")


def conclude(takes: Mapping[str, Take], folder: Path, within: str = "") -> None:
    """Print what came of each take by its name, how far that can be trusted, what changes a decision, and where the
    files are: in `folder`, of several takes the first's `within` it."""
    for who, take in takes.items():
        for each in take.notices:
            if each.code == _FIRST:
                print(f"{who}{each.text}")
        print(f"{who}{' '.join([f'{length_of(take)}.', *answer(take)])}")
        if doubts := trusted(take):
            print(f"{who}{doubts}")
    more = _say(takes)
    point_to(folder, within)
    if more:
        print(f"{how_many(more, 'more note')} in the report (-v)")


def conclude_people(runs: Sequence[Person], folder: Path) -> None:
    """The same of one person's run or several people's, after who was left out."""
    for run in runs:
        if run.take is None:
            say("warning", f"person {run.name} was left out: {run.refusal}")
    takes = {f"person {run.name}: " * bool(run.folder): run.take for run in runs if run.take}
    conclude(takes, folder, next(run.folder for run in runs if run.take))


def point_to(folder: Path, within: str = "") -> None:
    """Print where the files are, and what opens the page and the recording among them. within: name of the folder that
    has these, where each person has one."""
    page, recording = find_page(folder / within), (folder / within / RECORDING).is_file()
    opened = [] if page is None else [f"open {quoted(page)}"]
    if recording:
        opened.append(f"the recording: pcnet3d view {quoted(folder / within)}")
    each = ", a folder for each person" * bool(within)
    print(f"results in {folder}{each}{': ' * bool(opened)}{'; '.join(opened)}")
    if is_verbose():
        print(f"files: {', '.join(sorted(path.name for path in folder.iterdir()))}")


def _say(takes: Mapping[str, Take]) -> int:
    """Say the notices that change a decision, warnings before notes, what names an option before what does not, each
    code once; with -v all of them. Returns how many are not said."""
    if sys.stdout is not None:
        sys.stdout.flush()  # what was printed stands before what is said on stderr
    whose: dict[Notice, list[str]] = {}
    for who, take in takes.items():
        in_verdict = {finding.text for finding in grave(take.judged)}
        for each in take.notices:
            if each.weight in _SAID and each.code not in _SAID_BEFORE and each.text not in in_verdict:
                whose.setdefault(each, []).append(who)
    chosen = [*whose]
    if not is_verbose():
        of_codes: dict[str, Notice] = {}
        for each in sorted(chosen, key=lambda each: (not each.warns, not each.advises)):
            if each.warns or each.advises:
                of_codes.setdefault(each.code, each)
        chosen = [*of_codes.values()][:_MOST]
    for each in chosen:
        say(each.weight, f"{'' if len(whose[each]) == len(takes) else ''.join(whose[each])}{each.text}")
    return len(whose) - len(chosen)
