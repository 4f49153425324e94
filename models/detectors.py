"""Opens networks that find people's joints in pictures; the kind is told by the network's inputs and outputs."""

from __future__ import annotations

from pathlib import Path

from ..pipeline.errors import InputError
from .detection import Detector, Found
from .movenet import MoveNet, MultiMoveNet
from .onnx_file import OnnxFile, open_onnx

__all__ = ["Detector", "Found", "load_detector"]

_WHAT = "a network that finds joints in pictures"


def load_detector(detector: str | Path) -> Detector:
    """The detector in an .onnx file.

    Known are MoveNet (one person, or up to six). InputError when there is no such file or it is of another kind.
    """
    network = open_onnx(detector, _WHAT)
    opened = _recognised(network)
    if opened is None:
        raise InputError(
            f"{network.path} is no network that finds joints in pictures: expected MoveNet, got {network.looks}."
        )
    return opened


def _recognised(network: OnnxFile) -> Detector | None:
    if len(network.inputs) != 1:
        return None
    (image,), outputs = network.inputs.values(), tuple(network.outputs.values())
    if len(image) == 4 and image[3] == 3 and len(outputs) == 1:
        if outputs[0] in ((1, 1, 17, 3), (None, 1, 17, 3)):
            return MoveNet(network)
        if outputs[0] in ((1, 6, 56), (None, 6, 56)):
            return MultiMoveNet(network)
    return None
