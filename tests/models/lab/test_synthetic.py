"""Synthetic views of motion capture: other proportions; cameras whose stated truth is the truth; 2D noise with the
statistics that its formula states; the published mixture of views."""

import numpy as np
import pytest
import torch

from golden.bodies import bone_lengths, facing_camera
from golden.takes import write_lifted
from pcnet3d.models.common.canonical import body_axes
from pcnet3d.models.lab import synthetic as module
from pcnet3d.models.lab.synthetic import (
    TYPICAL,
    WILD,
    BodyRange,
    Draw,
    Noise,
    NumpyDraw,
    Spoilt,
    ViewRange,
    hidden_joints,
    mirror,
    paper_angles,
    place,
    resize,
    seen,
    views,
)
from pcnet3d.models.lab.training.rectifier import read_lifted
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.layouts import LIMBS
from pcnet3d.pipeline.core.rotations import rotate, transpose
from refusals import refused

BONES = np.array([H36M17.indices(bone) for bone in H36M17.bones])
LOWER = H36M17.indices(("pelvis", "l_hip", "r_hip", "l_knee", "r_knee", "l_ankle", "r_ankle"))
UPPER = [i for i in range(17) if i not in LOWER]


@pytest.fixture
def joints(rng):
    return rng.normal([2.0, 1.0, 0.9], 0.5, (6, 9, 17, 3))


def directions(joints):
    bones = joints[..., BONES[:, 1], :] - joints[..., BONES[:, 0], :]
    return bones / np.linalg.norm(bones, axis=-1, keepdims=True)


def test_bones_change_by_their_factors_and_keep_their_directions(joints, rng):
    factors = module.drawn_factors(torch.from_numpy(joints), NumpyDraw(rng), BodyRange()).numpy()
    resized = resize(joints, factors)
    np.testing.assert_allclose(directions(resized), directions(joints), atol=1e-9)
    ratio = bone_lengths(resized) / bone_lengths(joints)
    np.testing.assert_allclose(ratio, np.broadcast_to(factors[:, None, BONES[:, 1]], ratio.shape))
    assert ratio.std(axis=0).min() > 0.03
    np.testing.assert_allclose(resize(joints, np.full((6, 17), 1.2)), 1.2 * joints)  # the path with the legs
    np.testing.assert_array_equal(factors, factors[:, H36M17.mirror])  # limbs of both sides alike
    left, right = H36M17.indices(("l_wrist", "r_wrist"))
    np.testing.assert_allclose(mirror(joints)[..., left, :], joints[..., right, :] * [-1, 1, 1])


def test_combined_motions_keep_the_legs_of_one_and_the_arms_of_the_other(joints, rng):
    hip = np.array([0.08, 0.06, 0.0])
    for name, side in (("l_hip", hip), ("r_hip", -hip)):
        joints[..., H36M17.index(name), :] = joints[..., 0, :] + side
    expected = joints.copy()
    expected[..., UPPER, :] += rng.normal(0, 0.2, (6, 9, len(UPPER), 3))
    upper = 3 + expected[..., [1, 0, 2]] * [-1, 1, 1]  # that person elsewhere, turned by 90 degrees
    combined = module.combine(*map(torch.from_numpy, (joints, upper))).numpy()
    np.testing.assert_allclose(combined, expected, atol=1e-9)
    joints[:, 4, H36M17.index("l_hip")] = joints[:, 4, 0] + [0.0, 0.0, 0.5]  # hips without a heading
    np.testing.assert_array_equal(module.combine(*map(torch.from_numpy, (joints, upper))), joints)


# Where people are in real videos, mirrored to one side: x, y, logarithm of the size, aspect.
ROWS = np.array([[abs(x), y, np.log(size), aspect] for x, y, size, aspect in module.PLACES])


@pytest.fixture
def draw(rng):
    return NumpyDraw(rng)


