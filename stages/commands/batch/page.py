"""study.html: every take of a study in tables that can be sorted, and the changes within subjects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from markupsafe import Markup

from ....pipeline.messages import how_many
from ....pipeline.motion.angles import ANGLES, MIDLINE
from ....pipeline.pose import package_version
from ...drawing.page import Cell, Link, box, glance, heading, joined, page, small, table
from ...report.sections import spoken
from .study import Change

_RANGE = "range_of_motion.{}.p05_p95_deg"
_OTHERS = {
    "walking.cadence_spm": "cadence (steps/min)",
    "walking.steps": "steps",
    "walking.mean_stride_time_s": "stride (s)",
    "walking.step_time_symmetry_index_percent": "symmetry of step times (%)",
    "knee_bends.count": "knee bends",
    "knee_bends.squats": "of them squats",
    "knee_bends.mean_rise_deg": "depth of a knee bend (°)",
    "knee_bends.mean_duration_s": "duration of a knee bend (s)",
    "arm_raises.right.count": "raises of the right arm",
    "arm_raises.left.count": "raises of the left arm",
    "arm_raises.right.mean_rise_deg": "right arm rises by (°)",
    "arm_raises.left.mean_rise_deg": "left arm rises by (°)",
}
_COUNTS = ("steps", "count", "squats")

Rows = Sequence[Mapping[str, Any]]


def as_page(title: str, rows: Rows, found: Sequence[Change]) -> str:
    """The page. rows: of the study's table, a failed take's with its `reason`; found: changes within subjects."""
    done = [row for row in rows if row["state"] == "done"]
    failed = [row for row in rows if row["state"] == "failed"]
    sections = [
        ("Failed takes", _failed(failed)),
        ("Takes", _takes(done)),
        ("Change within subjects", _changes(found)),
        ("Ranges of motion", _ranges(done)),
        ("Walking and repetitions", _others(done)),
        ("Warnings and repairs", _told(done)),
    ]
    return page(title, _head(rows, done, failed), sections)


def _head(rows: Rows, done: Rows, failed: Rows) -> Markup:
    named = [
        (label, {row[label] for row in rows if row[label]}) for label in ("subject", "visit", "condition")
    ]
    told = [("Takes done", str(len({row["name"] for row in done}))), ("Takes failed", str(len(failed)))]
    told += [(f"{label.capitalize()}s", str(len(names))) for label, names in named if names]
    unsure = [_name(row) for row in done if row.get("level_ok") is False]
    words = (
        f"{how_many(len(unsure), 'take')} could not be levelled, so what rests on the vertical "
        "is not to be believed: "
    )
    shown = ", ".join(unsure[:20]) + (" ..." if len(unsure) > 20 else "")
    return glance([*told, ("pcnet3d", package_version())]) + box(
        "Warning", [words + shown] if unsure else [], "warning"
    )


def _name(row: Mapping[str, Any]) -> str:
    return f"{row['name']}, {row['person']}" if row.get("person") else row["name"]


def _linked(row: Mapping[str, Any]) -> Cell:
    return Link(_name(row), quote(row["report"])) if row.get("report") else _name(row)


def _labels(rows: Rows) -> list[str]:
    """Those of subject, visit and condition that any take has."""
    return [label for label in ("subject", "visit", "condition") if any(row[label] for row in rows)]


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
        "frames": [row.get("frames") for row in rows],
        "duration (s)": [row.get("duration_s") for row in rows],
        "poses are": [row.get("verdict") or None for row in rows],
        "levelled": ["yes" if row.get("level_ok") else "no" for row in rows],
        "up known to within (°, 90 %)": [row.get("up_bound_deg") for row in rows],
        "expected rotation error (°)": [row.get("error_deg_mean") for row in rows],
        "bone lengths vary by (%)": [_percent(row.get("bone_length_spread")) for row in rows],
        "warnings": [len(row.get("warnings", ())) for row in rows],
        "repairs": [len(row.get("repairs", ())) for row in rows],
    }
    words = "A take's name leads to its report. A click on a column's heading sorts by it."
    return _table(rows, columns) + small(words) if rows else Markup("")


def _percent(share: float | None) -> float | None:
    return None if share is None else 100 * share


def _ranges(rows: Rows) -> Markup:
    parts = {
        "right": [name for name in ANGLES if name.startswith("r_")],
        "left": [name for name in ANGLES if name.startswith("l_")],
        "midline": list(MIDLINE),
    }
    tables = {
        part: _table(
            rows,
            {
                spoken(name.removeprefix("r_").removeprefix("l_")): _of(rows, _RANGE.format(name))
                for name in names
            },
        )
        for part, names in parts.items()
    }
    shown = joined(heading(part) + content for part, content in tables.items() if content)
    return (
        small("From the 5th to the 95th percentile of the frames, degrees.") + shown if shown else Markup("")
    )


def _others(rows: Rows) -> Markup:
    return _table(rows, {words: _of(rows, key) for key, words in _OTHERS.items()})


def _of(rows: Rows, measure: str) -> list[Cell]:
    values = [row.get("measures", {}).get(measure) for row in rows]
    counts = measure.split(".")[-1] in _COUNTS
    return [
        None if value is None else int(value) if counts and value.is_integer() else value for value in values
    ]


def _told(rows: Rows) -> Markup:
    lines: list[list[Cell]] = [
        [_linked(row), kind.removesuffix("s"), words]
        for row in rows
        for kind in ("warnings", "repairs")
        for words in row.get(kind, ())
    ]
    return table(("take", "kind", "what"), lines, sortable=True)


def _changes(found: Sequence[Change]) -> Markup:
    wanted = {_RANGE.format(name): f"range of {spoken(name)} (°)" for name in ANGLES} | _OTHERS
    tables = []
    for factor, earlier, later in dict.fromkeys((one.factor, one.earlier, one.later) for one in found):
        rows: list[list[Cell]] = [
            [wanted[one.measure], one.n, one.bias, one.sd, one.lower, one.upper]
            for one in found
            if (one.factor, one.earlier, one.later) == (factor, earlier, later) and one.measure in wanted
        ]
        head = ("measure", "subjects", "bias", "SD of differences", "lower limit", "upper limit")
        tables.append(heading(f"{factor} {later} less {earlier}") + table(head, rows, sortable=True))
    words = (
        "Differences of each subject's mean, compared within the same condition or visit; subjects who have both, "
        "without takes that could not be levelled. "
        "Limits of agreement: bias and 1.96 standard deviations of the differences to each side (Bland & Altman "
        "1986). With few subjects the limits themselves are uncertain. All measures are in changes.csv."
    )
    return joined(tables) + small(words) if tables else Markup("")
