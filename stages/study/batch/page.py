"""study.html: every take of a study in tables that can be sorted, and the changes within subjects."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import UNITS, Measure, half_bar, shown
from ....pipeline.core.messages import how_many
from ....pipeline.core.notices import WARNS
from ....pipeline.core.pose import package_version
from ....pipeline.signals.angles import ANGLES, MIDLINE, OF_BOTH, sides_of
from ...drawing.page import Cell, Link, Stated, answer, box, heading, joined, page, small, table
from ...drawing.skeletons import body_views, skeletons
from ...drawing.words import ERRORS_OF_ANGLES, spoken
from .study import FEWEST_SUBJECTS, Change, doubts, name_of, place, rates_within

_RANGE = "range_of_motion.{}.p05_p95"
# Measures by place (study.py), and how they are called here.
_WALKING = {
    "walking.walking_speed": "walking speed",
    "walking.cadence": "cadence",
    "walking.steps": "steps",
    "walking.mean_stride_time": "stride",
    "walking.step_time_symmetry_index": "symmetry of step times",
}
_REPETITIONS = {
    "knee_bends.count": "knee bends",
    "knee_bends.squats": "of them squats",
    "knee_bends.mean_rise": "depth of a knee bend",
    "knee_bends.mean_duration": "duration of a knee bend",
    "arm_raises.right.count": "raises of the right arm",
    "arm_raises.left.count": "raises of the left arm",
    "arm_raises.right.mean_rise": "right arm rises by",
    "arm_raises.left.mean_rise": "left arm rises by",
}
_ARM = ("elbow", "shoulder", "upper_arm")  # how the names of its angles begin
_PAIRED = [both for both in OF_BOTH if both not in MIDLINE]
_PARTS = {
    "legs": [name for both in _PAIRED if not both.startswith(_ARM) for name in sides_of(both)],
    "arms": [name for both in _PAIRED if both.startswith(_ARM) for name in sides_of(both)],
    "trunk and pelvis": list(MIDLINE),
}
_GROUPS = {"walking": _WALKING, "repetitions": _REPETITIONS}
_MOST = 20  # names of runs in a sentence
_MOST_TOLD = 5  # changes

_LEVELLED = {True: "yes", False: "no", None: None}

_LABELS = ("subject", "visit", "condition")
_WORDS = {_RANGE.format(name): f"range of {spoken(name)}" for name in ANGLES} | _WALKING | _REPETITIONS

Rows = Sequence[Mapping[str, Any]]


def as_page(title: str, rows: Rows, changed: Sequence[Change]) -> str:
    """The page. rows: of the study's table, a failed take's with its `reason`; changed: changes within subjects."""
    done = [row for row in rows if row["state"] == "done"]
    failed = [row for row in rows if row["state"] == "failed"]
    sections = [
        ("Failed takes", _failed(failed)),
        ("Takes", _takes(done)),
        ("Change within subjects", _changes(changed)),
        ("Ranges of motion", _ranges(done)),
        ("Walking and repetitions", _others(done)),
        ("Warnings and repairs", _told(done)),
    ]
    return page(title, _head(rows, done, changed), sections)


def _head(rows: Rows, done: Rows, changed: Sequence[Change]) -> Markup:
    named = {label: dict.fromkeys(row[label] for row in rows if row[label]) for label in _LABELS}
    about = [how_many(len(names), label) for label, names in named.items() if names]
    unsure = [
        f"{how_many(len(runs), 'run')} {what}: {'; '.join(map(name_of, runs[:_MOST]))}"
        f"{' ...' if len(runs) > _MOST else ''}"
        for what, runs in doubts(done).items()
    ]
    if rates := rates_within(done):
        unsure.append(rates)
    return (
        small(" · ".join([*about, f"pcnet3d {package_version()}"]))
        + answer(_conclusion(rows, done, changed))
        + box("Not to be trusted, or with care", unsure, "warning")
    )


def _conclusion(rows: Rows, done: Rows, changed: Sequence[Change]) -> Iterator[str]:
    """How many takes are done and to be trusted, and what changed."""
    names = {row["name"] for row in done}
    failed = len({row["name"] for row in rows} - names)
    of = f" of {len(names) + failed} done" if failed else " done, none failed"
    doubtful = {row["name"] for runs in doubts(done).values() for row in runs}
    trusted = f"{len(doubtful)} of them with doubts" if doubtful else "no doubts about poses or levelling"
    yield f"{how_many(len(names), 'take')}{of}{f'; {trusted}' if done else ''}."
    for (factor, earlier, later), on_page in _by_step(changed).items():
        step = (
            f"From {factor} {earlier} to {later}, {how_many(max(change.n for change in on_page), 'subject')}"
        )
        of_step = [
            change
            for change in changed
            if (change.factor, change.earlier, change.later) == (factor, earlier, later)
        ]
        yield from (_of_primary(step, change) for change in of_step if change.primary)
        tested = [change for change in of_step if change.differs is not None and not change.primary]
        judged = [change for change in on_page if change in tested]
        beyond = [change for change in judged if change.differs]
        beyond.sort(key=lambda change: -abs(change.bias) / change.sd)
        if not judged:
            yield f"{step}: too few to say whether anything changed on average; {FEWEST_SUBJECTS} are needed."
            continue
        kind = "other measure" if any(change.primary for change in of_step) else "measure"
        counts = f"{len(beyond) or 'none'} of {how_many(len(judged), kind)} changed on average"
        told = ", ".join(f"{_named(change.of)} {change.bias:+.3g}" for change in beyond[:_MOST_TOLD])
        more = f" and {len(beyond) - _MOST_TOLD} more" if len(beyond) > _MOST_TOLD else ""
        chance = (
            f"corrected for all {len(tested)} of changes.csv, where one in twenty of those that changed is expected to "
            "be false: Benjamini & Hochberg 1995"
        )
        yield f"{step}: {counts} ({chance}){f': {told}{more}' if told else ''}."


def _of_primary(step: str, change: Change) -> str:
    """What is said of the outcome that was declared beforehand."""
    by = "by Student's t, 5 %, without correction"
    told = {
        True: f"it changed on average ({by})",
        False: f"it did not change on average ({by})",
        None: f"too few subjects ({change.n} of the {FEWEST_SUBJECTS} needed) to say whether it changed on average",
    }[change.differs]
    between = f"95 % interval {change.mean_lower:.3g} to {change.mean_upper:.3g}"
    return f"{step}: the primary outcome, {_named(change.of)}, {change.bias:+.3g} ({between}); {told}."


def _by_step(changed: Sequence[Change]) -> dict[tuple[str, str, str], list[Change]]:
    """Those changes that the page shows, by factor, earlier and later."""
    steps: dict[tuple[str, str, str], list[Change]] = {}
    for change in changed:
        if place(change.of) in _WORDS:
            steps.setdefault((change.factor, change.earlier, change.later), []).append(change)
    return steps


def _named(measure: Measure) -> str:
    """A measure with its unit, such as "cadence (steps/min)"; one that the page does not show by its place."""
    unit, named = UNITS[measure.unit].page.format("m"), _WORDS.get(place(measure), place(measure))
    return f"{named} ({unit})" if unit else named


def _linked(row: Mapping[str, Any]) -> Cell:
    return Link(name_of(row), quote(row["report"])) if row.get("report") else name_of(row)


def _labels(rows: Rows) -> list[str]:
    """Those of subject, visit and condition that any take has."""
    return [label for label in _LABELS if any(row[label] for row in rows)]


def _table(rows: Rows, columns: Mapping[str, Sequence[Cell]]) -> Markup:
    """The takes' names and labels, then the columns (head: a cell a take), but for empty ones."""
    kept = {head: cells for head, cells in columns.items() if any(cell is not None for cell in cells)}
    if not kept:
        return Markup("")
    labels = _labels(rows)
    lines = [
        [_linked(row), *(row[label] or None for label in labels), *(cells[i] for cells in kept.values())]
        for i, row in enumerate(rows)
    ]
    return table(["take", *labels, *kept], lines, sortable=True)


