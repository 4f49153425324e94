"""What is said of up and of errors follows from who made the poses, and not from the axes that they come in."""

import numpy as np
import pytest

from golden.jumps import jumping
from golden.walks import SIZE
from pcnet3d.examples.walker.camera import camera_poses
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.models.gait.clock import clock_doubts
from pcnet3d.pipeline import CAMERA, Pipeline, Take, change_frame, rotate
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.intrinsics import Intrinsics
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.pose import MadeBy, PoseSequence, RootPath
from pcnet3d.pipeline.core.take import Told
from pcnet3d.pipeline.running.sentences import ERRORS_OF_ANGLES, trusted
from pcnet3d.stages.angles import THE_ANGLES, Angles, errors_unknown
from pcnet3d.stages.export.stage import summary
from pcnet3d.stages.lift import Lift
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.report.stage import report
from pcnet3d.stages.trajectories import Trajectories

STAGES = Pipeline((Rectify("geometric"), Trajectories(), Angles(), Measures()))


@pytest.fixture(scope="module")
def seen(walk, camera):
    """The walker in the camera's axes."""
    return change_frame(walk.poses, CAMERA, camera.R_camera_from_world)


@pytest.fixture(scope="module")
def keypoints(walk, camera):
    """All of the walker's joints in the image."""
    scores = np.ones(walk.poses.joints.shape[:2])
    return PoseSequence(
        camera.project(walk.world), H36M17, IMAGE, scores, walk.poses.time_s, walk.poses.frame_index
    )


def unknown(take: Take) -> dict[str, str]:
    """Why errors are not known, by what they are of."""
    said = (each.values for each in take.notices if each.code == "errors-unknown")
    return {each["what"]: each["reason"] for each in said}


@pytest.mark.parametrize("made_by", [MadeBy("estimated", "GEM-X"), MadeBy()])
def test_the_up_of_an_estimators_world_is_told_and_its_error_not_known(walk, made_by):
    """A world that leaned by 8 degrees was "known to within 0.0 degrees"."""
    take = STAGES(Take("gem", poses=walk.poses.with_(made_by=made_by)))
    assert np.isnan(take.rectified.up_bound_deg).all()
    assert "error is not known" in trusted(take)
    assert "0.0°" not in trusted(take)
    assert errors_unknown(take.poses)
    assert errors_unknown(take.poses) in take.notices
    assert "knows its own up" not in report(take)


def test_only_poses_of_a_judged_lifter_have_its_errors(seen):
    """The errors of the built-in lifter's angles were stated for everybody's poses, and held in 20 to 62 % of them."""

    def done(made_by: MadeBy) -> Take:
        return STAGES(Take("take", poses=seen.with_(made_by=made_by)))

    def stated(take: Take) -> bool:
        return bool(np.isfinite(take.kinematics["r_knee_flexion_sd_deg"]).any())

    def of_errors(take: Take) -> bool:
        return THE_ANGLES in unknown(take)

    own, other = done(MadeBy("estimated", shipped_noise().lifter)), done(MadeBy("estimated", "BlazePose"))
    assert stated(own)
    assert not of_errors(own)
    assert own.angle_errors == "judged"
    assert ERRORS_OF_ANGLES["judged"] in report(own)
    assert not stated(other)
    assert other.angle_errors == "none"
    assert "errors of the angles are not known" in report(other)
    assert of_errors(other)
    assert of_errors(done(MadeBy()))
    measured = done(seen.made_by)
    assert not stated(measured)
    assert not of_errors(measured)
    assert measured.angle_errors == "none"


def test_with_the_keypoints_another_lifters_angles_have_errors_by_disagreement(seen, keypoints, camera):
    """As far as both are apart, and no less than the built-in lifter's own."""
    seen = seen.with_(made_by=MadeBy("estimated", "other"))
    told = Told(image_size=(camera.width, camera.height), focal_px=camera.focal_px)
    straight = STAGES(Take("take", poses=seen, keypoints=keypoints, told=told))
    assert straight.angle_errors == "disagreement"
    assert ERRORS_OF_ANGLES["disagreement"] in report(straight)
    assert summary(straight)["angle_errors"] == "disagreement"
    bent = seen.joints.copy()
    knee, ankle = (H36M17.index(f"r_{joint}") for joint in ("knee", "ankle"))
    bent[:, ankle] = bent[:, knee] + (bent[:, ankle] - bent[:, knee]) * [1.0, 0.3, 1.0]
    worse = STAGES(Take("take", poses=seen.with_(joints=bent), keypoints=keypoints, told=told))

    def sd(take: Take, angle: str) -> float:
        return float(np.nanmedian(take.kinematics[f"{angle}_sd_deg"]))

    assert sd(worse, "r_knee_flexion") > sd(straight, "r_knee_flexion") + 2
    assert sd(worse, "l_knee_flexion") == pytest.approx(sd(straight, "l_knee_flexion"), rel=0.1)
    assert np.isnan(worse.kinematics["r_knee_flexion_sd_degps"]).all()


