"""Windows that the lifter is trained on: what they show, of whom, and what spoils them."""

from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.models.lab.mocap.clips import Clip, lying
from pcnet3d.models.lab.synthetic.bodies import STANDARD_SIZE_M, size_m
from pcnet3d.models.lifter import features as run_time
from pcnet3d.models.lifter.features import CHANNELS
from pcnet3d.pipeline import H36M17, InputError, rotate

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
from pcnet3d.models.lab.synthetic.draw import Draw  # noqa: E402
from pcnet3d.models.lab.synthetic.keypoint_noise import Noise, Spoilt, detect  # noqa: E402
from pcnet3d.models.lab.training.lifter import Batch, Material, Windows, target  # noqa: E402

STILL = Material(unchanged=1.0, mirrored=0.0, other_rates=0.0)
LEGS = H36M17.indices([f"{side}_{part}" for side in "lr" for part in ("knee", "ankle")])


def upright_world(facing_camera):
    """CAMERA to +Z up."""
    return (facing_camera[:, [0, 2, 1]] * [1, 1, -1]).astype(np.float32)


def filmed(facing_camera, frames):
    """400 times somebody who stands still 4 m away: (400, T, 17, 3), and their pixels."""
    away = (facing_camera + np.array([0, 0, 4.0])).astype(np.float32)
    joints = torch.from_numpy(np.tile(away, (400, frames, 1, 1)))
    return joints[..., :2] / joints[..., 2:] * 1000 + 500, joints


def standing_still(clips, facing_camera):
    still = np.tile(upright_world(facing_camera), (150, 1, 1))
    return tuple(replace(clip, joints=still) for clip in clips)


def batch(clips, material, count, frames, step=0):
    return Batch(*(part.numpy() for part in Windows(clips, material).batch(Draw(3, step), count, frames)))


@pytest.mark.parametrize(("count", "frames"), [(50, 1), (8, 30), (3, 150)])
def test_windows_are_what_they_say(clips, count, frames):
    x, joints, velocity = batch(clips, Material(other_rates=0.0, derived=0.5, pans=0.3), count, frames)
    assert x.shape == (count, frames, CHANNELS)
    assert joints.shape == velocity.shape == (count, frames, 17, 3)
    assert x.dtype == joints.dtype == velocity.dtype == np.float32
    assert np.isfinite(x).all()
    np.testing.assert_array_equal(joints[..., 0, :], 0)
    np.testing.assert_allclose(size_m(joints), STANDARD_SIZE_M, rtol=1e-4)
    if frames == 1:
        assert not velocity.any()  # of a single frame nothing is known, and nothing asked


def test_the_image_shows_the_target(clips):
    """x and y of the target are the image, up to perspective, noise and scale."""
    x, joints, _ = batch(clips, STILL, 300, 1)
    image = x[:, 0, :34].reshape(-1, 17, 2)
    seen = x[:, 0, 51:68] > 0
    use = seen & seen[:, :1]
    correlation = np.corrcoef((image - image[:, :1])[use].ravel(), joints[:, 0, :, :2][use].ravel())[0, 1]
    assert correlation > 0.9


def test_combined_windows_have_other_upper_bodies(clips):
    plain, mixed = (
        batch(clips, Material(unchanged=1.0, mirrored=0.0, other_rates=0.0, combined=share), 60, 1).joints
        for share in (0.0, 1.0)
    )

    def apart(joints, part):
        left, right = (joints[:, 0, H36M17.index(f"{side}_{part}")] for side in "lr")
        return np.linalg.norm(left - right, axis=-1)

    linked, loose = (abs(np.corrcoef(apart(y, "knee"), apart(y, "wrist"))[0, 1]) for y in (plain, mixed))
    assert linked > 0.4  # three people: who has these knees has these wrists
    assert loose < 0.3


def test_a_truncated_image_loses_the_legs_first_and_absent_joints_are_never_seen(facing_camera):
    pixels, joints = filmed(facing_camera, 5)

    def lost(**spoilt):
        keypoints, confidence = detect(pixels, joints, Draw(0, 0), spoilt=Spoilt(**spoilt))
        assert not confidence[keypoints.isnan().any(-1)].any()
        return keypoints.isnan().any(-1).float().mean((0, 1)).numpy()

    plain, cut = lost(), lost(truncated=1.0)
    assert (cut[LEGS] > plain[LEGS] + 0.2).all()
    assert cut[H36M17.index("head")] < 0.3
    absent = lost(absent={"nose": 1.0, "head": 0.5})
    assert absent[H36M17.index("nose")] == 1
    assert absent[H36M17.index("head")] == pytest.approx(0.5, abs=0.1)
    occluded = lost(occluded=1.0) - plain
    assert 0.02 < occluded[LEGS].mean() < 0.5
    assert np.abs(occluded[H36M17.indices(("pelvis", "thorax", "l_hip", "r_shoulder"))]).max() < 0.05


