"""study.html: every take of a study in tables that can be sorted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any
from urllib.parse import quote

from markupsafe import Markup

from ....pipeline.core.figures import GROUPS, label_of
from ....pipeline.core.measures import Measure, Side, with_bar
from ....pipeline.core.messages import bound_in_words, how_many
from ....pipeline.core.notices import WARNS
from ....pipeline.core.pose import package_version
from ...drawing.facts import ERRORS_OF_ANGLES
from ...drawing.page import Cell, Link, Number, answer, box, heading, joined, page, small, table
from .manifest import LABELS
from .study import concluded, doubts, name_of

_MOST = 20  # names of runs in a sentence
_LEVELLED = {True: "yes", False: "no", None: None}

Rows = Sequence[Mapping[str, Any]]


def as_page(title: str, rows: Rows) -> str:
    """The page. rows: of the study's table, a failed take's with its `reason`."""
    done = [row for row in rows if row["state"] == "done"]
    failed = [row for row in rows if row["state"] == "failed"]
    sections = [
        ("Failed takes", _failed(failed)),
        ("Takes", _takes(done)),
        ("Figures", _figures(done)),
    ]
    return page(title, _head(rows, done), sections)


def _head(rows: Rows, done: Rows) -> Markup:
    named = {label: dict.fromkeys(row[label] for row in rows if row[label]) for label in LABELS}
    about = [how_many(len(names), label) for label, names in named.items() if names]
    unsure = [
        f"{how_many(len(runs), 'run')} {what}: {'; '.join(map(name_of, runs[:_MOST]))}"
        f"{' ...' if len(runs) > _MOST else ''}"
        for what, runs in doubts(done).items()
    ]
    return (
        small(" · ".join([*about, f"pcnet3d {package_version()}"]))
        + answer(f"{line[:1].upper()}{line[1:]}." for line in concluded(rows))
        + box("Not to be trusted, or with care", unsure, "warning")
    )


def _linked(row: Mapping[str, Any]) -> Cell:
    return Link(name_of(row), quote(row["report"])) if row.get("report") else name_of(row)


def _table(rows: Rows, columns: Mapping[str, Sequence[Cell]]) -> Markup:
    """The takes' names and labels, then the columns (head: a cell a take), but for empty ones."""
    filled = {head: cells for head, cells in columns.items() if any(cell is not None for cell in cells)}
    if not filled:
        return Markup("")
    labels = [label for label in LABELS if any(row[label] for row in rows)]
    lines = [
        [_linked(row), *(row[label] or None for label in labels), *(cells[i] for cells in filled.values())]
        for i, row in enumerate(rows)
    ]
    return table(["take", *labels, *filled], lines, sortable=True)


def _failed(rows: Rows) -> Markup:
    columns = {"exit code": [row["exit_code"] for row in rows], "why": [row["reason"] for row in rows]}
    about = "The whole log of each is logs/NAME.txt. The same command tries these again and leaves the others alone."
    return _table(rows, columns) + small(about) if rows else Markup("")


def _takes(rows: Rows) -> Markup:
    columns: dict[str, list[Cell]] = {
        "frames": [row.get("frames") for row in rows],
        "duration (s)": _numbers(rows, "duration_s", "{:.1f}".format),
        "poses are": [row.get("verdict") or None for row in rows],
        "levelled": [_LEVELLED[row.get("level_ok")] for row in rows],
        "errors of angles": [ERRORS_OF_ANGLES.get(row.get("angle_errors", "")) for row in rows],
        "up known to within (°, 90 %)": _numbers(rows, "up_bound_deg", bound_in_words),
        "expected rotation error (°)": _numbers(rows, "error_deg_mean", bound_in_words),
        "bone lengths vary by (%)": _numbers(
            rows, "bone_length_spread", lambda share: with_bar(100 * share, None)
        ),
        "warnings": [sum(each["weight"] in WARNS for each in row.get("notices", ())) for row in rows],
    }
    about = "A take's name links to its report. Click a column's heading to sort by it."
    return _table(rows, columns) + small(about) if rows else Markup("")


def _numbers(rows: Rows, name: str, in_words: Callable[[float], str]) -> list[Cell]:
    return [None if row.get(name) is None else Number(in_words(row[name])) for row in rows]


def _figures(rows: Rows) -> Markup:
    """A table for each group of the catalogue of figures, and for each side."""
    groups: dict[tuple[str, Side], dict[str, list[Cell]]] = {}
    for key, measure in {key: of for row in rows for key, of in row.get("measures", {}).items()}.items():
        of = [row.get("measures", {}).get(key) for row in rows]
        cells = [None if each is None else Number(each.in_words()) for each in of]
        groups.setdefault((measure.group[0], measure.side), {})[_named(measure)] = cells
    tables = [
        heading(", ".join(filter(None, [GROUPS[group].title.capitalize(), side]))) + _table(rows, columns)
        for (group, side), columns in groups.items()
    ]
    about = (
        "Ranges are from the 5th to the 95th percentile of the frames; the truth lies within ± in nine of ten cases. "
        "study.csv and study.parquet have all figures."
    )
    return small(about) + joined(tables) if tables else Markup("")


def _named(measure: Measure) -> str:
    """A measure with its unit, such as "right: cadence (steps/min)"; of ranges the angle."""
    group, *inner = measure.group
    if group == "range_of_motion":
        return f"{label_of(inner[0])} (°)"
    return ": ".join([*map(label_of, inner), measure.about.label_with_unit()])
