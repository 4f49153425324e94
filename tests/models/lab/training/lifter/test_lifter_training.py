"""Training windows of the lifter, and a training run as small as it gets."""

import json
from dataclasses import replace

import numpy as np
import pytest

from golden.lifts import lift
from golden.trainings import LIFTER, tiny
from pcnet3d.models.lab.mocap.convert import write_mocap
from pcnet3d.models.lab.train import train
from pcnet3d.models.lifter.builtin import network
from pcnet3d.models.lifter.builtin import run as lift_features
from pcnet3d.models.lifter.features import CHANNELS
from pcnet3d.pipeline import H36M17, IMAGE, InputError, PoseSequence
from refusals import refused

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
module = pytest.importorskip("pcnet3d.models.lab.training.lifter")
from pcnet3d.models.lab.synthetic.draw import Draw  # noqa: E402
from pcnet3d.models.lab.synthetic.keypoint_noise import Noise  # noqa: E402
from pcnet3d.models.lab.training.lifter import (  # noqa: E402  # noqa: E402
    Batch,
    LifterNet,
    Material,
    NetConfig,
    Windows,
    _depth,
)

LENGTHS = "lengths = { 1 = 0.3, 16 = 0.7 }"


@pytest.fixture
def run(tmp_path, clips, monkeypatch):
    """Trains into a folder with the tiny config changed; everybody is the same three people."""
    monkeypatch.setattr(module, "read_clips", lambda subjects: clips)

    def run(*changes, text=LIFTER, output="out"):
        (tmp_path / "tiny.toml").write_text(tiny(*changes, text=text))
        train(tmp_path / "tiny.toml", tmp_path / output, "cpu", 1)
        return tmp_path / output

    return run


def as_kept(net):
    """The network with its matrices rounded as its file keeps them."""
    for value in net.parameters():
        if value.ndim > 1:
            value.data = value.data.half().float()
    return net


@pytest.fixture
def without_export(monkeypatch):
    """Export takes seconds."""
    monkeypatch.setattr(module, "export", lambda net, path, **said: path.write_bytes(b"slow"))


def test_the_deviation_that_costs_least_is_the_true_one():
    """Its weight teaches the deviations, and pulls at nothing else."""
    torch.manual_seed(0)
    joints = torch.zeros(50, 40, 17, 3)
    error = torch.randn(joints.shape) * torch.tensor([0.02, 0.02, 0.05])
    error[:, :, 0] = 0
    truth = Batch(joints, joints, joints)
    weights = module.Weights(motion=0.0, velocity=0.0, deviation=1.0)

    def cost(across, along):
        sd = torch.tensor([across, along]).expand(50, 40, 17, 2)
        return float(module.loss((joints + error, sd, joints), truth, weights))

    least = cost(0.02, 0.05)
    assert all(least < cost(*other) for other in ((0.018, 0.05), (0.022, 0.05), (0.02, 0.045), (0.02, 0.055)))
    answer = (joints + error).requires_grad_()
    sd = torch.full((50, 40, 17, 2), 0.03)
    slopes = [
        torch.autograd.grad(
            module.loss((answer, sd, joints), truth, weights.model_copy(update={"deviation": d})), answer
        )[0]
        for d in (0.0, 1.0)
    ]
    assert torch.equal(*slopes)


