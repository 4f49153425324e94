"""The real videos with truth, read: cameras, true joints, and three kinds of 2D keypoints (docs/training.md)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import IMAGE
from ....pipeline.core.layouts import COCO17, H36M17, LIMBS
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate, unit
from ....pipeline.core.take import Video
from ....pipeline.files.arrays import load_all
from ....pipeline.reading.choose import choose_person
from ...detector.load import load_detector
from ...detector.video import detect
from ..mocap.clips import data_folder

MOVING, STANDING = "pose2sim", "pose2sim_static"  # folders of the data's README, under real/
_DETECTOR = Path("models") / "movenet_lightning_int8.onnx"


@dataclass(frozen=True, eq=False)
class RealCamera:
    """A camera of a real take. video: its file. up: (3,), against gravity, in the camera.
    R_camera_from_world (3, 3), world +Z up, and t_m (3,): x_camera = R x_world + t; None where the take has no truth.
    focal_px, principal_point_px: (2,). distortion: (4,) k1, k2, p1, p2 as in OpenCV."""

    video: Path
    up: np.ndarray
    focal_px: np.ndarray
    principal_point_px: np.ndarray
    distortion: np.ndarray
    R_camera_from_world: np.ndarray | None = None
    t_m: np.ndarray | None = None

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3) from directions before the lens to pixels, as OpenCV has it."""
        matrix = np.diag([*self.focal_px, 1.0])
        matrix[:2, 2] = self.principal_point_px
        return matrix

    def to_camera(self, joints_world: np.ndarray) -> np.ndarray:
        """(..., J, 3) world -> camera, metres, of a take with truth."""
        assert self.R_camera_from_world is not None
        assert self.t_m is not None
        return rotate(self.R_camera_from_world, joints_world) + self.t_m

    def project(self, joints_world: np.ndarray) -> np.ndarray:
        """(..., 3) world, metres -> (..., 2) pixels, lens distortion included."""
        import cv2

        assert self.R_camera_from_world is not None
        assert self.t_m is not None
        turn, _ = cv2.Rodrigues(self.R_camera_from_world)
        points = joints_world.reshape(-1, 1, 3).astype(np.float64)
        pixels, _ = cv2.projectPoints(points, turn, self.t_m, self.matrix, self.distortion)
        return pixels.reshape(*joints_world.shape[:-1], 2)


@dataclass(frozen=True, eq=False)
class RealTruth:
    """limbs: (T, 12, 3) metres, joints LIMBS, world +Z up; row i is frame i of every video. openpose: by camera, its
    keypoints (T, 17, 3), COCO17: x, y in pixels and score."""

    limbs: np.ndarray
    openpose: dict[str, np.ndarray]


def read_cameras(folder: Path) -> dict[str, RealCamera]:
    """The cameras of a real take by name, from its cameras.json. InputError when that is missing or says less."""
    path = folder / "cameras.json"
    try:
        listed = json.loads(path.read_text(encoding="utf-8"))["cameras"]
        return {name: _camera(folder / f"{name}.mp4", said) for name, said in listed.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            "file-damaged",
            f"Expected the cameras of a real take in {path}, got {type(error).__name__}: {error}.",
        ) from None


def _camera(video: Path, said: Mapping[str, Any]) -> RealCamera:
    keys = ("focal_px", "principal_point_px", "distortion", "R_camera_from_world", "t_m")
    arrays = {key: np.array(said[key], dtype=np.float64) for key in keys if key in said}
    return RealCamera(video, unit(np.array(said["up_in_camera"], dtype=np.float64)), **arrays)


def read_truth(folder: Path, cameras: Sequence[str]) -> RealTruth:
    """The truth of a real take, from its truth.npz. InputError when that is missing, damaged or lacks a limb."""
    keys = {name: f"openpose_body25b_{name}" for name in cameras}
    arrays = load_all(folder / "truth.npz", "joints", "joint_names", *keys.values())
    names = [str(name) for name in arrays["joint_names"]]
    if missing := [name for name in LIMBS if name not in names]:
        raise InputError(
            "wrong-content",
            f"Expected the limbs' joints in {folder / 'truth.npz'}; {', '.join(missing)} missing.",
        )
    return RealTruth(
        limbs=arrays["joints"][:, [names.index(name) for name in LIMBS]].astype(np.float64),
        # The first 17 joints of BODY_25B are COCO's, in its order.
        openpose={name: arrays[key][:, : len(COCO17)].astype(np.float64) for name, key in keys.items()},
    )


