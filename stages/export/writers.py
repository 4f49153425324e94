"""The built-in files on request, registered by name in pyproject.toml as those of any other package are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...pipeline.core.notices import Notice
from ...pipeline.files.markers import check_c3d
from .animation import write_bvh, write_glb
from .annotated import write_annotated
from .markers import write_c3d, write_mot, write_trc
from .netcdf import check_xarray, write_netcdf
from .tables import write_csv


@dataclass(frozen=True)
class _Format:
    """A pipeline.plugins.protocols.Writer with all that one may have."""

    file: str
    what: str
    write: Callable[..., Sequence[Notice] | None]
    check: Callable[[], None] = lambda: None
    images: bool = False
    metric: bool = False
    bones: bool = False


CSV = _Format("kinematics.csv", "the columns of kinematics.parquet as text", write_csv)
TRC = _Format("markers.trc", "joints as markers for OpenSim; needs metres", write_trc, metric=True)
MOT = _Format("angles.mot", "joint angles for OpenSim", write_mot)
C3D = _Format(
    "markers.c3d", "joints as points, with pcnet3d[c3d]; needs metres", write_c3d, check_c3d, metric=True
)
NETCDF = _Format(
    "poses.nc", "poses for the package movement, with pcnet3d[xarray]", write_netcdf, check_xarray
)
BVH = _Format("skeleton.bvh", "animated skeleton for animation programs", write_bvh, bones=True)
GLB = _Format("skeleton.glb", "animated skeleton for viewers and game engines", write_glb, bones=True)
MP4 = _Format(
    "annotated.mp4",
    "the video with keypoints, horizon and upright skeleton",
    write_annotated,
    images=True,
)
