"""kinematics.parquet and kinematics.csv: one row a frame, and the same names of columns for every source.

Degrees and seconds end the names. Lengths are in metres, or in the source's own unit: which, says `length_unit` ("m" or
"arbitrary") in the provenance, and in the parquet file `unit` in the metadata of each column.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from ...pipeline.core.blocks import blocks
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ..drawing.provenance import provenance
from ..trajectories import unit_of

if TYPE_CHECKING:
    import pyarrow as pa

_ROWS = 1 << 14  # written at a time


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
