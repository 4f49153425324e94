"""A rectifier by its name or file."""

from __future__ import annotations

from pathlib import Path

from ...pipeline.errors import InputError
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.plugins.protocols import Rectifier
from .geometric import Geometric

_WEIGHTS = {"pcnet": "pcnet.onnx", "paper": "paper.onnx"}


def load_rectifier(name: str) -> Rectifier:
    """A rectifier by name: "geometric"; "pcnet", the shipped network; "paper", the paper's at its full size; or the
    one in an .onnx file.

    InputError naming the known ones for anything else.
    """
    if name == "geometric":
        return Geometric()
    if name not in _WEIGHTS and not name.endswith(".onnx"):
        raise InputError(
            f"There is no rectifier '{name}'; {did_you_mean(name, ('geometric', *_WEIGHTS))} A trained network of "
            "yours is given as its .onnx file."
        )
    from .onnx import PCNetRectifier

    return PCNetRectifier(Path(__file__).parent / _WEIGHTS[name] if name in _WEIGHTS else name)
