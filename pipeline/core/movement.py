"""Poses in the layout of the package `movement`.

Names are those of its version 0.17 (its validators/datasets.py), which calls dimensions in the singular.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .pose import PoseSequence

Variable = tuple[tuple[str, ...], np.ndarray, dict[str, Any]]


class Dataset(NamedTuple):
    """What xarray.Dataset takes. coordinates: by dimension. variables: dimensions, array and attributes of each.
    attributes: of the whole."""

    coordinates: dict[str, Any]
    variables: dict[str, Variable]
    attributes: dict[str, Any]


def dataset_of(poses: PoseSequence) -> Dataset:
    """`position` (time, space, keypoint, individual) and `confidence` (time, keypoint, individual) of one person.
    InputError without time stamps."""
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
    return Dataset(coordinates, variables, whole)
