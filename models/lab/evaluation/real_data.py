"""The real videos with truth, read: as the keypoints that a run finds in them, and what is true (docs/training.md)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from ....pipeline.core.errors import readable
from ....pipeline.core.layouts import H36M17, LIMBS
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate, unit
from ....pipeline.core.take import Video
from ....pipeline.files.arrays import load_all
from ....pipeline.reading.choose import choose_person
from ....pipeline.reading.load import read_video
from ....pipeline.running.progress import each
from ...common.canonical import R_world_from_body
from ...detector.load import load_detector
from ...detector.video import detect
from ...gravity.lines import tangent
from ..mocap.clips import data_folder, lying
from .testbed import SeenTake

BALANCING, STANDING = "pose2sim", "pose2sim_static"  # folders of the data's README, under real/
_DETECTOR = Path("models") / "movenet_lightning_int8.onnx"


def real_takes(name: str) -> Iterator[tuple[Video, SeenTake]]:
    """What each camera of a real take, BALANCING or STANDING, filmed. The truth has the limbs alone, pelvis and thorax
    between them; other joints are NaN, and all of a take of which only up is known. InputError where the data is
    not."""
    folder = data_folder() / "real" / name
    cameras, limbs = read_cameras(folder), read_limbs(folder)
    for camera, said in each(cameras.items(), "cameras", len(cameras)):
        video, keypoints = read_seen(folder / f"{camera}.mp4")
        if limbs is None:
            up = unit(said["up_in_camera"])
            across = tangent(up)[:, 0]
            R_camera_from_world = np.column_stack([across, np.cross(up, across), up])
            joints = np.full((len(video.time_s), len(H36M17), 3), np.nan)
        else:
            R_camera_from_world = said["R_camera_from_world"]
            joints = rotate(R_camera_from_world, whole_body(limbs)) + said["t_m"]
        world = rotate(R_camera_from_world.T, joints)
        truth = SeenTake(
            keypoints=keypoints,
            image_size=video.size,
            focal_px=float(said["focal_px"].mean()),
            joints_camera=joints,
            R_camera_from_body=R_camera_from_world @ R_world_from_body(world),
            R_camera_from_world=R_camera_from_world,
            lying=lying(world),
            clip=camera,
            subject="real take",
        )
        yield video, truth


def read_cameras(folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """{camera: what its take's cameras.json says of it}: up_in_camera (3,), against gravity, and focal_px (2,); of a
    take with truth also R_camera_from_world (3, 3), world +Z up, and t_m (3,): x_camera = R x_world + t. InputError
    when the file is missing."""
    path = folder / "cameras.json"
    with readable(path, "the cameras of a real take"):
        cameras = json.loads(path.read_text(encoding="utf-8"))["cameras"]
    return {camera: {key: np.array(of) for key, of in said.items()} for camera, said in cameras.items()}


def read_limbs(folder: Path) -> np.ndarray | None:
    """A real take's true limbs (T, 12, 3) in metres, joints LIMBS, world +Z up, row i of frame i of every video; None
    of a take that has none."""
    path = folder / "truth.npz"
    if not path.exists():
        return None
    arrays = load_all(path, "joints", "joint_names")
    names = arrays["joint_names"].tolist()
    return arrays["joints"][:, [names.index(joint) for joint in LIMBS]].astype(np.float64)


@cache
def read_seen(path: Path) -> tuple[Video, PoseSequence]:
    """A video, and in COCO17, IMAGE, whom the data's own detector sees in it for longest, looking as often as in a run;
    once in a process, for several reports on it."""
    video = read_video(path)
    found = detect(video, load_detector(data_folder() / _DETECTOR, looks=None))
    return video, choose_person(found.people(), "longest", str(path))


def whole_body(limbs: np.ndarray) -> np.ndarray:
    """(T, 17, 3) of joints LIMBS (T, 12, 3), in the same axes; pelvis and thorax are the middles of hips and shoulders,
    others NaN."""
    whole = np.full((len(limbs), len(H36M17), 3), np.nan)
    whole[:, H36M17.indices(LIMBS)] = limbs
    for middle, part in (("pelvis", "hip"), ("thorax", "shoulder")):
        whole[:, H36M17.index(middle)] = whole[:, H36M17.indices((f"r_{part}", f"l_{part}"))].mean(axis=1)
    return whole
