"""A small model of OpenSim of our own making: pelvis, legs, trunk and arms, of rigid bodies without muscles."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

# Each body: what it hangs on, where in that (metres, x forward, y up, z right), and the axes of its coordinates.
_MIDDLE = {
    "pelvis": ("", (0, 0.95, 0), {"pelvis_tilt": "z", "pelvis_list": "x", "pelvis_rotation": "y"}),
    "torso": ("pelvis", (0, 0.1, 0), {"lumbar_extension": "z", "lumbar_bending": "x", "lumbar_rotation": "y"}),
}  # fmt: skip
_SIDES = {
    "femur": ("pelvis", (0, -0.07, 0.09), {"hip_flexion": "z", "hip_adduction": "x", "hip_rotation": "y"}),
    "tibia": ("femur", (0, -0.4, 0), {"knee_angle": "-z"}),
    "talus": ("tibia", (0, -0.41, 0), {"ankle_angle": "z"}),
    "calcn": ("talus", (-0.05, -0.04, 0), {}),
    "toes": ("calcn", (0.18, 0, 0), {"mtp_angle": "z"}),
    "humerus": ("torso", (0, 0.36, 0.17), {"arm_flex": "z", "arm_add": "x", "arm_rot": "y"}),
    "ulna": ("humerus", (0, -0.29, 0), {"elbow_flex": "z"}),
    "radius": ("ulna", (0, -0.01, 0), {"pro_sup": "y"}),
    "hand": ("radius", (0, -0.24, 0), {"wrist_flex": "z"}),
}  # fmt: skip

_Z_ALONG = {"z": (0, 0, 0), "-z": (math.pi, 0, 0), "y": (-math.pi / 2, 0, 0)}  # angles about x, y and z


def small_model() -> Any:
    """opensim.Model in metres, standing."""
    import opensim

    model = opensim.Model()
    model.setName("small")
    for body, (parent, place, turns) in _MIDDLE.items():
        _hang(opensim, model, body, parent, place, turns, "")
    for side, across in (("r", 1), ("l", -1)):
        for body, (parent, (x, y, z), turns) in _SIDES.items():
            of = parent if parent in _MIDDLE else f"{parent}_{side}"
            _hang(opensim, model, f"{body}_{side}", of, (x, y, across * z), turns, f"_{side}")
    model.finalizeConnections()
    return model


def write_small_model(folder: Path) -> Path:
    path = folder / "small.osim"
    small_model().printToXML(str(path))
    return path


def _hang(
    opensim: Any, model: Any, name: str, parent: str, place: tuple, turns: dict[str, str], end: str
) -> None:
    body = opensim.Body(name, 1.0, opensim.Vec3(0), opensim.Inertia(0.01, 0.01, 0.01))
    model.addBody(body)
    of, zero = model.getBodySet().get(parent) if parent else model.getGround(), opensim.Vec3(0)
    if not turns:
        model.addJoint(opensim.WeldJoint(f"{name}_joint", of, opensim.Vec3(*place), zero, body, zero, zero))
        return
    if len(turns) == 1:  # about the joint's z
        [(coordinate, axis)] = turns.items()
        turned = opensim.Vec3(*_Z_ALONG[axis])
        joint = opensim.PinJoint(f"{name}_joint", of, opensim.Vec3(*place), turned, body, zero, turned)
        joint.updCoordinate().setName(coordinate + end)
        model.addJoint(joint)
        return
    transform = opensim.SpatialTransform()
    rows = [("rotation", coordinate + end, axis) for coordinate, axis in turns.items()]
    if not parent:
        rows += [("translation", f"pelvis_t{axis}", axis) for axis in "xyz"]
    for number, (kind, coordinate, axis) in enumerate(rows):
        along = getattr(transform, f"upd_{kind}{number % 3 + 1}")()
        along.setCoordinateNames(opensim.ArrayStr(coordinate, 1))
        along.setAxis(opensim.Vec3(*(float(axis == each) for each in "xyz")))
        along.set_function(opensim.LinearFunction(1, 0))
    model.addJoint(
        opensim.CustomJoint(f"{name}_joint", of, opensim.Vec3(*place), zero, body, zero, zero, transform)
    )
