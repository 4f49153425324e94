"""The built-in files on request, registered by name in pyproject.toml as those of any other package are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...pipeline.files.markers import check_c3d
from ...pipeline.take import Take
from .c3d import write_c3d
from .netcdf import write_netcdf
from .opensim import write_mot, write_trc
from .tables import write_csv


@dataclass(frozen=True)
class _Format:
    """A pipeline.plugins.protocols.CheckedWriter."""

    file: str
    what: str
    write: Callable[[Take, Path], None]
    check: Callable[[], None] = lambda: None


CSV = _Format("kinematics.csv", "the columns of kinematics.parquet as text", write_csv)
TRC = _Format("markers.trc", "joints as markers for OpenSim; needs metres", write_trc)
MOT = _Format("angles.mot", "joint angles for OpenSim", write_mot)
C3D = _Format("markers.c3d", "joints as points, with pcnet3d[c3d]; needs metres", write_c3d, check_c3d)
NETCDF = _Format("poses.nc", "poses for the package movement and xarray", write_netcdf)
