"""Two walkers before one tilted camera, as MMPose's JSON holds them."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import Camera, aimed
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline import CAMERA, PoseSequence, change_frame

LATE = 15  # frame in which the second walker enters


@dataclass(frozen=True, eq=False)
class Scene:
    walks: tuple[Walk, Walk]
    camera: Camera

    @property
    def poses(self) -> tuple[PoseSequence, PoseSequence]:
        """Both in CAMERA, relative to the pelvis; the second from frame LATE on."""
        first, second = (
            change_frame(walk.poses, CAMERA, self.camera.R_camera_from_world).with_(person=name)
            for walk, name in zip(self.walks, "01", strict=True)
        )
        rows = slice(LATE, None)
        assert second.time_s is not None
        late = PoseSequence(
            second.joints[rows], second.layout, second.frame, time_s=second.time_s[rows],
            frame_index=second.frame_index[rows], person="1",
        )  # fmt: skip
        return first, late

    def heading_deg(self) -> np.ndarray:
        """(T,) how much further than the first the second faces to the left, true, while both are seen."""
        return (self.walks[1].heading_deg - self.walks[0].heading_deg)[LATE:]


@pytest.fixture(scope="session")
def scene() -> Scene:
    walks = walker(seconds=3, heading_deg=180), walker(seconds=3, heading_deg=250, stature_m=1.6, turn_deg=30)
    return Scene(walks, aimed(walks[0].root.mean(axis=0), 6, heading_deg=0, pitch_deg=25, roll_deg=8))


@pytest.fixture(scope="session")
def mmpose(scene, tmp_path_factory):
    """mmpose(ghost=4, mirrored=()) -> Path: the scene, somebody else in `ghost` frames, and who is mirrored."""

    def write(ghost: int = 0, mirrored: tuple[str, ...] = ()) -> Path:
        frames: list[list[dict]] = [[] for _ in scene.walks[0].time_s]
        for place, poses in enumerate(scene.poses):
            for frame, body in zip(poses.frame_index, poses.joints, strict=True):
                frames[frame].append(_instance(body, place, poses.person in mirrored))
        for frame in range(30, 30 + ghost):
            frames[frame].append(_instance(scene.poses[0].joints[frame], 9, False))
        path = tmp_path_factory.mktemp("mmpose") / "walk.json"
        listed = [{"frame_id": i, "instances": people} for i, people in enumerate(frames)]
        path.write_text(json.dumps(listed))
        return path

    return write


def _instance(body: np.ndarray, place: int, mirrored: bool) -> dict:
    x, y, z = np.moveaxis(body * [-1 if mirrored else 1, 1, 1], -1, 0)
    box = [500.0 * place, 100, 500 * place + 200 + 20 * place, 600]
    return {
        "keypoints": np.stack([-x, z, -y], axis=-1).tolist(), "keypoint_scores": [1.0] * 17, "bbox": [box],
        "bbox_score": 0.9,
    }  # fmt: skip
