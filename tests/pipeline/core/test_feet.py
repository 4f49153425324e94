"""Heels and toes ride along: whatever moves the joints moves them alike, and what cannot leaves none."""

import numpy as np
import pytest

from golden.bodies import feet_of, turning
from pcnet3d.pipeline import BODY, CAMERA, H36M17, InputError, PoseSequence, change_frame, remap, rotate
from pcnet3d.pipeline.core.frames import PC_CAMERA
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, FEET, HALPE26, with_feet
from pcnet3d.pipeline.signals.guard import repaired
from pcnet3d.pipeline.signals.swaps import Swap, mask_swaps
from pcnet3d.stages.clean import clean, without
from pcnet3d.stages.rectify import rectify
from pcnet3d.stages.scale import scale
from pcnet3d.stages.trajectories import smooth

FRAMES = 60


@pytest.fixture
def poses():
    bodies = turning(FRAMES)
    return PoseSequence(bodies, H36M17, CAMERA, time_s=np.arange(FRAMES) / 30, feet=feet_of(bodies))


def assert_rigid(poses, tolerance=1e-5):
    """The feet are still where they belong on this body."""
    np.testing.assert_allclose(poses.feet, feet_of(poses.joints.astype(float)), atol=tolerance)


def test_feet_are_checked(poses):
    with pytest.raises(InputError, match="feet of shape"):
        poses.with_(feet=poses.feet[:, :5])
    with pytest.raises(InputError, match="finite"):
        poses.with_(feet=np.full_like(poses.feet, np.inf))
    with pytest.raises(ValueError, match="read-only"):
        poses.feet[0] = 1


def test_other_joints_leave_no_feet_unless_they_are_given(poses):
    assert poses.with_(joints=poses.joints + 1).feet is None
    assert poses.with_(person="1").feet is not None
    assert_rigid(poses.mapped(lambda points: points + 1))


def test_feet_of_layouts(poses):
    """Derived, missing and present ones; a layout that has them itself needs none beside it."""
    points = dict(
        zip((*H36M17.joints, *FEET.joints), np.moveaxis(with_feet(poses).joints, 1, 0), strict=True)
    )

    def named(layout, other):
        joints = np.stack([points.get(joint, other) for joint in layout.joints], axis=1)
        return PoseSequence(joints, layout, CAMERA)

    halpe = remap(named(HALPE26, points["thorax"]))
    np.testing.assert_array_equal(halpe.feet, poses.feet)
    assert remap(halpe, H36M17).feet is not None
    blaze = remap(named(BLAZEPOSE33, points["nose"]))
    small = FEET.indices(["r_small_toe", "l_small_toe"])
    assert np.isnan(blaze.feet[:, small]).all()
    np.testing.assert_array_equal(blaze.feet[:, FEET.index("r_heel")], points["r_heel"])
    assert "r_big_toe = r_foot_index" in blaze.history[-1].options["derived"]
    assert remap(named(HALPE26, points["thorax"]), HALPE26).feet is None


def test_with_feet_leaves_out_what_is_never_there(poses):
    bare = poses.with_(feet=None)
    assert with_feet(bare) is bare
    lacking = poses.feet.copy()
    lacking[:, FEET.index("r_small_toe")] = np.nan
    whole = with_feet(poses.with_(feet=lacking))
    assert len(whole.layout) == 17 + 5
    assert "r_small_toe" not in whole.layout
    assert ("r_heel", "r_big_toe") in whole.layout.bones
    np.testing.assert_array_equal(whole.joint("l_heel"), poses.feet[:, FEET.index("l_heel")])


def test_axes_units_and_origin(poses):
    away = poses.mapped(lambda points: points + np.array([0, 0, 3]), frame=CAMERA.with_(origin="camera"))
    seen = change_frame(away, PC_CAMERA.with_(unit="mm"))
    turn = PC_CAMERA.basis @ CAMERA.basis.T
    np.testing.assert_allclose(seen.feet, 1000 * rotate(turn, poses.feet), atol=1e-2)


def test_scale(poses):
    small = poses.mapped(lambda points: points / 3, frame=CAMERA.with_(unit="arbitrary"))
    again = scale(small, 1.7)[0]
    factor = again.history[-1].options["factor"]
    np.testing.assert_allclose(again.feet, small.feet * factor, rtol=1e-5)


@pytest.mark.parametrize("handedness", ["mirror", "swap", "swap-legs"])
def test_left_and_right_put_right(poses, handedness):
    """What was wrong in joints and feet alike is right in both."""
    wrong = repaired(poses, handedness)
    assert np.abs(wrong.feet - poses.feet).max() > 0.1
    np.testing.assert_allclose(repaired(wrong, handedness).feet, poses.feet, atol=1e-6)
    left, right = (poses.feet[:, FEET.index(f"{side}_heel")] for side in "lr")
    expected = left * [-1, 1, 1] if handedness == "mirror" else right
    np.testing.assert_allclose(wrong.feet[:, FEET.index("l_heel")], expected, atol=1e-6)


def test_swapped_legs_take_their_feet_along(poses):
    def masked(kind):
        return mask_swaps(poses, [Swap(kind=kind, first_row=10, last_row=19, evidence=9.0)]).feet

    assert np.isnan(masked("legs exchanged")[10:20]).all()
    np.testing.assert_array_equal(masked("legs exchanged")[20:], poses.feet[20:])
    np.testing.assert_array_equal(masked("arms exchanged"), poses.feet)


def test_clean_fills_gaps_and_removes_jumps(poses):
    feet = poses.feet.copy()
    feet[20:23, FEET.index("r_heel")] = np.nan
    feet[40, FEET.index("l_heel")] += 1.0
    index = np.delete(np.arange(FRAMES), [50, 51])
    broken = PoseSequence(
        poses.joints[index], H36M17, CAMERA, time_s=index / 30, frame_index=index, feet=feet[index]
    )
    mended = clean(broken)[0]
    assert len(mended) == FRAMES
    assert_rigid(mended, 1e-3)
    assert mended.history[-1].options["spikes_removed"] == 1


def test_a_foot_below_an_ankle_that_nobody_saw_is_missing(poses):
    hidden = np.zeros((FRAMES, 17), dtype=bool)
    hidden[:5, H36M17.index("r_ankle")] = True
    seen = without(poses, hidden)
    right = FEET.indices([point for point in FEET.joints if point.startswith("r_")])
    assert np.isnan(seen.feet[:5, right]).all()
    assert np.isfinite(seen.feet).sum() == poses.feet.size - 5 * 3 * 3


def test_rectified_and_filtered(poses):
    rectified = rectify(poses, "geometric")
    for canonical in (rectified.body, rectified.level):
        assert_rigid(canonical)
    assert rectified.body.frame.family == BODY.family
    still = smooth(rectified.level)[0]
    shaken = rectified.level.feet + 0.02 * np.random.default_rng(0).standard_normal(poses.feet.shape)
    calmed = smooth(rectified.level.with_(feet=shaken))[0]
    assert np.nanstd(calmed.feet - still.feet) < 0.75 * np.std(shaken - rectified.level.feet)
