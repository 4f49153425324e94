"""The study's tables: study.parquet and study.csv, a row for every take and for every person of a take; and study.html,
whose tables can be sorted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from markupsafe import Markup

from ....pipeline.core.errors import InputError
from ....pipeline.core.measures import nested
from ....pipeline.core.messages import bound_in_words, how_many
from ....pipeline.core.notices import WARNS
from ....pipeline.core.pose import package_version
from ....pipeline.files.atomic import REPORT, SUMMARY, plain, printable, read_summary, whole_file, write_rows
from ....pipeline.files.finished import read_run
from ....pipeline.files.names import POSES
from ....pipeline.running.sentences import ERRORS_OF_ANGLES, POSES_ARE, judgement
from ....pipeline.signals.checks import bone_spread
from ...drawing.facts import mean
from ...drawing.page import Cell, Link, Number, answer, page, small, table
from .manifest import LABELS

_QUALITY = ("up_error_deg", "up_bound_deg", "error_deg_mean", "bone_length_spread")
# Of a notice.
_SAID = ("code", "weight", "about", "text")

# Of study.parquet, whose other columns are numbers, each measure's among them.
_COLUMNS = (
    "name", "subject", "visit", "condition", "person", "state", "exit_code", "code", "reason", "report", "notices",
    "verdict", "judgement", "frames", "fps", "duration_s", "unit", "method", "angle_errors", "device",
    "level_ok", "level_reason", *_QUALITY,
)  # fmt: skip
_NUMBERS = ("fps", "duration_s", *_QUALITY)
# What is said of runs whose poses are not good, by `judgement`: "" without the stage `export`, as there are no figures.
_DOUBTFUL = {
    "with suspicious poses": ("suspicious",),
    "with unusable poses": ("unusable",),
    "whose poses cannot be judged": ("error-unknown", "too-few-frames", ""),
}
_OF_FAILED = (
    "The whole log of each is logs/NAME.txt. The same command tries these again and leaves the others alone."
)
_OF_TAKES = (
    "A take's name links to its report. Click a column's heading to sort by it. study.csv and study.parquet have all "
    "figures."
)
_LEVELLED = {True: "yes", False: "no", None: None}

Row = Mapping[str, Any]  # of a take, or of a person of it; a failed one has its `reason`


def figures(folder: Path) -> tuple[dict[str, Any], ...]:
    """What the table says of a take's folder, a row for each person who has a run in it. numbers: all single numbers by
    their keys, as in summary.json. InputError when a file is not as a run writes it."""
    people = [path.parent for path in sorted(folder.glob(f"*/{SUMMARY}")) if (path.parent / POSES).exists()]
    return tuple(_figures(run, run.relative_to(folder.parent.parent)) for run in people or [folder])


def _figures(folder: Path, place: Path) -> dict[str, Any]:
    """place: of the folder, seen from the study's page."""
    device = read_summary(folder).get("device")
    networks = device.get("networks") if isinstance(device, dict) else None
    processors = sorted({*map(str, networks.values())}) if isinstance(networks, dict) else ()
    row = {
        "person": printable(folder.name) if len(place.parts) > 2 else "",
        "report": printable((place / REPORT).as_posix()) if (folder / REPORT).exists() else "",
        "device": printable(", ".join(processors)),
    }
    if not (folder / POSES).exists():
        return row
    try:
        take = read_run(folder)
    except InputError as error:
        raise InputError(error.code, f"{str(error).rstrip('.')}: remove that folder first.") from None
    poses, rectified = take.need("poses"), take.need("rectified")
    rows = rectified.turned if rectified.camera == "moving" else slice(None)
    row |= {
        "notices": [{part: printable(getattr(each, part)) for part in _SAID} for each in take.said],
        "verdict": take.verdict or "",
        "judgement": judgement(take) or "",
        "frames": len(poses),
        "fps": poses.fps,
        "duration_s": poses.duration_s,
        "unit": poses.frame.unit,
        "method": printable(rectified.method),
        "angle_errors": take.angle_errors or "",
        "level_ok": rectified.level_ok,
        "level_reason": printable(rectified.level_reason),
        "up_error_deg": mean(rectified.up_error_deg[rows]),
        "up_bound_deg": mean(rectified.up_bound_deg[rows]),
        "error_deg_mean": mean(rectified.error_deg),
        "bone_length_spread": bone_spread(poses),
        "numbers": {printable(name): value for name, value in _numbers(nested(take.figures))},
    }
    return plain(row)


def _numbers(group: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, float]]:
    """The single figures, their keys joined by dots as in measures.csv; lists and words are left out."""
    for key, value in group.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{above}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{above}{key}", float(value)