@pytest.fixture
def windows(rng):
    """(40, 25, 17, 3): people of scattered joints that wander over metres."""
    person = rng.uniform([-0.4, -0.4, 0], [0.4, 0.4, 1.8], (40, 1, 17, 3))
    return torch.from_numpy(person + np.cumsum(rng.normal(0, 0.05, (40, 25, 1, 3)), axis=1))


def test_people_stand_anywhere_inside_the_image_and_ranges_are_kept(windows, draw):
    many = windows.repeat_interleave(10, 0)
    for of, (low, high), most in ((WILD, (-30, 45), 10.01), (TYPICAL, (-5, 25), 5.01)):
        cameras = place(many, draw, of)
        pixels, size = cameras.project(cameras.to_camera(many)), cameras.image_size[:, None, None]
        assert bool(((pixels >= 0) & (pixels <= size)).all())
        assert bool(((pixels.mean(dim=(1, 2)) / cameras.image_size).std(dim=0) > 0.05).all())
        right, away = (cameras.R_camera_from_world[:, 0, row].numpy() for row in (0, 2))
        pitch = np.degrees(np.arcsin(-away[:, 2]))
        assert low <= pitch.min() < low + 5
        assert high - 5 < pitch.max() <= high
        assert np.abs(np.degrees(np.arcsin(right[:, 2] / np.cos(np.radians(pitch))))).max() <= most
        assert np.abs(np.exp(1j * np.arctan2(away[:, 1], away[:, 0])).mean()) < 0.15  # all around
        ratio = (cameras.focal_px / cameras.image_size.amax(-1)).numpy()
        assert of.focal[0] <= ratio.min() < ratio.max() <= of.focal[1]


def test_people_are_placed_as_in_real_videos_and_a_share_is_before_typical_cameras(monkeypatch):
    for spread in ("PLACE_SPREAD", "SIZE_SPREAD"):
        monkeypatch.setattr(module, spread, 0.0)
    body = facing_camera()[:, [0, 2, 1]] * [1, 1, -1]
    world = torch.from_numpy(np.tile(body, (600, 9, 1, 1)).astype(np.float32))
    cameras = place(world, Draw(2, 0), placed=1.0)
    size = cameras.image_size[:, None, None]
    pixels = cameras.project(cameras.to_camera(world))[:, :, H36M17.indices(LIMBS)]
    spot, large = module.place_and_size((pixels - size / 2) / size.amax(-1, keepdim=True))
    aspect = cameras.image_size[:, 0] / cameras.image_size[:, 1]
    shown = torch.stack([spot[:, 0].abs(), spot[:, 1], large.log(), aspect], dim=-1).numpy()
    fits = (np.abs(shown[:, None] - ROWS) < [0.001, 0.001, 0.01, 0.001]).all(-1)
    assert fits.any(1).mean() > 0.95  # the others do not fit into the image there
    assert fits.any(0).all()  # every row is drawn
    level = ViewRange(pitch_deg=(0, 0), roll_deg=(0, 0))
    both = module.place_among(world, Draw(2, 0), level, WILD, 0.7, 0.0).R_camera_from_world[:, 0, 2, 2]
    assert float((both.abs() < 1e-4).float().mean()) == pytest.approx(0.7, abs=0.06)


GAUSSIAN = Noise(outliers=0, swap_rate=0, missing_rate=0, absent_rate=0)
ELBOW, OTHER = H36M17.indices(("l_elbow", "r_elbow"))
LEGS = H36M17.indices([f"{side}_{part}" for side in "lr" for part in ("knee", "ankle")])


def spread_arms(frames=1, count=1, turned_deg=0.0):
    """(count, frames, 17, 3) the upright person with arms spread, 4 m in front of the camera."""
    joints = facing_camera() * [1, 1, 0]
    for name, x in (("elbow", 0.45), ("wrist", 0.7)):
        for side, sign in (("l", 1), ("r", -1)):
            joints[H36M17.index(f"{side}_{name}")] = [sign * x, joints[H36M17.index("thorax"), 1], 0]
    angle = np.radians(turned_deg)
    x, y = joints[:, 0], joints[:, 1]
    person = np.stack([x * np.cos(angle), y, 4 + x * np.sin(angle)], axis=-1)
    return np.broadcast_to(person, (count, frames, 17, 3)).copy()


