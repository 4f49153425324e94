"""The rectifier: an answer that is a rotation whatever the scale and the missing joints, losses of known values,
training frames whose truth fits the joints, and a training run as small as it gets."""

import json
import sys
from importlib.resources import files

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from golden.bodies import bone_lengths
from golden.takes import write_lifted
from golden.trainings import tiny
from pcnet3d.models.common import vectors
from pcnet3d.models.common.canonical import body_axes
from pcnet3d.models.lab.clips import Clip, trunk_lean_deg
from pcnet3d.models.lab.synthetic import Draw, PoseRange
from pcnet3d.models.lab.train import train
from pcnet3d.models.lab.training import rectifier as module
from pcnet3d.models.lab.training.rectifier import NetConfig, PCNet, read_lifted
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.rotations import geodesic_deg, rotate, transpose
from pcnet3d.pipeline.running.recipe import load_toml
from refusals import refused

SMALL = {"width": 16, "output": 24}
EVERY = [NetConfig(residual=residual, align=residual == "off", **SMALL) for residual in ("off", "free")]


@pytest.fixture
def poses(facing_camera):
    """(20, 17, 3) variations of an upright person."""
    joints = facing_camera + np.random.default_rng(0).normal(0, 0.04, (20, 17, 3))
    return torch.tensor(joints - joints[:, :1], dtype=torch.float32)


def build(config):
    """With weights large enough that the answer depends on the input."""
    torch.manual_seed(0)
    net = PCNet(config).eval().requires_grad_(False)
    torch.nn.init.normal_(net.rotation.weight, std=0.5)
    return net


each_config = pytest.mark.parametrize("config", EVERY, ids=lambda c: c.residual)


@each_config
def test_the_answer_is_a_rotation_whatever_the_unit_and_a_missing_joint_holds(config, poses):
    net, valid = build(config), torch.ones(poses.shape[:2])
    result = net(poses, valid)
    R = result.R.numpy().astype(np.float64)
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.broadcast_to(np.eye(3), R.shape), atol=1e-5)
    np.testing.assert_allclose(np.linalg.det(R), 1, atol=1e-5)
    assert geodesic_deg(R, np.broadcast_to(R[0], R.shape)).max() > 0.1  # it looks at the pose
    # An untrained residual head adds nothing: canonical is R^T x.
    np.testing.assert_allclose(result.canonical, rotate(transpose(R), poses.numpy()), atol=1e-5)
    for scale in (1000.0, 1e-2):
        other = net(scale * poses + 3 * scale, valid)
        assert geodesic_deg(R, other.R.numpy()).max() < 0.05
        np.testing.assert_allclose(result.error_deg, other.error_deg, rtol=1e-3)
        np.testing.assert_allclose(result.canonical * scale, other.canonical, atol=2e-3 * scale)
    valid[:, H36M17.indices(("l_wrist", "r_hip", "thorax"))] = 0
    without = net(poses, valid).R
    assert torch.equal(without, net(torch.where(valid[..., None] > 0, poses, 7.0), valid).R)
    assert not torch.allclose(without, result.R, atol=1e-5)


def test_the_papers_network_weights_and_recipe():
    paper = NetConfig()
    assert (paper.width, paper.output, paper.residual) == (256, 384, "free")
    assert (module.GRAPH_LAYERS, module.ATTENTION_LAYERS, module.HEADS, paper.align) == (3, 2, 8, False)
    assert PCNet(paper)(torch.randn(2, 17, 3), torch.ones(2, 17)).attention.shape == (2, 8, 17, 17)
    assert (module.POSE, module.ROTATION, module.CYCLE, module.PERCEPTUAL) == (1, 1, 0.25, 0.15)
    config = shipped("mmfi")
    assert (config.net, config.mixture, config.targets) == (paper, module.Mixture(), "axes")


