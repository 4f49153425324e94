"""A training run as small as it gets: it writes what it should, resumes exactly, and refuses what it must."""

import json
import sys

import numpy as np
import pytest

from golden.takes import write_lifted
from golden.trainings import TINY, tiny
from pcnet3d.pipeline import InputError

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
module = pytest.importorskip("pcnet3d.models.lab.training.rectifier.train")
from golden.checkpoints import read_checkpoint  # noqa: E402


@pytest.fixture
def config(tmp_path, clips, monkeypatch):
    """A config file, with one clip for every part of the data."""
    monkeypatch.setattr(module, "read_clips", lambda part: clips[part])
    monkeypatch.setattr(module, "_VALIDATION_FRAMES", 40)
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    return path


@pytest.fixture
def without_export(monkeypatch):
    """Export takes seconds."""
    monkeypatch.setattr(module, "export", lambda deployed, path, **said: path.write_bytes(b"slow"))


def test_a_run_writes_the_network_its_log_and_its_config(config, tmp_path, capsys):
    module.train_pcnet(config, tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        "pcnet.onnx", "best.pt", "checkpoint.pt", "pcnet.toml", "log.jsonl",
    }  # fmt: skip
    assert (tmp_path / "out" / "pcnet.toml").read_text() == TINY
    lines = [json.loads(line) for line in (tmp_path / "out" / "log.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [2, 4, 6]
    keys = ("loss", "paper", "wide", "paper_expected", "score")
    assert all(np.isfinite(line[key]) for line in lines for key in keys)
    assert all(line["score"] == line["paper"] for line in lines)
    from pcnet3d.models.rectifier.onnx import PCNetRectifier

    joints = np.random.default_rng(0).normal(0, 0.4, (5, 17, 3))
    assert np.isfinite(PCNetRectifier(tmp_path / "out" / "pcnet.onnx").rotation(joints)[0]).all()
    assert "parameters" in capsys.readouterr().out


def test_without_onnx_the_trained_network_waits_for_it(config, tmp_path, monkeypatch):
    """As on a machine where nothing can be installed."""
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "onnx", None)
        with pytest.raises(InputError, match=r"trained.*needs onnx, which is not installed"):
            module.train_pcnet(config, tmp_path / "out")
    assert not (tmp_path / "out" / "pcnet.onnx").exists()
    log = (tmp_path / "out" / "log.jsonl").read_text()
    monkeypatch.setattr(module, "export", lambda deployed, path, **said: path.write_bytes(b"slow"))
    module.train_pcnet(config, tmp_path / "out")
    assert (tmp_path / "out" / "pcnet.onnx").exists()
    assert (tmp_path / "out" / "log.jsonl").read_text() == log  # it trained no step more


def test_it_learns(config, tmp_path, without_export):
    config.write_text(
        tiny(("steps = 6", "steps = 60"), ("every = 2", "every = 20"), ("rate = 1e-3", "rate = 1e-2"))
    )
    module.train_pcnet(config, tmp_path / "out")
    lines = [json.loads(line) for line in (tmp_path / "out" / "log.jsonl").read_text().splitlines()]
    assert lines[-1]["paper"] < 0.7 * lines[0]["paper"]


def test_bf16_is_for_training_and_not_for_judging(config, tmp_path, monkeypatch, without_export):
    config.write_text(tiny(("bf16 = false", "bf16 = true")))
    seen = []
    check = module.check
    monkeypatch.setattr(
        module, "check", lambda deployed, checks: (seen.append(deployed.net.bf16), check(deployed, checks))[1]
    )
    total = module.total
    monkeypatch.setattr(module, "total", lambda net, *rest: (seen.append(net.bf16), total(net, *rest))[1])
    module.train_pcnet(config, tmp_path / "out")
    assert seen == [True, True, False] * 3 + [False]


def test_the_best_are_the_best_on_lifted_frames_where_there_are_some(
    config, tmp_path, standing, without_export
):
    lifted = write_lifted(tmp_path / "val.npz", standing, names=("07_01",))
    config.write_text(tiny(("lifted_val = []", f'lifted_val = ["{lifted.as_posix()}"]')))
    module.train_pcnet(config, tmp_path / "out")
    lines = [json.loads(line) for line in (tmp_path / "out" / "log.jsonl").read_text().splitlines()]
    assert all(line["score"] == line["lifted"] != line["paper"] for line in lines)
    assert read_checkpoint(tmp_path / "out")["best"] == min(line["lifted"] for line in lines)


def test_people_who_lie_are_a_tenth_of_the_score(config, clips, tmp_path, standing):
    upright = write_lifted(tmp_path / "upright.npz", standing, names=("07_01",))
    lies = write_lifted(
        tmp_path / "lies.npz", standing[:, [2, 1, 0]] * np.float32([1, 1, -1]), names=("07_02",)
    )
    held = dict(np.load(lies))
    np.savez(lies, **held | {"lying": np.ones(len(held["lying"]))})
    both = module.validation(clips["val"], module.read_lifted([upright, lies]), "body")
    assert {"lifted", "lifted_lying"} < set(both)
    torch.manual_seed(0)
    figures = module.check(module.Deployed(module.PCNet(module.read_config(config).net).eval(), True), both)
    expected = 0.9 * figures["lifted"] + 0.1 * figures["lifted_lying"]
    assert figures["score"] == pytest.approx(expected) != figures["lifted"]


def test_it_starts_with_the_weights_of_an_earlier_run(config, tmp_path, without_export):
    module.train_pcnet(config, tmp_path / "first")
    start = (tmp_path / "first" / "best.pt").as_posix()
    config.write_text(tiny(("seed = 1", f'seed = 2\nstart = "{start}"'), ("rate = 1e-3", "rate = 1e-12")))
    module.train_pcnet(config, tmp_path / "second")
    first, second = (torch.load(tmp_path / run / "best.pt", weights_only=True) for run in ("first", "second"))
    for name, weights in first.items():
        torch.testing.assert_close(second[name], weights)


@pytest.mark.parametrize(
    ("person", "where", "words"),
    [("01", "lifted_val", r"the validation's.*01"), ("03", "lifted", "test subjects")],
)
def test_lifted_takes_of_people_of_another_part_are_refused(config, tmp_path, standing, person, where, words):
    """Validation of people who are trained on, and training on those of the test."""
    lifted = write_lifted(tmp_path / "t.npz", standing, names=(f"{person}_01",))
    used = [("lifted = 0.0", "lifted = 0.5")] if where == "lifted" else []
    config.write_text(tiny((f"{where} = []", f'{where} = ["{lifted.as_posix()}"]'), *used))
    with pytest.raises(InputError, match=words):
        module.train_pcnet(config, tmp_path / "out")


def test_the_expected_error_is_calibrated(config, clips):
    """On average it is the true one."""
    torch.manual_seed(0)
    checks = module.validation(clips["val"], None, "body")
    deployed = module.Deployed(module.PCNet(module.read_config(config).net).eval(), symmetric=True)
    before = module.check(deployed, checks)
    assert before["paper_expected"] != pytest.approx(before["paper"], rel=0.05)
    module.calibrate(deployed, checks["paper"])
    after = module.check(deployed, checks)
    assert after["paper_expected"] == pytest.approx(after["paper"], rel=1e-3)
    assert after["paper"] == before["paper"]


@pytest.mark.parametrize("part", ["val", "test", "hdm05", "tennis"])
def test_a_subject_in_train_and_elsewhere_is_refused(config, tmp_path, monkeypatch, part):
    read = module.read_clips
    monkeypatch.setattr(module, "read_clips", lambda p: read("train") if p == part else read(p))
    with pytest.raises(InputError, match=rf"{part} subjects.*01"):
        module.train_pcnet(config, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["pcnet", "paper", "mmfi"])
def test_the_recipes_can_be_read_and_written(name, tmp_path):
    from importlib.resources import files

    from pcnet3d.models.lab.common.toml_config import as_toml

    config = module.read_config(files("pcnet3d.models.lab.training.rectifier").joinpath(f"{name}.toml"))
    assert config.trained_on == "train"
    if name == "mmfi":  # the paper's, which are the defaults
        assert (config.net, config.weights, config.targets) == (module.NetConfig(), module.Weights(), "axes")
    (tmp_path / "again.toml").write_text(as_toml(config))
    assert module.read_config(tmp_path / "again.toml") == config
