"""Training frames: truth that fits the joints, what spoils the input, and the poses that are made."""

import numpy as np
import pytest

from golden.bodies import bone_lengths
from golden.takes import write_lifted
from pcnet3d.models.common.canonical import body_axes
from pcnet3d.models.lab.mocap.clips import Clip, trunk_lean_deg
from pcnet3d.models.lab.synthetic.views import read_lifted
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.rotations import angle_deg, rotate, transpose

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
module = pytest.importorskip("pcnet3d.models.lab.training.rectifier")
from pcnet3d.models.lab.synthetic.draw import Draw  # noqa: E402
from pcnet3d.models.lab.synthetic.poses import PoseRange, posed  # noqa: E402

SPOILT = {
    "wide": 0.5, "combined": 0.3, "noisy": 0.5, "missing": 0.5, "flipped": 0.5, "unchanged": 0.3, "real": 0.2,
    "redefined": 0.5,
    "poses": PoseRange(exchanged=0.2, sampled=0.2, swung=0.3, limbs_swung=0.3, turned=0.3, leaning=0.2),
}  # fmt: skip


@pytest.fixture
def clips(standing):
    rng = np.random.default_rng(0)
    poses = (standing + rng.normal(0, 0.03, (3, 80, 17, 3))).astype(np.float32)
    return [Clip(f"0{i}_01", f"0{i}", "asfamc", 30.0, joints) for i, joints in enumerate(poses)]


def batch(clips, count=200, step=0, lifted=None, **mixture):
    """(joints, valid, truth, R) as arrays."""
    frames = module.TrainingFrames(clips, module.Mixture(**mixture), lifted).batch(Draw(5, step), count)
    return module.Frames(*(part.numpy() for part in frames))


def upright_lean_deg(frames):
    return trunk_lean_deg(rotate(transpose(frames.R), frames.truth))


