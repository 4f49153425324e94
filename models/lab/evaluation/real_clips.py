"""Our lift beside other lifters' outputs on real clips: agreement, not error, since nobody knows the truth."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....pipeline.core.frames import CAMERA, IMAGE
from ....pipeline.core.layouts import BLAZEPOSE33, COCO17, H36M17, HALPE26, Layout, remap
from ....pipeline.core.pose import PoseSequence
from ...common.metrics import Figure, procrustes_error, relative
from ..mocap.clips import data_folder
from ..synthetic.bodies import STANDARD_SIZE_M, size_m
from .sets import Question

# file, 2D array, its detector and layout, other lifters' arrays, their names and layouts
_CLIPS: tuple[tuple[str, str, str, Layout, tuple[tuple[str, str, Layout], ...]], ...] = (
    ("boxing", "alphapose_kp2d", "AlphaPose", HALPE26,
     (("motionbert", "MotionBERT", H36M17), ("blazepose_world", "BlazePose", BLAZEPOSE33))),
    ("boxing", "movenet_kp2d", "MoveNet", COCO17,
     (("motionbert", "MotionBERT", H36M17), ("blazepose_world", "BlazePose", BLAZEPOSE33))),
    ("mhformer_skating", "run_a_kp2d", "HRNet", H36M17, (("run_a", "MHFormer", H36M17),)),
    ("walk_crop", "movenet_kp2d", "MoveNet", COCO17, (("blazepose_world", "BlazePose", BLAZEPOSE33),)),
    ("demo_man", "movenet_kp2d", "MoveNet", COCO17, (("blazepose_world", "BlazePose", BLAZEPOSE33),)),
)  # fmt: skip
# Spine, thorax, nose and head are other points for every lifter (formats.md section 1).
_LIMBS = H36M17.indices(
    [f"{side}_{part}" for side in "lr" for part in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")]
)


def agreement(question: Question) -> list[dict[str, Any]]:
    """PA-MPJPE over the twelve limb joints, mm of a standard body, of every pair of lifters on every clip."""
    rows = []
    for clip, array, detector, layout, others in _CLIPS:
        with np.load(data_folder() / "lifter" / f"{clip}.npz", allow_pickle=False) as file:
            keypoints = image_poses(file[array], layout)
            width, height = (int(side) for side in file["image_size"])
            poses = {f"pcnet3d on {detector}": question.lift(keypoints, (width, height)).joints}
            for name, label, other_layout in others:
                camera = CAMERA.with_(unit="arbitrary")
                poses[label] = remap(PoseSequence(file[name], other_layout, camera)).joints
        labels = list(poses)
        for i, one in enumerate(labels):
            for other in labels[i + 1 :]:
                apart = limb_distance(poses[one], poses[other])
                row = {"pair": (clip.removeprefix("mhformer_"), one, other), "apart": Figure.of(apart)}
                if all(row["pair"] != known["pair"] for known in rows):
                    rows.append(row)
    return rows


def image_poses(keypoints: np.ndarray, layout: Layout) -> PoseSequence:
    """(T, J, 2 or 3) pixels and maybe scores -> H36M17 in IMAGE."""
    poses = PoseSequence(keypoints[..., :2], layout, IMAGE)
    if keypoints.shape[-1] == 3:
        poses = poses.with_(confidence=np.clip(keypoints[..., 2], 0, 1))
    return remap(poses)


def limb_distance(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(T,) mm of a standard body, after the best similarity of every frame; joints (T, 17, 3)."""
    a, b = (relative(joints.astype(np.float64)) for joints in (one, other))
    seen = np.isfinite(a).all(axis=(-2, -1)) & np.isfinite(b).all(axis=(-2, -1))
    scale = STANDARD_SIZE_M / size_m(b[seen])
    error = np.full(len(a), np.nan)
    error[seen] = 1000 * procrustes_error(a[seen][:, _LIMBS], b[seen][:, _LIMBS] * scale)
    return error
