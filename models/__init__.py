"""Rectifiers and what makes them."""

from __future__ import annotations

from ..pipeline.errors import InputError
from ..pipeline.options import did_you_mean
from ..pipeline.sockets import Rectifier
from .geometric import Geometric

_BUILT_IN = {"geometric": Geometric}


def load_rectifier(name: str) -> Rectifier:
    """A rectifier by name, "geometric", or the one in an .onnx file. InputError naming the known ones otherwise."""
    if name.endswith(".onnx"):
        from .pcnet_onnx import PCNetRectifier

        return PCNetRectifier(name)
    if name not in _BUILT_IN:
        raise InputError(f"There is no rectifier '{name}'; {did_you_mean(name, _BUILT_IN)}")
    return _BUILT_IN[name]()
