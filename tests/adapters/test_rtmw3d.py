"""RTMW3D's demo JSON: crop pixels and depth bins of 133 joints (formats.md 4)."""

import numpy as np
import pytest

from golden.lifters import rtmw3d
from pcnet3d.adapters import read
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.anthropometry import implied_stature

FRAMES = 60


@pytest.fixture
def save(turning, tmp_path):
    """save(change) writes results_walk.json of the demo, after change(crop coordinates (T, 133, 3))."""
    return lambda change=lambda crop: crop, count=133: rtmw3d(tmp_path, [turning(FRAMES)], change, count)


def test_golden(save, turning):
    stature = implied_stature(turning(FRAMES))
    path = save()
    poses = read(path, fps=30, stature_m=stature)
    assert poses.root is None  # a place in the crop
    limbs = [joint for joint in H36M17.joints if joint.endswith(("hip", "knee", "ankle", "elbow", "wrist"))]
    expected = turning(FRAMES)
    hips = expected[:, H36M17.indices(["l_hip", "r_hip"])].mean(axis=1)  # COCO has no pelvis
    for joint in limbs:
        np.testing.assert_allclose(poses.joint(joint), expected[:, H36M17.index(joint)] - hips, atol=2e-3)
    assert (poses.frame.name, poses.frame.unit) == ("CAMERA", "m")
    assert poses.frame_index[0] == 0
    assert np.nanmax(poses.confidence) == 1


def test_what_is_assumed_is_said(save):
    assert {said.code for said in read(save()).notices} == {"rebased-to-floor"}


def test_stature_sets_the_plane_and_not_the_depth(save):
    path = save()
    small, tall = (read(path, stature_m=stature) for stature in (1.5, 1.9))
    assert implied_stature(tall.joints) == pytest.approx(1.9, abs=1e-3)
    np.testing.assert_allclose(small.joints[..., 2], tall.joints[..., 2], atol=1e-6)
    with pytest.raises(InputError, match="stature_m"):
        read(path, stature_m=17)


def test_wrong_joints_name_the_other_adapter(save):
    with pytest.raises(InputError, match="adapter mmpose3d reads 17"):
        read(save(count=17), "rtmw3d")


def test_depth_without_a_body_is_refused(save):
    with pytest.raises(InputError, match="deeper than tall"):
        read(save(lambda crop: crop * [1, 1, 100]), "rtmw3d")
