"""The losses: zero at the truth, known values elsewhere, gradients that never break."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.pipeline import H36M17

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
losses = pytest.importorskip("pcnet3d.models.lab.training.rectifier")
net_module = pytest.importorskip("pcnet3d.models.lab.training.rectifier")


def rotations(count=40, seed=0):
    return torch.tensor(Rotation.random(count, rng=np.random.default_rng(seed)).as_matrix())


def turned(R, degrees, seed=1):
    axis = np.random.default_rng(seed).normal(size=(len(R), 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return R @ torch.tensor(Rotation.from_rotvec(axis * np.radians(degrees)).as_matrix())


@pytest.fixture
def pose(facing_camera):
    return torch.tensor(facing_camera)[None]


@pytest.mark.parametrize("degrees", [0.0, 0.01, 1, 90, 179, 180])
def test_geodesic_is_the_angle_and_has_a_gradient(degrees):
    R_1 = rotations().requires_grad_()
    angle = losses.geodesic(R_1, turned(rotations(), degrees))
    np.testing.assert_allclose(np.degrees(angle.detach().numpy()), degrees, atol=2e-4)
    angle.sum().backward()
    assert torch.isfinite(R_1.grad).all()


def test_a_turn_costs_pose_but_neither_bones_nor_angles_nor_the_cycle(pose):
    """Why the residual-free preset does without cycle and perceptual."""
    R, wrong = rotations(1), turned(rotations(1), 30)
    canonical, off = net_module.rotate(R.mT, pose), net_module.rotate(wrong.mT, pose)
    assert losses.pose(off, canonical) > 1e-3
    assert losses.cycle(wrong, off, pose).item() == pytest.approx(0, abs=1e-12)
    assert losses.perceptual(off, canonical).item() == pytest.approx(0, abs=1e-5)


def test_known_values(pose):
    moved = pose.clone()
    moved[0, H36M17.index("l_wrist"), 0] += 0.17
    assert losses.pose(moved, pose).item() == pytest.approx(0.17**2 / 17)
    assert losses.cycle(torch.eye(3, dtype=torch.float64)[None], moved, pose).item() == pytest.approx(
        0.17**2 / 17
    )
    straight, bent = torch.zeros(1, 17, 3), torch.zeros(1, 17, 3)
    arm = H36M17.indices(("r_shoulder", "r_elbow", "r_wrist"))
    straight[0, arm] = torch.tensor([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    bent[0, arm] = torch.tensor([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])
    valid = torch.zeros(1, 17)
    valid[0, arm] = 1
    # One of eight angles differs by a right angle; both bones keep their lengths.
    assert losses.perceptual(straight, bent, valid).item() == pytest.approx(np.pi / 2 / 8, rel=1e-3)
    stretched = straight.clone()
    stretched[0, arm[2], 0] = 2.5
    assert losses.perceptual(stretched, straight, valid).item() == pytest.approx(0.5 / 16, rel=1e-3)


def test_heads_that_look_alike_are_told():
    same = torch.rand(3, 1, 17, 17).softmax(-1).expand(3, 4, 17, 17)
    assert losses.attention_likeness(same).item() == pytest.approx(1, abs=1e-5)
    apart = torch.eye(17).reshape(1, 17, 1, 17).expand(1, 17, 17, 17)  # head h looks at joint h only
    assert losses.attention_likeness(apart).item() == pytest.approx(0, abs=1e-6)


def test_the_error_head_is_pulled_to_the_mean():
    angles = torch.tensor([2.0, 4.0, 12.0]).deg2rad()
    tries = torch.linspace(1, 20, 400)
    values = [losses.error_likelihood(e.expand(3), angles).item() for e in tries]
    assert tries[int(np.argmin(values))].item() == pytest.approx(6, abs=0.1)


def test_the_weights_are_the_papers():
    assert (losses.POSE, losses.ROTATION, losses.CYCLE, losses.PERCEPTUAL) == (1, 1, 0.25, 0.15)
