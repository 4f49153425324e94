"""Kinematics, measures and strides as tables: a row a frame, a figure, and a per cent of a stride or repetition.

kinematics.parquet and kinematics.csv have the same names of columns for every source. Degrees and seconds end the
names. Lengths are in metres, or in the source's own unit: which, says `length_unit` ("m" or "arbitrary") in the
provenance, and in the parquet file `unit` in the metadata of each column.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...pipeline.core.blocks import blocks
from ...pipeline.core.figures import UNITS
from ...pipeline.core.measures import Measure, Measures, Moments, Remark
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file, write_rows
from ...pipeline.signals.angles import ALL_ANGLES, near, unwrapped
from ...pipeline.signals.filters import around, breaks, each_path, resample
from ..drawing.facts import provenance
from ..measures.figures import POINTS
from ..trajectories import unit_of

if TYPE_CHECKING:
    import pyarrow as pa

_ROWS = 1 << 14  # written at a time
_CYCLES = 64  # whose rows are made at a time
_WITH_CYCLES = ("knee_bends", "arm_raises", "repetitions", "walking")


def write_parquet(take: Take, path: Path) -> None:
    """kinematics.parquet; its schema's metadata are the provenance, a column's has its `unit`.

    They say `horizontal: relative to the camera` when the camera moves (stages/trajectories.py).
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    parts = _parts(take, missing_is_null=False)
    first = next(parts)
    # Values of measurement hardly repeat: a dictionary of them is made in vain, and makes the file larger. The names of
    # columns are fine for use_dictionary, though pyarrow's types do not say so.
    repeated = [
        name for name, type_ in zip(first.schema.names, first.schema.types, strict=True) if type_ == pa.int8()
    ]
    # Opened here, for pyarrow takes no path whose bytes are not UTF-8.
    with (
        whole_file(path) as partial,
        open(partial, "wb") as file,
        pq.ParquetWriter(file, first.schema, use_dictionary=repeated) as table,  # type: ignore[arg-type]
    ):
        for part in chain([first], parts):
            table.write_table(part)


def write_csv(take: Take, path: Path) -> None:
    """kinematics.csv: a line of names, then the rows; commas between, a point in numbers, what is missing is empty.

    It is nothing but a table, which spreadsheets and pandas.read_csv open as it is: the provenance is in summary.json.
    The last columns say in every row what the figures mean nothing without: `length_unit`, and `horizontal` where the
    camera moves.
    """
    write_as_text(path, (_told(part) for part in _parts(take, missing_is_null=True)))


def write_as_text(path: Path, parts: Iterator[pa.Table]) -> None:
    """The rows of one table or more with the same columns as a whole CSV file, below a line of their names."""
    from pyarrow import csv

    first = next(parts)
    options = csv.WriteOptions(quoting_style="none")
    # Opened here, for the writer leaves a file that it opened itself open, and Windows renames none such.
    with (
        whole_file(path) as partial,
        open(partial, "wb") as file,
        csv.CSVWriter(file, first.schema, write_options=options) as table,
    ):
        for part in chain([first], parts):
            table.write_table(part)


def _told(part: pa.Table) -> pa.Table:
    """The table with a column of each line of provenance without which its figures mean nothing."""
    import pyarrow as pa

    metadata = {name.decode(): text.decode() for name, text in part.schema.metadata.items()}
    for name in ("length_unit", "horizontal"):
        if name in metadata:
            part = part.append_column(name, pa.array([metadata[name]] * len(part)))
    return part


def _parts(take: Take, missing_is_null: bool) -> Iterator[pa.Table]:
    """The table, some minutes of the take at a time: hours of it would stand in memory twice."""
    import pyarrow as pa

    poses = take.need("poses")
    columns = {"frame": poses.frame_index, "time_s": poses.times, **take.need("kinematics")}
    metadata, length = provenance(take), poses.frame.unit
    for rows in blocks(len(poses), _ROWS):
        arrays = [pa.array(values[rows], from_pandas=missing_is_null) for values in columns.values()]
        fields = [
            pa.field(name, array.type, metadata={"unit": unit} if (unit := unit_of(name, length)) else None)
            for name, array in zip(columns, arrays, strict=True)
        ]
        yield pa.table(arrays, schema=pa.schema(fields, metadata=metadata))


class Row(NamedTuple):
    """One figure, a line of measures.csv. measure: the keys that lead to it in summary.json, joined by dots. side:
    "right", "left" or None. item: which of a list, from 0 on; None for a single figure. value: a number, or None where
    `text` says something. error: its standard error, where it is stated. unit: "deg", "s", "%", "1/min", the take's
    unit of length or that a second, None for pure numbers. start_s, stop_s: of the repetition that the figure is of;
    None where it is of the take."""

    measure: str
    side: str | None
    item: int | None = None
    value: float | None = None
    error: float | None = None
    unit: str | None = None
    start_s: float | None = None
    stop_s: float | None = None
    text: str | None = None


