"""`pcnet3d lab train` from the command line, on a data folder as small as it gets: what is wrong gets one sentence and
exit code 2."""

import json

import numpy as np
import pytest

from commands import pcnet3d, refused
from golden.trainings import tiny
from pcnet3d.models.lab.mocap.files import write_mocap
from pcnet3d.pipeline.reading.mocap import Clip

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
training = pytest.importorskip("pcnet3d.models.lab.training.rectifier.train")

CONFIG = tiny(
    ("steps = 6", "steps = 3"),
    ("every = 2", "every = 3"),
    ('residual = "off"\nalign = true', 'residual = "free"'),
)


OTHERS = {"accad_mocap": {}, "tennis_mocap": {"test": ["tennis-a"]}}  # of the split, beside CMU


@pytest.fixture
def folder(tmp_path, standing, monkeypatch):
    """A data folder with one subject for every part, and a config beside it."""
    joints = standing + np.random.default_rng(0).normal(0, 0.03, (40, 17, 3))
    data = tmp_path / "data"
    data.mkdir()
    for file, names in {
        "cmu_mocap": ["01", "07", "03"], "hdm05_subset": ["bd"], "accad_mocap": ["accad-f1"],
        "tennis_mocap": ["tennis-a", "tennis-b"],
    }.items():  # fmt: skip
        clips = [Clip(f"{name}_01", name, "asfamc", 30.0, joints.astype(np.float32)) for name in names]
        write_mocap(data / f"{file}.npz", clips)
    cmu = {"train": ["01"], "val": ["07"], "test": ["03"]}
    (data / "splits.json").write_text(json.dumps({**OTHERS, "cmu_mocap": cmu}))
    (tmp_path / "tiny.toml").write_text(CONFIG)
    monkeypatch.setenv("PCNET3D_DATA", str(data))
    monkeypatch.chdir(tmp_path)
    # Export takes seconds and has tests of its own.
    monkeypatch.setattr(training, "export", lambda deployed, path, **said: path.write_bytes(b""))
    return tmp_path


@pytest.fixture
def train(folder):
    """Runs `pcnet3d lab train` in the folder."""
    return lambda config="tiny.toml", output="out": pcnet3d(
        "lab", "train", config, "-o", output, "--device", "cpu"
    )


def change(folder, before, after):
    text = (folder / "tiny.toml").read_text()
    assert before in text
    (folder / "tiny.toml").write_text(text.replace(before, after))


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("steps = 3", "steps = 0", ("tiny.toml", "steps")),
        ("batch = 32", "batch = 0", ("batch",)),
        ("bf16 = false", "bf16 = false\nthreads = 1", ("threads",)),
        ("cooldown = 0.5", "cooldown = 0", ("schedule.cooldown",)),
        ("[weights]", "[weights]\nposture = 1", ("weights.posture",)),
        ("rate = 1e-3", "rate = nan", ("rate",)),
        ("seed = 1", "seed = -1", ("seed",)),
        ("wide = 0.5", "wide = 7", ("mixture.wide",)),
        ("roll_deg = 10.0", "roll_deg = inf", ("mixture.roll_deg",)),
        ("turned = 0.2", "turnt = 0.2", ("mixture.poses.turnt",)),
        ("width = 16", "width = 0", ("net", "width")),
        ("heads = 2", "heads = 3", ("net", "3 heads", "16")),
        ('kind = "pcnet"', 'kind = "pcnett"', ("kind", "pcnett", "lifter, pcnet")),
        ("lifted = 0.0", "lifted = 0.5", ("lifted takes", "testbed")),
        ("lifted = []", 'lifted = ["none.npz"]', ("none.npz",)),
        ("lifted = []", 'lifted = ["data/cmu_mocap.npz"]', ("cmu_mocap.npz", "testbed")),
    ],
)
def test_configs_that_cannot_be_trained(folder, train, before, after, words):
    change(folder, before, after)
    refused(train(), *words)
    assert not (folder / "out").exists()


def test_a_config_that_is_not_there_and_a_folder(folder, train):
    refused(train("none.toml"), "none.toml")
    refused(train("data"), "data")


@pytest.mark.parametrize("residual", ["off", "free"])
def test_nothing_stays_on_another_device(residual):
    """The meta device computes no numbers, but refuses to mix tensors of two devices, as a GPU does."""
    from pcnet3d.models.lab.training.rectifier.net import NetConfig, PCNet
    from pcnet3d.models.lab.training.rectifier.train import Deployed, Truth, Weights, total

    config = NetConfig(width=16, output=8, heads=2, residual=residual, align=True)
    device = torch.device("meta")
    network = PCNet(config).to(device)
    joints, R = torch.zeros(4, 17, 3, device=device), torch.zeros(4, 3, 3, device=device)
    valid = torch.ones(4, 17, device=device)
    answer = network(joints, valid)
    total(network, answer, joints, Truth(joints, R, valid), Weights()).backward()
    assert all(p.grad.device == device for p in network.parameters())
    assert Deployed(network, symmetric=True)(joints, valid)[0].device == device
