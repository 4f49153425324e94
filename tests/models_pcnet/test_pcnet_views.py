"""Training frames: the published mixture of views, truth that fits the joints, and what spoils the input."""

import numpy as np
import pytest

from pcnet3d.models.mocap import Clip
from pcnet3d.models.pcnet_views import (
    Mixture,
    Views,
    paper_angles,
    read_lifted,
    redefined,
    refuse_shared_subjects,
    seen,
    swing,
    views,
)
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.canonical import R_world_from_body, body_axes
from pcnet3d.pipeline.frames import CAMERA, Z_UP
from pcnet3d.pipeline.rotations import angle_deg, geodesic_deg, rotate

PLAIN = {
    "lifted": 0.0, "wide": 0.0, "combined": 0.0, "swung": 0.0, "definitions_m": 0.0, "noisy": 0.0, "noise_m": 0.0,
    "missing": 0.0, "flipped": 0.0, "roll_deg": 0.0, "unchanged": 1.0,
}  # fmt: skip


@pytest.fixture
def standing(facing_camera):
    """(17, 3) the upright person in a Z-up world, facing -x there."""
    R_world_from_camera = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    assert (CAMERA.right_handed, Z_UP.right_handed) == (True, True)
    return rotate(R_world_from_camera, facing_camera) + np.array([0, 0, 0.9])


@pytest.fixture
def clips(standing):
    rng = np.random.default_rng(0)
    return [
        Clip(
            f"0{i}_01",
            f"0{i}",
            "asfamc",
            30.0,
            (standing + rng.normal(0, 0.03, (80, 17, 3))).astype(np.float32),
        )
        for i in range(3)
    ]


def mixture(**changes):
    return Mixture(**{**PLAIN, **changes})


def lengths(joints):
    pairs = np.array([H36M17.indices(bone) for bone in H36M17.bones])
    return np.linalg.norm(joints[:, pairs[:, 0]] - joints[:, pairs[:, 1]], axis=-1)


def test_the_published_mixture():
    roll, pitch, yaw = paper_angles(np.random.default_rng(0), 200_000)
    front = np.abs(yaw) <= 60  # no side view reaches 3 standard deviations in
    assert front.mean() == pytest.approx(0.75 * 60 / 70, abs=0.01)
    assert (np.abs(yaw) > 140).mean() == pytest.approx(0.10 * 0.954, abs=0.01)
    assert np.abs(pitch).max() == 20
    assert np.abs(roll).max() == 8
    assert (np.abs(pitch[front]) == 20).mean() == pytest.approx(0.0956, abs=0.01)  # 12 degrees clamped at 20
    assert ((yaw > 100) & (yaw < 140)).mean() < 0.02


def test_a_view_without_angles_is_the_person_who_faces_the_camera(monkeypatch):
    zero = np.zeros(1)
    for view in ("paper", "wide"):
        monkeypatch.setattr(
            f"pcnet3d.models.pcnet_views.{view}_angles", lambda rng, count: (zero, zero, zero)
        )
        np.testing.assert_allclose(
            views(view, np.random.default_rng(0), 1)[0], [[0, -1, 0], [0, 0, -1], [1, 0, 0]]
        )


@pytest.mark.parametrize(
    ("view", "angles", "up"),
    [
        # Yaw last: the camera of the paper's mixture rolls when the subject stands sideways and "pitches".
        ("paper", (0, 20, 90), (-np.sin(np.radians(20)), -np.cos(np.radians(20)), 0)),
        # Yaw first: a camera that is really pitched sees up lean away from it whatever the heading.
        ("wide", (0, 20, 90), (0, -np.cos(np.radians(20)), np.sin(np.radians(20)))),
    ],
)
def test_pitch_tilts_body_or_camera(view, angles, up, monkeypatch):
    values = tuple(np.array([float(a)]) for a in angles)
    monkeypatch.setattr(f"pcnet3d.models.pcnet_views.{view}_angles", lambda rng, count: values)
    np.testing.assert_allclose(views(view, np.random.default_rng(0), 1)[0, :, 2], up, atol=1e-9)


def test_wide_views_look_up_and_down_from_everywhere():
    R = views("wide", np.random.default_rng(0), 100_000)
    tilt = angle_deg(R[..., 2], np.array([0, -1.0, 0]))
    assert tilt.max() > 55
    heading = np.degrees(np.arctan2(R[:, 0, 0], R[:, 2, 0]))
    counts, _ = np.histogram(heading, bins=12)
    assert counts.min() > 0.6 * counts.mean()


@pytest.mark.parametrize("view", ["paper", "wide"])
def test_the_joints_seen_have_the_rotation_asked_for(standing, view):
    R = views(view, np.random.default_rng(0), 50)
    joints, fine = seen(np.tile(standing, (50, 1, 1)), R)
    assert fine.all()
    np.testing.assert_allclose(body_axes(joints, R[..., 2]), R, atol=1e-9)
    np.testing.assert_allclose(lengths(joints), lengths(standing[None]).repeat(50, 0), atol=1e-9)