def test_a_slow_error_lasts_for_seconds_and_the_confidence_does_not_know_of_it(facing_camera):
    pixels, joints = filmed(facing_camera, 91)
    silent = Noise(std=1e-6, outliers=0.0, swap_rate=0.0, missing_rate=0.0, absent_rate=0.0)
    hips = H36M17.indices(("l_hip", "r_hip"))
    (plain, sure), (slow, as_sure) = (
        detect(pixels, joints, Draw(0, 0), 30.0, silent, Spoilt(slow=share)) for share in (0.0, 0.02)
    )
    body = np.ptp(pixels[0, 0].numpy(), axis=0).max()
    off = (slow - plain)[:, :, hips].numpy() / body
    assert off.std() == pytest.approx(0.02, rel=0.1)
    same = {s: float(np.mean(off[:, 0] * off[:, round(30 * s)]) / 0.02**2) for s in (0.1, 3.0)}
    assert same[0.1] == pytest.approx(np.exp(-0.1 / 3), abs=0.1)
    assert same[3.0] == pytest.approx(np.exp(-1), abs=0.15)
    assert float(as_sure.mean()) == pytest.approx(float(sure.mean()), abs=0.01)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_clips_of_people_who_lie_are_drawn_as_often_as_asked(clips, facing_camera, share):
    """Of four clips as long as each other one lies."""
    upright = standing_still(clips, facing_camera)
    lies = replace(upright[0], joints=upright[0].joints[..., [0, 2, 1]] * np.float32([1, -1, 1]))
    windows = Windows((*upright, lies), Material(lying=share))
    drawn = windows._motion(Draw(3, 0), 20, 30.0, 400).numpy()
    assert float(lying(drawn[:, 0]).mean()) == pytest.approx(share + (1 - share) / 4, abs=0.08)


def test_clips_that_cannot_be_learned_from_are_refused(clips, facing_camera):
    odd = Clip("07_01", "07", "asfamc", 60.0, clips[0].joints)
    with pytest.raises(InputError, match="30 frames per second to train on, got 60"):
        Windows([*clips, odd], STILL)
    with pytest.raises(InputError, match="clips in which somebody lies"):
        Windows(standing_still(clips, facing_camera), Material(lying=0.1))


def test_training_and_run_time_make_the_same_features(rng):
    """Torch's and numpy's, of keypoints with gaps."""
    keypoints = rng.uniform(0, 1000, (4, 12, 17, 2))
    keypoints[rng.uniform(size=keypoints.shape[:-1]) < 0.2] = np.nan
    keypoints[1, :3] = keypoints[2, 5:8] = np.nan  # nobody at the start, nor in the middle
    confidence = rng.uniform(size=keypoints.shape[:-1])
    confidence[0] = np.nan
    up = rng.normal(size=(4, 12, 3))
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    up[0], up[1, 4] = np.nan, [0, 0, 1]  # unknown, along the ray
    given = keypoints, confidence, np.full((4, 2), 1000.0), np.full(4, 900.0), up
    x, R = run_time.features(*given)
    made_x, made_R = run_time.features(*map(torch.from_numpy, given))
    np.testing.assert_allclose(made_x, x, atol=1e-5)
    np.testing.assert_allclose(made_R, R, atol=1e-6)


def test_the_target_is_the_skeleton_seen_along_its_ray(rng):
    joints = rng.normal([1.0, -0.5, 4.0], 0.3, (2, 9, 17, 3))
    unknown = torch.full((2, 1, 3), torch.nan, dtype=torch.float64)
    answer, velocity = (part.numpy() for part in target(torch.from_numpy(joints), unknown))
    R_camera_from_ray = run_time.body_rays(joints)
    relative = joints - joints[:, :, :1]
    scaled = relative * STANDARD_SIZE_M / size_m(relative)[:, None, None, None]
    np.testing.assert_allclose(rotate(R_camera_from_ray, answer), scaled, atol=1e-6)
    np.testing.assert_allclose(rotate(R_camera_from_ray, velocity), np.gradient(scaled, axis=1), atol=1e-6)
