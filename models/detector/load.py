"""Opens networks that find people's joints in images; the kind is told by the network's inputs and outputs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...pipeline.core.errors import InputError
from ...pipeline.plugins.registry import open_model
from ..common.onnx import open_onnx
from .function import FunctionDetector
from .networks import MoveNet, PersonBoxes, SimCC
from .protocols import CropNetwork, Detector, Found
from .topdown import Follower, TopDown

__all__ = ["Detector", "Found", "load_detector"]

_USUAL_PERSONS = "yolox"


def load_detector(
    detector: str | Path | Callable[..., Any],
    person_detector: str | Path | None = None,
    looks: int | None = 1,
    everybody: bool = False,
    joints: str | None = None,
) -> Detector:
    """The detector of a name of `pcnet3d list models`, downloaded if need be, or the one in an .onnx file; or one that
    is a function (function.py), whose joints are in that layout, if their number does not tell.

    Files may hold MoveNet, and RTMPose and other SimCC networks, which look at a single person: they follow one through
    the images, or get everybody's box from `person_detector`, a name or the .onnx file of a YOLOX. everybody: get the
    boxes from YOLOX where no other is named. looks: at every person that such a network looks at, 1 or 2
    (topdown.looked_twice); None for 2. InputError when there is no such name or file, or it is of another kind.
    """
    if looks not in (None, 1, 2):
        raise InputError("bad-value", f"Expected 1 or 2 looks at a person, got --set detect.looks={looks}.")
    if joints is not None and isinstance(detector, str | Path):
        raise InputError("option-conflict", "The detector knows its joints; leave --set detect.joints out.")
    if isinstance(detector, str | Path):
        opened, name = open_model("detectors", detector), f"The detector '{detector}'"
    else:
        opened = FunctionDetector(detector, joints)
        name = f"The function {opened.method}"
    if isinstance(opened, Path):
        joints_of_one = _joints(opened)
        if person_detector is None and not everybody:
            return Follower(joints_of_one, looks != 1)
        persons = open_model("person_detectors", person_detector or _USUAL_PERSONS)
        if isinstance(persons, Path):
            persons = PersonBoxes(open_onnx(persons, "a network that finds people"))
        return TopDown(joints_of_one, persons, looks != 1)
    if person_detector is not None:
        raise InputError(
            "option-conflict", f"{name} finds people by itself; leave --set detect.person_detector out."
        )
    if looks == 2:
        raise InputError(
            "option-conflict", f"{name} looks at all people at once; leave --set detect.looks={looks} out."
        )
    return opened


def _joints(path: Path) -> CropNetwork:
    what = "a network that finds joints in images"
    network = open_onnx(path, what)
    shapes = list(network.inputs.values())
    outputs = [shape[1:] for shape in network.outputs.values()]
    if len(shapes) == 1 and len(shapes[0]) == 4:
        if shapes[0][1] == 3 and {"simcc_x", "simcc_y"} <= network.outputs.keys():
            return SimCC(network)
        if shapes[0][3] == 3 and outputs == [(1, 17, 3)]:
            # What MoveNet of 8-bit weights answers depends on the number of threads; one is as fast.
            return MoveNet(open_onnx(path, what, threads=1))
    raise InputError(
        "wrong-network",
        f"{network.path} is not {what}: expected MoveNet's outputs for one person, or SimCC's; got {network.looks}.",
    )
