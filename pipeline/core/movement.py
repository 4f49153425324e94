"""Poses in the layout of the package `movement`.

Names are those of its version 0.17 (its validators/datasets.py), which calls dimensions in the singular.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .errors import needed_for
from .pose import PoseSequence

if TYPE_CHECKING:
    import xarray


def dataset_of(poses: PoseSequence) -> xarray.Dataset:
    """`position` (time, space, keypoint, individual) and `confidence` (time, keypoint, individual) of one person.
    InputError without time stamps, and where xarray is not installed."""
    coordinates = {
        "time": poses.times, "space": list("xyz"), "keypoint": list(poses.layout.joints), "individual": [poses.person],
    }  # fmt: skip
    axes = {"units": poses.frame.unit, "axes": str(poses.frame)}
    position = np.swapaxes(poses.joints, 1, 2)[..., None]
    variables = {
        "position": (tuple(coordinates), position, axes),
        "confidence": (("time", "keypoint", "individual"), poses.confidence[..., None], {}),
    }
    whole = {"ds_type": "poses", "source_software": "pcnet3d", "time_unit": "seconds", "fps": poses.fps}
    with needed_for("to_xarray", "xarray"):
        import xarray
    return xarray.Dataset(variables, coordinates, whole)
