"""kinematics.parquet and kinematics.csv: one row a frame, every column's unit in its name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..pipeline.outputs import whole_file
from ..pipeline.take import Take
from ._export_provenance import provenance

if TYPE_CHECKING:
    import pyarrow as pa


def write_parquet(take: Take, path: Path) -> None:
    """kinematics.parquet; its schema's metadata are the provenance.

    They say `horizontal: relative to the camera` when the camera moves (stages/trajectories.py).
    """
    import pyarrow.parquet as pq

    with whole_file(path) as partial:
        pq.write_table(_table(take, missing_is_null=False), partial)


def write_csv(take: Take, path: Path) -> None:
    """kinematics.csv: lines of provenance that begin with "# ", a line of names, the rows; what is missing is empty.

    Read it with `pandas.read_csv(path, comment="#")` or R's `read.csv(path, comment.char = "#")`.
    """
    from pyarrow import csv

    head = "".join(f"# {name}: {text}\n" for name, text in provenance(take).items())
    with whole_file(path) as partial, open(partial, "wb") as file:
        file.write(head.encode())
        csv.write_csv(_table(take, missing_is_null=True), file, csv.WriteOptions(quoting_style="none"))


def _table(take: Take, missing_is_null: bool) -> pa.Table:
    import pyarrow as pa

    assert take.poses is not None
    assert take.kinematics is not None
    columns = {"frame": take.poses.frame_index, "time_s": take.poses.times, **take.kinematics}
    arrays = {name: pa.array(values, from_pandas=missing_is_null) for name, values in columns.items()}
    return pa.table(arrays).replace_schema_metadata(provenance(take))
