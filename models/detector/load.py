"""Opens networks that find people's joints in images, whose kind is told by their inputs and outputs; or a function of
the user's own: an RGB image (H, W, 3) uint8 -> keypoints of everybody (people, K, 3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import COCO17, Layout
from ...pipeline.core.rotations import is_finite
from ...pipeline.plugins.registry import open_model
from ...pipeline.reading.given import layout_in_2d
from ..common.function import answer_of, failed, name_of
from ..common.onnx import open_onnx
from .networks import Follower, MoveNet, PersonBoxes, SimCC, TopDown
from .protocols import CropNetwork, Detector, Found

_USUAL_PERSONS = "yolox"


class FunctionDetector:
    """A Detector (protocols.py) whose `people` asks the function.

    function: image (H, W, 3) uint8 RGB -> (people, K, 3): x and y in pixels of the image, and a score in [0, 1]; a
        joint that is NaN or at 0, 0 was not found. None or an empty list where nobody is. Also torch tensors and lists.
    joints: a layout by name; without it the usual one of K joints, of a body with face and hands its first joints.
    """

    def __init__(self, function: Callable[..., Any], joints: str | None = None) -> None:
        self._function, self._joints = function, joints
        self._count: int | None = None  # of joints, which the first person tells
        self.method = f"{name_of(function)} (a function)"
        self.layout: Layout = COCO17

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says. InputError where the function raises, or answers something else."""
        points = answer_of("detect", self._function, "keypoints", image)
        if points.ndim and not len(points):
            return ()
        if points.ndim != 3 or points.shape[2] != 3 or self._count not in (None, points.shape[1]):
            expected = f"expected the shape (people, {self._count or 'K'}, 3), got {points.shape}."
            raise failed("detect", self._function, expected)
        if self._count is None:
            try:
                self.layout = layout_in_2d(points.shape[1], self._joints, "its keypoints")
            except InputError as error:
                raise failed("detect", self._function, str(error)) from None
            self._count = points.shape[1]
        people = (_found(person) for person in points[:, : len(self.layout)])
        return tuple(person for person in people if person is not None)


def _found(points: np.ndarray) -> Found | None:
    """One person of keypoints (K, 3); None where there is no joint."""
    visible = np.asarray(is_finite(points[:, :2])) & points[:, :2].any(axis=-1)
    if not visible.any():
        return None
    score = np.where(visible, np.clip(np.nan_to_num(points[:, 2]), 0, 1), 0)
    low, high = points[visible, :2].min(axis=0), points[visible, :2].max(axis=0)
    xy = np.where(visible[:, None], points[:, :2], (low + high) / 2)  # what has no score counts for nothing
    return Found(xy, score, np.concatenate([low, high]), float(score[visible].mean()))


def load_detector(
    detector: str | Path | Callable[..., Any],
    person_detector: str | Path | None = None,
    looks: int | None = 1,
    everybody: bool = False,
    joints: str | None = None,
) -> Detector:
    """The detector of a name of `pcnet3d list models`, downloaded if need be, or the one in an .onnx file; or one that
    is a function, whose joints are in that layout, if their number does not tell.

    Files may hold MoveNet, and RTMPose and other SimCC networks, which look at a single person: they follow one through
    the images, or get everybody's box from `person_detector`, a name or the .onnx file of a YOLOX. everybody: get the
    boxes from YOLOX where no other is named. looks: at every person that such a network looks at, 1 or 2
    (networks.looked_twice); None for 2. InputError when there is no such name or file, or it is of another kind.
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
