"""The 2D noise has the statistics that its formula states."""

import numpy as np
import pytest
import torch

from golden.bodies import facing_camera
from pcnet3d.models.lab.synthetic import keypoint_noise
from pcnet3d.models.lab.synthetic.draw import Draw, NumpyDraw
from pcnet3d.models.lab.synthetic.keypoint_noise import Noise, Spoilt, hidden_joints, in_profile
from pcnet3d.pipeline import H36M17

GAUSSIAN = Noise(outliers=0, swap_rate=0, missing_rate=0, absent_rate=0)
ELBOW, OTHER = H36M17.indices(("l_elbow", "r_elbow"))
LEGS = H36M17.indices([f"{side}_{part}" for side in "lr" for part in ("knee", "ankle")])


def standing(frames=1, count=1, turned_deg=0.0):
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
    keypoints, confidence = (part.numpy() for part in keypoint_noise.detect(*given, draw, fps, noise, spoilt))
    return pixels, keypoints, confidence, np.ptp(pixels, axis=-2).max(axis=-1)[..., None, None]


def errors(joints, noise=GAUSSIAN, fps=30.0):
    pixels, keypoints, _, size = detect(joints, noise, fps)
    return (keypoints - pixels) / size


@pytest.mark.parametrize("fps", [15.0, 60.0])
def test_size_of_the_error_and_its_correlation_in_time(fps):
    error = errors(standing(frames=600, count=20), fps=fps)
    std = error.std(axis=(0, 1, 3))
    np.testing.assert_allclose(std[H36M17.indices(("l_knee", "r_elbow", "spine"))], 0.015, rtol=0.06)
    np.testing.assert_allclose(std[H36M17.indices(("l_wrist", "r_ankle"))], 0.0225, rtol=0.06)
    knee = error[:, :, H36M17.index("l_knee")]
    correlation = (knee[:, 1:] * knee[:, :-1]).mean() / (knee**2).mean()
    assert correlation == pytest.approx(0.8 ** (30 / fps), abs=0.02)


def test_a_joint_behind_the_trunk_is_hidden_noisier_and_trusted_less():
    joints = standing(frames=400, count=10)
    assert not hidden_joints(joints).any()
    joints[..., ELBOW, :] = joints[..., H36M17.index("spine"), :] + [0, 0, 0.3]
    assert hidden_joints(joints)[..., ELBOW].all()
    pixels, keypoints, confidence, _ = detect(joints, GAUSSIAN)
    error = keypoints - pixels
    assert error[..., ELBOW, :].std() / error[..., OTHER, :].std() == pytest.approx(2, rel=0.05)
    assert confidence[..., ELBOW].mean() < confidence[..., OTHER].mean() - 0.15
    joints[..., ELBOW, 2] -= 0.6
    assert not hidden_joints(joints)[..., ELBOW].any()


def test_swaps_happen_in_profile_only_and_exchange_whole_limbs():
    assert not in_profile(standing(turned_deg=45)).any()
    noise = Noise(std=0, outliers=0, missing_rate=0, absent_rate=0)
    assert np.abs(errors(standing(frames=300, count=5), noise)).max() == 0
    side = standing(frames=300, count=5, turned_deg=90)
    assert in_profile(side).all()
    pixels, keypoints, *_ = detect(side, noise)
    left, right = (H36M17.indices([f"{s}_{p}" for p in ("hip", "knee", "ankle")]) for s in "lr")
    swapped = (keypoints[..., left, :] == pixels[..., right, :]).all(axis=(-2, -1))
    assert (swapped ^ (keypoints[..., left, :] == pixels[..., left, :]).all(axis=(-2, -1))).all()
    assert 0.05 < swapped.mean() < 0.3
    assert swapped.sum() / (np.abs(np.diff(swapped.astype(int), axis=1)).sum() / 2) > 4  # runs


def test_missing_joints_are_nan_without_confidence_and_outliers_as_far_as_stated():
    _, keypoints, confidence, _ = detect(standing(frames=500, count=10))
    lost = np.isnan(keypoints).all(axis=-1)
    np.testing.assert_array_equal(lost, confidence == 0)
    assert 0.003 < lost.mean() < 0.05
    noise = Noise(std=0, swap_rate=0, missing_rate=0, absent_rate=0, outliers=0.01)
    apart = np.linalg.norm(errors(standing(frames=500, count=20), noise), axis=-1)
    far = apart[apart > 1e-9]
    assert len(far) / apart.size == pytest.approx(0.01, rel=0.1)
    assert 0.0999 <= far.min() < far.max() <= 0.3001


def test_a_truncated_image_loses_the_legs_first_and_absent_joints_are_never_seen():
    def lost(**spoilt):
        """(17,) shares of what a training draws."""
        joints = standing(5, 400).astype(np.float32)
        return np.isnan(detect(joints, draw=Draw(0, 0), spoilt=Spoilt(**spoilt))[1]).any(-1).mean((0, 1))

    plain, cut = lost(), lost(truncated=1.0)
    assert (cut[LEGS] > plain[LEGS] + 0.2).all()
    assert cut[H36M17.index("head")] < 0.3
    absent = lost(absent={"nose": 1.0, "head": 0.5})
    assert absent[H36M17.index("nose")] == 1
    assert absent[H36M17.index("head")] == pytest.approx(0.5, abs=0.1)
    occluded = lost(occluded=1.0) - plain
    assert 0.02 < occluded[LEGS].mean() < 0.5
    assert np.abs(occluded[H36M17.indices(("pelvis", "thorax", "l_hip", "r_shoulder"))]).max() < 0.05