def test_a_batch_tells_the_truth_and_is_the_same_for_the_same_step(clips):
    a, b = batch(clips, **SPOILT), batch(clips, **SPOILT)
    for one, other in zip(a, b, strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == np.float32
    assert np.abs(a.R - batch(clips, step=1, **SPOILT).R[: len(a.R)]).max() > 0.1
    np.testing.assert_allclose(body_axes(a.truth, a.R[..., 2]), a.R, atol=2e-3)
    np.testing.assert_array_equal(a.joints[a.valid == 0], 0)
    assert 0 < (a.valid == 0).mean() < 0.3
    assert (a.valid[:, 0] == 1).all()
    changed = np.abs(a.joints - a.truth)[a.valid > 0]
    assert 0 < (changed > 1e-5).mean() < 0.9


def test_without_spoiling_the_input_is_the_truth(clips):
    frames = batch(clips)
    np.testing.assert_array_equal(frames.joints, frames.truth)
    assert (frames.valid == 1).all()
    captured = np.concatenate([clip.joints for clip in clips])
    both = bone_lengths(np.concatenate([captured, captured[:, H36M17.mirror]]))
    apart = np.abs(bone_lengths(frames.truth)[:, None] - both).max(-1).min(1)
    assert apart.max() < 1e-5  # each is one of the captured bodies, or its mirror image
    assert upright_lean_deg(frames).max() < 20


def test_turned_bodies_lie_and_lean_under_the_worlds_own_up(clips):
    """Up is the world's whatever the body does: turned back by R they lie on the ground in every direction."""
    turned = batch(clips, 1000, poses=PoseRange(turned=1.0))
    lean = upright_lean_deg(turned)
    assert (lean > 60).mean() > 0.1
    assert (lean > 120).any()
    np.testing.assert_allclose(body_axes(turned.truth, turned.R[..., 2]), turned.R, atol=2e-3)
    trunk = rotate(transpose(turned.R), turned.truth)[:, H36M17.index("thorax")]
    lying = trunk[lean > 60]
    assert min((lying[:, 0] > 0.2).mean(), (lying[:, 0] < -0.2).mean()) > 0.1  # on the back, on the belly
    assert min((lying[:, 1] > 0.2).mean(), (lying[:, 1] < -0.2).mean()) > 0.1  # on either side
    leaning = upright_lean_deg(batch(clips, 1000, poses=PoseRange(leaning=1.0)))
    assert leaning.max() < 50
    assert 5 < leaning.mean() < 15


def test_laid_bodies_lie_on_every_side_under_the_worlds_own_up(clips):
    frames = batch(clips, 400, poses=PoseRange(laid=0.5))
    lies = upright_lean_deg(frames) > 60
    assert lies.mean() == pytest.approx(0.5, abs=0.1)
    np.testing.assert_allclose(body_axes(frames.truth, frames.R[..., 2]), frames.R, atol=2e-3)
    upper = rotate(transpose(frames.R[lies]), frames.truth[lies])[:, H36M17.index("thorax")]
    assert abs(upper[:, 2].mean()) < 0.1  # head up as often as down
    assert (np.abs(upper[:, :2]).max(axis=0) > 0.3).all()


def test_a_swing_of_limbs_bends_no_knee_and_stretches_nothing(clips):
    joints = torch.from_numpy(clips[0].joints)[:, None]
    swung = posed(joints, joints, Draw(0, 0), PoseRange(limbs_swung=1.0), 30.0)[:, 0].numpy()
    still = [H36M17.index(name) for name in ("pelvis", "spine", "thorax", "head", "l_hip", "r_shoulder")]
    np.testing.assert_array_equal(swung[:, still], clips[0].joints[:, still])
    np.testing.assert_allclose(bone_lengths(swung), bone_lengths(clips[0].joints), atol=1e-5)

    def bent(body, a, at, b):
        a, at, b = (body[:, H36M17.index(name)] for name in (a, at, b))
        return angle_deg(a - at, b - at)

    for limb in (("l_hip", "l_knee", "l_ankle"), ("r_shoulder", "r_elbow", "r_wrist")):
        np.testing.assert_allclose(bent(swung, *limb), bent(clips[0].joints, *limb), atol=0.05)
        a, b = (
            body[:, H36M17.index(limb[1])] - body[:, H36M17.index(limb[0])]
            for body in (swung, clips[0].joints)
        )
        typical = 10 if "hip" in limb[0] else 20
        assert 0.6 * typical < angle_deg(a, b).mean() < 1.6 * typical
    half = posed(joints, joints, Draw(0, 0), PoseRange(limbs_swung=0.5), 30.0)[:, 0].numpy()
    moved = np.abs(half - clips[0].joints).max((1, 2)) > 1e-4
    assert 0.3 < moved.mean() < 0.7


def test_a_depth_flip_is_invisible_from_the_front(clips):
    frames = batch(clips, flipped=1.0)
    np.testing.assert_allclose(frames.joints[..., :2], frames.truth[..., :2], atol=1e-6)
    assert np.abs(frames.joints[..., 2] - frames.truth[..., 2]).max() > 0.05
    np.testing.assert_allclose(bone_lengths(frames.joints), bone_lengths(frames.truth), atol=1e-5)


def test_noise_is_as_large_as_it_says_and_twice_that_in_depth(clips):
    frames = batch(clips, 4000, noisy=1.0)
    error = (frames.joints - frames.truth)[:, 1:]
    # Uniform up to 3 cm, of the joint and of the pelvis that it is relative to.
    expected = 0.03 / np.sqrt(3) * np.sqrt(2)
    np.testing.assert_allclose(error.std((0, 1)), expected * np.array([1, 1, 2]), rtol=0.05)
    half = batch(clips, 4000, noisy=0.5)
    assert (np.abs(half.joints - half.truth).max((1, 2)) > 0).mean() == pytest.approx(0.5, abs=0.03)


def test_lifted_frames_are_mirrored_and_rolled_with_their_truth(clips, standing, tmp_path):
    takes = read_lifted([write_lifted(tmp_path / "takes.npz", standing)])
    frames = module.TrainingFrames(clips, module.Mixture(lifted=1.0, roll_deg=30.0), takes).batch(
        Draw(0, 0), 300
    )
    frames = module.Frames(*(part.numpy() for part in frames))
    np.testing.assert_allclose(body_axes(frames.truth, frames.R[..., 2]), frames.R, atol=1e-4)
    np.testing.assert_allclose(frames.joints, frames.truth, atol=1e-5)  # this lifter is right
    canonical = rotate(transpose(frames.R), frames.joints)
    own = rotate(transpose(takes.R), takes.joints)
    one = np.abs(canonical[:, None] - own).max((2, 3)).min(1) < 1e-4
    other = np.abs(canonical[:, H36M17.mirror][:, None] * [1, -1, 1] - own).max((2, 3)).min(1) < 1e-4
    assert (one | other).all()
    rolled = np.abs(frames.R[:, None] - takes.R).max((2, 3)).min(1) > 0.01
    assert rolled.mean() > 0.9


def test_what_cannot_be_made_is_refused(clips):
    with pytest.raises(InputError, match="pcnet3d lab testbed"):
        module.TrainingFrames(clips, module.Mixture(lifted=0.5))
    with pytest.raises(InputError, match="clips in which somebody lies"):
        module.TrainingFrames(clips, module.Mixture(lying=0.1))


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_people_who_lie_are_drawn_as_often_as_asked(clips, standing, tmp_path, share):
    """One frame in 241 lies in the clips, and one in two in the lifted takes."""
    lying = standing[:, [2, 1, 0]] * np.float32([1, 1, -1])  # on the back
    alone = Clip("07_01", "07", "asfamc", 30.0, lying[None].astype(np.float32))
    lifted = read_lifted(
        [write_lifted(tmp_path / "a.npz", standing), write_lifted(tmp_path / "b.npz", lying)]
    )
    few = lifted._replace(lying=trunk_lean_deg(rotate(transpose(lifted.R), lifted.truth)) > 60)
    for source in (None, few):
        mixture = module.Mixture(lying=share, lifted=1.0 if source else 0.0)
        drawn = module.TrainingFrames([*clips, alone], mixture, source).batch(Draw(5, 0), 600)
        frames = module.Frames(*(part.numpy() for part in drawn))
        lies = float((upright_lean_deg(frames) > 60).mean())
        usual = 0.5 if source else 1 / 241
        assert lies == pytest.approx(share + (1 - share) * usual, abs=0.07)
