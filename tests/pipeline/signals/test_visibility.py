"""Joints that nobody saw are gaps with a reason, and are said."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.residuals import limb_scores, unsure_joints
from pcnet3d.pipeline import H36M17, PoseSequence, Take
from pcnet3d.pipeline.core.frames import CAMERA, IMAGE
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.core.take import Video
from pcnet3d.pipeline.signals.angles import UNSEEN
from pcnet3d.pipeline.signals.visibility import mean_scores, unseen
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.clean import Clean, not_seen
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

SIZE = (640, 480)
FRAMES = 90
TIMES = np.arange(FRAMES) / 30
ANKLES = H36M17.indices(("r_ankle", "l_ankle"))


def keypoints(points=None, score=0.9):
    if points is None:
        points = np.random.default_rng(0).uniform(100, 300, (FRAMES, 17, 2))
    confidence = np.broadcast_to(score, (FRAMES, 17)).copy()
    return PoseSequence(points, H36M17, IMAGE, confidence, TIMES, np.arange(FRAMES))


def judged(given, size=SIZE):
    return unseen(given, size, np.arange(FRAMES), TIMES)


@pytest.mark.parametrize("score", [0.9, np.nan])
def test_what_is_seen_and_what_has_no_score_is_no_gap(score):
    hidden, out = judged(keypoints(score=score))
    assert not hidden.any()
    assert not out.any()
    assert not judged(keypoints(np.full((FRAMES, 17, 2), 5000.0), score), None)[0].any()  # without a size


@pytest.mark.parametrize(("axis", "value"), [(0, -5.0), (0, 700.0), (1, 0.0), (1, 479.5)])
def test_beyond_the_border_from_a_time_on(axis, value):
    given = keypoints()
    points = given.joints.copy()
    points[60:, ANKLES, axis] = value
    hidden, out = judged(given.with_(joints=points))
    assert hidden[70:, ANKLES].all()
    assert not hidden[:50].any()
    np.testing.assert_array_equal(hidden, out)
    (said,) = not_seen(hidden, out, TIMES)
    assert said.values["how"] == "not in the image"
    assert said.values["when"].startswith("from 2.00 to ")


def test_a_low_score_is_not_seen_by_the_detector():
    given = keypoints()
    score = given.confidence.copy()
    score[:, H36M17.index("l_wrist")] = 0.1
    hidden, out = judged(given.with_(confidence=score))
    assert hidden[:, H36M17.index("l_wrist")].all()
    assert not out.any()
    assert [said.text for said in not_seen(hidden, out, TIMES)] == [
        "The left hand is not visible in the whole take; results that need it are missing there."
    ]


def test_a_short_loss_is_left_to_the_lifter():
    given = keypoints()
    points = given.joints.copy()
    points[40:45, ANKLES] = np.nan
    assert not judged(given.with_(joints=points))[0].any()
    points[40:70, ANKLES] = np.nan
    assert judged(given.with_(joints=points))[0][45:65, ANKLES].all()


def test_without_a_video_the_border_is_that_of_the_told_size(facing_camera):
    points = keypoints().joints.copy()
    points[:, ANKLES, 1] = 479.9
    bodies = np.tile(facing_camera, (FRAMES, 1, 1))
    poses = PoseSequence(bodies, H36M17, CAMERA.with_(origin="pelvis"), None, TIMES, np.arange(FRAMES))
    take = Take("cut", keypoints=keypoints(points), poses=poses)
    for size, missing in ((SIZE, True), (None, False)):
        done = Clean()(take.telling(image_size=size))
        assert np.isnan(done.poses.joints[:, ANKLES]).all() == missing


def test_frames_without_keypoints_say_nothing():
    given = keypoints(np.full((FRAMES, 17, 2), -10.0))
    hidden, _ = unseen(given, SIZE, np.arange(FRAMES, 2 * FRAMES), TIMES + 3)
    assert not hidden.any()


def test_a_take_loses_the_angles_of_what_was_not_seen(facing_camera, tmp_path):
    video = Video(tmp_path / "none.mp4", *SIZE, TIMES, "h264")
    points = keypoints().joints.copy()
    points[:, ANKLES, 1] = 479.9
    moving = facing_camera + np.random.default_rng(1).normal(0, 0.005, (FRAMES, 17, 3))
    poses = PoseSequence(
        moving - moving[:, :1], H36M17, CAMERA.with_(origin="pelvis"), None, TIMES, np.arange(FRAMES)
    )
    take = Take("cut", video=video, keypoints=keypoints(points), poses=poses)
    for stage in (Clean(), Rectify(), Trajectories(), Angles()):
        take = stage(take)
    assert (take.kinematics["r_knee_flexion_reason"] == UNSEEN).all()
    assert np.isnan(take.kinematics["r_knee_flexion_deg"]).all()
    assert (
        np.isfinite(take.kinematics["r_elbow_flexion_deg"]).any()
        or (take.kinematics["r_elbow_flexion_reason"] != UNSEEN).all()
    )
    assert any("feet are not in the image in the whole take" in event.text for event in take.notices)
    assert any(step.name == "unseen" for step in take.poses.history)


def _leaving(rng, sinks_px_a_s=150.0):
    """Keypoints of the built-in walker who sinks out of the image at the bottom, as a detector has them: what is beyond
    the edge lies at it; and the second from which each foot is out."""
    walk = walker()
    times = walk.time_s
    points = side_camera(walk).project(walk.world)
    height = np.nanmax(points[..., 1]) + 40
    points[..., 1] += np.clip(times - 2.0, 0, 2.2)[:, None] * sinks_px_a_s
    gone = points[:, ANKLES, 1] > height - 1
    beyond = points[..., 1] > height - 1
    points += rng.normal(0, 1.0, points.shape)
    points[..., 1] = np.where(beyond, height - 1 - rng.uniform(0.0, 5.0, beyond.shape), points[..., 1])
    score = np.where(beyond, rng.uniform(0.3, 0.6, beyond.shape), 0.9)
    size = (int(points[..., 0].max() + 200), round(height))
    given = PoseSequence(points, H36M17, IMAGE, score, times, np.arange(len(times)))
    return given, size, times, [times[~one][-1] for one in gone.T]


@pytest.mark.parametrize("seed", range(4))
def test_feet_that_pile_up_at_the_edge_are_out_from_when_they_left(seed):
    given, size, times, left_s = _leaving(np.random.default_rng(seed))
    hidden, out = unseen(given, size, given.frame_index, times)
    for joint, at in zip(ANKLES, left_s, strict=True):
        assert abs(times[hidden[:, joint].argmax()] - at) <= 0.1
        assert hidden[times > at + 0.2, joint].all()
        assert not hidden[times < at - 0.2, joint].any()
        np.testing.assert_array_equal(hidden[:, joint], out[:, joint])
    (said,) = [one for one in not_seen(hidden, out, times) if one.values["part"] == "feet"]
    assert said.values["how"] == "not in the image"


def test_who_only_stands_near_the_edge_is_in_the_image():
    given, size, times, _ = _leaving(np.random.default_rng(0), sinks_px_a_s=0.0)
    assert not unseen(given, size, given.frame_index, times)[0].any()


def test_scores_are_means_over_a_quarter_of_a_second_and_of_movenet_only():
    given = keypoints(score=np.where(np.arange(FRAMES) % 2, 0.3, 0.5)[:, None])
    assert mean_scores(given, given.frame_index, TIMES) is None
    found = given.with_(made_by=MadeBy("estimated", "movenet@0")).rows(0, 60)
    scores = mean_scores(found, given.frame_index, TIMES)
    np.testing.assert_allclose(scores[4:50], 0.4, atol=0.02)
    assert np.isnan(scores[70:]).all()


@pytest.mark.parametrize(("between", "meanwhile"), [(0.4, True), (0.7, False)])
@pytest.mark.parametrize("detector", ["movenet@0", "other@0"])
def test_a_joint_that_was_not_seen_comes_back_when_the_detector_is_sure_of_it(between, meanwhile, detector):
    """Of feet behind a banner "not see the feet until 1.2 s, from 4.1 to 7.7 s": between and after it guessed them."""
    score = np.full((FRAMES, 17), 0.9)
    score[:, ANKLES] = 0.1
    score[30:50, ANKLES] = score[75:, ANKLES] = between
    given = keypoints(score=score).with_(made_by=MadeBy("estimated", detector))
    hidden, _ = judged(given)
    assert hidden[:, ANKLES[0]].all() == (meanwhile and detector == "movenet@0")
    assert hidden[:20, ANKLES].all()
    assert not np.delete(hidden, ANKLES, axis=1).any()


@pytest.mark.parametrize("kind", ["measured", "estimated"])
def test_a_detector_hides_nothing_of_motion_capture(kind):
    """Knees that markers had measured lost their range, because MoveNet did not see them in the video."""
    joints = np.random.default_rng(0).normal(size=(FRAMES, 17, 3))
    poses = PoseSequence(joints, H36M17, CAMERA, time_s=TIMES, made_by=MadeBy(kind))
    score = np.full((FRAMES, 17), 0.9)
    score[:, ANKLES] = 0.1
    given = keypoints(score=score).with_(made_by=MadeBy("estimated", "movenet@0"))
    done = Clean()(Take("t", poses=poses, keypoints=given).telling(image_size=SIZE))
    assert np.isnan(done.poses.joints[:, ANKLES]).any() == (kind == "estimated")
    assert ("not-seen" in [each.code for each in done.notices]) == (kind == "estimated")
    assert bool(limb_scores(done)) == bool(unsure_joints(done)) == (kind == "estimated")
