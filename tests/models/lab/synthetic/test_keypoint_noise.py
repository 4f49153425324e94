"""The 2D noise has the statistics that its formula states."""

import numpy as np
import pytest

from golden.bodies import facing_camera
from pcnet3d.pipeline import H36M17

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
from pcnet3d.models.lab.synthetic import keypoint_noise  # noqa: E402
from pcnet3d.models.lab.synthetic.draw import Draw, NumpyDraw  # noqa: E402
from pcnet3d.models.lab.synthetic.keypoint_noise import Noise, Spoilt, hidden_joints, in_profile  # noqa: E402

GAUSSIAN = Noise(outliers=0, swap_rate=0, missing_rate=0, absent_rate=0)
STANDING = {
    "pelvis": (0, 0), "r_hip": (-0.1, 0), "r_knee": (-0.12, 0.45), "r_ankle": (-0.14, 0.9),
    "l_hip": (0.1, 0), "l_knee": (0.12, 0.45), "l_ankle": (0.14, 0.9), "spine": (0, -0.25), "thorax": (0, -0.5),
    "nose": (0, -0.6), "head": (0, -0.8), "l_shoulder": (0.2, -0.5), "l_elbow": (0.45, -0.5), "l_wrist": (0.7, -0.5),
    "r_shoulder": (-0.2, -0.5), "r_elbow": (-0.45, -0.5), "r_wrist": (-0.7, -0.5),
}  # fmt: skip


def standing(frames=1, count=1, turned_deg=0.0):
    """(count, frames, 17, 3) a person with arms spread, 4 m in front of the camera, whose own left is to the right."""
    flat = np.array([STANDING[name] for name in H36M17.joints])
    angle = np.radians(turned_deg)
    person = np.stack([flat[:, 0] * np.cos(angle), flat[:, 1], 4 + flat[:, 0] * np.sin(angle)], axis=-1)
    return np.broadcast_to(person, (count, frames, 17, 3)).copy()


def detect(pixels, joints, noise=None, fps=30.0):
    draw = NumpyDraw(np.random.default_rng(0))
    found = keypoint_noise.detect(torch.from_numpy(pixels), torch.from_numpy(joints), draw, fps, noise)
    return tuple(part.numpy() for part in found)


def pixels_of(joints):
    return joints[..., :2] / joints[..., 2:] * 1000 + 500


def errors(joints, noise=GAUSSIAN, fps=30.0):
    pixels = pixels_of(joints)
    keypoints, _ = detect(pixels, joints, noise, fps)
    return (keypoints - pixels) / np.ptp(pixels, axis=-2).max(axis=-1)[..., None, None]


def test_size_of_the_error():
    error = errors(standing(frames=400, count=20))
    std = error.std(axis=(0, 1, 3))
    np.testing.assert_allclose(std[H36M17.indices(("l_knee", "r_elbow", "spine"))], 0.015, rtol=0.05)
    np.testing.assert_allclose(std[H36M17.indices(("l_wrist", "r_ankle"))], 0.0225, rtol=0.05)
    assert np.abs(error.mean(axis=(0, 1))).max() < 0.002


@pytest.mark.parametrize("fps", [15.0, 30.0, 60.0])
def test_correlation_in_time(fps):
    knee = errors(standing(frames=600, count=20), fps=fps)[:, :, H36M17.index("l_knee")]
    correlation = (knee[:, 1:] * knee[:, :-1]).mean() / (knee**2).mean()
    assert correlation == pytest.approx(0.8 ** (30 / fps), abs=0.02)


def test_a_wrist_behind_the_back_is_hidden_and_one_in_front_is_not():
    joints = standing()
    wrist = H36M17.index("l_wrist")
    joints[..., wrist, :] = [0, -0.25, 4.3]
    assert hidden_joints(joints)[0, 0, wrist]
    joints[..., wrist, 2] = 3.7
    assert not hidden_joints(joints)[0, 0, wrist]
    assert not hidden_joints(standing()).any()