def detect(joints, noise=None, fps=30.0, draw=None, spoilt=None):
    """Exact pixels, found keypoints and confidence, and how large the person is."""
    pixels = joints[..., :2] / joints[..., 2:] * 1000 + 500
    draw = draw or NumpyDraw(np.random.default_rng(0))
    given = (torch.from_numpy(part) for part in (pixels, joints))
    keypoints, confidence = (part.numpy() for part in module.detect(*given, draw, fps, noise, spoilt))
    return pixels, keypoints, confidence, np.ptp(pixels, axis=-2).max(axis=-1)[..., None, None]


@pytest.mark.parametrize("fps", [15.0, 60.0])
def test_errors_have_their_size_and_last_and_behind_the_trunk_they_are_larger_and_trusted_less(fps):
    joints = spread_arms(frames=600, count=20)
    joints[..., ELBOW, :] = joints[..., H36M17.index("spine"), :] + [0, 0, 0.3]
    pixels, keypoints, confidence, size = detect(joints, GAUSSIAN, fps)
    error = (keypoints - pixels) / size
    std = error.std(axis=(0, 1, 3))
    np.testing.assert_allclose(std[H36M17.indices(("l_knee", "r_elbow", "spine"))], 0.015, rtol=0.06)
    np.testing.assert_allclose(std[H36M17.indices(("l_wrist", "r_ankle"))], 0.0225, rtol=0.06)
    assert std[ELBOW] == pytest.approx(0.03, rel=0.06)
    assert confidence[..., ELBOW].mean() < confidence[..., OTHER].mean() - 0.15
    joints[..., ELBOW, 2] -= 0.6
    assert not hidden_joints(joints).any()
    knee = error[:, :, H36M17.index("l_knee")]
    correlation = (knee[:, 1:] * knee[:, :-1]).mean() / (knee**2).mean()
    assert correlation == pytest.approx(0.8 ** (30 / fps), abs=0.02)


@pytest.mark.parametrize(
    ("rates", "spoilt", "turned_deg", "low", "high"),
    [
        ({}, {}, 0, 0, 0),
        ({"outliers": 0.01}, {}, 0, 0.009, 0.011),
        ({"swap_rate": 0.02}, {}, 45, 0, 0),
        ({"swap_rate": 0.02}, {}, 90, 0.05, 0.3),
        ({"missing_rate": 0.001}, {}, 0, 0.005, 0.015),
        ({"absent_rate": 0.003}, {}, 0, 0.012, 0.035),
        ({}, {"truncated": 1.0}, 0, 0.2, 0.8),
        ({}, {"occluded": 1.0}, 0, 0.02, 0.5),
        ({}, {"absent": {"l_ankle": 1.0, "r_ankle": 0.5}}, 0, 0.33, 0.42),
    ],
)
def test_what_spoils_keypoints_has_the_share_and_size_that_is_stated(rates, spoilt, turned_deg, low, high):
    """Of legs; joints of the trunk are not occluded, and of the head less is cut off."""
    noise = Noise(
        **dict.fromkeys(("std", "outliers", "swap_rate", "missing_rate", "absent_rate"), 0.0) | rates
    )
    joints = spread_arms(300, 40, turned_deg).astype(np.float32)
    pixels, keypoints, confidence, size = detect(joints, noise, draw=Draw(0, 0), spoilt=Spoilt(**spoilt))
    np.testing.assert_array_equal(np.isnan(keypoints).all(-1), confidence == 0)
    wrong = (keypoints != pixels).any(-1)
    assert low <= wrong[..., LEGS].mean() <= high
    if "swap_rate" in rates:
        mirrored = pixels[..., H36M17.mirror, :]
        np.testing.assert_array_equal(keypoints[wrong], mirrored[wrong])  # whole limbs, in runs
        assert not wrong.any() or wrong.sum() > 4 * (np.diff(wrong.astype(int), axis=1) > 0).sum()
    elif "outliers" in rates:
        far = (np.linalg.norm(keypoints - pixels, axis=-1) / size[..., 0])[wrong]
        assert 0.0999 <= far.min() < far.max() <= 0.3001
    elif spoilt:
        upper = wrong[..., H36M17.indices(("head", "thorax"))].mean((0, 1))
        assert (upper < [0.3, 0.3 if "truncated" in spoilt else 1e-9]).all()


