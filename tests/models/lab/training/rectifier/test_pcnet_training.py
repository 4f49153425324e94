"""A training run as small as it gets: it writes what it should, and refuses what it must."""

import json
import sys
from importlib.resources import files

import numpy as np
import onnxruntime
import pytest

from golden.takes import write_lifted
from golden.trainings import tiny
from pcnet3d.models.lab.mocap.convert import write_mocap
from pcnet3d.models.lab.train import train
from pcnet3d.models.rectifier.onnx import PCNetRectifier
from pcnet3d.models.shipped import PCNET
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.running.recipe import load_toml

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
module = pytest.importorskip("pcnet3d.models.lab.training.rectifier")


@pytest.fixture
def run(tmp_path, clips, monkeypatch):
    """Trains into a folder with the tiny config changed, with one clip for every part of the data."""
    monkeypatch.setattr(module, "read_clips", lambda part: clips[part])
    monkeypatch.setattr(module, "_VALIDATION_FRAMES", 40)

    def run(*changes, output="out"):
        (tmp_path / "tiny.toml").write_text(tiny(*changes))
        train(tmp_path / "tiny.toml", tmp_path / output, "cpu", 1)
        return tmp_path / output

    return run


@pytest.fixture
def without_export(monkeypatch):
    """Export takes seconds."""
    monkeypatch.setattr(module, "export", lambda deployed, path, **said: path.write_bytes(b"slow"))


def log_of(folder):
    return [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]


def test_a_run_writes_the_network_its_log_and_its_config(run, capsys):
    out = run()
    assert {path.name for path in out.iterdir()} == {
        "pcnet.onnx", "best.pt", "checkpoint.pt", "config.json", "log.jsonl",
    }  # fmt: skip
    assert json.loads((out / "config.json").read_text())["schedule"]["steps"] == 6
    log = log_of(out)
    assert [line["step"] for line in log] == [2, 4, 6]
    keys = ("loss", "paper", "wide", "paper_expected", "score")
    assert all(np.isfinite(line[key]) for line in log for key in keys)
    assert all(line["score"] == line["paper"] for line in log)
    joints = np.random.default_rng(0).normal(0, 0.4, (5, 17, 3))
    assert np.isfinite(PCNetRectifier(out / "pcnet.onnx").rotation(joints)[0]).all()
    assert "parameters" in capsys.readouterr().out


def test_without_onnx_the_trained_network_waits_for_it(run, tmp_path, monkeypatch):
    """As on a machine where nothing can be installed."""
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "onnx", None)
        with pytest.raises(InputError, match=r"trained.*needs onnx, which is not installed"):
            run()
    log = (tmp_path / "out" / "log.jsonl").read_text()
    monkeypatch.setattr(module, "export", lambda deployed, path, **said: path.write_bytes(b"slow"))
    assert (run() / "pcnet.onnx").exists()
    assert (tmp_path / "out" / "log.jsonl").read_text() == log  # it trained no step more


def test_bf16_is_for_training_and_not_for_judging(monkeypatch):
    used = []
    autocast = torch.autocast
    monkeypatch.setattr(torch, "autocast", lambda *of: (used.append(of), autocast(*of))[1])
    net = module.PCNet(module.NetConfig(width=16, output=8, heads=2), bf16=True)
    joints = torch.randn(4, 17, 3), torch.ones(4, 17)
    net.eval()(*joints)
    assert not used
    net.train()(*joints)
    assert len(used) == 1


def test_the_best_are_the_best_on_lifted_frames_where_there_are_some(run, tmp_path, standing, without_export):
    lifted = write_lifted(tmp_path / "val.npz", standing, names=("07_01",))
    log = log_of(run(("lifted_val = []", f'lifted_val = ["{lifted.as_posix()}"]')))
    assert all(line["score"] == line["lifted"] != line["paper"] for line in log)


def test_people_who_lie_are_a_tenth_of_the_score(clips, tmp_path, standing):
    upright = write_lifted(tmp_path / "upright.npz", standing, names=("07_01",))
    lies = write_lifted(
        tmp_path / "lies.npz", standing[:, [2, 1, 0]] * np.float32([1, 1, -1]), names=("07_02",)
    )
    held = dict(np.load(lies))
    np.savez(lies, **held | {"lying": np.ones(len(held["lying"]))})
    both = module.validation(clips["val"], module.read_lifted([upright, lies]), "body")
    torch.manual_seed(0)
    net = module.PCNet(module.NetConfig(width=16, output=8, heads=2)).eval()
    figures = module.check(module.Deployed(net, True), both)
    expected = 0.9 * figures["lifted"] + 0.1 * figures["lifted_lying"]
    assert figures["score"] == pytest.approx(expected) != figures["lifted"]


def test_it_starts_with_the_shipped_networks_own_answers():
    path = files("pcnet3d.models.lab.training").joinpath("pcnet.toml")
    config = module.TrainConfig.model_validate(load_toml(path, "a training config"))
    net = module.started(module.PCNet(config.net), PCNET.files[0]).eval()
    joints = np.random.default_rng(0).normal(0, 0.4, (20, 17, 3)).astype(np.float32)
    joints -= joints[:, :1]
    with torch.no_grad():
        R, _ = module.Deployed(net, config.symmetric)(torch.from_numpy(joints), torch.ones(20, 17))
    np.testing.assert_allclose(R.numpy(), PCNetRectifier(PCNET.files[0]).rotation(joints)[0], atol=1e-3)


