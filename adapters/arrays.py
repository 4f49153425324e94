"""Bare arrays of 3D joints whose meaning the caller gives in full; nothing is guessed, so nothing is sniffed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import FRAMES, Frame
from ..pipeline.core.layouts import layout_named
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import keys, load
from .kit.world import Maker, maker

name = "arrays"
gives = "poses"
reads = "any .npy or .npz of (frames, joints, 3), with options layout, frame, unit and, for an .npz, key"

_BESIDE = ("confidence", "time_s", "frame_index")
# LEVEL and BODY are what rectification makes, IMAGE is 2D.
_FRAMES = {key: frame for key, frame in FRAMES.items() if frame.family in ("camera", "world")}


def sniff(path: Path) -> bool:
    return False


def read(
    path: Path, layout: str, frame: str, unit: str, key: str | None = None, made_by: Maker | None = None
) -> tuple[PoseSequence]:
    """The one person of the file, in the layout, frame and unit that the caller names.

    layout: a joint layout by name, such as "H36M17" or "COCO17".
    frame: the axes by name: "CAMERA", "GL_CAMERA", "PC_CAMERA", "Z_UP" or "Y_UP".
    unit: "m", "mm", "cm", "inch", "px" or "arbitrary".
    key: which array of an .npz holds the joints; may be left out where only one can.
    made_by: "measured" or "estimated"; without it poses in a camera's axes are taken for an estimator's, and of those
    in a world's nobody knows how well they stand.
    Camera axes may have their origin anywhere; the reader subtracts the pelvis. An .npz may also hold
    `confidence` (frames, joints), `time_s` (frames,) and `frame_index` (frames,), whole numbers from 0.
    Raises InputError for unknown names, for arrays of another shape, and when several could be the joints.
    """
    joint_layout, axes = layout_named(layout), _axes(frame, unit)
    held = keys(path)
    joints = load(path, ("frames", len(joint_layout), 3), key=_key_of_joints(path, held, key))
    shapes = {"confidence": joints.shape[:2], "time_s": joints.shape[:1], "frame_index": joints.shape[:1]}
    beside: dict[str, Any] = {part: load(path, shapes[part], key=part) for part in _BESIDE if part in held}
    index = beside.get("frame_index")
    if index is not None and (index != np.floor(index)).any():
        raise InputError(
            "wrong-content",
            f"{path}, array 'frame_index': expected whole numbers of video frames, got fractions.",
        )
    return (PoseSequence(joints=joints, layout=joint_layout, frame=axes, made_by=maker(made_by), **beside),)


def _axes(frame: str, unit: str) -> Frame:
    if frame.upper() not in _FRAMES:
        raise InputError("bad-value", f"Expected a frame of {', '.join(_FRAMES)}; got '{frame}'.")
    axes = _FRAMES[frame.upper()]
    return replace(axes, unit=unit, origin="camera" if axes.family == "camera" else axes.origin)


def _key_of_joints(path: Path, held: tuple[str, ...], key: str | None) -> str | None:
    could_be = [name for name in held if name not in _BESIDE]
    if key is not None or not held:
        return key
    if len(could_be) != 1:
        raise InputError(
            "choose-entry",
            f"{path} holds the arrays {', '.join(held)}; name the joints with key=NAME (--option key=NAME).",
        )
    return could_be[0]
