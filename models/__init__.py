"""Rectifiers and what makes them."""

from __future__ import annotations

from pathlib import Path

from ..pipeline.errors import InputError
from ..pipeline.options import did_you_mean
from ..pipeline.sockets import Rectifier
from .geometric import Geometric

_NAMES = ("geometric", "pcnet")


def load_rectifier(name: str) -> Rectifier:
    """A rectifier by name: "geometric", or "pcnet", the shipped network; or the one in an .onnx file.

    InputError naming the known ones for anything else.
    """
    if name == "geometric":
        return Geometric()
    if name != "pcnet" and not name.endswith(".onnx"):
        raise InputError(f"There is no rectifier '{name}'; {did_you_mean(name, _NAMES)}")
    from .pcnet_onnx import PCNetRectifier

    return PCNetRectifier(Path(__file__).with_name("pcnet.onnx") if name == "pcnet" else name)
