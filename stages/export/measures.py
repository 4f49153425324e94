"""measures.csv and measures.parquet: the take's figures as one tidy table, a row for each; and strides.csv: every
stride and repetition."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import UNITS, Curves, Group, Moments, Remark, grouped, moments
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file, write_rows
from ...pipeline.files.measures import Row
from .provenance import provenance
from .strides import columns_of, stride_rows


def write_measures(take: Take, path: Path) -> None:
    """measures.csv: a line with the names of Row's fields, then a line a figure. A take without measures
    has none but the first line."""
    write_rows(path, Row._fields, rows(take))


def write_strides(take: Take, path: Path) -> None:
    """strides.csv: the same with the columns of `stride_rows` 101 lines a stride or
    repetition."""
    lines = (tuple("" if value != value else value for value in row.values()) for row in stride_rows(take))
    write_rows(path, columns_of(take), lines)


def write_measures_parquet(take: Take, path: Path) -> None:
    """measures.parquet: the same columns, missing is null; the schema's metadata are the provenance. InputError for a
    take without measures."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if take.measures is None:
        raise InputError(
            "needs-stage", "A table of measures needs them; put the stage 'measures' before 'export'."
        )
    kinds = dict.fromkeys(Row._fields, pa.float64()) | {"item": pa.int32()}
    kinds |= dict.fromkeys(("measure", "side", "unit", "text"), pa.string())
    table = pa.Table.from_pylist([row._asdict() for row in rows(take)], pa.schema(kinds, provenance(take)))
    with whole_file(path) as partial, open(partial, "wb") as file:
        pq.write_table(table, file)


def rows(take: Take) -> Iterator[Row]:
    """The take's figures in the order of summary.json, without its curves. A figure's error stands beside it and has no
    row of its own."""
    length = take.need("poses").frame.unit
    yield from _rows(grouped(take.measures or ()), (), length)


def _rows(group: Group, above: tuple[str, ...], length: str) -> Iterator[Row]:
    starts, stops = (moments(group, end) or moments(group, f"stride_{end}") for end in ("start", "stop"))
    for name, leaf in group.items():
        if isinstance(leaf, dict):
            yield from _rows(leaf, (*above, name), length)
        elif isinstance(leaf, Remark):
            yield _said(".".join((*above, leaf.key)), leaf.side, leaf.text)
        elif isinstance(leaf, Moments):
            for i, at_s in enumerate(leaf.at_s):
                spans = _span(starts, stops, i) if len(leaf.at_s) == len(starts) else (None, None)
                yield Row(
                    ".".join((*above, leaf.key)), leaf.side or None, i, float(at_s), None, "s", *spans, None
                )
        elif not isinstance(leaf, Curves):
            for one in leaf if isinstance(leaf, list) else [leaf]:
                span = (None, None) if one.number is None else _span(starts, stops, one.number)
                unit = UNITS[one.unit].table.format(length) or None
                figure = one.side or None, one.number, float(one.value), one.error, unit
                yield Row(".".join((*above, one.key)), *figure, *span, None)
                for name, judged in one.judged.items():
                    yield _said(".".join((*above, name)), one.side, str(judged))


def _said(measure: str, side: str, text: str) -> Row:
    return Row(measure, side or None, None, None, None, None, None, None, text)


def _span(starts: tuple[float, ...], stops: tuple[float, ...], i: int) -> tuple[float | None, float | None]:
    return (starts[i] if i < len(starts) else None), (stops[i] if i < len(stops) else None)