def write_measures(take: Take, path: Path) -> None:
    """measures.csv: a line with the names of Row's fields, then a line a figure. A take without measures
    has none but the first line."""
    write_rows(path, Row._fields, rows(take))


def rows(take: Take) -> Iterator[Row]:
    """The take's figures in the order of summary.json, without its curves. A figure's error stands beside it and has no
    row of its own."""
    length = take.need("poses").frame.unit
    for row in take.figures:
        own = take.figures.group(*row.group)
        place, side = ".".join((*row.group, "")), row.side or None
        if isinstance(row, Remark):
            yield Row(place + row.name, side, text=row.text)
        elif isinstance(row, Moments):
            of_repetitions = len(row.at_s) == len(own.times("stride_start") or own.times("start"))
            for i, at_s in enumerate(row.at_s):
                span = _span(own, i) if of_repetitions else (None, None)
                yield Row(place + row.key, side, i, float(at_s), None, "s", *span)
        elif isinstance(row, Measure):
            span = (None, None) if row.number is None else _span(own, row.number)
            unit = UNITS[row.unit].table.format(length) or None
            yield Row(place + row.key, side, row.number, float(row.value), row.error, unit, *span)
            for name, judged in row.judged.items():
                yield Row(place + name, side, text=str(judged))


def _span(group: Measures, i: int) -> tuple[float | None, float | None]:
    """When the repetition or stride of that number began and ended."""
    starts, stops = (group.times(end) or group.times(f"stride_{end}") for end in ("start", "stop"))
    return (starts[i] if i < len(starts) else None), (stops[i] if i < len(stops) else None)


def _moving(measures: Measures) -> Iterator[Measures]:
    """The groups of strides and repetitions, in the order of summary.json."""
    for name, group in measures.groups.items():
        if measures.path or name in _WITH_CYCLES:
            yield group
            yield from _moving(group)


def write_strides(take: Take, path: Path) -> None:
    """strides.csv: a line of names, then 101 lines a stride or repetition; commas between, a point in numbers, what is
    missing is empty. A take without measures has none but the names."""
    write_as_text(path, stride_tables(take))


def stride_tables(take: Take) -> Iterator[pa.Table]:
    """A table without rows, which has the names of the columns; then some strides and repetitions each, whose rows are
    each per cent of them, 0 to 100: the time of the take, and every angle and its standard deviation in degrees, of a
    spline through the frames; null where it is missing. An angle goes on through the end of its range within one
    cycle."""
    import pyarrow as pa

    degrees = {
        f"{name}_deg": angle for name, angle in ALL_ANGLES.items() if f"{name}_deg" in take.need("kinematics")
    }
    angle_columns = [column for name in degrees for column in (name, f"{name.removesuffix('_deg')}_sd_deg")]
    kinds = {"movement": pa.string(), "side": pa.string(), "number": pa.int32(), "percent": pa.int32()}
    kinds |= {"time_s": pa.float64()} | dict.fromkeys(angle_columns, pa.float32())
    yield pa.schema(kinds).empty_table()
    if take.measures is None or take.filtered is None:
        return
    times, seams, columns = take.filtered.times, breaks(take.filtered), take.need("kinematics")
    angles = np.stack(
        [unwrapped(columns[name]) if name in degrees else columns[name] for name in angle_columns], axis=-1
    )
    for cycled, spans in ((cycled, cycled.spans) for cycled in _moving(take.measures)):
        for some in blocks(len(spans), _CYCLES):
            at_s = np.stack([np.linspace(*span, POINTS) for span in spans[some]])
            near = around(times, at_s)
            own_seams = [seam - near.start for seam in seams if near.start < seam < near.stop]
            at_percents = partial(resample, time_s=times[near], at_s=at_s.ravel(), seams=own_seams)
            curves = each_path(at_percents, angles[near].astype(np.float64), at_s.size)
            values = dict(zip(angle_columns, curves.T, strict=True))
            for name, angle in degrees.items():
                of_cycles = values[name].reshape(at_s.shape)
                values[name] = np.concatenate([_within_range(curve, angle.centre_deg) for curve in of_cycles])
            labels = {"movement": ".".join(cycled.path), "side": cycled.rows[0].side}
            rows = {name: [label] * at_s.size for name, label in labels.items()}
            rows |= {"number": np.repeat(np.arange(len(spans))[some], POINTS), "time_s": at_s.ravel()}
            rows |= {"percent": np.tile(np.arange(POINTS), len(at_s))} | values
            arrays = [pa.array(rows[name], kind, from_pandas=True) for name, kind in kinds.items()]
            yield pa.table(arrays, pa.schema(kinds))


def _within_range(curve_deg: np.ndarray, centre_deg: float) -> np.ndarray:
    """A curve (101,) moved by whole turns, so that it begins within 180 degrees of centre_deg."""
    finite = curve_deg[np.isfinite(curve_deg)]
    return curve_deg + near(finite[0], centre_deg) - finite[0] if len(finite) else curve_deg
