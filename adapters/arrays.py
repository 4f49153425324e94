"""Bare arrays of 3D joints: whose meaning the caller gives in full, or (frames, 17, 3) of which a body shows it.

Without a word of the caller nothing else is read than Human3.6M's joints in a camera's axes, and only where left and
right, the lengths of the bones and what is above what agree with that: MotionBERT's output that somebody smoothed, so
that no exact zero says whose it is, or MM-Fi's ground_truth.npy.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA, FRAMES
from ..pipeline.core.layouts import COCO17, H36M17, MPI3DHP17, layout_named
from ..pipeline.core.notices import notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import keys, load, peek, plain_array
from ..pipeline.reading.joint_order import MISFIT, misfit, other_order
from ..pipeline.signals.checks import chirality
from .kit import lifters
from .kit.world import Maker, maker, upright

name = "arrays"
gives = "poses"
reads = "any .npy or .npz of (frames, joints, 3), with options layout, frame, unit and, for an .npz, key"

_HOW = (
    "say what it holds with --adapter arrays -O layout=H36M17 -O frame=CAMERA -O unit=m, or whichever layout, axes and "
    "unit it has"
)
_BESIDE = ("confidence", "time_s", "frame_index")
# LEVEL and BODY are what rectification makes, IMAGE is 2D.
_FRAMES = {key: frame for key, frame in FRAMES.items() if frame.family in ("camera", "world")}
_TALL = (1.2, 2.3)  # metres
_BEFORE_M = 0.5  # metres from a camera, nearer than which nobody is seen whole
_MILLIMETRES = (500.0, 2600.0)
_UPRIGHT = 0.5  # cosine of trunk and legs to the vertical in the usual frame


def sniff(path: Path) -> bool:
    """Only of arrays that no lifter's adapter knows, and that show a body in a camera's axes."""
    joints = peek(path, lifters.FRAMES)
    return joints is not None and name in lifters.lifters_of(joints) and not why_no_body(joints)


def lacks(path: Path) -> str:
    """Why an array is not read for what its body shows, and how it is read; "" for anything else. Never raises."""
    if path.suffix not in (".npy", ".npz"):
        return ""
    joints = peek(path, lifters.FRAMES)
    reason = "it is not (frames, 17, 3)" if joints is None else why_no_body(joints)
    return f"{reason}; {_HOW}"


def read(
    path: Path,
    layout: str | None = None,
    frame: str | None = None,
    unit: str | None = None,
    key: str | None = None,
    made_by: Maker | None = None,
) -> tuple[PoseSequence]:
    """The one person of the file, in the layout, frame and unit that the caller names.

    layout: a joint layout by name, such as "H36M17" or "COCO17".
    frame: the axes by name: "CAMERA", "GL_CAMERA", "PC_CAMERA", "Z_UP" or "Y_UP".
    unit: "m", "mm", "cm", "inch", "px" or "arbitrary".
    key: which array of an .npz holds the joints; may be left out where only one can.
    made_by: "measured" or "estimated"; without it poses in a camera's axes are taken for an estimator's, and of those
    in a world's nobody knows how well they stand.
    Without layout, frame and unit (frames, 17, 3) is read for what the body shows, and a notice says so. Camera axes
    may have their origin anywhere; the reader subtracts the pelvis. An .npz may also hold `confidence` (frames,
    joints), `time_s` (frames,) and `frame_index` (frames,), whole numbers from 0.
    Raises InputError for unknown names, for arrays of another shape, and when several could be the joints.
    """
    meaning = {"layout": layout, "frame": frame, "unit": unit}
    if missing := [option for option, value in meaning.items() if value is None]:
        if len(missing) < len(meaning) or keys(path):
            raise InputError("needs-input", f"Adapter 'arrays' needs the options {', '.join(missing)}, too.")
        return (_judged(path),)
    joint_layout, axes = layout_named(str(layout)), _FRAMES.get(str(frame).upper())
    if axes is None:
        raise InputError("bad-value", f"Expected a frame of {', '.join(_FRAMES)}; got '{frame}'.")
    axes = replace(axes, unit=str(unit), origin="camera" if axes.family == "camera" else axes.origin)
    held = keys(path)
    could_be = [name for name in held if name not in _BESIDE]
    if key is None and held and len(could_be) != 1:
        raise InputError(
            "choose-entry",
            f"{path} holds the arrays {', '.join(held)}; name the joints with key=NAME (--option key=NAME).",
        )
    key = key or next(iter(could_be), None)
    joints = plain_array(path, ("frames", len(joint_layout), 3), key=key)
    shapes = {"confidence": joints.shape[:2], "time_s": joints.shape[:1], "frame_index": joints.shape[:1]}
    beside: dict[str, Any] = {part: load(path, shapes[part], key=part) for part in _BESIDE if part in held}
    index = beside.get("frame_index")
    if index is not None and (index != np.floor(index)).any():
        raise InputError(
            "wrong-content",
            f"{path}, array 'frame_index': expected whole numbers of video frames, got fractions.",
        )
    return (PoseSequence(joints=joints, layout=joint_layout, frame=axes, made_by=maker(made_by), **beside),)


def _judged(path: Path) -> PoseSequence:
    joints = plain_array(path, lifters.FRAMES)
    if why := why_no_body(joints, sides=False):
        raise InputError(
            "wrong-axes",
            f"{path}: expected Human3.6M's joints in camera axes, as nothing else is said of it, but {why}; {_HOW}.",
        )
    unit = _unit_from_camera(joints)
    poses = lifters.in_camera(joints, frame=CAMERA.with_(origin="camera", unit=unit or "arbitrary"))
    return poses.saying(
        notice("array-judged", unit=f"{unit} from the camera" if unit else "a unit of its own")
    )


def _unit_from_camera(joints: np.ndarray) -> str:
    """The unit of joints (T, 17, 3) of an adult who is in front of the camera throughout; "" for any others, for a
    lifter's own units, or its metres about the pelvis, have the size of metres too."""
    tall, nearest = lifters.stature_of(joints), np.nanmin(joints[..., 2])
    units = {"m": 1.0, "mm": 1e-3}
    return next(
        (u for u, m in units.items() if _TALL[0] < tall * m < _TALL[1] and nearest * m > _BEFORE_M), ""
    )


