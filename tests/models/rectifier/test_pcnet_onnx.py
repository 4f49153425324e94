"""The exported network answers like torch, and its run time refuses what it cannot use."""

from pathlib import Path

import numpy as np
import pytest

import pcnet3d
from pcnet3d.models import load_rectifier
from pcnet3d.models.rectifier import load as pcnet_onnx
from pcnet3d.models.rectifier.load import PCNetRectifier, prepare
from pcnet3d.pipeline import H36M17, InputError
from refusals import refused

SHIPPED = ("lifter/lifter.onnx", "rectifier/pcnet.onnx", "rectifier/paper.onnx")
NETS = {"pcnet": True, "paper": False}  # symmetric and aligned, or neither


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """{net: (torch network, file)} of small untrained networks."""
    torch = pytest.importorskip("torch", reason="export needs torch, the extra 'train'")
    pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
    from pcnet3d.models.lab.training.rectifier import Deployed, NetConfig, PCNet, export

    torch.manual_seed(0)
    made = {}
    for net, align in NETS.items():
        network = PCNet(NetConfig(width=16, output=24, residual="off" if align else "free", align=align))
        torch.nn.init.normal_(network.rotation.weight, std=0.2)
        path = tmp_path_factory.mktemp("onnx") / f"{net}.onnx"
        deployed = Deployed(network, symmetric=align)
        export(deployed, path, name=f"tiny-{net}", targets="axes")
        made[net] = (deployed.eval(), path)
    return made


@pytest.fixture
def poses(facing_camera):
    rng = np.random.default_rng(0)
    joints = facing_camera + rng.normal(0, 0.05, (300, 17, 3))
    return joints - joints[:, :1]


def test_networks_do_not_tell_on_which_machine_they_were_made(exported):
    """torch's exporter notes for every node the source lines that it came from, with their folders."""
    ours = [Path(pcnet3d.__file__).parent / "models" / name for name in SHIPPED]
    for path in (*ours, *(path for _, path in exported.values())):
        assert b".py" not in path.read_bytes()


@pytest.mark.parametrize("net", NETS)
def test_it_answers_like_torch(exported, poses, net):
    import torch

    network, path = exported[net]
    poses[5, H36M17.index("r_wrist")] = np.nan
    R, error_deg = PCNetRectifier(path).rotation(poses)
    joints, valid, usable = prepare(poses)
    assert usable.all()
    with torch.no_grad():
        expected = network(torch.from_numpy(joints), torch.from_numpy(valid))
    np.testing.assert_allclose(R, expected[0].numpy(), atol=1e-4)
    np.testing.assert_allclose(error_deg, expected[1].numpy(), rtol=1e-4)


def test_the_mirrored_body_gets_the_mirrored_answer(exported, poses):
    """By construction where the file was exported as symmetric, and only there."""
    across, body = np.diag([-1.0, 1, 1]), np.diag([1.0, -1, 1])
    for net, symmetric in NETS.items():
        rectifier = PCNetRectifier(exported[net][1])
        R, _ = rectifier.rotation(poses)
        mirrored, _ = rectifier.rotation(poses[:, H36M17.mirror] * np.array([-1, 1, 1]))
        assert np.allclose(mirrored, across @ R @ body, atol=1e-4) == symmetric


def test_chunks_and_threads_do_not_matter(exported, poses, monkeypatch):
    path = exported["paper"][1]
    R, error_deg = PCNetRectifier(path).rotation(poses)
    one = [PCNetRectifier(path).rotation(poses[i : i + 1])[0][0] for i in range(0, 300, 60)]
    np.testing.assert_allclose(one, R[::60], atol=1e-5)
    monkeypatch.setattr(pcnet_onnx, "CHUNK", 7)
    np.testing.assert_allclose(PCNetRectifier(path).rotation(poses)[1], error_deg, rtol=1e-4)


