"""A loader for the package movement (0.17 or later), whose load_dataset then opens finished runs, and every file of
poses that pcnet3d reads, upright:

import pcnet3d.examples.movement_loader
from movement.io import load_dataset

run = load_dataset("results", source_software="pcnet3d")
lifted = load_dataset("X3D.npy", source_software="pcnet3d", fps=30, stature=1.75)
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import xarray
from movement.io.load import register_loader
from movement.validators.datasets import ValidPosesInputs

import pcnet3d


@register_loader("pcnet3d")  # type: ignore[arg-type]  # movement's type lists its own loaders alone
def from_pcnet3d(file: Path | str, fps: float | None = None, **options: Any) -> xarray.Dataset:
    """The joints in LEVEL as movement has them. file: the folder of a run, or poses; fps, options: of pcnet3d.process,
    for poses."""
    path = Path(file)
    take = pcnet3d.read_run(path) if path.is_dir() else pcnet3d.process(poses=path, fps=fps, **options)
    data = take.to_xarray()
    ValidPosesInputs.validate(data)
    return data
