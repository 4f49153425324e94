"""Lifters and rectifiers on real clips: agreement and consistency, not error, since nobody knows the truth.

Two lifters of one video should show one body, and a camera that stands still has one `up`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np

from ....pipeline.core.frames import CAMERA, IMAGE
from ....pipeline.core.layouts import BLAZEPOSE33, COCO17, H36M17, Layout, remap
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import angle_deg, geodesic_deg, kabsch, rotate, transpose, unit
from ...common.metrics import relative
from ..common.metrics import Figure
from ..mocap.clips import data_folder
from .runs import Question
from .takes import Answer, answers, named
from .testbed import lifted_by

_OURS = "pcnet3d on MoveNet"
# By clip: an array of its file, the lifter's name and the array's layout; the cameras stand still.
_CLIPS: dict[str, tuple[tuple[str, str, Layout], ...]] = {
    "boxing": (
        ("motionbert", "MotionBERT", H36M17), ("movenet_kp2d", _OURS, COCO17),
        ("blazepose_world", "BlazePose", BLAZEPOSE33),
    ),
    "walk_crop": (("movenet_kp2d", _OURS, COCO17), ("blazepose_world", "BlazePose", BLAZEPOSE33)),
    "demo_man": (("movenet_kp2d", _OURS, COCO17), ("blazepose_world", "BlazePose", BLAZEPOSE33)),
    "mhformer_skating": (("run_a", "MHFormer", H36M17),),
}  # fmt: skip
ABOUT = (
    "Nobody knows the truth of these. Degrees over frames, p50 / mean / p95: how far two lifters of one video are "
    "apart before and after rectification; a frame's up against the take's mean up."
)


def real_poses(question: Question) -> Iterator[tuple[str, str, PoseSequence]]:
    """(clip, lifter, poses): H36M17 in CAMERA axes relative to the pelvis, the lifter's unit; ours on 2D
    keypoints, whose focal length is unknown."""
    for clip, arrays in _CLIPS.items():
        with np.load(data_folder() / "lifter" / f"{clip}.npz", allow_pickle=False) as file:
            for array, name, layout in arrays:
                found, time_s = file[array], np.arange(len(file[array])) / float(file["fps"])
                if name == _OURS:
                    width, height = (int(side) for side in file["image_size"])
                    poses = lifted_by(question.lifter, image_poses(found, layout), (width, height))
                else:
                    poses = remap(PoseSequence(found, layout, CAMERA.with_(unit="arbitrary")))
                joints = relative(poses.joints.astype(np.float64))
                yield clip.removeprefix("mhformer_"), name, poses.with_(joints=joints, time_s=time_s)


def image_poses(keypoints: np.ndarray, layout: Layout) -> PoseSequence:
    """(T, J, 2 or 3) pixels and maybe scores -> H36M17 in IMAGE."""
    poses = PoseSequence(keypoints[..., :2], layout, IMAGE)
    if keypoints.shape[-1] == 3:
        poses = poses.with_(confidence=np.clip(keypoints[..., 2], 0, 1))
    return remap(poses)


def tables(question: Question) -> dict[str, Any]:
    """{"real, rectified": {"apart": {"clip: lifter, lifter": {axes: Figure}}, "up": {"clip, lifter": {method:
    Figure}}}}, degrees over frames.

    apart: one lifter's body against the other's, before ("camera axes") and after each rectifier, frame by frame and
        with one gravity a take: the rotation that brings one closest to the other. up: between a frame's up and the
        take's mean of them.
    """
    by_clip: dict[str, dict[str, tuple[np.ndarray, dict[str, Answer]]]] = {}
    for clip, lifter, poses in real_poses(question):
        found = named(answers(question.rectifiers, poses.joints, poses.times))
        by_clip.setdefault(clip, {})[lifter] = poses.joints, found
    apart: dict[str, dict[str, Figure]] = {}
    up: dict[str, dict[str, Figure]] = {}
    for clip, lifters in by_clip.items():
        for (one, (joints, found)), (other, (others, others_found)) in combinations(lifters.items(), 2):
            figures = apart[f"{clip}: {one}, {other}"] = {"camera axes": Figure.of(_apart(joints, others))}
            for method, answer in found.items():
                body = rotate(transpose(answer.R_camera_from_body), joints)
                other_body = rotate(transpose(others_found[method].R_camera_from_body), others)
                figures[method] = Figure.of(_apart(body, other_body))
        for lifter, (_, found) in lifters.items():
            up[f"{clip}, {lifter}"] = {
                rectifier.method: Figure.of(
                    spread_deg(found[f"{rectifier.method}, a frame"].R_camera_from_body[..., 2])
                )
                for rectifier in question.rectifiers
            }
    return {**question.heading(), "real, rectified": {"apart": apart, "up": up}}


def spread_deg(up: np.ndarray) -> np.ndarray:
    """(T,) degrees between each unit vector of up (T, 3) and their mean; NaN frames stay NaN."""
    return angle_deg(up, np.broadcast_to(unit(np.nanmean(up, axis=0)), up.shape))


def _apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(T,) degrees between two skeletons of the same frames; NaN where a joint of either is missing."""
    seen = np.isfinite(a).all(axis=(1, 2)) & np.isfinite(b).all(axis=(1, 2))
    out = np.full(len(a), np.nan)
    out[seen] = geodesic_deg(kabsch(a[seen], b[seen]), np.eye(3))
    return out
