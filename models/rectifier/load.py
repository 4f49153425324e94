"""A rectifier by its name or file."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from ...pipeline.core.device import Placement, placement
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.plugins.registry import open_model


def load_rectifier(name: str | Path) -> Rectifier:
    """A rectifier by name, one of `pcnet3d list models`: "geometric"; "pcnet", the default; "paper", of the published
    size; or another package's. Or the network in an .onnx file.

    InputError naming the nearest ones for an unknown name, and for a file that holds no rectifier.
    """
    opened = open_model("rectifiers", name)
    return _network(opened, placement()) if isinstance(opened, Path) else opened


@lru_cache(maxsize=8)  # several stages ask the same network
def _network(file: Path, where: Placement) -> Rectifier:
    from .onnx import PCNetRectifier

    return PCNetRectifier(file)