def concluded(rows: Sequence[Row], before: int | None = None) -> Iterator[str]:
    """How many takes are done, `before` of them by an earlier batch, and how far their runs can be trusted; rows: as of
    `study_rows`."""
    done = [row for row in rows if row["state"] == "done"]
    names = {row["name"] for row in done}
    kept = "" if before is None else f" ({before} of them before)"
    yield f"{how_many(len(names), 'take')} done{kept}, {len({row['name'] for row in rows} - names)} failed"
    if done:
        many = {
            what: sum(row.get("judgement", "") in codes for row in done) for what, codes in _DOUBTFUL.items()
        }
        many["not levelled"] = sum(row.get("level_ok") is False for row in done)
        doubtful = ", ".join(f"{count} {what}" for what, count in many.items() if count)
        yield f"of {how_many(len(done), 'run')}: {doubtful or 'no doubts about poses or levelling'}"


def name_of(row: Row) -> str:
    """A take's name, and the person's where it shows several."""
    return f"{row['name']}, {row['person']}" if row.get("person") else row["name"]


def write_table(rows: Sequence[Row], path: Path) -> None:
    """The columns of the rows, then a column for every number of any; null where a take has none. As Parquet at `path`,
    and beside it as CSV, where a take's notices are their codes."""
    import pyarrow as pa
    from pyarrow import parquet

    kinds: dict[str, Any] = {name: pa.float64() if name in _NUMBERS else pa.string() for name in _COLUMNS}
    kinds |= {"exit_code": pa.int64(), "frames": pa.int64(), "level_ok": pa.bool_()}
    kinds["notices"] = pa.list_(pa.struct([(name, pa.string()) for name in _SAID]))
    kinds |= {key: pa.float64() for row in rows for key in row.get("numbers", {}) if key not in kinds}
    lines = [{**row.get("numbers", {}), **row} for row in rows]
    with whole_file(path) as partial, open(partial, "wb") as file:
        parquet.write_table(pa.Table.from_pylist(lines, schema=pa.schema(kinds)), file)
    for line in lines:
        line["notices"] = " ".join(each["code"] for each in line.get("notices", ()))
    write_rows(path.with_suffix(".csv"), kinds, ([line.get(name) for name in kinds] for line in lines))


def as_page(title: str, rows: Sequence[Row]) -> str:
    """study.html."""
    done = [row for row in rows if row["state"] == "done"]
    failed = [row for row in rows if row["state"] == "failed"]
    why = {"exit code": [row["exit_code"] for row in failed], "why": [row["reason"] for row in failed]}
    sections = [
        ("Failed takes", _table(failed, why, _OF_FAILED)),
        ("Takes", _table(done, _columns(done), _OF_TAKES)),
    ]
    head = answer(f"{line[:1].upper()}{line[1:]}." for line in concluded(rows))
    return page(title, head + small(f"pcnet3d {package_version()}"), sections)


def _table(rows: Sequence[Row], columns: Mapping[str, Sequence[Cell]], about: str) -> Markup:
    """The takes' names and labels, then the columns (head: a cell a take), but for empty ones; and a sentence about
    them. Nothing without takes."""
    if not rows:
        return Markup("")
    filled = {head: cells for head, cells in columns.items() if any(cell is not None for cell in cells)}
    labels = [label for label in LABELS if any(row[label] for row in rows)]
    names = [Link(name_of(row), quote(row["report"])) if row.get("report") else name_of(row) for row in rows]
    lines = [
        [names[i], *(row[label] or None for label in labels), *(cells[i] for cells in filled.values())]
        for i, row in enumerate(rows)
    ]
    return table(["take", *labels, *filled], lines, sortable=True) + small(about)


def _columns(rows: Sequence[Row]) -> dict[str, list[Cell]]:
    return {
        "frames": [row.get("frames") for row in rows],
        "duration (s)": _written(rows, "duration_s", "{:.1f}".format),
        "poses": [POSES_ARE.get(row.get("judgement", "")) for row in rows],
        "levelled": [_LEVELLED[row.get("level_ok")] for row in rows],
        "errors of angles": [ERRORS_OF_ANGLES.get(row.get("angle_errors", "")) for row in rows],
        "up known to within (°, 90 %)": _written(rows, "up_bound_deg", bound_in_words),
        "warnings": [sum(each["weight"] in WARNS for each in row.get("notices", ())) for row in rows],
    }


def _written(rows: Sequence[Row], name: str, in_words: Callable[[float], str]) -> list[Cell]:
    return [None if row.get(name) is None else Number(in_words(row[name])) for row in rows]
