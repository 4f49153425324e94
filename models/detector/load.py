"""Opens networks that find people's joints in images; the kind is told by the network's inputs and outputs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...pipeline.core.errors import InputError
from ...pipeline.plugins.registry import open_model
from ..common.onnx import OnnxFile, open_onnx
from .function import FunctionDetector
from .looks import MOST_LOOKS
from .movenet import MoveNet, MultiMoveNet
from .protocols import CropNetwork, Detector, Found, PersonNetwork
from .rtmpose import SimCC
from .topdown import Follower, TopDown
from .yolox import PersonBoxes

__all__ = ["Detector", "Found", "load_detector"]

_USUAL_PERSONS = "yolox"
_USUAL_LOOKS = 2  # twice the time, and most of what four gain


def load_detector(
    detector: str | Path | Callable[..., Any],
    person_detector: str | Path | None = None,
    looks: int | None = 1,
    everybody: bool = False,
    joints: str | None = None,
) -> Detector:
    """The detector of a name of `pcnet3d list models`, downloaded if need be, or the one in an .onnx file; or one that
    is a function (function.py), whose joints are in that layout, if their number does not tell.

    Files may hold MoveNet (one person, or up to six), and RTMPose and other SimCC networks. One that looks at a single
    person follows it through the images, or gets everybody's box from `person_detector`, a name or the .onnx file of a
    YOLOX. everybody: get the boxes from YOLOX where no other is named. looks: at every person that such a network looks
    at, 1 to 4 (looks.py); None for 2, or 1 where the network finds people by itself. InputError when there is no such
    name or file, or it is of another kind.
    """
    if looks is not None and not 1 <= looks <= MOST_LOOKS:
        raise InputError(
            "bad-value", f"Expected 1 to {MOST_LOOKS} looks at a person, got --set detect.looks={looks}."
        )
    if joints is not None and isinstance(detector, str | Path):
        raise InputError("option-conflict", "The detector knows its joints; leave --set detect.joints out.")
    if isinstance(detector, str | Path):
        opened, name = open_model("detectors", detector), f"The detector '{detector}'"
    else:
        opened = FunctionDetector(detector, joints)
        name = f"The function {opened.method}"
    if isinstance(opened, Path):
        path, what = opened, "a network that finds joints in images"
        network = open_onnx(path, what)
        opened, name = _joints(network), str(network.path)
        if isinstance(opened, MoveNet):
            # What MoveNet of 8-bit weights answers depends on the number of threads; one is as fast.
            opened = MoveNet(open_onnx(path, what, threads=1))
        if opened is None:
            raise InputError(
                "wrong-network",
                f"{name} is not a network that finds joints in images: expected MoveNet or SimCC outputs, got "
                f"{network.looks}.",
            )
        if not isinstance(opened, MultiMoveNet):
            count = _USUAL_LOOKS if looks is None else looks
            if person_detector is None and not everybody:
                return Follower(opened, count)
            return TopDown(opened, _persons(person_detector or _USUAL_PERSONS), count)
    if person_detector is not None:
        raise InputError(
            "option-conflict", f"{name} finds people by itself; leave --set detect.person_detector out."
        )
    if looks is not None and looks > 1:
        raise InputError(
            "option-conflict", f"{name} looks at all people at once; leave --set detect.looks={looks} out."
        )
    return opened


def _joints(network: OnnxFile) -> CropNetwork | MultiMoveNet | None:
    if len(network.inputs) != 1:
        return None
    (image,) = network.inputs.values()
    outputs = [shape[1:] for shape in network.outputs.values()]
    if len(image) != 4:
        return None
    if image[1] == 3 and {"simcc_x", "simcc_y"} <= network.outputs.keys():
        return SimCC(network)
    if image[3] == 3 and outputs == [(1, 17, 3)]:
        return MoveNet(network)
    if image[3] == 3 and outputs == [(6, 56)]:
        return MultiMoveNet(network)
    return None


def _persons(name: str | Path) -> PersonNetwork:
    opened = open_model("person_detectors", name)
    if not isinstance(opened, Path):
        return opened
    network = open_onnx(opened, "a network that finds people")
    if len(network.inputs) != 1:
        raise InputError(
            "wrong-network", f"{network.path} is not a network that finds people: {network.looks}."
        )
    return PersonBoxes(network)
