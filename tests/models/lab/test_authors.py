"""The default network of the paper's authors, on the sample: what it answers is a rotation, and its side matters."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from pcnet3d.models.lab import authors as module
from pcnet3d.models.lab.evaluation.rectifiers import clean_takes
from pcnet3d.pipeline import InputError, rotate

SAMPLE = Path(__file__).parents[2] / "data"


class Told(torch.nn.Module):
    """Six numbers, or a residual, whatever the features are."""

    def __init__(self, rows):
        super().__init__()
        self.rows = torch.as_tensor(rows, dtype=torch.float32)

    def forward(self, features):
        return self.rows


def test_the_true_rotation_leads_back_on_the_right_side_alone(clips):
    net = module.network()
    shapes = [tuple(weights.shape) for weights in net.parameters() if weights.ndim == 2]
    assert shapes == [(512, 51), (256, 512), (128, 256), (256, 128), (6, 256), (51, 256)]
    (take,) = clean_takes(clips["test"], "paper")
    R = module.CAMERA_FROM_SOURCE.T @ take.R
    net["rotation"] = Told(np.concatenate([R[..., 0], R[..., 1]], axis=-1))
    net["residual"] = Told(np.zeros((len(R), 51)))
    own, back = (errors[0].values for errors in module.judge_net(net, [take]))
    assert own["rotation"].max() < 0.1
    assert back["unscaled"].max() < 0.1
    assert own["unscaled"].mean() > 100
    joints = torch.from_numpy(rotate(module.CAMERA_FROM_SOURCE.T, take.joints)).float()
    true = torch.from_numpy(R).float()
    # With a residual that makes up for the wrong side, its own size is all that is lost.
    residual = torch.einsum("bji,bkj->bki", true, joints) - torch.einsum("bij,bkj->bki", true, joints)
    net["residual"] = Told(residual.flatten(1))
    loss = module.loss_of(net, joints, true)
    assert loss.item() == pytest.approx(module.RESIDUAL * residual.norm(dim=-1).mean().item(), abs=2e-5)


def test_the_command_trains_and_judges_on_the_sample(tmp_path, monkeypatch):
    monkeypatch.setenv("PCNET3D_DATA", str(SAMPLE))
    with pytest.raises(InputError, match="--because"):
        module.authors(tmp_path / "out", sets="cmu")
    module.authors(tmp_path / "out", sets="cmu", because="a test", steps=3, device="cpu")
    rows = json.loads((tmp_path / "out" / "authors.json").read_text())["rows"]["CMU test"]
    own, back = rows["authors, R x + residual"], rows["authors, R^T x"]
    assert own["rotation"] == back["rotation"]
    assert own["unscaled"] != back["unscaled"]
    assert rows["geometric"]["frames"] == own["frames"] == back["frames"]
    assert "a test" in (tmp_path / "out" / "ledger.csv").read_text()
