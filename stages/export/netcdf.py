"""poses.nc: LEVEL in the layout of the package `movement`, as a netCDF file that it and xarray open."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ...pipeline.core.layouts import with_feet
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from .provenance import provenance


def write_netcdf(take: Take, path: Path) -> None:
    """`position` (time, space, keypoint, individual) and `confidence` (time, keypoint, individual), unfiltered.

    Names are those of movement 0.17 (its validators/datasets.py), which calls dimensions in the singular. Version 3
    of netCDF needs scipy alone; its texts are arrays of characters, which xarray joins again.
    """
    from scipy.io import netcdf_file

    level = with_feet(take.need("rectified").level)
    names = {"space": list("xyz"), "keypoint": list(level.layout.joints), "individual": [level.person]}
    with whole_file(path) as partial, netcdf_file(partial, "w", version=2) as file:
        file.createDimension("time", len(level))
        time = file.createVariable("time", "d", ("time",))
        time[:] = level.times
        for name, texts in names.items():
            encoded = [text.encode() for text in texts]
            width = max(map(len, encoded))
            file.createDimension(name, len(texts))
            file.createDimension(f"{name}_characters", width)
            coordinate = file.createVariable(name, "c", (name, f"{name}_characters"))
            coordinate[:] = np.array(encoded, dtype=f"S{width}").view("S1").reshape(len(texts), width)
            coordinate._Encoding = "utf-8"
        position = file.createVariable("position", "f", ("time", *names))
        position[:] = np.swapaxes(level.joints, 1, 2)[..., None]
        position.units = level.frame.unit
        position.axes = str(level.frame)
        confidence = file.createVariable("confidence", "f", ("time", "keypoint", "individual"))
        confidence[:] = level.confidence[..., None]
        file.ds_type = "poses"
        file.source_software = "pcnet3d"
        file.time_unit = "seconds"
        file.fps = level.fps
        file.provenance = json.dumps(provenance(take, level.frame, level.history))
