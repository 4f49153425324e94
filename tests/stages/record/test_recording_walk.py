"""The view of the walk: the path lies on the floor, and the camera sees the person as it did."""

import numpy as np
import pytest

from golden.recordings import Recording
from golden.walks import GEOMETRIC, SIZE, filmed
from pcnet3d.examples.walker.camera import aimed
from pcnet3d.pipeline import CAMERA, Y_UP, Pipeline, change_frame
from pcnet3d.pipeline.core.anthropometry import ANKLE_HEIGHT
from pcnet3d.pipeline.core.pose import RootPath
from pcnet3d.pipeline.core.rotations import rotate
from pcnet3d.stages.record.stage import record

STRIPS = "LineStrips3D:strips"


@pytest.fixture(scope="module")
def take(walk):
    """The walker, whose place before the camera is known."""
    middle = walk.root.mean(axis=0)
    seen_by = aimed(middle, 6, heading_deg=walk.heading_deg[0] + 100, pitch_deg=10, roll_deg=3)
    take, root = filmed(walk, seen_by), seen_by.points(walk.root[:, None])[:, 0]
    poses = take.poses.with_(frame=CAMERA.with_(origin="pelvis", unit="m"), path=RootPath(root))
    return Pipeline(GEOMETRIC[:3])(take.with_(poses=poses))


@pytest.fixture(scope="module")
def recording(take, tmp_path_factory):
    path = tmp_path_factory.mktemp("walk") / "take.rrd"
    record(take, path)
    return Recording(path)


def test_the_path_lies_on_the_floor_under_the_feet(take, recording):
    level = take.rectified.level
    ankles = np.min([level.joint(f"{side}_ankle")[:, 2] for side in "rl"], axis=0) + level.root[:, 2]
    path, floor = (np.concatenate(recording.static(f"walk/{part}", STRIPS)) for part in ("path", "floor"))
    assert len(set(path[:, 2])) == 1
    assert np.median(ankles) - path[0, 2] == pytest.approx(ANKLE_HEIGHT * 1.75, abs=0.01)
    np.testing.assert_allclose(floor[:, 2], path[0, 2], rtol=1e-6)


def test_the_camera_at_its_place_sees_the_joints_at_their_keypoints(take, recording):
    (place,) = recording.static("walk/camera", "Transform3D:translation")
    (columns,) = recording.static("walk/camera", "Transform3D:mat3x3")
    (lens,) = recording.static("walk/camera", "Pinhole:image_from_camera")
    R_level_from_camera, image_from_camera = (np.reshape(each, (3, 3)).T for each in (columns, lens))
    _, _, joints = recording.over_time("level/joints", "Points3D:positions")
    joints = np.array(joints) + recording.over_time("level", "Transform3D:translation")[2]
    rays = rotate(image_from_camera @ R_level_from_camera.T, np.array(joints) - np.array(place))
    np.testing.assert_allclose(rays[..., :2] / rays[..., 2:], take.keypoints.joints, atol=0.05)
    assert recording.static("walk/camera", "Pinhole:resolution") == [list(SIZE)]


def test_a_path_from_a_worlds_origin_has_no_camera(take, read_back):
    world = change_frame(take.rectified.body, Y_UP.with_(origin="pelvis"), R_to_from_source=Y_UP.basis)
    entities = read_back(take.with_(poses=world)).entities
    assert "walk/camera" not in entities
    assert "walk/path" in entities
