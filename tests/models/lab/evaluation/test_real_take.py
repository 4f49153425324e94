"""Real takes with truth: what is known of them is what their cameras saw, and errors are the ones put in."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.gravity.view import known_camera
from pcnet3d.models.lab import beds as testbed
from pcnet3d.models.lab.beds import BALANCING, STANDING, Configuration, finished
from pcnet3d.models.lab.evaluation.errors import statements
from pcnet3d.models.lab.evaluation.real_take import row
from pcnet3d.pipeline import H36M17, PoseSequence, rotate
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.layouts import COCO17, LIMBS
from pcnet3d.pipeline.core.take import Video

SIZE = (1920, 1080)


@pytest.fixture
def walk(monkeypatch, tmp_path):
    """Somebody walks before a level camera, whose limbs and camera are known; of "standing" only up. In three frames
    the detector finds nobody."""
    clip = walked(seconds=3)
    limbs = clip.joints[:, H36M17.indices(LIMBS)].astype(np.float64)
    R = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    t_m = np.array([0, 0, 9.0]) - R @ limbs.mean(axis=(0, 1))
    camera = {"up_in_camera": R[:, 2], "focal_px": np.full(2, 1500.0), "R_camera_from_world": R, "t_m": t_m}
    visible = rotate(R, limbs) + t_m
    pixels = 1500.0 * visible[..., :2] / visible[..., 2:] + np.array(SIZE) / 2
    joints = np.repeat(pixels.mean(axis=1, keepdims=True), len(COCO17), axis=1)
    joints[:, COCO17.indices(LIMBS)] = pixels
    time_s, rows = np.arange(len(limbs)) / clip.fps, np.delete(np.arange(len(limbs)), [40, 41, 42])
    seen = np.ones((len(rows), len(COCO17)))
    keypoints = PoseSequence(joints[rows], COCO17, IMAGE, seen, time_s[rows], rows)
    video = Video(Path("cam.mp4"), *SIZE, time_s, "h264")
    monkeypatch.setattr(testbed, "data_folder", lambda: tmp_path)
    monkeypatch.setattr(testbed, "read_cameras", lambda folder: {"cam": camera})
    monkeypatch.setattr(testbed, "read_limbs", lambda folder: None if "static" in folder.name else limbs)
    monkeypatch.setattr(testbed, "read_seen", lambda path: (video, keypoints))
    monkeypatch.setattr(testbed, "camera_of", lambda *_: known_camera(SIZE, 1500.0, None))


def test_a_take_is_known_by_its_limbs_and_seen_by_the_keypoints_that_a_run_finds(walk):
    (one,) = finished(Configuration(real=BALANCING, focal_known=True, image=True))
    assert (one.label, one.truth.subject) == ("real take", "real take")
    hips = one.truth.joints_camera[:, H36M17.indices(("r_hip", "l_hip"))]
    np.testing.assert_allclose(one.truth.joints_camera[:, 0], hips.mean(axis=1))
    np.testing.assert_allclose(
        one.truth.world[..., 2] - one.truth.world[:, :1, 2], one.truth.truth @ one.truth.up
    )
    assert np.isnan(one.truth.truth[:, H36M17.index("head")]).all()
    assert np.median(np.linalg.norm(one.take.poses.root - one.truth.joints_camera[one.rows, 0], axis=1)) < 1.0
    stated = statements(one)
    assert {"up", "knee_flexion", "pelvis along the ray, m", "pelvis from frame to frame, m"} <= set(stated)
    assert "joints" not in stated  # of which nobody knows all
    figures = {"/".join(keys): value for keys, value in row(one)}
    assert 5 < figures["rigid_mm"] < 200
    assert figures["knee_flexion/mae"] <= figures["knee_flexion/rmse"] < 40
    assert figures["up_deg"] < 10
    of_none = {"/".join(keys): value for keys, value in row(replace(one, take=None))}
    assert of_none.keys() == figures.keys()
    assert of_none.pop("levelled") == 0
    assert np.isnan([*of_none.values()]).all()
    (still,) = finished(Configuration(real=STANDING, image=True))
    assert [keys for keys, _ in row(still)] == [("levelled",), ("up_deg",), ("stated_deg",)]
