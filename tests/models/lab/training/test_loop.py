"""The loop that networks are trained with: schedule, checkpoints, runs that are killed, and what is refused."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
import torch

from golden.checkpoints import read_checkpoint, same
from golden.pickles import Trap
from pcnet3d.models.lab.clips import Clip
from pcnet3d.models.lab.training import loop as module
from pcnet3d.pipeline import InputError
from refusals import refused

SCHEDULE = {
    "steps": 10, "rate": 0.01, "warmup": 2, "cooldown": 0.4, "weight_decay": 0.1, "average": 0.9, "every": 4,
}  # fmt: skip


def schedule(**changes):
    return module.Schedule(**SCHEDULE | changes)


def network(seed=0):
    """That is to learn a sum of four numbers."""
    torch.manual_seed(seed)
    return torch.nn.Sequential(torch.nn.Linear(4, 8), torch.nn.Dropout(0.5), torch.nn.Linear(8, 1))


def squared_error(net, seed):
    x = torch.from_numpy(np.random.default_rng(seed).normal(size=(16, 4)).astype(np.float32))
    return (net(x)[:, 0] - x.sum(-1)).square().mean()


@torch.no_grad()
def score(average):
    return {"score": float(squared_error(average, 0))}


def fit(folder, seed=0, look=score, killed_at=None, learns_from="", loss_of=None, **changes):
    net = network(seed)

    def loss(step):
        if step == killed_at:
            raise KeyboardInterrupt
        return squared_error(net, step) if loss_of is None else loss_of(net, step)

    config = module.Training(seed=3, bf16=False, schedule=schedule(**changes))
    module.fit(net, [net[0].weight], config, learns_from, loss, look, folder)


def test_the_rate_warms_up_stays_and_cools_down():
    shares = [schedule(steps=10, warmup=3, cooldown=0.4).share(step) for step in range(1, 11)]
    np.testing.assert_allclose(shares, [1 / 3, 2 / 3, 1, 1, 1, 1, 1, 0.75, 0.5, 0.25])
    cosine = [schedule(steps=4, warmup=0, cooldown=1.0, decline="cosine").share(step) for step in range(1, 5)]
    np.testing.assert_allclose(cosine, [1, (2 + 2**0.5) / 4, 0.5, (2 - 2**0.5) / 4])


def test_killed_at_any_step_it_comes_to_the_same(tmp_path, monkeypatch):
    fit(tmp_path / "whole")
    monkeypatch.setattr(module, "SAVED_EVERY_S", 0.0)
    for step in range(2, 11):
        with pytest.raises(KeyboardInterrupt):  # what it starts with does not matter, the checkpoint counts
            fit(tmp_path / "pieces", seed=step if step > 2 else 0, killed_at=step)
        assert read_checkpoint(tmp_path / "pieces")["step"] == step - 1
    fit(tmp_path / "pieces", seed=11)
    assert same(read_checkpoint(tmp_path / "whole"), read_checkpoint(tmp_path / "pieces"))
    best = [torch.load(tmp_path / folder / "best.pt", weights_only=True) for folder in ("whole", "pieces")]
    assert same(*best)
    for folder in ("whole", "pieces"):
        log = (tmp_path / folder / "log.jsonl").read_text().splitlines()
        assert [json.loads(line)["step"] for line in log] == [4, 8, 10]


def test_the_best_weights_are_those_of_the_lowest_score(tmp_path):
    scores, looked_at = iter([5.0, 3.0, 4.0, 3.5, 6.0]), []

    def look(average):
        looked_at.append({name: value.clone() for name, value in average.state_dict().items()})
        return {"score": next(scores)}

    fit(tmp_path, look=look, every=2)
    assert same(torch.load(tmp_path / "best.pt", weights_only=True), looked_at[1])
    assert read_checkpoint(tmp_path)["best"] == 3.0


def test_a_run_goes_on_with_its_own_config_and_what_it_learned_from_only(tmp_path):
    """Parts, names, numbers and their order count."""
    joints = np.random.default_rng(0).normal(size=(2, 5, 17, 3)).astype(np.float32)
    one, other = (Clip(f"0{i}_1", f"0{i}", "test", 30.0, of) for i, of in enumerate(joints))
    of, named = module.fingerprint, replace(other, name="02_1")
    own = of({"train": [one, other], "val": []}, joints)
    trains = ([one], [other, one], [one, named], [one, replace(other, joints=-other.joints)])
    assert own not in [of({"train": train, "val": []}, joints) for train in trains]
    assert own not in (of({"train": [one], "val": [other]}, joints), of({"train": [one, other]}, -joints))
    fit(tmp_path, learns_from=own)
    for changes in ({"learns_from": "another"}, {"learns_from": own, "rate": 0.02}):
        with refused("already-there"):
            fit(tmp_path, **changes)
    fit(tmp_path, learns_from=own)


@pytest.mark.parametrize("what", ["cut", "pickled", "pickled by torch", "another shape"])
@pytest.mark.filterwarnings("ignore")
def test_a_damaged_checkpoint_and_a_strangers_pickle(tmp_path, what):
    folder = tmp_path / "out"
    fit(folder)
    path, trap, kept = folder / "checkpoint.pt", Trap(tmp_path / "was-here"), read_checkpoint(folder)
    if what == "cut":
        path.write_bytes(path.read_bytes()[:3000])
    elif what == "pickled":
        path.write_bytes(pickle.dumps(trap))
    else:
        narrow = {name: value[..., :1] for name, value in kept["net"].items()}
        torch.save(kept | {"net": trap if "torch" in what else narrow}, path)
    with refused("file-damaged", folder):
        fit(folder)
    assert not (tmp_path / "was-here").exists()


@pytest.mark.parametrize("where", ["loss", "gradient", "validation"])
def test_what_is_no_number_keeps_the_last_good_checkpoint(tmp_path, where):
    calls = []

    def loss_of(net, step):
        loss = net(torch.ones(16, 4)).square().mean()
        bias = net[2].bias
        spoilt = {"loss": loss * float("nan"), "gradient": loss + 0 * (bias - bias).sum().sqrt()}  # 0 x inf
        return spoilt.get(where, loss) if step == 3 else loss

    def look(average):
        calls.append(1)
        return {"score": float("nan") if where == "validation" and len(calls) == 3 else 1.0}

    with pytest.raises(InputError, match=r"at step 3; the last checkpoint stays"):
        fit(tmp_path, look=look, loss_of=loss_of, every=1)
    kept = read_checkpoint(tmp_path)
    assert kept["step"] == 2
    assert all(torch.isfinite(value).all() for key in ("net", "average") for value in kept[key].values())
