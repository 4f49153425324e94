"""The shipped configs' first steps come to the losses that they came to when the shipped networks were trained: whoever
changes the loop, the beds or a loss on purpose measures them anew."""

import json
import tomllib
from importlib.resources import files
from pathlib import Path

import pytest

from pcnet3d.models.lab.training import lifter, rectifier

SAMPLE = Path(__file__).parents[3] / "data"
SMALL = {"width": 16, "output": 24}
# Of the shipped ones, what a processor and the sample allow. Nobody lies in the sample, and it has no lifted takes.
CHANGES = {
    "lifter": {"frames": 324, "single": 1},
    "pcnet": {"batch": 64, "net": SMALL | {"residual": "off", "align": True}},
    "paper": {"batch": 64, "net": SMALL},
    "mmfi": {"batch": 64, "net": SMALL},
}
LOSSES = {
    "lifter": (0.711365, 1.249924, 0.969290),
    "pcnet": (1.052099, 1.265953, 1.335718),
    "paper": (4.166024, 4.460205, 4.237181),
    "mmfi": (4.596923, 4.618149, 4.396521),
}


@pytest.mark.parametrize("name", CHANGES)
def test_the_first_steps_lose_as_much_as_ever(name, tmp_path, monkeypatch):
    module = lifter if name == "lifter" else rectifier
    monkeypatch.setattr(rectifier, "HEADS", 2)
    for constant, value in (("WIDTH", 8), ("TRUNK", 16), ("DILATIONS", (1, 3))):
        monkeypatch.setattr(lifter, constant, value)
    # Validation and export take seconds.
    monkeypatch.setattr(module, "judged" if name == "lifter" else "check", lambda *given: {"score": 0.0})
    monkeypatch.setattr(module, "whole_takes" if name == "lifter" else "calibrate", lambda *given: {})
    monkeypatch.setattr(module, "export", lambda *given, **said: None)
    split = json.loads((SAMPLE / "splits.json").read_text())["cmu_mocap"]
    (tmp_path / "splits.json").write_text(json.dumps({"cmu_mocap": split | {"val": ["07"]}}))
    (tmp_path / "cmu_mocap.npz").symlink_to(SAMPLE / "cmu_mocap.npz")
    monkeypatch.setenv("PCNET3D_DATA", str(tmp_path))
    folder = files(module.__package__)
    content = tomllib.loads(folder.joinpath(f"{name}.toml").read_text(encoding="utf-8")) | CHANGES[name]
    content["bf16"] = False
    content["schedule"] |= {"steps": 3, "every": 1, "warmup": 2}
    if name == "lifter":
        content["material"]["lying"] = 0.0
    else:
        content |= {"lifted": [], "lifted_val": []}
        content["mixture"] |= {"lifted": 0.0, "lying": 0.0}
    module.train(module.TrainConfig.model_validate(content), tmp_path / "out")
    log = (tmp_path / "out" / "log.jsonl").read_text().splitlines()
    first, *later = (json.loads(line)["loss"] for line in log)
    assert first == pytest.approx(LOSSES[name][0], rel=1e-5)
    # Muon works in bfloat16, which processors round differently: by up to 5e-4 of a loss.
    assert later == pytest.approx(LOSSES[name][1:], rel=2e-3)
