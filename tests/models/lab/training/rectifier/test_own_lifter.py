"""From a lifter's answers and their truth to a rectifier: what is read, what is refused, what is judged, and a run."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from pcnet3d.models.shipped import GEOMETRIC, PAPER, PCNET
from pcnet3d.pipeline import H36M17, rotate
from refusals import refused

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
from pcnet3d.models.lab.training.rectifier import own_lifter as module  # noqa: E402
from pcnet3d.models.lab.training.rectifier import train as training  # noqa: E402
from pcnet3d.models.lab.training.rectifier.export import Deployed, parity, started  # noqa: E402
from pcnet3d.models.lab.training.rectifier.net import NetConfig, PCNet  # noqa: E402

R_CAMERA_FROM_WORLD = np.array(
    [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]]
)  # level, before a person at -x
FRAMES = 40


@pytest.fixture
def folders(tmp_path, standing):
    """The answers of a lifter that is right but for size and noise, and the truth, of four people."""
    answers, truth, rng = tmp_path / "mylifter", tmp_path / "truth", np.random.default_rng(0)
    for folder in (answers, truth):
        folder.mkdir()
    for person in "abcd":
        joints = standing + rng.normal(0, 0.01, (FRAMES, 17, 3))
        np.savez(
            truth / f"{person}_1.npz",
            joints=joints, fps=30, joint_names=np.array(H36M17.joints), R_camera_from_world=R_CAMERA_FROM_WORLD,
        )  # fmt: skip
        lifted = 0.5 * rotate(R_CAMERA_FROM_WORLD, joints)
        lifted[3] = np.nan
        np.save(answers / f"{person}_1.npy", lifted + 0.005 * rng.normal(size=lifted.shape))
    return answers, truth


def test_a_pair_is_the_truth_in_the_camera_and_the_answer(folders):
    pairs = module.read_pairs(*folders)
    assert [pair.clip.subject for pair in pairs] == list("abcd")
    take = pairs[0].take
    assert len(take.R) == FRAMES - 1  # one frame has no answer
    np.testing.assert_allclose(take.truth[0], 2 * take.joints[0], atol=0.08)
    np.testing.assert_allclose(take.R[:, :, 2], np.tile([0.0, -1.0, 0.0], (FRAMES - 1, 1)), atol=1e-6)


def test_what_does_not_fit_is_refused(folders, tmp_path):
    answers, truth = folders
    with refused("cannot-open", tmp_path / "none"):
        module.read_pairs(tmp_path / "none", truth)
    with refused("nothing-usable", truth):
        module.read_pairs(tmp_path, truth)
    with refused("nothing-usable", 2):
        module._parts_of(["a", "b"])
    held = dict(np.load(truth / "a_1.npz"))
    for wrong in (2 * R_CAMERA_FROM_WORLD, -R_CAMERA_FROM_WORLD, np.ones((FRAMES - 1, 3, 3))):
        np.savez(truth / "a_1.npz", **held | {"R_camera_from_world": wrong})
        with refused("wrong-content", "a_1.npz"):
            module.read_pairs(answers, truth)
    np.savez(truth / "a_1.npz", **held)
    np.save(answers / "a_1.npy", np.load(answers / "a_1.npy")[1:])
    with refused("files-apart", FRAMES):
        module.read_pairs(answers, truth)


def test_answers_in_other_axes_are_refused(folders):
    for path in folders[0].iterdir():
        np.save(path, np.load(path) * [-1, -1, 1])  # y up
    with refused("wrong-axes", 180):
        module.read_pairs(*folders)


def test_people_are_in_one_part_only():
    parts = module._parts_of(list("abcdefghij"))
    assert sorted(one for people in parts.values() for one in people) == list("abcdefghij")
    assert {part: len(people) for part, people in parts.items()} == {"train": 6, "val": 2, "test": 2}


def test_the_same_rectifier_twice_is_neither_better_nor_worse(folders):
    class Own:
        method, rotation = "own@1", staticmethod(GEOMETRIC.open().rotation)

    found = module.judged(module.read_pairs(*folders), GEOMETRIC.open(), Own())
    assert [found["change"][key] for key in ("mean", "low", "high")] == [0.0, 0.0, 0.0]
    assert "do not tell" in found["verdict"]
    assert found["tested"] == 4
    rotations = [of["rotation"] for of in found["rectifiers"].values()]
    assert rotations[0] == rotations[1]
    assert rotations[0]["low"] <= rotations[0]["mean"] <= rotations[0]["high"]


def test_a_run_ends_in_a_network_of_the_lifters_name_and_its_figures(folders, tmp_path, monkeypatch):
    monkeypatch.setattr(training, "_VALIDATION_FRAMES", 10)
    told = []
    monkeypatch.setattr(
        training, "export", lambda net, path, **said: (told.append(said), shutil.copy(PAPER.files[0], path))
    )
    checked = module.checked
    monkeypatch.setattr(module, "checked", lambda content, *rest: checked({**content, "batch": 8}, *rest))
    figures = module.train_own_lifter(*folders, tmp_path / "out", steps=1)
    assert figures is not None
    assert (tmp_path / "out" / "mylifter.onnx").exists()
    assert told[0]["name"] == "mylifter"
    written = json.loads((tmp_path / "out" / "judged.json").read_text())
    assert written["tested"] == 1
    assert written["change"]["low"] is None  # one person has no interval
    assert "(one person)" in (tmp_path / "out" / "judged.md").read_text()
    config = training.read_config(tmp_path / "out" / "pcnet.toml")
    assert str(config.start) == "pcnet"
    assert config.mixture.lying == 0  # nobody lies


def test_the_shipped_network_can_be_gone_on_with():
    """Its answers come back, though the exporter has forgotten names and worked out what no input changes."""
    net = training.read_config(Path(training.__file__).with_name("pcnet.toml")).net
    assert parity(Deployed(started(PCNet(net), PCNET.files[0]).eval(), True), PCNET.files[0]) < 1e-4


def test_no_other_network_can(tmp_path):
    with refused("file-damaged", PCNET.files[0]):
        started(PCNet(NetConfig(width=64)), PCNET.files[0])
    with refused("cannot-open", "none.onnx"):
        started(PCNet(NetConfig()), tmp_path / "none.onnx")