def _failed(rows: Rows) -> Markup:
    columns = {"exit code": [row["exit_code"] for row in rows], "why": [row["reason"] for row in rows]}
    words = "The whole log of each is logs/NAME.txt. The same command tries these again and leaves the others alone."
    return _table(rows, columns) + small(words) if rows else Markup("")


def _takes(rows: Rows) -> Markup:
    columns: dict[str, list[Cell]] = {
        "posture": [_posture(row) for row in rows],
        "frames": [row.get("frames") for row in rows],
        "duration (s)": [row.get("duration_s") for row in rows],
        "poses are": [row.get("verdict") or None for row in rows],
        "levelled": [_LEVELLED[row.get("level_ok")] for row in rows],
        "errors of angles": [ERRORS_OF_ANGLES.get(row.get("angle_errors", "")) for row in rows],
        "up known to within (°, 90 %)": [row.get("up_bound_deg") for row in rows],
        "expected rotation error (°)": [row.get("error_deg_mean") for row in rows],
        "bone lengths vary by (%)": [_percent(row.get("bone_length_spread")) for row in rows],
        "warnings": [_count(row, WARNS) for row in rows],
        "repairs": [_count(row, ("repair",)) for row in rows],
    }
    words = (
        "A take's name links to its report. Posture: a frame far from the take's usual one, from the front and from "
        "the right; orange is the person's right. Click a column's heading to sort by it."
    )
    return _table(rows, columns) + small(words) if rows else Markup("")