def test_the_published_mixture():
    roll, pitch, yaw = paper_angles(np.random.default_rng(0), 200_000)
    front = np.abs(yaw) <= 60  # no side view reaches 3 standard deviations in
    assert front.mean() == pytest.approx(0.75 * 60 / 70, abs=0.01)
    assert (np.abs(yaw) > 140).mean() == pytest.approx(0.10 * 0.954, abs=0.01)
    assert np.abs(pitch).max() == 20
    assert np.abs(roll).max() == 8
    assert (np.abs(pitch[front]) == 20).mean() == pytest.approx(0.0956, abs=0.01)  # 12 degrees clamped at 20
    assert ((yaw > 100) & (yaw < 140)).mean() < 0.02


@pytest.mark.parametrize(("view", "forward"), [("paper", (-1, 0)), ("wide", (0, 1))])
def test_pitch_tilts_body_or_camera(view, forward, monkeypatch):
    """Yaw last: the camera of the paper's mixture rolls when the subject stands sideways and "pitches". Yaw first: a
    camera that is really pitched sees up lean away from it whatever the heading."""
    values = tuple(np.array([angle]) for angle in (0.0, 20.0, 90.0))
    monkeypatch.setattr(module, f"{view}_angles", lambda rng, count: values)
    c, s = np.cos(np.radians(20)), np.sin(np.radians(20))
    up = views(view, np.random.default_rng(0), 1)[0, :, 2]
    np.testing.assert_allclose(up, [s * forward[0], -c, s * forward[1]], atol=1e-9)


def test_the_joints_seen_have_the_rotation_asked_for_to_the_body_or_to_the_worlds_axes(standing):
    """With targets "axes" R takes the world's axes to the camera's, whatever the person does there."""
    world = np.tile(standing, (20, 1, 1))
    R = views("wide", np.random.default_rng(0), 20)
    joints, fine = seen(world, R)
    assert fine.all()
    np.testing.assert_allclose(body_axes(joints, R[..., 2]), R, atol=1e-9)
    by_axes, _ = seen(world, R, "axes")
    np.testing.assert_allclose(rotate(transpose(R), by_axes), world - world[:, :1], atol=1e-6)
    turned = world[..., [1, 0, 2]] * np.array([-1, 1, 1])  # the person faces another way
    np.testing.assert_allclose(seen(turned, R, "body")[0], joints, atol=1e-6)
    assert np.abs(seen(turned, R, "axes")[0] - by_axes).max() > 0.1


def test_lifted_frames_come_with_their_truth_at_their_scale_and_other_files_are_refused(standing, tmp_path):
    path = write_lifted(tmp_path / "takes.npz", standing)
    takes = read_lifted([path])
    assert len(takes.joints) == 59  # one was not lifted
    np.testing.assert_allclose(takes.truth, takes.joints, atol=1e-5)
    assert takes.clips == ("01_01", "02_01")
    held = dict(np.load(path))
    wrong = [("lifted", np.zeros((60, 17, 2))), ("lying", np.array(["no"] * 60)), ("clip", ["01_01"])]
    for name, content in [*wrong, *(("take_start", start) for start in ([0, 40, 20, 60], [1, 60], []))]:
        np.savez(path, **held | {name: content})
        with refused("wrong-content", name):
            read_lifted([path])