def read_moving() -> tuple[dict[str, RealCamera], RealTruth]:
    """The cameras and the truth of the take of the man who balances. InputError where the data is not."""
    folder = data_folder() / "real" / MOVING
    cameras = read_cameras(folder)
    return cameras, read_truth(folder, list(cameras))


def found_keypoints(video: Video, looks: int | None = None) -> PoseSequence:
    """COCO17 in IMAGE: whom the data's own detector sees for longest. looks: of load_detector, as in a run without it.
    InputError when it sees nobody."""
    found = detect(video, load_detector(data_folder() / _DETECTOR, looks=looks))
    if not len(found.person):
        raise InputError(
            "nothing-usable", f"Expected a person in {video.path}, but {found.method} finds nobody."
        )
    return choose_person(found.people(), "longest", str(video.path))


def openpose_keypoints(keypoints: np.ndarray, time_s: np.ndarray) -> PoseSequence:
    """COCO17 in IMAGE of keypoints (T, 17, 3), x, y and score; a joint that was not found has the score 0."""
    joints = np.where(keypoints[..., 2:] > 0, keypoints[..., :2], np.nan)
    confidence = np.clip(keypoints[..., 2], 0, 1)
    return PoseSequence(joints, COCO17, IMAGE, confidence, time_s, np.arange(len(time_s)))


def exact_keypoints(camera: RealCamera, limbs: np.ndarray, found: PoseSequence) -> PoseSequence:
    """The same with the true limbs (T, 12, 3) as the camera sees them in place of those that were found. The five
    points of the face stay: nobody knows their truth, and every detector gives some."""
    joints, confidence = found.joints.copy(), found.confidence.copy()
    rows = COCO17.indices(LIMBS)
    joints[:, rows], confidence[:, rows] = camera.project(limbs), 1.0
    return found.with_(joints=joints, confidence=confidence)


def triangulated(cameras: Mapping[str, RealCamera], openpose: Mapping[str, np.ndarray]) -> np.ndarray:
    """(T, 12, 3) metres, joints LIMBS, world +Z up: where the keypoints of all cameras that found a joint meet, by
    linear least squares. openpose: RealTruth's; NaN where fewer than two found it."""
    import cv2

    rows, equations = COCO17.indices(LIMBS), []
    for name, camera in cameras.items():
        assert camera.R_camera_from_world is not None
        assert camera.t_m is not None
        points, score = openpose[name][:, rows, :2], openpose[name][:, rows, 2]
        plane = cv2.undistortPoints(points.reshape(-1, 1, 2), camera.matrix, camera.distortion)
        plane = plane.reshape(*points.shape)
        P = np.column_stack([camera.R_camera_from_world, camera.t_m])
        lines = plane[..., None] * P[2] - P[:2]
        equations.append(np.where((score > 0)[..., None, None], lines, 0.0))
    A = np.concatenate(equations, axis=-2)
    seen = (np.abs(A).sum(axis=-1) > 0).sum(axis=-1) >= 4
    solved = np.einsum("...ij,...j->...i", np.linalg.pinv(A[..., :3]), -A[..., 3])
    return np.where(seen[..., None], solved, np.nan)


def whole_body(limbs: np.ndarray) -> np.ndarray:
    """(T, 17, 3) of joints LIMBS (T, 12, 3), relative to the middle of the hips; pelvis and thorax are the middles of
    hips and shoulders, others NaN."""
    whole = np.full((len(limbs), len(H36M17), 3), np.nan)
    whole[:, H36M17.indices(LIMBS)] = about_hips(limbs)
    for middle, part in (("pelvis", "hip"), ("thorax", "shoulder")):
        whole[:, H36M17.index(middle)] = whole[:, H36M17.indices((f"r_{part}", f"l_{part}"))].mean(axis=1)
    return whole


def about_hips(limbs: np.ndarray) -> np.ndarray:
    """Joints LIMBS (..., 12, 3) relative to the middle of the hips."""
    return limbs - mid_hips(limbs)


def mid_hips(limbs: np.ndarray) -> np.ndarray:
    """(..., 1, 3) of joints LIMBS (..., 12, 3)."""
    return limbs[..., [LIMBS.index("r_hip"), LIMBS.index("l_hip")], :].mean(axis=-2, keepdims=True)