def _posture(row: Mapping[str, Any]) -> Cell:
    if row.get("posture") is None:
        return None
    joints = np.array(row["posture"], dtype=float)  # what is not known is null in JSON, NaN here
    return skeletons(
        body_views(joints), H36M17, f"A posture of {name_of(row)}, from the front and from the right"
    )


def _percent(share: float | None) -> float | None:
    return None if share is None else 100 * share


def _ranges(rows: Rows) -> Markup:
    tables = {
        part: _table(rows, {spoken(name): _of(rows, _RANGE.format(name)) for name in names})
        for part, names in _PARTS.items()
    }
    shown = joined(heading(part) + content for part, content in tables.items() if content)
    words = "From the 5th to the 95th percentile of the frames, degrees; the truth lies within ± in nine of ten cases."
    return small(words) + shown if shown else Markup("")


def _others(rows: Rows) -> Markup:
    tables = {part: _table(rows, _columns(rows, keys)) for part, keys in _GROUPS.items()}
    return joined(heading(part) + content for part, content in tables.items() if content)


def _columns(rows: Rows, keys: Iterable[str]) -> dict[str, list[Cell]]:
    """Measures of all takes under their names; those that any take has."""
    measures = {key: measure for row in rows for key, measure in row.get("measures", {}).items()}
    return {_named(measures[key]): _of(rows, key) for key in keys if key in measures}


def _of(rows: Rows, key: str) -> list[Cell]:
    """A measure of every take, with its error where it states one."""
    return [_figure(row.get("measures", {}).get(key)) for row in rows]


def _figure(measure: Measure | None) -> Cell:
    if measure is None:
        return None
    if measure.error is not None:
        return Stated(float(shown(measure.value, measure.error)), half_bar(measure.error))
    counts = not measure.unit and measure.value.is_integer()
    return int(measure.value) if counts else measure.value


def _told(rows: Rows) -> Markup:
    lines: list[list[Cell]] = [
        [_linked(row), said["weight"], said["code"], said["text"]]
        for row in rows
        for said in row.get("notices", ())
        if said["weight"] in (*WARNS, "repair")
    ]
    return table(("take", "weight", "code", "what"), lines, sortable=True)


def _count(row: Mapping[str, Any], weights: tuple[str, ...]) -> int:
    """How many notices of a take have one of the weights."""
    return sum(said["weight"] in weights for said in row.get("notices", ()))


def _changes(changed: Sequence[Change]) -> Markup:
    """The ranges of motion with both sides on one row, then what has no side."""
    tables = []
    for (factor, earlier, later), of in _by_step(changed).items():
        by = {place(change.of): change for change in of}
        rows: list[list[Cell]] = []
        for both in _PAIRED:
            sides = [by.get(_RANGE.format(name)) for name in sides_of(both)]
            if any(sides):
                cells = [cell for change in sides for cell in _changed(change)]
                rows.append([f"range of {spoken(both)} (°)", *cells])
        paired = {_RANGE.format(name) for name in ANGLES if name not in MIDLINE}
        rest = [[_named(change.of), *_changed(change)] for key, change in by.items() if key not in paired]
        head = ("mean change", "95 % interval", "MDC90", "n")
        tables += [
            heading(f"{factor} {later} minus {earlier}"),
            table(
                ("", *(f"{side}: {word}" for side in ("right", "left") for word in head)), rows, sortable=True
            ),
            table(("", *head), rest, sortable=True),
        ]
    words = (
        "Differences of each subject's mean, compared within the same condition or visit, for subjects who have "
        "both. Left out are takes that could not be levelled, have unusable poses, or show several people, because "
        "the subject is not marked there. 95 % interval: of the mean (Student's t), which includes at least the "
        "rounding of the figures; n: subjects. "
        "MDC90, for single takes of a subject from any camera place: if nothing changed, one change in ten is "
        "larger. All measures are in changes.csv."
    )
    return joined(tables) + small(words) if tables else Markup("")


def _changed(change: Change | None) -> list[Cell]:
    if change is None:
        return [None] * 4
    low, high = change.mean_lower, change.mean_upper
    digits = 1 if max(abs(low), abs(high)) >= 10 else 2
    return [change.bias, f"{low:z.{digits}f} to {high:z.{digits}f}", change.mdc90, change.n]