def shipped(name):
    path = files("pcnet3d.models.lab.training").joinpath(f"{name}.toml")
    return module.TrainConfig.model_validate(load_toml(path, "a training config"))


def turned(R, degrees):
    axis = np.random.default_rng(1).normal(size=(len(R), 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return R @ torch.tensor(Rotation.from_rotvec(axis * np.radians(degrees)).as_matrix())


def test_losses_have_known_values(facing_camera):
    """A turn costs pose, but neither bones nor angles nor the cycle: why a network without residual does without."""
    pose, valid = torch.tensor(facing_camera)[None], torch.ones(1, 17)
    R = torch.tensor(Rotation.random(1, rng=np.random.default_rng(0)).as_matrix())
    wrong = turned(R, 30)
    for degrees in (0, 30, 180):
        angle = module.geodesic(R.requires_grad_(), turned(R.detach(), degrees))
        assert np.degrees(angle.item()) == pytest.approx(degrees, abs=2e-4)
        assert torch.autograd.grad(angle.sum(), R)[0].isfinite().all()
    R = R.detach()
    canonical, off = vectors.rotate(R.mT, pose), vectors.rotate(wrong.mT, pose)
    assert module.pose(off, canonical) > 1e-3
    assert module.cycle(wrong, off, pose).item() == pytest.approx(0, abs=1e-12)
    assert module.perceptual(off, canonical, valid).item() == pytest.approx(0, abs=1e-5)
    moved = pose.clone()
    moved[0, H36M17.index("l_wrist"), 0] += 0.17
    assert module.pose(moved, pose).item() == pytest.approx(0.17**2 / 17)
    assert module.cycle(torch.eye(3).double()[None], moved, pose).item() == pytest.approx(0.17**2 / 17)
    arm, valid = H36M17.indices(("r_shoulder", "r_elbow", "r_wrist")), torch.zeros(1, 17)
    straight, bent, stretched = torch.zeros(3, 1, 17, 3)
    for of, wrist in ((straight, (2, 0, 0)), (bent, (1, 1, 0)), (stretched, (2.5, 0, 0))):
        of[0, arm] = torch.tensor([(0.0, 0, 0), (1, 0, 0), wrist])
    valid[0, arm] = 1
    # One of eight angles differs by a right angle; then one of 16 bones by half a metre.
    assert module.perceptual(straight, bent, valid).item() == pytest.approx(np.pi / 2 / 8, rel=1e-3)
    assert module.perceptual(stretched, straight, valid).item() == pytest.approx(0.5 / 16, rel=1e-3)
    apart = torch.eye(17).reshape(1, 17, 1, 17).expand(1, 17, 17, 17)  # head h looks at joint h only
    assert module.attention_likeness(apart).item() == pytest.approx(0, abs=1e-6)
    alike = torch.rand(3, 1, 17, 17).softmax(-1).expand(3, 4, 17, 17)
    assert module.attention_likeness(alike).item() == pytest.approx(1, abs=1e-5)


@pytest.fixture
def people(standing):
    rng = np.random.default_rng(0)
    poses = (standing + rng.normal(0, 0.03, (3, 80, 17, 3))).astype(np.float32)
    return [Clip(f"0{i}_01", f"0{i}", "asfamc", 30.0, joints) for i, joints in enumerate(poses)]


def batch(clips, count=200, takes=None, **mixture):
    """(joints, valid, truth, R) as arrays, of which truth and R are one body."""
    drawn = module.TrainingFrames(clips, module.Mixture(**mixture), takes).batch(Draw(5, 0), count)
    frames = module.Frames(*(part.numpy() for part in drawn))
    np.testing.assert_allclose(body_axes(frames.truth, frames.R[..., 2]), frames.R, atol=2e-3)
    return frames


def on_the_back(standing):
    return standing[:, [2, 1, 0]] * np.float32([1, 1, -1])


def lean_deg(frames):
    return trunk_lean_deg(rotate(transpose(frames.R), frames.truth))


@pytest.fixture
def lifted(standing, tmp_path):
    """Two files of lifted takes; in the second everybody lies."""
    both = enumerate((standing, on_the_back(standing)))
    takes = read_lifted([write_lifted(tmp_path / f"{i}.npz", of) for i, of in both])
    return takes._replace(lying=lean_deg(takes) > 60)


def test_a_batch_is_the_same_for_the_same_step_and_the_truth_where_nothing_spoils_it(people):
    spoilt = {name: 0.5 for name in ("wide", "combined", "noisy", "missing", "flipped", "redefined")}
    ranges = PoseRange(exchanged=0.2, sampled=0.2, swung=0.3, limbs_swung=0.3, turned=0.3, leaning=0.2)
    one, same = (batch(people, poses=ranges, unchanged=0.3, real=0.2, **spoilt) for _ in range(2))
    for part, again in zip(one, same, strict=True):
        np.testing.assert_array_equal(part, again)
    np.testing.assert_array_equal(one.joints[one.valid == 0], 0)
    assert 0 < (one.valid == 0).mean() < 0.3
    assert (one.valid[:, 0] == 1).all()
    captured = np.concatenate([clip.joints for clip in people])
    both = bone_lengths(np.concatenate([captured, captured[:, H36M17.mirror]]))
    every = PoseRange(swung=1.0, limbs_swung=1.0, turned=0.5, leaning=1.0, laid=0.5)
    for plain in (batch(people), batch(people, poses=every)):
        np.testing.assert_array_equal(plain.joints, plain.truth)
        assert (plain.valid == 1).all()
        # Each is one of the captured bodies, or its mirror image: no pose stretches a bone.
        assert np.abs(bone_lengths(plain.truth)[:, None] - both).max(-1).min(1).max() < 1e-5
    assert lean_deg(batch(people)).max() < 20


def test_lifted_frames_are_mirrored_and_rolled_with_their_truth(people, standing, tmp_path):
    takes = read_lifted([write_lifted(tmp_path / "takes.npz", standing)])
    frames = batch(people, 300, takes, lifted=1.0, roll_deg=30.0)
    np.testing.assert_allclose(frames.joints, frames.truth, atol=1e-5)  # this lifter is right
    canonical = rotate(transpose(frames.R), frames.joints)
    own = rotate(transpose(takes.R), takes.joints)
    one = np.abs(canonical[:, None] - own).max((2, 3)).min(1) < 1e-4
    other = np.abs(canonical[:, H36M17.mirror][:, None] * [1, -1, 1] - own).max((2, 3)).min(1) < 1e-4
    assert (one | other).all()
    assert (np.abs(frames.R[:, None] - takes.R).max((2, 3)).min(1) > 0.01).mean() > 0.9


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_people_who_lie_are_drawn_as_often_as_asked(people, standing, lifted, share):
    """One frame in 241 lies in the clips, and one in two in the lifted takes."""
    alone = Clip("07_01", "07", "asfamc", 30.0, on_the_back(standing)[None].astype(np.float32))
    for source, usual in ((None, 1 / 241), (lifted, 0.5)):
        frames = batch([*people, alone], 600, source, lying=share, lifted=1.0 if source else 0.0)
        assert float((lean_deg(frames) > 60).mean()) == pytest.approx(share + (1 - share) * usual, abs=0.07)
    if share:
        with pytest.raises(InputError, match="clips in which somebody lies"):
            module.TrainingFrames(people, module.Mixture(lying=share))


@pytest.fixture
def run(tmp_path, clips, monkeypatch):
    """Trains into a folder with the tiny config changed, with one clip for every part of the data."""
    monkeypatch.setattr(module, "read_clips", lambda part: clips[part])
    monkeypatch.setattr(module, "_VALIDATION_FRAMES", 40)

    def run(*changes):
        (tmp_path / "tiny.toml").write_text(tiny(*changes))
        train(tmp_path / "tiny.toml", tmp_path / "out", "cpu", 1)
        return tmp_path / "out"

    return run


def test_a_run_keeps_all_and_without_onnx_the_trained_network_waits_for_it(run, tmp_path, monkeypatch):
    """As on a machine where nothing can be installed. Of what is exported: tests/models/rectifier/test_pcnet_onnx.py"""
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "onnx", None)
        with pytest.raises(InputError, match=r"trained.*needs onnx, which is not installed"):
            run()
    text = (tmp_path / "out" / "log.jsonl").read_text()
    log = [json.loads(line) for line in text.splitlines()]
    assert [line["step"] for line in log] == [2, 4, 6]
    keys = ("loss", "paper", "wide", "paper_expected", "score")
    assert all(np.isfinite(line[key]) for line in log for key in keys)
    assert all(line["score"] == line["paper"] for line in log)
    monkeypatch.setattr(module, "export", lambda deployed, path, **said: path.write_text(json.dumps(said)))
    names = {"pcnet.onnx", "best.pt", "checkpoint.pt", "config.json", "log.jsonl"}
    assert {path.name for path in run().iterdir()} == names
    said = json.loads((tmp_path / "out" / "pcnet.onnx").read_text())
    assert said == {"targets": "body", "name": "pcnet"}
    assert (tmp_path / "out" / "log.jsonl").read_text() == text  # it trained no step more


def test_the_score_is_of_lifted_frames_a_tenth_of_people_who_lie_and_the_error_calibrated(clips, lifted):
    checks = module.validation(clips["val"], lifted, "body")
    torch.manual_seed(0)
    deployed = module.Deployed(PCNet(EVERY[0]).eval(), symmetric=True)
    before = module.check(deployed, checks)
    assert before["score"] == pytest.approx(0.9 * before["lifted"] + 0.1 * before["lifted_lying"])
    assert before["paper_expected"] != pytest.approx(before["paper"], rel=0.05)
    module.calibrate(deployed, checks["paper"])
    after = module.check(deployed, checks)
    assert after["paper_expected"] == pytest.approx(after["paper"], rel=1e-3)
    assert after["paper"] == before["paper"]


@pytest.mark.parametrize("part", ["train", "val"])
def test_lifted_takes_of_people_of_another_part_are_refused(run, tmp_path, standing, part):
    """Validation of people who are trained on, and training on those of the test."""
    lifted = write_lifted(tmp_path / "t.npz", standing, names=("01_01", "03_01"))
    key = "lifted_val" if part == "val" else "lifted"
    used = [("lifted = 0.0", "lifted = 0.5")] if part == "train" else []
    with refused("files-apart", part, "03"):
        run((f"{key} = []", f'{key} = ["{lifted.as_posix()}"]'), *used)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("seed = 1", 'seed = 1\ntargets = "axes"', "as they were recorded.*turned"),
        ("turned = 0.2", "turnt = 0.2", r"mixture\.poses\.turnt"),
        ("lifted = 0.0", "lifted = 0.5", "lifted takes.*testbed"),
    ],
)
def test_configs_that_cannot_be_trained(run, tmp_path, before, after, words):
    with pytest.raises(InputError, match=words):
        run((before, after))
    assert not (tmp_path / "out").exists()


@each_config
def test_nothing_stays_on_another_device(config):
    """The meta device computes no numbers, but refuses to mix tensors of two devices, as a GPU does."""
    device = torch.device("meta")
    network = PCNet(config).to(device)
    joints, R = torch.zeros(4, 17, 3, device=device), torch.zeros(4, 3, 3, device=device)
    frames = module.Frames(joints, torch.ones(4, 17, device=device), joints, R)
    module.total(network, network(joints, frames.valid), frames).backward()
    assert all(p.grad.device == device for p in network.parameters())
    assert module.Deployed(network, symmetric=True)(joints, frames.valid)[0].device == device