def test_a_batch_tells_the_truth_and_is_the_same_for_the_same_seed(clips):
    spoilt = mixture(
        wide=0.5,
        swung=0.5,
        noisy=0.5,
        noise_m=0.03,
        missing=0.5,
        flipped=0.5,
        unchanged=0.3,
        definitions_m=0.02,
    )
    a, b = (Views(clips, spoilt).batch(np.random.default_rng(5), 200) for _ in range(2))
    for one, other in zip(a, b, strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == np.float32
    np.testing.assert_allclose(body_axes(a.truth, a.R[..., 2]), a.R, atol=1e-4)
    np.testing.assert_array_equal(a.joints[a.valid == 0], 0)
    assert 0 < (a.valid == 0).mean() < 0.3
    assert (a.valid[:, 0] == 1).all()
    changed = np.abs(a.joints - a.truth)[a.valid > 0]
    assert 0 < (changed > 1e-5).mean() < 0.9


def test_without_spoiling_the_input_is_the_truth(clips):
    frames = Views(clips, mixture()).batch(np.random.default_rng(0), 100)
    np.testing.assert_array_equal(frames.joints, frames.truth)
    assert (frames.valid == 1).all()


def test_other_bodies_have_other_proportions_alike_on_both_sides(standing):
    clip = Clip("01_01", "01", "asfamc", 30.0, np.tile(standing, (2, 1, 1)).astype(np.float32))
    captured = lengths(standing[None])
    np.testing.assert_allclose(
        lengths(Views([clip], mixture()).batch(np.random.default_rng(0), 50).truth),
        captured.repeat(50, 0),
        atol=1e-5,
    )
    other = lengths(Views([clip], mixture(unchanged=0.0)).batch(np.random.default_rng(0), 300).truth)
    assert ((other / captured).std(axis=0) > 0.03).all()
    left, right = (
        [H36M17.bones.index(bone) for bone in H36M17.bones if bone[1].startswith(s)] for s in ("l_", "r_")
    )
    np.testing.assert_allclose(np.sort(other[:, left]), np.sort(other[:, right]), atol=1e-5)


def test_a_swing_bends_no_knee_and_stretches_no_limb(clips):
    world = clips[0].joints
    swung = swing(world, np.random.default_rng(0), 1.0)

    def knee(joints, side):
        hip, at, ankle = (joints[:, H36M17.index(f"{side}_{part}")] for part in ("hip", "knee", "ankle"))
        return angle_deg(hip - at, ankle - at)

    assert np.abs(swung - world).max() > 0.1
    np.testing.assert_allclose(knee(swung, "l"), knee(world, "l"), atol=1e-2)
    limbs = [i for i, bone in enumerate(H36M17.bones) if bone[0] not in ("spine",)]
    np.testing.assert_allclose(lengths(swung)[:, limbs], lengths(world)[:, limbs], atol=1e-4)
    np.testing.assert_allclose(swing(world, np.random.default_rng(0), 0.0), world, atol=1e-6)


def test_other_definitions_move_the_trunk_in_its_own_plane(standing):
    joints, _ = seen(np.tile(standing, (100, 1, 1)), views("wide", np.random.default_rng(0), 100))
    moved = redefined(joints, np.random.default_rng(1), 0.02)
    difference = moved - joints
    left = joints[:, H36M17.index("l_shoulder")] - joints[:, H36M17.index("r_shoulder")]
    rows = H36M17.indices(("spine", "thorax", "nose", "head"))
    assert np.abs(np.einsum("bji,bi->bj", difference[:, rows], left)).max() < 1e-6
    assert 0.01 < difference[:, rows].std() < 0.03
    assert np.delete(np.abs(difference), rows, axis=1).max() == 0


def test_a_depth_flip_is_invisible_from_the_front(clips):
    frames = Views(clips, mixture(flipped=1.0)).batch(np.random.default_rng(0), 200)
    np.testing.assert_allclose(frames.joints[..., :2], frames.truth[..., :2], atol=1e-6)
    assert np.abs(frames.joints[..., 2] - frames.truth[..., 2]).max() > 0.05
    np.testing.assert_allclose(lengths(frames.joints), lengths(frames.truth), atol=1e-5)


def write_lifted(path, standing, frames=60, names=("01_01", "02_01")):
    R = views("wide", np.random.default_rng(0), frames)
    truth, _ = seen(np.tile(standing, (frames, 1, 1)), R)
    lifted = 0.6 * truth
    lifted[0] = np.nan
    np.savez(
        path, lifted=lifted, truth=truth, R_camera_from_body=R, lying=np.zeros(len(R)), clip=np.array(names)
    )
    return path


def test_lifted_frames_come_with_their_truth_at_their_scale(clips, standing, tmp_path):
    path = write_lifted(tmp_path / "takes.npz", standing)
    takes = read_lifted([path])
    assert len(takes.joints) == 59  # one was not lifted
    np.testing.assert_allclose(takes.truth, takes.joints, atol=1e-5)
    frames = Views(clips, mixture(lifted=0.5, roll_deg=30.0), [path]).batch(np.random.default_rng(0), 200)
    # The mirrored and the rolled ones too: their rotation is that of their joints.
    np.testing.assert_allclose(body_axes(frames.truth, frames.R[..., 2]), frames.R, atol=1e-4)
    expected = R_world_from_body(standing[None])
    assert geodesic_deg(expected, expected)[0] < 1e-6


def test_lifted_frames_that_are_wanted_must_be_there(clips, tmp_path):
    with pytest.raises(InputError, match="pcnet3d testbed"):
        Views(clips, mixture(lifted=0.5))
    with pytest.raises(InputError, match=r"none\.npz"):
        read_lifted([tmp_path / "none.npz"])
    np.savez(tmp_path / "other.npz", joints=np.zeros(3))
    with pytest.raises(InputError, match="testbed"):
        read_lifted([tmp_path / "other.npz"])


def test_a_subject_on_both_sides_is_refused():
    refuse_shared_subjects(["01_01", "02_05"], ["03_01"], "the test subjects")
    with pytest.raises(InputError, match="02"):
        refuse_shared_subjects(["01_01", "02_05"], ["02_06"], "the test subjects")
