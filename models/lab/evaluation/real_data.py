"""The real videos with truth, read: cameras, true joints, and the keypoints that a run finds (docs/training.md)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17, LIMBS
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate, unit
from ....pipeline.core.take import Video
from ....pipeline.files.arrays import load_all
from ....pipeline.reading.choose import choose_person
from ....pipeline.reading.load import read_video
from ...detector.load import load_detector
from ...detector.video import detect
from ..mocap.clips import data_folder

BALANCING, STANDING = "pose2sim", "pose2sim_static"  # folders of the data's README, under real/
_DETECTOR = Path("models") / "movenet_lightning_int8.onnx"


@dataclass(frozen=True, eq=False)
class RealCamera:
    """A camera of a real take. video: its file. up: (3,), against gravity, in the camera. focal_px: (2,).
    R_camera_from_world (3, 3), world +Z up, and t_m (3,): x_camera = R x_world + t; None where the take has no truth.
    """

    video: Path
    up: np.ndarray
    focal_px: np.ndarray
    R_camera_from_world: np.ndarray | None = None
    t_m: np.ndarray | None = None

    def to_camera(self, joints_world: np.ndarray) -> np.ndarray:
        """(..., J, 3) world -> camera, metres, of a take with truth."""
        assert self.R_camera_from_world is not None
        assert self.t_m is not None
        return rotate(self.R_camera_from_world, joints_world) + self.t_m


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
    arrays = {
        key: np.array(said[key], dtype=np.float64) for key in ("R_camera_from_world", "t_m") if key in said
    }
    up, focal_px = (np.array(said[key], dtype=np.float64) for key in ("up_in_camera", "focal_px"))
    return RealCamera(video, unit(up), focal_px, **arrays)


def read_real(name: str) -> tuple[dict[str, RealCamera], np.ndarray | None]:
    """The cameras of a real take, BALANCING or STANDING, and its true limbs (T, 12, 3) in metres, joints LIMBS, world
    +Z up, row i of frame i of every video; None of a take that has none. InputError where the data is not, is damaged
    or lacks a limb."""
    folder = data_folder() / "real" / name
    cameras, truth = read_cameras(folder), folder / "truth.npz"
    if not truth.exists():
        return cameras, None
    arrays = load_all(truth, "joints", "joint_names")
    names = [str(joint) for joint in arrays["joint_names"]]
    if missing := [joint for joint in LIMBS if joint not in names]:
        raise InputError(
            "wrong-content", f"Expected the limbs' joints in {truth}; {', '.join(missing)} missing."
        )
    return cameras, arrays["joints"][:, [names.index(joint) for joint in LIMBS]].astype(np.float64)


@cache
def read_seen(path: Path) -> tuple[Video, PoseSequence]:
    """A video and the keypoints in it; once in a process, for several reports on it."""
    video = read_video(path)
    return video, found_keypoints(video)


def found_keypoints(video: Video) -> PoseSequence:
    """COCO17 in IMAGE: whom the data's own detector sees for longest, looking as often as in a run. InputError when it
    sees nobody."""
    found = detect(video, load_detector(data_folder() / _DETECTOR, looks=None))
    if not len(found.person):
        raise InputError(
            "nothing-usable", f"Expected a person in {video.path}, but {found.method} finds nobody."
        )
    return choose_person(found.people(), "longest", str(video.path))


def whole_body(limbs: np.ndarray) -> np.ndarray:
    """(T, 17, 3) of joints LIMBS (T, 12, 3), in the same axes; pelvis and thorax are the middles of hips and shoulders,
    others NaN."""
    whole = np.full((len(limbs), len(H36M17), 3), np.nan)
    whole[:, H36M17.indices(LIMBS)] = limbs
    for middle, part in (("pelvis", "hip"), ("thorax", "shoulder")):
        whole[:, H36M17.index(middle)] = whole[:, H36M17.indices((f"r_{part}", f"l_{part}"))].mean(axis=1)
    return whole
