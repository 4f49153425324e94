"""Finished takes: what a run leaves, beside a truth that knows it."""

from pathlib import Path

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.lab.errors.report import SOURCES
from pcnet3d.models.lab.evaluation import finished as module
from pcnet3d.models.lab.evaluation import sets
from pcnet3d.models.lab.evaluation.finished import Configuration, at_rate, finished
from pcnet3d.models.lab.evaluation.real_data import LIMBS, RealCamera, RealTruth
from pcnet3d.pipeline import H36M17, PoseSequence, angle_deg
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.take import Video


@pytest.fixture
def clip(monkeypatch):
    clip = walked(seconds=3)
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
    assert [(one.label, one.truth.subject, one.truth.clip) for one in takes] == [
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


def test_the_real_take_is_known_by_its_limbs_and_seen_by_the_keypoints_that_a_run_finds(clip, monkeypatch):
    limbs = clip.joints[:, H36M17.indices(LIMBS)].astype(np.float64)
    R = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    centre = limbs.mean(axis=(0, 1))
    focal, middle = np.full(2, 1500.0), np.array([960.0, 540.0])
    camera = RealCamera(
        Path("cam.mp4"), R[:, 2], focal, middle, np.zeros(4), R, np.array([0, 0, 9.0]) - R @ centre
    )
    time_s = np.arange(len(limbs)) / clip.fps
    seen = np.zeros((len(limbs), len(COCO17), 2))
    seen[:] = camera.project(limbs).mean(axis=1, keepdims=True)
    seen[:, COCO17.indices(LIMBS)] = camera.project(limbs)
    keypoints = PoseSequence(seen, COCO17, IMAGE, np.ones(seen.shape[:2]), time_s, np.arange(len(limbs)))
    monkeypatch.setattr(module, "read_moving", lambda: ({"cam": camera}, RealTruth(limbs, {})))
    monkeypatch.setattr(module, "read_video", lambda path: Video(path, 1920, 1080, time_s, "h264"))
    monkeypatch.setattr(module, "found_keypoints", lambda video: keypoints)
    (one,) = finished(sets.Question(), Configuration(real=True, focal_known=True))
    assert (one.label, one.truth.subject, one.reason) == ("real take", "real take", "")
    hips = one.truth.joints_camera[:, H36M17.indices(("r_hip", "l_hip"))]
    np.testing.assert_allclose(camera.to_camera(limbs)[:, [LIMBS.index("r_hip"), LIMBS.index("l_hip")]], hips)
    np.testing.assert_allclose(one.truth.joints_camera[:, 0], hips.mean(axis=1))
    assert np.isnan(one.truth.truth[:, H36M17.index("head")]).all()
    assert np.median(np.linalg.norm(one.take.poses.root - one.truth.joints_camera[:, 0], axis=1)) < 1.0
    stated = {stated.statement for source in SOURCES for stated in source(one) if len(stated.error)}
    assert {"up", "knee_flexion", "pelvis along the ray, m", "pelvis from frame to frame, m"} <= stated
    assert "joints" not in stated  # of which nobody knows all
