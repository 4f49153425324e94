"""A run of 43 frames from the side, lifted from noisy keypoints: what the user is told of it."""

import pytest

from golden.virtual import lifted
from pcnet3d.models.lab.evaluation.testbed import see
from pcnet3d.models.lab.mocap.clips import read_clips
from pcnet3d.models.lab.synthetic.cameras import TYPICAL
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.place import Place
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

pytestmark = pytest.mark.data("accad_mocap.npz")
TRUE_STEP_S, TRUE_MPS, TRUE_FLIGHT_S = 0.33, 4.94, 0.15


@pytest.fixture(scope="module", params=[0, 1, 6])
def running(request):
    """`measures.walking`, from three sides."""
    (clip,) = (clip for clip in read_clips("val") if clip.name == "accad-m1_run")
    take = lifted(clip, see(clip, request.param, views=TYPICAL))
    for stage in (Place(), Rectify(), Trajectories(), Angles(), Measures()):
        take = stage(take)
    return nested(take.measures)["walking"]


def test_a_short_run_has_steps_flight_cadence_and_speed_with_errors(running):
    assert running["gait"] == "running"
    assert running["steps"] >= 2
    for name, true in (
        ("mean_step_time_s", TRUE_STEP_S),
        ("mean_flight_time_s", TRUE_FLIGHT_S),
        ("cadence_spm", 60 / TRUE_STEP_S),
        ("walking_speed", TRUE_MPS),
    ):
        words, _, unit = name.rpartition("_")
        error = running["walking_speed_error" if name == "walking_speed" else f"{words}_error_{unit}"]
        assert abs(running[name] - true) < 2.5 * error, name
        assert error < 0.4 * true, name
