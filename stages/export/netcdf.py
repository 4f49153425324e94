"""poses.nc: LEVEL in the layout of the package `movement`, as a netCDF file that it and xarray open."""

from __future__ import annotations

import json
from pathlib import Path

from ...pipeline.core.errors import needed_for
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ..drawing.provenance import provenance


def check_xarray() -> None:
    """InputError when xarray is not installed."""
    with needed_for("netCDF", "xarray"):
        import xarray  # noqa: F401  # which Take.to_xarray needs


def write_netcdf(take: Take, path: Path) -> None:
    """What `Take.to_xarray` holds, unfiltered."""
    level = take.need("rectified").level
    said = json.dumps(provenance(take, level.frame, level.history))
    content = take.to_xarray().assign_attrs(provenance=said)
    with whole_file(path) as partial:
        content.to_netcdf(partial, engine="scipy", format="NETCDF3_64BIT")
