"""Heels and toes are joints: whatever moves the others moves them alike; what looks at the body does without them."""

import numpy as np
import pytest

from golden.bodies import BODY_AND_FEET, feet_in, feet_of, turning, with_feet
from pcnet3d.pipeline import BODY, CAMERA, H36M17, PoseSequence, remap
from pcnet3d.pipeline.core.conversions import body_in
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, FEET, HALPE26, body_of
from pcnet3d.pipeline.reading.findings import findings_of, repaired
from pcnet3d.stages.clean import clean, without
from pcnet3d.stages.rectify import rectify
from pcnet3d.stages.trajectories import smooth

FRAMES = 60


@pytest.fixture
def poses():
    return PoseSequence(
        with_feet(turning(FRAMES)), BODY_AND_FEET, CAMERA, time_s=np.arange(FRAMES) / 30,
        covariance=np.tile(np.eye(3), (FRAMES, len(BODY_AND_FEET), 1, 1)),
    )  # fmt: skip


def assert_rigid(poses, tolerance=1e-5):
    """The feet are still where they belong on this body."""
    body = poses.without_feet.joints.astype(float)
    np.testing.assert_allclose(feet_in(poses), feet_of(body), atol=tolerance)


def test_the_body_alone(poses):
    body = poses.without_feet
    assert body.layout == H36M17
    assert body.joints.shape[1] == body.confidence.shape[1] == body.covariance.shape[1] == 17
    assert body.without_feet is body
    halpe = PoseSequence(np.zeros((1, 26, 3)), HALPE26, CAMERA)
    assert halpe.without_feet is halpe
    assert not HALPE26.is_body
    assert H36M17.is_body
    assert BODY_AND_FEET.is_body


def test_a_layout_of_feet_has_both_sides():
    layout = body_of(["r_heel", "nose"])
    assert layout.joints[17:] == ("r_heel", "l_heel")
    assert layout.joints[layout.mirror[17]] == "l_heel"
    assert body_of(["nose"]) is H36M17


def with_all(poses):
    return remap(poses, body_in(poses))


def test_feet_of_layouts(poses):
    """Derived, missing and present ones."""
    points = dict(zip(BODY_AND_FEET.joints, np.moveaxis(poses.joints, 1, 0), strict=True))

    def named(layout, other):
        joints = np.stack([points.get(joint, other) for joint in layout.joints], axis=1)
        return PoseSequence(joints, layout, CAMERA)

    halpe = with_all(named(HALPE26, points["thorax"]))
    np.testing.assert_array_equal(feet_in(halpe), feet_in(poses))
    assert with_all(halpe) is halpe
    assert remap(halpe).layout == H36M17
    blaze = with_all(named(BLAZEPOSE33, points["nose"]))
    assert "r_small_toe" not in blaze.layout
    assert ("r_heel", "r_big_toe") in blaze.layout.bones
    np.testing.assert_array_equal(blaze.joint("r_heel"), points["r_heel"])
    assert "r_big_toe = r_foot_index" in blaze.history[-1].options["derived"]
    assert remap(named(HALPE26, points["thorax"]), HALPE26).layout == HALPE26


def test_points_that_are_never_there_are_left_out(poses):
    assert body_in(named_without(poses, "small_toe")) == body_of({"r_heel", "r_big_toe"})
    assert body_in(named_without(poses, "heel", "toe")) == H36M17


def named_without(poses, *parts):
    """Of HALPE26, with these points of the feet NaN throughout."""
    halpe = np.stack(
        [
            np.full((FRAMES, 3), np.nan)
            if name.endswith(parts)
            else poses.joint(name if name in poses.layout else "head")
            for name in HALPE26.joints
        ],
        axis=1,
    )
    return PoseSequence(halpe, HALPE26, CAMERA)


def test_feet_do_not_count_among_the_joints_that_are_looked_at(poses):
    """A heel that comes and goes makes no row incomplete."""
    joints = poses.joints.copy()
    joints[::2, BODY_AND_FEET.index("r_heel")] = np.nan
    gone = poses.with_(joints=joints)
    assert [each.code for each in findings_of(gone)] == [
        each.code for each in findings_of(poses.without_feet)
    ]


@pytest.mark.parametrize("handedness", ["mirror", "swap", "swap-legs"])
def test_left_and_right_put_right(poses, handedness):
    """What was wrong in joints and feet alike is right in both."""
    wrong = repaired(poses, handedness)
    assert np.abs(feet_in(wrong) - feet_in(poses)).max() > 0.1
    np.testing.assert_allclose(repaired(wrong, handedness).joints, poses.joints, atol=1e-6)
    left, right = (poses.joint(f"{side}_heel") for side in "lr")
    expected = left * [-1, 1, 1] if handedness == "mirror" else right
    np.testing.assert_allclose(wrong.joint("l_heel"), expected, atol=1e-6)


def test_clean_fills_gaps_and_removes_jumps(poses):
    joints = poses.joints.copy()
    joints[20:23, BODY_AND_FEET.index("r_heel")] = np.nan
    joints[40, BODY_AND_FEET.index("l_heel")] += 1.0
    index = np.delete(np.arange(FRAMES), [50, 51])
    broken = PoseSequence(joints[index], BODY_AND_FEET, CAMERA, time_s=index / 30, frame_index=index)
    mended = clean(broken)[0]
    assert len(mended) == FRAMES
    assert_rigid(mended, 1e-3)
    assert mended.history[-1].options["spikes_removed"] == 1


def test_a_foot_below_an_ankle_that_nobody_saw_is_missing(poses):
    hidden = np.zeros((FRAMES, 17), dtype=bool)
    hidden[:5, H36M17.index("r_ankle")] = True
    feet = feet_in(without(poses, hidden))
    right = FEET.indices([point for point in FEET.joints if point.startswith("r_")])
    assert np.isnan(feet[:5, right]).all()
    assert np.isfinite(feet).sum() == feet.size - 5 * 3 * 3


def test_rectified_and_filtered(poses):
    rectified = rectify(poses, "geometric")
    for canonical in (rectified.body, rectified.level):
        assert_rigid(canonical)
    assert rectified.body.frame.family == BODY.family
    still = feet_in(smooth(rectified.level)[0])
    noise = 0.02 * np.random.default_rng(0).standard_normal(poses.joints.shape)
    shaken = rectified.level.with_(joints=rectified.level.joints + noise)
    calmed = feet_in(smooth(shaken)[0])
    assert np.nanstd(calmed - still) < 0.75 * np.std(feet_in(shaken) - feet_in(rectified.level))
