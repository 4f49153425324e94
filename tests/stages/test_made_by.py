"""What is said of up and of errors follows from who made the poses, and not from the axes that they come in."""

import numpy as np
import pytest

from golden.jumps import jumping
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import CAMERA, Pipeline, Take, change_frame, rotate
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.running.conclusion import trust
from pcnet3d.pipeline.signals.rates import fall_doubts
from pcnet3d.stages.angles import Angles, errors_unknown
from pcnet3d.stages.drawing.facts import facts_of
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.report.stage import report
from pcnet3d.stages.trajectories import Trajectories

STAGES = Pipeline((Rectify("geometric"), Trajectories(), Angles(), Measures()))


@pytest.fixture(scope="module")
def walk():
    return walker(seconds=10)


@pytest.mark.parametrize("made_by", [MadeBy("estimated", "GEM-X"), MadeBy()])
def test_the_up_of_an_estimators_world_is_told_and_its_error_not_known(walk, made_by):
    """A world that leaned by 8 degrees was "known to within 0.0 degrees"."""
    take = STAGES(Take("gem", poses=walk.poses.with_(made_by=made_by)))
    assert np.isnan(take.rectified.up_bound_deg).all()
    assert "error is not known" in trust(take)[1]
    assert "0.0 degrees" not in trust(take)[1]
    assert "error is not known" in facts_of(take).up_of_world
    assert errors_unknown(take.poses)
    assert errors_unknown(take.poses) in take.notices
    assert "knows its own up" not in report(take)
    assert "slope_error_deg" not in nested(take.measures)["floor"]


def test_a_measured_world_knows_its_up(walk):
    take = STAGES(Take("vicon", poses=walk.poses))
    assert (take.rectified.up_bound_deg == 0).all()
    assert errors_unknown(take.poses) is None
    assert facts_of(take).up_of_world == "The source knows its own up."


def test_measured_poses_in_a_cameras_axes_have_no_lifters_errors(walk):
    seen = change_frame(walk.poses, CAMERA, side_camera(walk).R_camera_from_world)
    lifted = STAGES(Take("lifted", poses=seen.with_(made_by=MadeBy("estimated")))).kinematics
    measured = STAGES(Take("measured", poses=seen)).kinematics
    assert np.isfinite(lifted["r_knee_flexion_sd_deg"]).any()
    assert not np.isfinite(measured["r_knee_flexion_sd_deg"]).any()
    assert np.isfinite(
        STAGES(Take("unsaid", poses=seen.with_(made_by=MadeBy()))).kinematics["r_knee_flexion_sd_deg"]
    ).any()


def test_a_path_that_an_estimator_made_shows_no_jumps_and_doubts_no_rate(walk):
    """It may float or be smoothed: how it falls says nothing about gravity."""
    measured = STAGES(Take("vicon", poses=walk.poses))
    assert "count" in nested(measured.measures)["jumps"]
    estimated = STAGES(Take("gem", poses=walk.poses.with_(made_by=MadeBy("estimated", "GEM-X"))))
    assert "estimate" in nested(estimated.measures)["jumps"]["reason"]
    flying = jumping(4)
    assert fall_doubts(flying)
    assert fall_doubts(flying.with_(made_by=MadeBy("estimated", "GEM-X"))) == []


def test_what_rests_on_an_estimators_path_has_no_error(walk):
    """Nobody knows how far it drifts: not the errors of lifted poses over a path that is known."""
    R_camera_from_world = side_camera(walk).R_camera_from_world
    seen = change_frame(walk.poses, CAMERA, R_camera_from_world)
    root = rotate(R_camera_from_world, walk.root[:, None])[:, 0] + np.array([0.0, 0.0, 5.0])
    own = nested(STAGES(Take("own", poses=seen.with_(root=root, made_by=MadeBy("estimated", "X")))).measures)
    assert own["walking"]["walking_speed"] > 0
    assert not {"walking_speed_error", "mean_step_length_error"} & own["walking"].keys()
    assert "mean_step_time_error_s" in own["walking"]
    assert not {"floor_height_error", "slope_error_deg"} & own["floor"].keys()