def test_the_gait_of_poses_that_nobody_has_judged_has_no_errors(seen):
    """The built-in lifter's errors of times and of stance stood beside everybody's figures."""
    own = MadeBy("estimated", shipped_noise().lifter)
    for made_by, known in (
        (own, True),
        (seen.made_by, True),
        (MadeBy("estimated", "X"), False),
        (MadeBy(), False),
    ):
        take = STAGES(Take("take", poses=seen.with_(made_by=made_by)))
        walking = nested(take.measures)["walking"]
        assert walking["steps"] >= 3
        assert ("the gait figures" in unknown(take)) != known
        assert any("_error_" in key for key in walking) == known
        assert any("within_error" in key for key in walking) == known
    lifted, measured = (
        nested(STAGES(Take("take", poses=seen.with_(made_by=made_by))).measures)["walking"]
        for made_by in (own, seen.made_by)
    )
    assert measured["mean_stance_error_percent"] < lifted["mean_stance_error_percent"]


def test_the_second_lift_sees_what_the_stage_lift_sees(seen, keypoints, camera, monkeypatch):
    """It saw neither which way is up nor the lens: errors were those of another lift than the stage's."""
    seen = seen.with_(made_by=MadeBy("estimated", "other"))
    told = Told(image_size=(camera.width, camera.height), gravity=tuple((-camera.up).tolist()))
    size, focal = (camera.width, camera.height), float(camera.focal_px)
    lens = Intrinsics((focal, focal), (size[0] / 2, size[1] / 2), (-0.05, 0.0, 0.0, 0.0), image_size=size)
    known = Camera(size, focal, 0.0, "file", intrinsics=lens)
    take = Take("take", poses=seen, keypoints=keypoints, told=told, camera=known)
    given = []
    monkeypatch.setattr("pcnet3d.stages.angles.by_disagreement", lambda *args: given.append(args[2]))
    STAGES(take)
    lifted = Lift()(take.with_(poses=None)).poses
    np.testing.assert_array_equal(given[0].joints, lifted.joints)
    assert [step.name for step in lifted.history][-2:] == ["undistort", "lift"]
    assert lifted.history[-1].options["up_known"]


@pytest.mark.parametrize("of", ["lifted", "measured", "world"])
def test_a_file_of_errors_is_believed_and_told_where_it_is_not_used(walk, seen, tmp_path, of):
    path = tmp_path / "errors.json"
    path.write_text(shipped_noise().as_json(), encoding="utf-8")
    poses = {
        "lifted": seen.with_(made_by=MadeBy("estimated", "other")),
        "measured": walk.poses,
        "world": walk.poses.with_(made_by=MadeBy("estimated", "GEM-X")),
    }[of]
    done = Pipeline((Rectify("geometric"), Trajectories(), Angles(errors=path)))(Take("take", poses=poses))
    used = of == "lifted"
    assert ("the given file" in unknown(done).get(THE_ANGLES, "")) != used
    assert any(each.code == "errors-unknown" and each.warns for each in done.notices) != used
    assert done.angle_errors == ("file" if used else "none")
    assert np.isfinite(done.kinematics["r_knee_flexion_sd_deg"]).any() == used


def test_a_path_that_an_estimator_made_shows_no_jumps_and_doubts_no_rate(walk):
    """It may float or be smoothed: how it falls says nothing about gravity."""
    measured = STAGES(Take("vicon", poses=walk.poses))
    assert nested(measured.measures)["jumps"] == {"observable_percent": 100.0}
    estimated = STAGES(Take("gem", poses=walk.poses.with_(made_by=MadeBy("estimated", "GEM-X"))))
    assert nested(estimated.measures)["jumps"] == {"observable_percent": 0.0}
    flying = jumping(4)
    assert clock_doubts(flying)
    assert clock_doubts(flying.with_(made_by=MadeBy("estimated", "GEM-X"))) == []


def test_what_rests_on_an_estimators_path_has_no_error(walk, seen, camera):
    """Nobody knows how far it drifts: not the errors of lifted poses over a path that is known."""
    root = rotate(camera.R_camera_from_world, walk.root[:, None])[:, 0] + np.array([0.0, 0.0, 5.0])
    own = nested(
        STAGES(Take("own", poses=seen.with_(path=RootPath(root), made_by=MadeBy("estimated", "X")))).measures
    )
    assert own["walking"]["walking_speed"] > 0
    assert not {"walking_speed_error", "mean_step_length_error"} & own["walking"].keys()


def test_what_would_tell_the_errors_is_what_is_missing(walk, keypoints, camera):
    """Keypoints were asked for that had been given: the size of their image was missing, or they were of few frames."""
    poses = camera_poses(walk, camera).with_(made_by=MadeBy("estimated", "another lifter"))
    few = keypoints.rows(0, len(keypoints) // 4)

    def said(**beside) -> str:
        return unknown(STAGES(Take("take", poses=poses, **beside)))[THE_ANGLES]

    assert "keypoints" in said()
    without_size = said(keypoints=keypoints)
    assert "read.image_size" in without_size
    assert "keypoints" not in without_size
    with_both = said(keypoints=few, told=Told(image_size=SIZE))
    assert "angles.errors" in with_both
    assert not any(word in with_both for word in ("keypoints", "image_size"))
