"""The network: its answer is a rotation, whatever the scale, the view and the missing joints."""

import numpy as np
import pytest

from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.rotations import geodesic_deg

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
net_module = pytest.importorskip("pcnet3d.models.lab.training.rectifier")
NetConfig, PCNet = net_module.NetConfig, net_module.PCNet

SMALL = {"width": 16, "output": 24, "heads": 2}
EVERY = [
    NetConfig(residual=residual, align=align, **SMALL) for residual, align in (("off", True), ("free", False))
]


@pytest.fixture
def poses(facing_camera):
    """(20, 17, 3) variations of an upright person."""
    rng = np.random.default_rng(0)
    joints = facing_camera + rng.normal(0, 0.04, (20, 17, 3))
    return torch.tensor(joints - joints[:, :1], dtype=torch.float32)


def build(config, seed=0):
    """With weights large enough that the answer depends on the input."""
    torch.manual_seed(seed)
    net = PCNet(config).eval()
    torch.nn.init.normal_(net.rotation.weight, std=0.5)
    return net


def valid_all(poses):
    return torch.ones(poses.shape[:2])


@torch.no_grad()
def answer(net, poses, valid=None):
    return net(poses, valid_all(poses) if valid is None else valid)


@pytest.mark.parametrize("config", EVERY, ids=lambda c: f"{c.residual}-{c.align}")
def test_the_answer_is_a_rotation_and_its_canonical_pose(config, poses):
    net = build(config)
    result = answer(net, poses)
    R = result.R.numpy().astype(np.float64)
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.broadcast_to(np.eye(3), R.shape), atol=1e-5)
    np.testing.assert_allclose(np.linalg.det(R), 1, atol=1e-5)
    assert (result.error_deg > 0).all()
    assert geodesic_deg(R, np.broadcast_to(R[0], R.shape)).max() > 0.1  # it looks at the pose
    # An untrained residual head adds nothing: canonical is R^T x.
    expected = np.einsum("bji,bkj->bki", R, poses.numpy())
    np.testing.assert_allclose(result.canonical.numpy(), expected, atol=1e-5)


@pytest.mark.parametrize("config", EVERY, ids=lambda c: c.residual)
def test_metres_millimetres_and_no_unit_give_the_same(config, poses):
    for scale in [1000.0, 1.7, 1e-2]:
        net = build(config)
        one, other = answer(net, poses), answer(net, scale * poses + 3 * scale)
        assert geodesic_deg(one.R.numpy(), other.R.numpy()).max() < 0.05
        np.testing.assert_allclose(one.error_deg, other.error_deg, rtol=1e-3)
        np.testing.assert_allclose(one.canonical * scale, other.canonical, atol=2e-3 * scale)


@pytest.mark.parametrize("config", EVERY, ids=lambda c: c.residual)
def test_what_a_missing_joint_holds_does_not_matter(config, poses):
    net = build(config)
    valid = valid_all(poses)
    valid[:, H36M17.indices(("l_wrist", "r_hip", "thorax"))] = 0
    other = torch.where(valid[..., None] > 0, poses, torch.tensor(7.0))
    assert torch.equal(answer(net, poses, valid).R, answer(net, other, valid).R)
    assert not torch.allclose(answer(net, poses, valid).R, answer(net, poses).R, atol=1e-5)


def test_an_aligned_torso_turns_with_the_body(poses):
    """The torso's axes are equivariant, also where hips or shoulders are missing."""
    from scipy.spatial.transform import Rotation

    Q = torch.tensor(Rotation.random(20, rng=np.random.default_rng(0)).as_matrix(), dtype=torch.float32)
    for missing in ((), ("l_hip",), ("r_shoulder",), ("thorax",)):
        valid = valid_all(poses)
        valid[:, H36M17.indices(missing)] = 0
        turned = net_module.torso_axes(net_module.rotate(Q, poses), valid)
        expected = net_module.multiply(Q, net_module.torso_axes(poses, valid))
        np.testing.assert_allclose(turned, expected, atol=1e-4)


def test_body_size_is_the_stature_that_bones_speak_of(poses):
    from pcnet3d.pipeline.core.anthropometry import SEGMENTS

    (thigh,) = {v for k, v in SEGMENTS.items() if k == ("l_hip", "l_knee")}
    joints, valid = torch.zeros(1, 17, 3), torch.zeros(1, 17)
    joints[0, H36M17.index("l_knee"), 1] = 0.5
    valid[0, H36M17.indices(("l_hip", "l_knee"))] = 1
    assert net_module.body_size(joints, valid).item() == pytest.approx(0.5 / thigh)
    nobody = net_module.body_size(torch.zeros(1, 17, 3), torch.zeros(1, 17))
    assert nobody.item() == 1  # nothing to divide by


def test_the_paper_preset_is_the_papers():
    paper = NetConfig()
    assert (paper.width, paper.output, paper.residual) == (256, 384, "free")
    assert (paper.graph_layers, paper.attention_layers, paper.heads, paper.align) == (3, 2, 8, False)
    net = PCNet(paper)
    assert net(torch.randn(2, 17, 3), torch.ones(2, 17)).attention.shape == (2, 8, 17, 17)


def test_the_expected_error_does_not_bend_the_rotation(poses):
    net = build(EVERY[0])
    answer = net(poses, valid_all(poses))
    answer.error_deg.sum().backward()
    assert net.rotation.weight.grad is None
    assert all(p.grad is None for p in net.encoder.parameters())
    assert net.error[0].weight.grad.abs().sum() > 0