def test_no_frames_and_no_usable_frames(exported, poses):
    rectifier = PCNetRectifier(exported["pcnet"][1])
    assert rectifier.rotation(poses[:0])[0].shape == (0, 3, 3)
    R, error_deg = rectifier.rotation(np.full((4, 17, 3), np.nan))
    assert np.isnan(R).all()
    assert np.isnan(error_deg).all()
    assert np.isnan(
        rectifier.rotation(np.zeros((2, 17, 3)))[0]
    ).all()  # a failed frame that was filled with zeros


@pytest.mark.parametrize(
    ("missing", "fine"),
    [
        ((), True),
        (("l_wrist", "r_ankle", "nose", "head", "spine"), True),
        (("l_hip", "r_hip"), True),
        (("pelvis",), True),
        (("l_shoulder", "thorax"), False),
        (("l_hip", "r_shoulder"), False),
        (("pelvis", "l_hip"), False),
    ],
)
def test_too_few_torso_joints_give_no_rotation(exported, poses, missing, fine):
    poses[3, H36M17.indices(missing)] = np.nan
    R, error_deg = PCNetRectifier(exported["pcnet"][1]).rotation(poses[:6])
    assert np.isfinite(R[[0, 1, 2, 4, 5]]).all()
    assert np.isfinite(R[3]).all() == np.isfinite(error_deg[3]) == fine


def test_a_missing_pelvis_is_the_middle_of_the_hips(exported, poses):
    rectifier = PCNetRectifier(exported["pcnet"][1])
    lost = poses.copy()
    poses[:, 0] = poses[:, H36M17.indices(("l_hip", "r_hip"))].mean(axis=1)
    lost[:, 0] = np.nan
    np.testing.assert_allclose(rectifier.rotation(lost)[0], rectifier.rotation(poses)[0], atol=1e-4)


def test_the_method_names_the_weights(exported):
    for net, (_, path) in exported.items():
        name, digest = PCNetRectifier(path).method.split("@")
        assert (name, len(digest)) == (f"tiny-{net}", 12)


def test_a_network_of_somebody_else_is_named_by_its_file(exported, poses, tmp_path):
    onnx = pytest.importorskip("onnx", reason="needs onnx, the extra 'train'")
    network = onnx.load(exported["paper"][1])
    del network.metadata_props[:]
    onnx.save(network, tmp_path / "mine.onnx")
    rectifier = PCNetRectifier(tmp_path / "mine.onnx")
    assert rectifier.method.startswith("mine.onnx@")
    np.testing.assert_allclose(
        rectifier.rotation(poses)[0], PCNetRectifier(exported["paper"][1]).rotation(poses)[0]
    )


def test_a_network_for_one_batch_only_is_refused(exported, tmp_path):
    onnx = pytest.importorskip("onnx", reason="needs onnx, the extra 'train'")
    network = onnx.load(exported["paper"][1])
    for entry in network.graph.input:
        entry.type.tensor_type.shape.dim[0].dim_value = 1
    onnx.save(network, tmp_path / "one.onnx")
    with refused("wrong-network", "joints (1, 17, 3)"):
        PCNetRectifier(tmp_path / "one.onnx")


@pytest.mark.parametrize("name", ["mine.pth", "mine.pt", "mine.ckpt"])
def test_weights_of_torch_are_refused_with_what_to_do(tmp_path, name):
    (tmp_path / name).write_bytes(b"PK")
    with refused("wrong-network", "torch.onnx.export"):
        load_rectifier(tmp_path / name)


def test_other_files_are_refused(tmp_path):
    pytest.importorskip("onnx", reason="needs onnx, the extra 'train'")
    from golden.networks import save_graph

    with pytest.raises(InputError, match=r"none\.onnx"):
        PCNetRectifier(tmp_path / "none.onnx")
    (tmp_path / "text.onnx").write_text("not a network")
    with pytest.raises(InputError, match=r"text\.onnx"):
        PCNetRectifier(tmp_path / "text.onnx")
    graph = "toy (float[batch, 72] features) => (float[batch, 72] joints) { joints = Identity (features) }"
    save_graph(tmp_path / "lifter.onnx", graph)
    with refused("wrong-network"):
        PCNetRectifier(tmp_path / "lifter.onnx")