def test_hidden_joints_are_noisier_and_trusted_less():
    joints = standing(frames=400, count=10)
    elbow = H36M17.index("l_elbow")
    joints[..., elbow, :] = [0, -0.25, 4.3]
    pixels = pixels_of(joints)
    keypoints, confidence = detect(pixels, joints, GAUSSIAN)
    error = keypoints - pixels
    other = H36M17.index("r_elbow")
    assert error[..., elbow, :].std() / error[..., other, :].std() == pytest.approx(2, rel=0.05)
    assert confidence[..., elbow].mean() < confidence[..., other].mean() - 0.15


def test_profile_is_a_person_who_looks_sideways():
    assert in_profile(standing(turned_deg=90)).all()
    assert not in_profile(standing(turned_deg=0)).any()
    assert not in_profile(standing(turned_deg=45)).any()


def test_swaps_happen_in_profile_only_and_exchange_whole_limbs():
    noise = Noise(std=0, outliers=0, missing_rate=0, absent_rate=0)
    assert np.abs(errors(standing(frames=300, count=5), noise)).max() == 0
    side = standing(frames=300, count=5, turned_deg=90)
    pixels = pixels_of(side)
    keypoints, _ = detect(pixels, side, noise)
    left, right = (H36M17.indices([f"{s}_{p}" for p in ("hip", "knee", "ankle")]) for s in "lr")
    swapped = (keypoints[..., left, :] == pixels[..., right, :]).all(axis=(-2, -1))
    straight = (keypoints[..., left, :] == pixels[..., left, :]).all(axis=(-2, -1))
    assert (swapped ^ straight).all()
    assert 0.05 < swapped.mean() < 0.3
    changes = np.abs(np.diff(swapped.astype(int), axis=1)).sum()
    assert swapped.sum() / (changes / 2) > 4  # runs, not single frames


def test_missing_joints_are_nan_without_confidence():
    joints = standing(frames=500, count=10)
    keypoints, confidence = detect(pixels_of(joints), joints)
    lost = np.isnan(keypoints).all(axis=-1)
    np.testing.assert_array_equal(lost, np.isnan(keypoints).any(axis=-1))
    np.testing.assert_array_equal(lost, confidence == 0)
    assert 0.003 < lost.mean() < 0.05
    assert (confidence <= 1).all()


def test_outliers_are_as_frequent_and_as_far_as_stated():
    noise = Noise(std=0, swap_rate=0, missing_rate=0, absent_rate=0, outliers=0.01)
    apart = np.linalg.norm(errors(standing(frames=500, count=20), noise), axis=-1)
    far = apart[apart > 1e-9]
    assert len(far) / apart.size == pytest.approx(0.01, rel=0.1)
    assert far.min() >= 0.0999
    assert far.max() <= 0.3001


FAR = H36M17.indices(keypoint_noise.FAR_JOINTS)
NEAR = H36M17.indices([f"{side}_{part}" for side in "lr" for part in ("shoulder", "hip", "knee", "elbow")])


def of_training(spoilt):
    """(B, T, 17) how far keypoints of a standing person are off, of the box's longer side, by torch's numbers."""
    joints = np.broadcast_to(facing_camera() + np.array([0, 0, 4.0]), (600, 30, 17, 3)).astype(np.float32)
    pixels = torch.from_numpy(joints[..., :2] / joints[..., 2:] * 1000 + 500)
    found, _ = keypoint_noise.detect(pixels, torch.from_numpy(joints), Draw(0, 0), spoilt=spoilt)
    return (found - pixels).norm(dim=-1).numpy() / np.ptp(pixels[0, 0].numpy(), axis=0).max()


def test_a_good_detector_errs_by_a_hundredth_and_a_half_at_wrists_and_ankles_as_elsewhere():
    usual, good = of_training(None), of_training(Spoilt(good=1.0))
    assert np.nanmean(good[..., FAR]) == pytest.approx(0.015, rel=0.05)
    assert np.nanmean(good[..., NEAR]) == pytest.approx(0.015, rel=0.05)
    assert np.nanmean(usual[..., FAR]) > 0.025
    assert (good > 0.1).mean() < 0.6 * (usual > 0.1).mean()  # outliers
    assert np.isnan(good).mean() < 0.6 * np.isnan(usual).mean()  # gaps
    each = np.nanmean(of_training(Spoilt(good=0.3))[..., FAR], axis=(1, 2))
    assert (each < (0.015 + np.nanmean(usual[..., FAR])) / 2).mean() == pytest.approx(0.3, abs=0.06)
