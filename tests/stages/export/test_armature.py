"""The animated skeleton against the walker's joints: where they are, how it stands at rest, what a gap does."""

from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.rotations import geodesic_deg
from pcnet3d.pipeline.files.skeletons import place
from pcnet3d.stages.export.animation import ANIMATION, armature
from pcnet3d.stages.export.markers import evenly, markers
from refusals import refused


def of_rows(filtered, kept, **changes):
    """The filtered poses of those rows alone."""
    arrays = ("joints", "confidence", "time_s", "frame_index")
    path = filtered.path.each(lambda values: values[kept])
    return replace(filtered, path=path, **{name: getattr(filtered, name)[kept] for name in arrays} | changes)


def posed(found):
    """(N, J, 3) by the joints' names."""
    joints, _ = place(found.skeleton, found.root, found.R_parent_from_joint)
    return dict(zip(found.skeleton.names, np.moveaxis(joints, 1, 0), strict=True))


@pytest.mark.parametrize("feet", [False, True])
def test_joints_are_where_the_take_has_them(walked, feet):
    """But for the walker's soles, which bend where they meet the floor."""
    take = walked(feet)
    found, wanted = armature(take), evenly(take, ANIMATION)
    joints = posed(found)
    assert len(wanted.names) == (23 if feet else 17)
    for i, name in enumerate(wanted.names):
        off = 2e-3 if name in H36M17 else 0.05
        np.testing.assert_allclose(joints[name] - found.root, wanted.joints[:, i], atol=off, err_msg=name)
    over_the_floor = markers(take, ANIMATION).root
    np.testing.assert_allclose(found.root - found.root[0], over_the_floor - over_the_floor[0], atol=1e-9)


def test_bones_do_not_spin_about_themselves(walked):
    """A knee and an elbow are hinges: their rotation is the angle between their bones, and no more."""
    take = walked()
    found = armature(take)
    joints = {name: take.filtered.joint(name).astype(float) for name in H36M17.joints}
    for end, joint, start in (("ankle", "knee", "hip"), ("wrist", "elbow", "shoulder")):
        for side in "lr":
            upper = joints[f"{side}_{joint}"] - joints[f"{side}_{start}"]
            lower = joints[f"{side}_{end}"] - joints[f"{side}_{joint}"]
            cosine = (upper * lower).sum(-1) / np.linalg.norm(upper, axis=-1) / np.linalg.norm(lower, axis=-1)
            R = found.R_parent_from_joint[:, found.skeleton.names.index(f"{side}_{joint}")]
            bend = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
            np.testing.assert_allclose(geodesic_deg(R, np.eye(3)), bend, atol=1.0)
    steps = geodesic_deg(found.R_parent_from_joint[1:], found.R_parent_from_joint[:-1])
    assert steps.max() < 26  # the arms are raised by 25 degrees a frame


def test_frames_without_a_pose_are_cut_at_the_ends_and_held_between(gappy, walk):
    found = armature(gappy)
    assert len(found.root) == len(walk) - 4
    assert found.time_s[0] == pytest.approx(walk.time_s[4])
    assert found.held["pelvis"] == found.held["r_knee"] == 10
    assert found.held["l_elbow"] == 15
    assert not found.held["l_wrist"]
    elbow = found.skeleton.names.index("l_elbow")
    held = found.R_parent_from_joint[15:22, elbow]
    np.testing.assert_array_equal(held[1:6], np.repeat(held[:1], 5, axis=0))
    assert geodesic_deg(held[5], held[6]) > 0.01
    said = {event.code: event for event in found.notes("a.bvh")}
    assert "in 15 of 116 frames nothing is known about l_elbow" in said["animation-held"].text
    assert all(event.weight == "note" for event in found.notes("a.bvh"))


def test_a_straight_upper_arm_needs_no_wrist(gappy, walk):
    """A missing wrist takes the forearm, not the upper arm that ends in a known elbow."""
    found = armature(gappy)
    joints = posed(found)
    elbow = evenly(gappy, ANIMATION).joints[20:25, H36M17.index("l_elbow")]
    np.testing.assert_allclose((joints["l_elbow"] - found.root)[16:21], elbow, atol=2e-3)


def test_without_a_path_the_pelvis_stays_above_feet_on_the_floor(walked):
    take = walked()
    filtered = take.filtered.with_(path=None)
    found = armature(take.with_(filtered=filtered))
    assert np.ptp(found.root, axis=0).max() == 0
    assert found.root[0, 1] == pytest.approx(0.93, abs=0.03)


def test_a_limb_that_is_never_seen_is_left_out(walked):
    take = walked()
    joints = np.array(take.filtered.joints)
    joints[:, H36M17.index("r_knee")] = np.nan
    found = armature(take.with_(filtered=take.filtered.with_(joints=joints)))
    assert {"r_knee", "r_ankle"}.isdisjoint(found.skeleton.names)
    assert "l_ankle" in found.skeleton.names


@pytest.mark.parametrize("tick_s", [1e-9, 1 / 90_000, 1e-3])
def test_every_measured_row_is_kept_where_others_are_lost(walked, walk, tick_s):
    """A fifth of the frames was lost; the stamps of the rest are rounded as MP4, MPEG-TS and MKV do."""
    kept = np.union1d([0, len(walk) - 1], np.flatnonzero(np.random.default_rng(1).random(len(walk)) < 0.8))
    whole = walked()
    stamps = np.round(whole.filtered.times[kept] / tick_s) * tick_s
    part = whole.with_(filtered=of_rows(whole.filtered, kept, time_s=stamps))
    found, wanted = evenly(part, ANIMATION), evenly(whole, ANIMATION)
    np.testing.assert_allclose(found.time_s, wanted.time_s, atol=1e-3)
    np.testing.assert_array_equal(found.joints[kept], wanted.joints[kept])
    np.testing.assert_array_equal(found.root[kept], wanted.root[kept])
    lost = np.setdiff1d(np.arange(len(walk)), kept)
    assert np.isnan(found.joints[lost]).all()


def test_when_the_take_begins_is_said(walked, walk):
    assert not any(event.code == "file-begins" for event in armature(walked()).notes("a.bvh"))
    said = armature(walked(time_s=walk.time_s + 7.25)).notes("a.bvh")
    assert [event.values["begin_s"] for event in said if event.code == "file-begins"] == [7.25]


def test_what_cannot_be_animated_is_refused(walked):
    take = walked()
    with refused("needs-stage"):
        armature(take.with_(filtered=None))
    first = take.filtered
    one = type(first)(first.joints[:1], first.layout, first.frame, time_s=first.times[:1])
    with pytest.raises(InputError, match="two frames or more"):
        armature(take.with_(filtered=one))
    joints = np.array(take.filtered.joints)
    joints[:, H36M17.index("r_hip")] = np.nan
    with pytest.raises(InputError, match=r"pelvis, hips and spine .* too short to be smoothed"):
        armature(take.with_(filtered=take.filtered.with_(joints=joints)))
