"""Finished takes: what a run leaves, beside a truth that knows it."""

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lab.evaluation import sets
from pcnet3d.models.lab.evaluation.finished import Configuration, at_rate, finished
from pcnet3d.pipeline import angle_deg
from pcnet3d.pipeline.reading.mocap.clip import Clip


@pytest.fixture
def clip(monkeypatch):
    walk = walker(seconds=3)
    clip = Clip("03_01", "03", "asfamc", walk.fps, walk.world.astype(np.float32))
    monkeypatch.setattr(sets, "read_clips", lambda subjects: (clip,))
    return clip


def tilt(one):
    up = one.take.rectified.R_source_from_level[..., 2]
    return angle_deg(*np.broadcast_arrays(up, one.truth.up))


@pytest.mark.parametrize(
    ("configuration", "most_deg"),
    [
        (Configuration(up_told=True, bed="typical"), 1.0),
        (Configuration(image=True, camera="moving", fps=60.0, bed="typical"), 2.0),
        (Configuration(lifter="", image=True, bed="typical"), 2.0),
    ],
)
def test_a_take_is_finished_and_its_truth_is_that_of_its_frames(clip, configuration, most_deg):
    takes = list(finished(sets.Question(people="test"), configuration))
    assert [(one.label, one.person, one.clip) for one in takes] == [
        ("CMU test", "03", "03_01"),
        ("HDM05", "03", "03_01"),
    ]
    one = takes[0]
    assert one.take.poses.fps == pytest.approx(configuration.fps)
    assert len(one.take.poses) == len(one.truth.truth)
    assert one.truth.up.shape == ((3,) if configuration.camera == "static" else (len(one.truth.truth), 3))
    assert tilt(one).mean() < most_deg
    assert np.isfinite(one.take.kinematics["r_knee_flexion_deg"]).any()


def test_another_rate_goes_through_the_captured_joints(clip):
    twice = at_rate(clip, 60.0)
    assert len(twice) == 2 * len(clip) - 1
    np.testing.assert_allclose(twice.joints[::2], clip.joints, atol=1e-5)
    assert at_rate(clip, clip.fps) is clip
