"""A training run as small as it gets: it writes what it should, resumes exactly, and refuses what it must."""

import json

import numpy as np
import pytest

from golden.trainings import TINY
from pcnet3d.pipeline import InputError

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
module = pytest.importorskip("pcnet3d.models.pcnet_train")


@pytest.fixture
def config(tmp_path, clips, monkeypatch):
    """A config file, with one clip for every part of the data."""
    monkeypatch.setattr(module, "read_clips", lambda part: clips[part])
    monkeypatch.setattr(module, "_EVERY", 2)
    monkeypatch.setattr(module, "_VALIDATION_FRAMES", 40)
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    return path


def weights(path):
    return torch.load(path, weights_only=True)


def test_a_run_writes_the_network_its_log_and_its_config(config, tmp_path, capsys):
    module.train_pcnet(config, tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"pcnet.onnx", "pcnet.pt", "last.pt", "pcnet.toml", "log.jsonl"}
    lines = [json.loads(line) for line in (tmp_path / "out" / "log.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [2, 4, 6]
    assert all(
        np.isfinite(line[key]) for line in lines for key in ("loss", "paper", "wide", "paper_expected")
    )
    from pcnet3d.models.pcnet_onnx import PCNetRectifier

    joints = np.random.default_rng(0).normal(0, 0.4, (5, 17, 3))
    assert np.isfinite(PCNetRectifier(tmp_path / "out" / "pcnet.onnx").rotation(joints)[0]).all()
    assert "parameters" in capsys.readouterr().out


def test_a_run_that_was_stopped_goes_on_to_the_same_weights(config, tmp_path, monkeypatch):
    module.train_pcnet(config, tmp_path / "whole")
    save, stopped = module.State.save, []

    def stop_after_two(self, path, config):
        save(self, path, config)
        if self.step == 2 and not stopped:
            stopped.append(True)
            raise KeyboardInterrupt

    monkeypatch.setattr(module.State, "save", stop_after_two)
    with pytest.raises(KeyboardInterrupt):
        module.train_pcnet(config, tmp_path / "broken")
    module.train_pcnet(config, tmp_path / "broken")
    for file, key in (("last.pt", "net"), ("last.pt", "average"), ("pcnet.pt", None)):
        one, other = (weights(tmp_path / run / file) for run in ("whole", "broken"))
        one, other = (one[key], other[key]) if key else (one, other)
        assert one.keys() == other.keys()
        assert all(torch.equal(one[name], other[name]) for name in one)


def test_another_config_cannot_go_on(config, tmp_path):
    module.train_pcnet(config, tmp_path / "out")
    before = (tmp_path / "out" / "pcnet.pt").read_bytes()
    config.write_text(TINY.replace("rate = 1e-3", "rate = 2e-3"))
    with pytest.raises(InputError, match="another config"):
        module.train_pcnet(config, tmp_path / "out")
    assert (tmp_path / "out" / "pcnet.pt").read_bytes() == before
    assert "1e-3" in (tmp_path / "out" / "pcnet.toml").read_text()


@pytest.mark.parametrize("content", [b"not a checkpoint", b""])
def test_a_damaged_checkpoint_is_refused(config, tmp_path, content):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "last.pt").write_bytes(content)
    with pytest.raises(InputError, match=r"last\.pt"):
        module.train_pcnet(config, tmp_path / "out")


def test_a_loss_that_is_no_number_stops_and_keeps_the_last_good_weights(config, tmp_path, monkeypatch):
    calls, total = [], module.total

    def broken(*args):
        calls.append(1)
        return total(*args) * (float("nan") if len(calls) == 4 else 1)

    monkeypatch.setattr(module, "total", broken)
    with pytest.raises(InputError, match="step 4"):
        module.train_pcnet(config, tmp_path / "out")
    saved = weights(tmp_path / "out" / "last.pt")
    assert saved["step"] == 2
    assert all(torch.isfinite(value).all() for value in saved["net"].values())


@pytest.mark.parametrize("part", ["val", "test", "hdm05"])
def test_a_subject_in_train_and_elsewhere_is_refused(config, tmp_path, monkeypatch, part):
    read = module.read_clips
    monkeypatch.setattr(module, "read_clips", lambda p: read("train") if p == part else read(p))
    with pytest.raises(InputError, match=rf"{part} subjects.*01"):
        module.train_pcnet(config, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_lifted_takes_of_a_test_subject_are_refused(config, tmp_path):
    R = np.tile([[0, -1, 0], [0, 0, -1], [1, 0, 0]], (5, 1, 1))
    joints = np.random.default_rng(0).normal(size=(5, 17, 3))
    np.savez(
        tmp_path / "t.npz",
        lifted=joints,
        truth=joints,
        R_camera_from_body=R,
        lying=np.zeros(len(R)),
        clip=np.array(["03_01"]),
    )
    text = TINY.replace("lifted = []", f'lifted = ["{tmp_path / "t.npz"}"]').replace(
        "lifted = 0.0", "lifted = 0.5"
    )
    config.write_text(text)
    with pytest.raises(InputError, match="test subjects"):
        module.train_pcnet(config, tmp_path / "out")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("seed", "sede"), "sede|seed"),
        (lambda text: text.replace('net = "mlp"', 'net = "cnn"'), "net.net"),
        (lambda text: text.replace("wide = 0.5", "wider = 0.5"), "mixture"),
        (lambda text: text + "]", "TOML"),
    ],
)
def test_a_wrong_config_is_refused_by_its_key(config, change, words):
    config.write_text(change(TINY))
    with pytest.raises(InputError, match=words):
        module.read_config(config)


def test_the_shipped_recipe_can_be_read():
    from importlib.resources import files

    config = module.read_config(files("pcnet3d.models").joinpath("pcnet.toml"))
    assert config.subjects == "train"