def test_a_run_gives_a_network_that_the_run_time_answers_alike(run, capsys):
    out = run()
    assert {path.name for path in out.iterdir()} == {
        "lifter.onnx", "best.pt", "checkpoint.pt", "config.json", "log.jsonl",
    }  # fmt: skip
    lines = [json.loads(line) for line in (out / "log.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [2, 4, 6]
    assert {"typical", "wild", "wild_up", "exact", "score", "loss"} < lines[0].keys()
    assert "parameters" in capsys.readouterr().out

    opened = network(out / "lifter.onnx")
    assert (opened.reach, opened.trained_on) == (4, "train")
    assert [output.name for output in opened.session.get_outputs()] == ["joints", "sd", "velocity"]
    net = as_kept(module.load_weights(LifterNet(NetConfig(4, 16, (1, 3))), out / "best.pt"))
    for frames in (1, 3, 40):
        x = np.random.default_rng(0).normal(size=(frames, CHANNELS)).astype(np.float32)
        with torch.no_grad():
            expected = [part[0].numpy() for part in net(torch.from_numpy(x)[None])]
        answers = opened.session.run(["joints", "sd", "velocity"], {"features": x[None]})
        for answer, part in zip(answers, expected, strict=True):
            np.testing.assert_allclose(answer[0], part, atol=1e-5)
        np.testing.assert_allclose(lift_features(x, out / "lifter.onnx")[0], expected[0], atol=1e-5)
        np.testing.assert_allclose(lift_features(x, out / "lifter.onnx", chunk=7)[1], expected[1], atol=1e-5)
    assert (answers[1] > 0).all()
    flat = np.random.default_rng(0).uniform(300, 700, (12, 17, 2))
    lifted = lift(PoseSequence(flat, H36M17, IMAGE), (1000, 1000), model=out / "lifter.onnx")
    assert np.isfinite(lifted.joints).all()


def test_it_starts_with_the_weights_of_an_earlier_run(run, without_export):
    first = run(output="first") / "best.pt"
    start = ("seed = 1", f'seed = 2\nstart = "{first.as_posix()}"')
    second = run(start, ("rate = 1e-3", "rate = 1e-12"), output="second") / "best.pt"
    one, two = (torch.load(path, weights_only=True) for path in (first, second))
    for name, value in one.items():
        torch.testing.assert_close(two[name], value, atol=1e-6, rtol=1e-5)
    with pytest.raises(InputError, match=r"best\.pt.*size mismatch"):
        run(start, ("width = 4", "width = 8"), output="third")


def windows_of(clips):
    """Features of exact keypoints, (6, 10, CHANNELS), and what they show."""
    silent = Noise(std=0.0, outliers=0.0, swap_rate=0.0, missing_rate=0.0, absent_rate=0.0)
    windows = Windows(clips, Material(unchanged=1.0, mirrored=0.0, other_rates=0.0, focal_known=1.0))
    windows.noise = silent
    return windows.batch(Draw(3, 0), 6, 10)


def test_joints_that_were_seen_lie_on_their_rays_but_for_what_is_learned(clips):
    """Exact keypoints: whatever the network answers then projects onto them, seen from one point a frame. Of joints
    that were not seen the image says nothing."""
    x = windows_of(clips).x
    net = LifterNet(NetConfig(8, 16, (1, 3)))
    torch.nn.init.normal_(net.leave_bone.weight)
    hidden = net.hidden(net.tokens(x)).detach()
    joints = net.answer(hidden, x)[0].detach()
    image, size = x[..., :34].unflatten(-1, (17, 2)), (x[..., 71:72] - 2).exp()
    # joints + offset = image (distance + size depth): three unknowns a frame.
    left = joints[..., :2] - image * (size * joints[..., 2])[..., None]
    middles = (part - part.mean(-2, keepdim=True) for part in (left, image))
    off, line = (part.flatten(-2) for part in middles)
    distance = (off * line).sum(-1, keepdim=True) / line.square().sum(-1, keepdim=True)
    np.testing.assert_allclose(off.numpy(), (distance * line).numpy(), atol=1e-4)
    torch.nn.init.normal_(net.leave_off.weight)
    assert (net.answer(hidden, x)[0] - joints).abs().max() > 0.01
    nobody = x.clone()
    nobody[..., 51:68] = 0
    elsewhere = nobody.clone()
    elsewhere[..., :34] += 1
    assert torch.equal(net.answer(hidden, nobody)[0], net.answer(hidden, elsewhere)[0])


def test_bones_seen_short_may_be_deep():
    shown = torch.tensor([0.0, 0.3, 0.4, 0.9])
    depth = _depth(torch.full((4,), 0.5), shown)
    np.testing.assert_allclose(depth[:3].numpy(), [0.5, 0.4, 0.3], atol=2e-3)
    assert 0 < depth[3] < 0.05


@pytest.fixture
def own(run, tmp_path, clips, monkeypatch):
    """Trains on a file of clips of people who stand and a split, the text changed; nothing else is read."""
    monkeypatch.setenv("PCNET3D_DATA", str(tmp_path / "nowhere"))
    for clip in clips:
        for part, height in ("hip", 0.9), ("shoulder", 1.4):
            clip.joints[:, H36M17.indices((f"l_{part}", f"r_{part}")), 2] = height
    write_mocap(tmp_path / "clips.npz", clips)
    (tmp_path / "split.json").write_text(json.dumps({"train": ["00", "01"], "val": ["02"]}))
    data, split = ((tmp_path / name).as_posix() for name in ("clips.npz", "split.json"))
    text = tiny(("seed = 1", f'seed = 1\ndata = "{data}"\nsplit = "{split}"'), text=LIFTER)
    return lambda *changes: run(*changes, text=text)


def test_training_on_own_data_does_not_go_on_with_another_split(own, tmp_path, monkeypatch):
    """Whoever was trained on would be tested."""
    said = {}
    monkeypatch.setattr(module, "export", lambda net, path, **properties: said.update(properties))
    log = own() / "log.jsonl"
    assert said == {"reach": 4, "trained_on": "clips.npz, split.json"}
    (tmp_path / "split.json").write_text(json.dumps({"train": ["00"], "val": ["02"], "test": ["01"]}))
    before = log.read_text()
    with pytest.raises(InputError, match=r"checkpoint\.pt learned from other recordings or another split"):
        own()
    assert log.read_text() == before


def test_own_data_that_cannot_be_trained_on_is_refused(own, tmp_path, clips):
    for before, after, words in [
        ("split = ", "# split = ", "`data` and `split` together"),
        ("clips.npz", "clip.npz", "found nothing"),
        ("16 = 0.7", "999 = 0.7", "999 frames"),
    ]:
        with pytest.raises(InputError, match=words):
            own((before, after))
    laid = [replace(clip, joints=clip.joints[..., [2, 1, 0]]) for clip in clips]
    write_mocap(tmp_path / "clips.npz", laid)
    with refused("nothing-usable"):  # nobody upright to validate on
        own()


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("seed", "sede", "sede|seed"),
        ("pans = 0.2", "pans = 20", r"material\.pans"),
        *((LENGTHS, f"lengths = {{ {of} }}", "lengths") for of in ("", "0 = 1.0", "1 = 0.0", "9 = inf")),
        ("dilations = [1, 3]", "dilations = [-1]", r"net\.dilations"),
        ("[material]", "[material]\nabsent = { foo = 0.3 }", r"material\.absent\.foo"),
        ("steps = 6", "steps = 6]", "TOML"),
    ],
)
def test_a_wrong_config_is_refused_by_its_key(run, tmp_path, before, after, words):
    with pytest.raises(InputError, match=words):
        run((before, after))
    assert not (tmp_path / "out").exists()
