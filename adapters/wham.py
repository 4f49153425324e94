"""WHAM's wham_output.pkl: the meshes of people, made into joints by the regressor that the user has.

A dict of subjects, each with the parameters of SMPL and the mesh that they make: `verts` (T, 6890, 3), metres in axes
of the camera and from its centre, and `frame_ids`, video frames from 0. The joints are inside the mesh: a regressor
makes them of it, which belongs to SMPL and has to be given as an array, as its licence forbids to ship it. Face, heels
and toes are points of the mesh, known by number. World poses are parameters alone and are not read.

MoViD saves the same dict with the joints in it: `joints3d` (T, 31, 3) about the hips' middle, COCO's 17 first, and
`trans_cam` (T, 3), where before the camera that is (demo.py). VIBE and its kin (TCMR, MEVA) save `joints3d` (T, 49, 3)
of SPIN, OpenPose's 25 first, about the body model's origin, and no place (demo.py, lib/data_utils/kp_utils.py).
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import BODY_25, COCO17, FEET, H36M17_B, Layout
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import load as load_array
from ..pipeline.files.arrays import shaped
from ..pipeline.files.skeletons import SMPL
from .kit.pickles import beginning, load

name = "wham"
gives = "poses"
made_by = MadeBy("estimated", "WHAM")
reads = "wham_output.pkl of WHAM (with option regressor: SMPL's, as a .npy), MoViD's and VIBE's: camera axes, metres"

_VERTICES, _JOINTS = 6890, "joints3d"
_SPIN = 49  # joints of VIBE
_POINTS = {  # of SMPL's mesh, as its authors' package smplx numbers them for OpenPose's joints
    "nose": 332, "r_eye": 6260, "l_eye": 2800, "r_ear": 4071, "l_ear": 583,
    "l_big_toe": 3216, "l_small_toe": 3226, "l_heel": 3387, "r_big_toe": 6617, "r_small_toe": 6624, "r_heel": 6787,
}  # fmt: skip
# What the rows of a regressor are, by their number: SMPL's own joints, of which the pelvis lies above the hips' middle
# and the head at the skull's base, or Human3.6M's in the order of SPIN and WHAM (J_regressor_h36m.npy).
_SMPL = ("smpl_pelvis", *SMPL[1:15], "skull", *SMPL[16:], "l_hand", "r_hand")
_ROWS = {len(_SMPL): (_SMPL, tuple(_POINTS)), len(H36M17_B): (H36M17_B.joints, FEET.joints)}
_SUM = 0.01  # how far the weights of a joint may be from adding up to 1
_FIRST_KEY = re.compile(rb"(\x8c\x04|X\x04\x00\x00\x00)pose[^_]")
_VIBES = re.compile(rb"(\x8c\x08|X\x08\x00\x00\x00)pred_cam")


def sniff(path: Path) -> bool:
    """By the beginning of the dict: the keys behind its first array lie anywhere in a long file."""
    start = beginning(path)
    if _VIBES.search(start[:128]):
        return True
    first = _FIRST_KEY.search(start[:1024])
    return first is not None and (b"defaultdict" in start[:128] or b"pose_world" in start)


def read(path: Path, regressor: str = "") -> tuple[PoseSequence, ...]:
    """One sequence a subject, in CAMERA axes from the camera's centre, metres.

    regressor: for meshes without joints, .npy of (24, 6890), SMPL's own joints, or (17, 6890), J_regressor_h36m.npy;
    looked for beside the results if the path leads nowhere. InputError when it lacks, and when the file holds anything
    but arrays and plain containers, is not of this form, or has no meshes.
    """
    held = load(path)
    if not isinstance(held, dict) or not held:
        raise InputError(
            "format-unknown", f"{path}: expected a dict of subjects, as WHAM writes it, got another pickle."
        )
    subjects = {str(person): values if isinstance(values, dict) else {} for person, values in held.items()}
    ready = all(_JOINTS in values for values in subjects.values())
    if not ready and not regressor:
        raise InputError(
            "needs-input",
            f"{path}: expected joints, got WHAM's meshes; give SMPL's joint regressor, an .npy of (24, 6890) or (17, "
            "6890), with regressor= (-O regressor=J_regressor_h36m.npy), or save joints with a frame rate as .npz "
            "for adapter amass.",
        )
    weights = (
        None if ready else _weights(Path(regressor) if Path(regressor).exists() else path.parent / regressor)
    )
    return tuple(_person(person, values, weights, str(path)) for person, values in subjects.items())


def _person(person: str, values: dict[str, Any], weights: np.ndarray | None, where: str) -> PoseSequence:
    """weights: of the regressor; without it the joints are VIBE's, or MoViD's about the hips' middle."""
    of_subject = f"{where}, subject {person}"
    by, layout, origin = "VIBE", BODY_25, "body model"
    if weights is None and getattr(values[_JOINTS], "shape", ())[1:] == (_SPIN, 3):
        joints = shaped(values[_JOINTS], f"{of_subject}, {_JOINTS}", ("frames", _SPIN, 3))[:, : len(BODY_25)]
    else:
        mesh = shaped(values.get("verts"), f"{of_subject}, verts", ("frames", _VERTICES, 3))
        if weights is None:
            stored = shaped(values[_JOINTS], f"{of_subject}, {_JOINTS}", (len(mesh), "joints", 3))
            away = shaped(values.get("trans_cam"), f"{of_subject}, trans_cam", (len(mesh), 3))
            if stored.shape[1] < len(COCO17):
                raise InputError(
                    "wrong-content",
                    f"{of_subject}: expected COCO's 17 joints first in {_JOINTS}, got {stored.shape[1]}.",
                )
            joints, names, points = stored[:, : len(COCO17)] + away[:, None], COCO17.joints, FEET.joints
        else:
            joints, (names, points) = weights @ mesh, _ROWS[len(weights)]
        joints = np.concatenate([joints, mesh[:, [_POINTS[point] for point in points]]], axis=1)
        by, layout, origin = "MoViD", Layout("SMPL mesh", (*names, *points)), "camera"
    frames = shaped(values.get("frame_ids"), f"{of_subject}, frame_ids", (len(joints),), kinds="iu")
    poses = PoseSequence(joints, layout, CAMERA.with_(origin=origin), frame_index=frames, person=person)
    if weights is None:
        return poses.with_(made_by=MadeBy("estimated", by))
    return poses.noted("regressor", joints=len(weights))


def _weights(path: Path) -> np.ndarray:
    """(J, 6890), each row of which adds up to 1."""
    weights = load_array(path, *((count, _VERTICES) for count in _ROWS)).astype(np.float32)
    if not np.abs(weights.sum(axis=1) - 1).max() < _SUM:
        raise InputError(
            "wrong-content",
            f"{path}: expected a joint regressor, whose weights add up to 1 for each joint, got another array.",
        )
    return weights
