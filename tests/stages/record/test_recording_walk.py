"""The view of the walk: foot prints lie where and when the feet landed, and the camera sees the person as it did."""

from dataclasses import replace

import numpy as np
import pytest

from golden.recordings import Recording
from golden.walks import GEOMETRIC, SIZE, filmed
from pcnet3d.examples.walker.camera import aimed
from pcnet3d.pipeline import CAMERA, Y_UP, Pipeline, change_frame
from pcnet3d.pipeline.core.rotations import rotate
from pcnet3d.stages.record.prints import foot_prints
from pcnet3d.stages.record.stage import record
from pcnet3d.stages.record.walk import _ellipses, walked

STRIPS = "LineStrips3D:strips"


@pytest.fixture(scope="module")
def seen_by(walk):
    return aimed(walk.root.mean(axis=0), 6, heading_deg=walk.heading_deg[0] + 100, pitch_deg=10, roll_deg=3)


@pytest.fixture(scope="module")
def take(walk, seen_by):
    """The walker, whose place before the camera is known."""
    take, root = filmed(walk, seen_by), seen_by.points(walk.root[:, None])[:, 0]
    poses = take.poses.with_(frame=CAMERA.with_(origin="pelvis", unit="m"), root=root)
    return Pipeline(GEOMETRIC[:3])(take.with_(poses=poses))


@pytest.fixture(scope="module")
def recording(take, tmp_path_factory):
    path = tmp_path_factory.mktemp("walk") / "take.rrd"
    record(take, path)
    return Recording(path)


def test_foot_prints_lie_on_the_floor_where_and_when_the_feet_landed(walk, take, recording):
    level, ground = walked(take.rectified), []
    for side, words in (("r", "right"), ("l", "left")):
        frame, nanoseconds, strips = recording.over_time(f"walk/prints/{words}", STRIPS)
        prints = [one for one in foot_prints(take) if one.side == words]
        assert len(frame) == len(prints) >= 3
        ankle = level.joint(f"{side}_ankle")
        for row, at, (outline,), one in zip(frame, nanoseconds / 1e9, strips, prints, strict=True):
            assert 0 <= at - one.start_s <= 1.01 / take.poses.fps
            flat = row + np.arange(int(0.15 * take.poses.fps), int(0.3 * take.poses.fps))
            off = np.linalg.norm(np.mean(outline, axis=0)[:2] - ankle[flat, :2].mean(axis=0))
            assert off < 0.12  # half a foot's length: the outline's middle lies before the ankle
            ground += [point[2] for point in outline]
        landed = np.array(walk.heel_strikes_s[side])
        starts = np.array([one.start_s for one in prints])
        inside = landed[(landed > starts[0] - 0.1) & (landed < starts[-1] + 0.1)]
        assert np.abs(inside[:, None] - starts).min(axis=1).max() < 0.1
    assert len(set(ground)) == 1
    low = min(level.joint(f"{side}_ankle")[:, 2].min() for side in "rl")
    assert ground[0] == pytest.approx(low, abs=0.06)
    floor = np.concatenate(recording.static("walk/floor", "LineStrips3D:strips"))
    np.testing.assert_allclose(floor[:, 2], ground[0], rtol=1e-6)


def test_feet_point_where_the_person_heads(walk, take, seen_by):
    R_level_from_world = take.rectified.R_source_from_level.T @ seen_by.R_camera_from_world
    prints = foot_prints(take)
    lie_flat = [one.start_s + 0.3 for one in prints]
    heading = np.radians(np.interp(lie_flat, walk.time_s, walk.heading_deg))
    ahead = (
        np.stack([np.cos(heading), np.sin(heading), np.zeros(len(prints))], axis=-1) @ R_level_from_world.T
    )
    turned = [np.degrees(np.arccos(one.ahead @ true[:2])) for one, true in zip(prints, ahead, strict=True)]
    assert len(prints) >= 5
    assert max(turned) < 15


def test_heels_and_toes_tell_direction_and_floor(take):
    level = take.rectified.level
    feet = np.repeat(level.joints[:, [3, 3, 3, 6, 6, 6]], 1, axis=1).astype(float)
    feet += np.array([[0, 0.15, -0.08], [0, 0.1, -0.08], [0, -0.05, -0.07]] * 2)
    shod = take.with_(rectified=replace(take.rectified, level=level.with_(feet=feet)))
    for one, bare in zip(foot_prints(shod), foot_prints(take), strict=True):
        np.testing.assert_allclose(one.ahead, [0, 1], atol=1e-4)
        assert one.place[2] == pytest.approx(bare.place[2] - 0.08, abs=1e-4)


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
    assert "walk/prints/right" in entities


def test_the_recording_shows_the_walk_and_keeps_foot_prints(recording):
    batches = [(chunk.entity_path, chunk.to_record_batch()) for chunk in recording.views]
    assert "walk" in recording.blueprint("ViewBlueprint:space_origin")
    kept = [path for path, batch in batches if "VisibleTimeRanges:ranges" in batch.schema.names]
    assert all(any(f"walk/prints/{side}" in path for path in kept) for side in ("right", "left"))


def test_no_prints_of_what_could_not_be_levelled(take):
    assert foot_prints(take)
    assert foot_prints(take.with_(rectified=replace(take.rectified, level_ok=False))) == []
    assert foot_prints(take.with_(kinematics=None)) == []


def test_ellipses_hold_the_pelvis_with_90_percent():
    rng = np.random.default_rng(0)
    covariance = np.array([[0.09, 0.03], [0.03, 0.02]])
    path, time_s = np.array([[4.0, 1.0, -1.0]]), np.zeros(1)
    ((*outline,),) = _ellipses(path, covariance[None], time_s, [slice(0, 1)])
    outline = np.array(outline)
    assert (outline[:, 2] == -1).all()
    drawn = rng.multivariate_normal(path[0, :2], covariance, 4000)
    side, to = np.diff(outline[:, :2], axis=0), drawn[:, None] - outline[:-1, :2]
    around = side[:, 0] * to[..., 1] - side[:, 1] * to[..., 0]
    inside = (around > 0).all(axis=1) | (around < 0).all(axis=1)
    assert inside.mean() == pytest.approx(0.9, abs=0.02)


def test_who_walks_has_an_ellipse_a_second_and_who_stays_has_one():
    time_s = np.arange(100) / 20
    covariance = np.tile(0.01 * np.eye(2), (100, 1, 1))
    stays, walks = np.zeros((100, 3)), np.column_stack([1.2 * time_s, 0 * time_s, 0 * time_s])
    assert len(_ellipses(stays, covariance, time_s, [slice(0, 100)])) == 1
    found = _ellipses(walks, covariance, time_s, [slice(0, 100)])
    np.testing.assert_allclose([np.mean(each[:-1, 0]) for each in found], 1.2 * np.arange(5), atol=1e-9)
    covariance[:45] = np.nan  # an error that nobody knows is not drawn
    assert len(_ellipses(walks, covariance, time_s, [slice(0, 100)])) == 2
