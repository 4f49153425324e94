"""poses.nc: LEVEL in the layout of the package `movement`, as a netCDF file that it and xarray open."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ...pipeline.core.movement import dataset_of
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ..drawing.provenance import provenance


def write_netcdf(take: Take, path: Path) -> None:
    """The variables of `dataset_of`, unfiltered.

    Version 3 of netCDF needs scipy alone; its texts are arrays of characters, which xarray joins again.
    """
    from scipy.io import netcdf_file

    level = take.need("rectified").level
    data = dataset_of(level)
    with whole_file(path) as partial, netcdf_file(partial, "w", version=2) as file:
        for name, values in data.coordinates.items():
            file.createDimension(name, len(values))
            if name == "time":
                file.createVariable(name, "d", (name,))[:] = values
                continue
            encoded = [text.encode() for text in values]
            width = max(map(len, encoded))
            file.createDimension(f"{name}_characters", width)
            coordinate = file.createVariable(name, "c", (name, f"{name}_characters"))
            coordinate[:] = np.array(encoded, dtype=f"S{width}").view("S1").reshape(len(values), width)
            coordinate._Encoding = "utf-8"
        for name, (dimensions, values, attributes) in data.variables.items():
            variable = file.createVariable(name, "f", dimensions)
            variable[:] = values
            for attribute, value in attributes.items():
                setattr(variable, attribute, value)
        for attribute, value in data.attributes.items():
            setattr(file, attribute, value)
        file.provenance = json.dumps(provenance(take, level.frame, level.history))