@pytest.mark.parametrize(
    ("person", "where", "words"),
    [("01", "lifted_val", r"the validation's.*01"), ("03", "lifted", "test subjects")],
)
def test_lifted_takes_of_people_of_another_part_are_refused(run, tmp_path, standing, person, where, words):
    """Validation of people who are trained on, and training on those of the test."""
    lifted = write_lifted(tmp_path / "t.npz", standing, names=(f"{person}_01",))
    used = [("lifted = 0.0", "lifted = 0.5")] if where == "lifted" else []
    with pytest.raises(InputError, match=words):
        run((f"{where} = []", f'{where} = ["{lifted.as_posix()}"]'), *used)


@pytest.mark.parametrize("part", ["val", "test", "hdm05", "tennis"])
def test_a_subject_in_train_and_elsewhere_is_refused(run, tmp_path, monkeypatch, part):
    read = module.read_clips
    monkeypatch.setattr(module, "read_clips", lambda p: read("train") if p == part else read(p))
    with pytest.raises(InputError, match=rf"{part} subjects.*01"):
        run()
    assert not (tmp_path / "out").exists()


def test_the_expected_error_is_calibrated(clips):
    """On average it is the true one."""
    torch.manual_seed(0)
    checks = module.validation(clips["val"], None, "body")
    net = module.PCNet(module.NetConfig(width=16, output=8, heads=2, align=True)).eval()
    deployed = module.Deployed(net, symmetric=True)
    before = module.check(deployed, checks)
    assert before["paper_expected"] != pytest.approx(before["paper"], rel=0.05)
    module.calibrate(deployed, checks["paper"])
    after = module.check(deployed, checks)
    assert after["paper_expected"] == pytest.approx(after["paper"], rel=1e-3)
    assert after["paper"] == before["paper"]


def test_the_papers_recipe_is_the_paper():
    path = files("pcnet3d.models.lab.training").joinpath("mmfi.toml")
    config = module.TrainConfig.model_validate(load_toml(path, "a training config"))
    assert (config.net, config.mixture, config.targets) == (module.NetConfig(), module.Mixture(), "axes")


@pytest.fixture
def own(tmp_path, clips):
    """(before, after): a file of clips and a split of ones own, for the paper's targets."""
    write_mocap(tmp_path / "clips.npz", [clips[part][0] for part in ("train", "val", "test")])
    (tmp_path / "split.json").write_text(json.dumps({"train": ["01"], "val": ["07"], "test": ["03"]}))
    data, split = ((tmp_path / name).as_posix() for name in ("clips.npz", "split.json"))
    return ("seed = 1", f'seed = 1\ntargets = "axes"\ndata = "{data}"\nsplit = "{split}"')


AS_RECORDED = ("turned = 0.2", "turned = 0.0")


def test_training_on_own_data_does_not_go_on_with_another_split(run, own, tmp_path):
    out = run(own, AS_RECORDED)
    properties = onnxruntime.InferenceSession(out / "pcnet.onnx").get_modelmeta().custom_metadata_map
    assert (properties["targets"], properties["trained_on"]) == ("axes", "clips.npz, split.json")
    (tmp_path / "split.json").write_text(json.dumps({"train": ["03"], "val": ["07"], "test": ["01"]}))
    with pytest.raises(InputError, match="other recordings or another split"):
        run(own, AS_RECORDED)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ((AS_RECORDED, ('"axes"', '"compass"')), "targets"),
        ((AS_RECORDED, ("lifted = []", 'lifted = ["a.npz"]')), "as they were recorded"),
        ((AS_RECORDED, ("clips.npz", "clip.npz")), "found nothing"),
        ((), "as they were recorded"),
    ],
)
def test_a_config_that_contradicts_itself_is_refused(run, own, tmp_path, changes, words):
    with pytest.raises(InputError, match=words):
        run(own, *changes)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("steps = 6", "steps = 0", r"tiny\.toml: schedule\.steps"),
        ("bf16 = false", "bf16 = false\nthreads = 1", "threads"),
        ("rate = 1e-3", "rate = nan", "rate"),
        ("roll_deg = 10.0", "roll_deg = inf", r"mixture\.roll_deg"),
        ("turned = 0.2", "turnt = 0.2", r"mixture\.poses\.turnt"),
        ("heads = 2", "heads = 3", "net.*3 heads.*16"),
        ('kind = "pcnet"', 'kind = "pcnett"', "kind of lifter, pcnet; got 'pcnett'"),
        ("lifted = 0.0", "lifted = 0.5", "lifted takes.*testbed"),
        ("lifted = []", 'lifted = ["none.npz"]', r"none\.npz"),
    ],
)
def test_configs_that_cannot_be_trained(run, tmp_path, before, after, words):
    with pytest.raises(InputError, match=words):
        run((before, after))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("residual", ["off", "free"])
def test_nothing_stays_on_another_device(residual):
    """The meta device computes no numbers, but refuses to mix tensors of two devices, as a GPU does."""
    device = torch.device("meta")
    network = module.PCNet(module.NetConfig(width=16, output=8, heads=2, residual=residual, align=True)).to(
        device
    )
    joints, R = torch.zeros(4, 17, 3, device=device), torch.zeros(4, 3, 3, device=device)
    frames = module.Frames(joints, torch.ones(4, 17, device=device), joints, R)
    answer = network(joints, frames.valid)
    module.total(network, answer, frames).backward()
    assert all(p.grad.device == device for p in network.parameters())
    assert module.Deployed(network, symmetric=True)(joints, frames.valid)[0].device == device
