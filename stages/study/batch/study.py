"""The study's table: a row for every take, and for every person of a take."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ....models.angle_error.repeatability import figure_of
from ....models.common.metrics import plain
from ....pipeline.core.errors import InputError
from ....pipeline.core.figures import OF_LENGTH
from ....pipeline.core.measures import Measure, nested
from ....pipeline.core.messages import how_many
from ....pipeline.core.take import Take
from ....pipeline.files.atomic import REPORT, SUMMARY, printable, read_summary, whole_file, write_rows
from ....pipeline.files.finished import read_run
from ....pipeline.files.names import POSES
from ....pipeline.signals.checks import bone_spread
from ...drawing.facts import mean

QUALITY = ("up_error_deg", "up_bound_deg", "error_deg_mean", "bone_length_spread")
_COUNTS = ("count", "steps")  # of movements, which the page shows beside the figures that have errors
# Of a notice.
_SAID = ("code", "weight", "about", "text")

# Of study.parquet, whose other columns are numbers, each measure's among them.
_COLUMNS = (
    "name", "subject", "visit", "condition", "person", "state", "exit_code", "code", "reason", "report", "notices",
    "verdict", "frames", "fps", "duration_s", "unit", "method", "angle_errors", "device",
    "level_ok", "level_reason", *QUALITY,
)  # fmt: skip
_NUMBERS = ("fps", "duration_s", *QUALITY)


def figures(folder: Path) -> tuple[dict[str, Any], ...]:
    """What the table says of a take's folder, a row for each person who has a run in it. numbers: all single numbers by
    their keys, as in summary.json. What `write_table` has not: measures, by `place`, those that the page shows.
    InputError when a file is not as a run writes it."""
    people = [path.parent for path in sorted(folder.glob(f"*/{SUMMARY}")) if (path.parent / POSES).exists()]
    return tuple(_figures(run, run.relative_to(folder.parent.parent)) for run in people or [folder])


def _figures(folder: Path, place: Path) -> dict[str, Any]:
    """place: of the folder, seen from the study's page."""
    device = read_summary(folder).get("device")
    networks = device.get("networks") if isinstance(device, dict) else None
    row = {
        "person": printable(folder.name) if len(place.parts) > 2 else "",
        "report": printable((place / REPORT).as_posix()) if (folder / REPORT).exists() else "",
        "device": printable(", ".join(sorted({*map(str, networks.values())})))
        if isinstance(networks, dict)
        else "",
    }
    if not (folder / POSES).exists():
        return row
    try:
        take = read_run(folder)
    except InputError as error:
        raise InputError(error.code, f"{str(error).rstrip('.')}: remove that folder first.") from None
    return {**plain(_of_take(take)), "measures": _shown(take), **row}


def _of_take(take: Take) -> dict[str, Any]:
    poses, rectified = take.need("poses"), take.need("rectified")
    rows = rectified.turned if rectified.camera == "moving" else slice(None)
    return {
        "notices": [{part: printable(getattr(each, part)) for part in _SAID} for each in take.said],
        "verdict": take.verdict or "",
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


def _numbers(group: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, float]]:
    """The single figures, their keys joined by dots as in measures.csv; lists and words are left out."""
    for key, value in group.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{above}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{above}{key}", float(value)


def _shown(take: Take) -> dict[str, Measure]:
    """The take's figures that takes are compared by, and its counts, by place, but no length without a scale."""
    metric = take.need("poses").frame.metric
    return {
        place(row): row
        for row in take.figures
        if isinstance(row, Measure)
        and (figure_of(row, "walking") or (row.name in _COUNTS and row.number is None))
        and (metric or row.unit not in OF_LENGTH)
    }


def place(measure: Measure) -> str:
    """Its groups and its name: `walking.cadence`."""
    return ".".join((*measure.group, measure.name))


def doubts(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Finished runs by what is not to be believed of them, such as "with unusable poses", or by why it cannot be told;
    rows: as of `study_rows`, one for each person of a take."""
    runs = {
        f"with {weight} poses": [row for row in rows if row.get("verdict") == weight]
        for weight in ("suspicious", "unusable")
    }
    runs["not levelled"] = [row for row in rows if row.get("level_ok") is False]
    # Without the stage `export` a run's summary has no figures.
    runs["that cannot be judged"] = [row for row in rows if row.get("level_ok") is None]
    return {what: doubtful for what, doubtful in runs.items() if doubtful}


def concluded(rows: Sequence[Mapping[str, Any]], before: int | None = None) -> Iterator[str]:
    """How many takes are done, `before` of them by an earlier batch, and how far their runs can be trusted; rows: as of
    `study_rows`."""
    done = [row for row in rows if row["state"] == "done"]
    names = {row["name"] for row in done}
    kept = "" if before is None else f" ({before} of them before)"
    yield f"{how_many(len(names), 'take')} done{kept}, {len({row['name'] for row in rows} - names)} failed"
    if done:
        doubtful = ", ".join(f"{len(runs)} {what}" for what, runs in doubts(done).items())
        yield f"of {how_many(len(done), 'run')}: {doubtful or 'no doubts about poses or levelling'}"


def name_of(row: Mapping[str, Any]) -> str:
    """A take's name, and the person's where it shows several."""
    return f"{row['name']}, {row['person']}" if row.get("person") else row["name"]


def write_table(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
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
