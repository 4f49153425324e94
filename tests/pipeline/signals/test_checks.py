"""The chirality guard and the bone check on a person whose left and right are known."""

import numpy as np
import pytest

from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence
from pcnet3d.pipeline.reading.findings import repaired
from pcnet3d.pipeline.signals.checks import bone_spread, chirality, empty_rows

FRAMES = 40


@pytest.fixture
def person(facing_camera) -> PoseSequence:
    jitter = np.random.default_rng(0).normal(scale=0.004, size=(FRAMES, 17, 3))
    return PoseSequence(facing_camera + jitter, H36M17, CAMERA)


@pytest.mark.parametrize(
    ("spoil", "verdict"), [("mirror", "wrong"), ("swap", "wrong"), ("swap-legs", "legs against arms")]
)
def test_a_mirrored_or_renamed_person_is_wrong_and_the_named_repair_mends_it(person, spoil, verdict):
    assert chirality(person).verdict == "good"
    spoiled = repaired(person, spoil)
    assert chirality(spoiled).verdict == verdict
    np.testing.assert_array_equal(repaired(spoiled, spoil).joints, person.joints)


@pytest.mark.parametrize("repair", ["mirror", "swap", "swap-legs"])
def test_stated_errors_go_with_their_joints(person, repair):
    """Of samples and their covariances: repaired samples have the repaired covariances."""
    rng = np.random.default_rng(0)
    errors = rng.normal(size=(400, 17, 3)) * rng.uniform(0.5, 2, (17, 1)) * [1, 1, 3]
    errors[..., 2] += errors[..., 0]

    def covariance(samples):
        return np.einsum("nji,njk->jik", samples, samples) / len(samples)

    stated = np.broadcast_to(covariance(errors), (FRAMES, 17, 3, 3)).astype(np.float32)
    found = repaired(person.with_(covariance=stated), repair)
    moved = repaired(PoseSequence(errors, H36M17, CAMERA), repair).joints
    np.testing.assert_allclose(found.covariance[0], covariance(moved), rtol=1e-4, atol=1e-4)


def test_one_cue_alone_only_warns(person):
    joints = person.joints.copy()
    nose, head, thorax = (H36M17.index(name) for name in ("nose", "head", "thorax"))
    joints[:, nose] = joints[:, thorax] + joints[:, head] - joints[:, nose]
    assert chirality(person.with_(joints=joints)).verdict == "doubtful"


def test_a_nose_that_was_made_of_other_joints_has_no_vote(person):
    """Wherever it is, the knees decide; without them nothing is certain."""
    made = person.deriving("markers", {"nose": "mean(Neck, Head)"})
    assert chirality(made).verdict == "good"
    assert chirality(made).nose_votes == 0
    assert "of 0 frames" not in str(chirality(made))
    assert chirality(repaired(made, "mirror")).verdict == "wrong"
    straight = made.joints.copy()
    for side in "lr":
        hip, knee, ankle = (H36M17.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle"))
        straight[:, knee] = (straight[:, hip] + straight[:, ankle]) / 2
    assert chirality(made.with_(joints=straight)).verdict == "doubtful"


def test_a_few_frames_are_never_strong_evidence(person):
    short = PoseSequence(repaired(person, "mirror").joints[:5], H36M17, CAMERA)
    assert chirality(short).verdict == "doubtful"


def test_bone_spread_ignores_a_person_who_grows_but_not_bones_that_change(person, facing_camera):
    growth = np.linspace(1, 3, FRAMES)[:, None, None]
    assert bone_spread(PoseSequence(facing_camera * growth, H36M17, CAMERA)) < 1e-6
    stretched = facing_camera * np.ones((FRAMES, 1, 1))
    wrist, elbow = H36M17.index("l_wrist"), H36M17.index("l_elbow")
    factor = np.linspace(0.5, 1.5, FRAMES)[:, None]
    stretched[:, wrist] = stretched[:, elbow] + factor * (facing_camera[wrist] - facing_camera[elbow])
    assert bone_spread(PoseSequence(stretched, H36M17, CAMERA)) > 0.01


def test_empty_rows_are_those_with_all_joints_on_one_point(person):
    joints = person.joints.copy()
    joints[3], joints[5] = 0, 0.7
    joints[6] = np.nan
    assert np.flatnonzero(empty_rows(person.with_(joints=joints))).tolist() == [3, 5]
    joints[:, H36M17.index("head")] = np.nan  # a joint that the source never has
    assert np.flatnonzero(empty_rows(person.with_(joints=joints))).tolist() == [3, 5]
    joints[7, 2:] = np.nan
    joints[7, :2] = 0.7  # two points that coincide are no failed frame
    assert np.flatnonzero(empty_rows(person.with_(joints=joints))).tolist() == [3, 5]


@pytest.mark.data("native")
@pytest.mark.parametrize(("name", "worst"), [("boxing", 0.06), ("cycling", 0.11)])
def test_real_lifts_pass_the_guard(data, name, worst):
    joints = np.load(data / "native" / "motionbert" / f"{name}_X3D.npy")
    poses = PoseSequence(joints, H36M17, CAMERA.with_(unit="arbitrary"))
    assert chirality(poses).verdict == "good"
    assert bone_spread(poses) < worst
