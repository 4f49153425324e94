"""The built-in files on request, registered by name in pyproject.toml as those of any other package are."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from ...pipeline.core.errors import needed_for
from ...pipeline.core.notices import Notice
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ..drawing.facts import provenance
from .animation import write_bvh, write_glb
from .annotated import write_annotated
from .markers import write_c3d, write_mot, write_trc
from .tables import write_csv


def write_netcdf(take: Take, path: Path) -> None:
    """poses.nc: what `Take.to_xarray` holds, LEVEL unfiltered, as a netCDF file that movement and xarray open."""
    level = take.need("rectified").level
    said = json.dumps(provenance(take, level.frame, level.history))
    content = take.to_xarray().assign_attrs(provenance=said)
    with whole_file(path) as partial:
        content.to_netcdf(partial, engine="scipy", format="NETCDF3_64BIT")


@dataclass(frozen=True)
class _Format:
    """A pipeline.plugins.protocols.Writer with all that one may have. package: what it needs, of an extra."""

    file: str
    what: str
    write: Callable[..., Sequence[Notice] | None]
    package: str = ""
    extra: str = ""
    images: bool = False
    metric: bool = False
    bones: bool = False

    def check(self) -> None:
        """InputError when its package is not installed."""
        if self.package:
            with needed_for(self.file, self.extra):
                import_module(self.package)


CSV = _Format("kinematics.csv", "the columns of kinematics.parquet as text", write_csv)
TRC = _Format("markers.trc", "joints as markers for OpenSim; needs metres", write_trc, metric=True)
MOT = _Format("angles.mot", "joint angles for OpenSim", write_mot)
C3D = _Format(
    "markers.c3d", "joints as points, with pcnet3d[c3d]; needs metres", write_c3d, "ezc3d", "c3d", metric=True
)
NETCDF = _Format(
    "poses.nc", "poses for the package movement, with pcnet3d[xarray]", write_netcdf, "xarray", "xarray"
)
BVH = _Format("skeleton.bvh", "animated skeleton for animation programs", write_bvh, bones=True)
GLB = _Format("skeleton.glb", "animated skeleton for viewers and game engines", write_glb, bones=True)
MP4 = _Format(
    "annotated.mp4",
    "the video with keypoints, horizon and upright skeleton",
    write_annotated,
    images=True,
)