def why_no_body(joints: np.ndarray, sides: bool = True) -> str:
    """What contradicts that joints (T, 17, 3) are Human3.6M's in camera axes; "" where nothing does. sides: whether
    left and right count, which are looked at in what was read, too."""
    whole = joints[np.isfinite(joints).all(axis=(1, 2)) & (np.ptp(joints, axis=(1, 2)) > 0)].astype(
        np.float64
    )
    if not len(whole):
        return "no frame has all joints"
    if other := other_order(whole, H36M17, (COCO17, MPI3DHP17)):
        return f"the lengths of its bones are those of a body in the order of {other.name}"
    if misfit(whole, H36M17) > MISFIT:
        return "the lengths of its bones are not those of a body in that order"
    tall = lifters.stature_of(whole)
    if _MILLIMETRES[0] < tall < _MILLIMETRES[1] and not _unit_from_camera(joints):
        return f"a body in it measures {tall:.0f}, as in millimetres (unit=mm) or pixels"
    stands = upright(whole, H36M17)
    if not (-stands[:, 1] > _UPRIGHT).all():
        axis = int(np.abs(stands).sum(axis=0).argmax())
        return f"the body stands along {'-' if stands[:, axis].sum() < 0 else '+'}{'xyz'[axis]}, not along -y"
    verdict = chirality(lifters.in_camera(whole)).verdict if sides else ""
    return "its left and right contradict nose and knees" if verdict in ("wrong", "legs against arms") else ""
