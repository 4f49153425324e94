"""The types: validated once, frozen, honest about what is missing."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pcnet3d.pipeline import (
    BODY,
    CAMERA,
    H36M17,
    LEVEL,
    InputError,
    MadeBy,
    PoseSequence,
    Rectified,
    Take,
)
from refusals import refused

finite_or_nan = st.floats(-1e6, 1e6, width=32) | st.just(float("nan"))


@given(hnp.arrays(np.float32, st.tuples(st.integers(1, 5), st.just(17), st.just(3)), elements=finite_or_nan))
def test_any_finite_or_missing_coordinates_are_kept_as_they_are(joints):
    poses = PoseSequence(joints, H36M17, CAMERA)
    np.testing.assert_array_equal(poses.joints, joints)
    assert poses.joints.dtype == np.float32
    assert len(poses) == len(joints)


@given(st.lists(st.integers(0, 10**6), min_size=2, max_size=8))
def test_frame_numbers_are_accepted_exactly_when_they_increase(numbers):
    joints = np.zeros((len(numbers), 17, 3))
    if all(a < b for a, b in pairwise(numbers)):
        poses = PoseSequence(joints, H36M17, CAMERA, frame_index=numbers)
        assert poses.frame_index.tolist() == numbers
        assert poses.frames_known
    else:
        with refused("times-broken"):
            PoseSequence(joints, H36M17, CAMERA, frame_index=numbers)


def test_what_does_not_fit_is_refused_with_expected_and_got():
    for joints, changes, words in [
        (np.zeros((3, 16, 3)), {}, ["(frames, 17, 3)", "(3, 16, 3)"]),
        (np.zeros((3, 17, 2)), {}, ["(frames, 17, 3)", "(3, 17, 2)"]),
        (np.zeros((17, 3)), {}, ["(17, 3)"]),
        (np.zeros((0, 17, 3)), {}, ["no frames"]),
        (np.full((2, 17, 3), np.inf), {}, ["infinite", "row 0", "pelvis"]),
        (np.zeros((2, 17, 3)), {"confidence": np.full((2, 17), 1.5)}, ["between 0 and 1"]),
        (np.zeros((2, 17, 3)), {"confidence": np.zeros((2, 3))}, ["(2, 17)", "(2, 3)"]),
        (np.zeros((2, 17, 3)), {"time_s": [0.0, 0.0]}, ["time_s", "increase"]),
        (np.zeros((2, 17, 3)), {"time_s": [0.0, np.nan]}, ["time_s"]),
        (np.zeros((2, 17, 3)), {"frame_index": [0.0, 1.5]}, ["frame_index", "whole"]),
        (np.zeros((2, 17, 3)), {"seams": (2,)}, ["seams"]),
    ]:
        with refused(None, *words):
            PoseSequence(joints, H36M17, CAMERA, **changes)


def test_unknown_frame_numbers_stay_unknown_through_changes():
    poses = PoseSequence(np.zeros((3, 17, 3)), H36M17, CAMERA)
    assert poses.frame_index.tolist() == [0, 1, 2]
    assert not poses.with_(person="7").frames_known


def test_no_clock_no_rate():
    poses = PoseSequence(np.zeros((3, 17, 3)), H36M17, CAMERA)
    with pytest.raises(InputError, match="--fps"):
        _ = poses.fps
    assert poses.with_(time_s=[0, 0.02, 0.04]).fps == pytest.approx(50)
    assert poses.with_(time_s=[0, 0.02, 0.04]).duration_s == pytest.approx(3 / 50)
    assert poses.with_(time_s=[0, 0.02, 0.04]).rows(0, 1).duration_s == 0


def test_rectified_checks_frames_and_shapes():
    level = PoseSequence(np.ones((2, 17, 3)), H36M17, LEVEL)
    eyes = np.broadcast_to(np.eye(3), (2, 3, 3))
    good = {"R_source_from_body": eyes, "R_source_from_level": np.eye(3), "error_deg": np.zeros(2)}
    rectified = Rectified(level, **good, method="m", level_heading="median")
    assert rectified.body.frame == BODY
    np.testing.assert_allclose(rectified.body.joints, level.joints)
    with pytest.raises(InputError, match="LEVEL"):
        Rectified(rectified.body, **good, method="m", level_heading="median")
    with pytest.raises(InputError, match="error_deg"):
        Rectified(level, **{**good, "error_deg": np.zeros(3)}, method="m", level_heading="median")


def test_arrays_are_shared_only_where_nobody_can_change_them():
    joints = np.zeros((3, 17, 3), np.float32)
    window = joints[:]
    window.setflags(write=False)
    for array in (joints, window):  # the second can be changed through the first
        poses = PoseSequence(array, H36M17, CAMERA)
        joints += 1
        assert (poses.joints == joints - 1).all()
    again = poses.noted("nothing").with_(person="1")
    assert again.joints is poses.joints
    assert again.confidence is poses.confidence
    assert joints.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        again.joints[0] = 1


def test_other_joints_leave_no_covariance_unless_it_is_given():
    poses = PoseSequence(np.zeros((4, 17, 3)), H36M17, CAMERA)
    covariance = np.broadcast_to(np.eye(poses.frame.dims), (*poses.joints.shape, poses.frame.dims))
    stated = poses.with_(covariance=covariance)
    assert stated.with_(person="1").covariance is not None
    assert stated.with_(joints=poses.joints * 2).covariance is None
    assert stated.with_(joints=poses.joints * 2, covariance=4 * covariance).covariance[0, 0, 0, 0] == 4
    with pytest.raises(InputError, match="covariance of shape"):
        poses.with_(covariance=covariance[:, :3])


def test_printed_in_one_line_with_who_how_many_rate_frame_and_unit():
    poses = PoseSequence(
        np.zeros((3, 17, 3)), H36M17, CAMERA, time_s=np.arange(3) / 25, person="anna\x1b[2J",
        made_by=MadeBy("estimated", "MotionBERT"),
    )  # fmt: skip
    for words in ("anna\\x1b[2J", "3 frames", "25 a second", "H36M17 in CAMERA", "m", "MotionBERT"):
        assert words in repr(poses)
    assert f"{poses.in_words}; filled: poses>" in repr(Take("walk", poses=poses))
