"""The kit that networks are trained with: schedule, checkpoints, pieces, and what is refused."""

import json
import pickle
import zipfile

import numpy as np
import pytest
from pydantic import BaseModel, ConfigDict

from pcnet3d.pipeline import InputError
from refusals import refused

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
module = pytest.importorskip("pcnet3d.models.lab.common.training")
from golden.checkpoints import read_checkpoint, same  # noqa: E402
from golden.pickles import Trap  # noqa: E402

CPU = torch.device("cpu")


class Config(BaseModel):
    model_config = ConfigDict(frozen=True)
    seed: int = 3
    schedule: module.Schedule
    note: str = ""


def schedule(**changes):
    said = {
        "steps": 10,
        "rate": 0.01,
        "warmup": 2,
        "cooldown": 0.4,
        "weight_decay": 0.1,
        "average": 0.9,
        "every": 4,
    }
    return module.Schedule(**{**said, **changes})


def state(config, seed=0):
    torch.manual_seed(seed)
    net = torch.nn.Sequential(torch.nn.Linear(4, 8), torch.nn.Dropout(0.5), torch.nn.Linear(8, 1))
    return module.State(net, module.optimisers_of(net, config.schedule, [net[0].weight]))


def fit(run, config, folder, minutes=None, look=None):
    """Learns a sum of four numbers; looks are scored by the distance from it."""

    def loss_of(step):
        x = torch.from_numpy(np.random.default_rng(step).normal(size=(16, 4)).astype(np.float32))
        return (run.net(x)[:, 0] - x.sum(-1)).square().mean()

    def score(average):
        x = torch.from_numpy(np.random.default_rng(0).normal(size=(16, 4)).astype(np.float32))
        with torch.no_grad():
            return {"score": float((average(x)[:, 0] - x.sum(-1)).square().mean())}

    folder.mkdir(exist_ok=True)
    return module.fit(run, config, loss_of, look or score, folder, minutes)


def test_the_rate_warms_up_stays_and_cools_down():
    shares = [schedule(steps=10, warmup=3, cooldown=0.4).share(step) for step in range(1, 11)]
    np.testing.assert_allclose(shares, [1 / 3, 2 / 3, 1, 1, 1, 1, 1, 0.75, 0.5, 0.25])
    straight_down = [schedule(steps=4, warmup=0, cooldown=1.0).share(step) for step in range(1, 5)]
    np.testing.assert_allclose(straight_down, [1, 0.75, 0.5, 0.25])
    cosine = [schedule(steps=4, warmup=0, cooldown=1.0, decline="cosine").share(step) for step in range(1, 5)]
    np.testing.assert_allclose(cosine, [1, (2 + 2**0.5) / 4, 0.5, (2 - 2**0.5) / 4])


def test_matrices_go_to_muon_and_the_rest_to_adamw_with_decay_for_matrices_only():
    run = state(Config(schedule=schedule()))
    muon, adamw = run.optimisers
    sizes = [[tuple(p.shape) for p in group["params"]] for group in (*muon.param_groups, *adamw.param_groups)]
    assert sizes == [[(8, 4)], [(1, 8)], [(8,), (1,)]]
    assert [group["weight_decay"] for group in adamw.param_groups] == [0.1, 0.0]


def test_in_pieces_it_comes_to_the_same(tmp_path):
    config = Config(schedule=schedule())
    whole = state(config)
    assert fit(whole, config, tmp_path / "whole")
    for step in range(1, 11):
        run = state(config, seed=step)  # whatever it starts with, the checkpoint counts
        run.load(tmp_path / "pieces", config, CPU) if step > 1 else run.net.load_state_dict(
            state(config).net.state_dict()
        )
        if step == 1:
            run = state(config)
        assert run.step == step - 1
        assert fit(run, config, tmp_path / "pieces", minutes=0) == (step == 10)
    assert same(read_checkpoint(tmp_path / "whole"), read_checkpoint(tmp_path / "pieces"))
    best = [torch.load(tmp_path / folder / "best.pt", weights_only=True) for folder in ("whole", "pieces")]
    assert same(*best)
    steps = [
        [json.loads(line)["step"] for line in (tmp_path / folder / "log.jsonl").read_text().splitlines()]
        for folder in ("whole", "pieces")
    ]
    assert steps[0] == steps[1] == [4, 8, 10]


def test_the_best_weights_are_those_of_the_lowest_score(tmp_path):
    config, scores, seen = Config(schedule=schedule(every=2)), iter([5.0, 3.0, 4.0, 3.5, 6.0]), []

    def look(average):
        seen.append({name: value.clone() for name, value in average.state_dict().items()})
        return {"score": next(scores)}

    fit(state(config), config, tmp_path, look=look)
    assert same(torch.load(tmp_path / "best.pt", weights_only=True), seen[1])
    assert read_checkpoint(tmp_path)["best"] == 3.0


def test_a_save_that_is_killed_leaves_the_last_checkpoint(tmp_path, monkeypatch):
    config = Config(schedule=schedule())
    run = state(config)
    run.save(tmp_path, config)
    run.step = 5
    write = torch.save
    monkeypatch.setattr(torch, "save", _killed_after(write))
    with pytest.raises(KeyboardInterrupt):
        run.save(tmp_path, config)
    again = state(config, seed=9)
    again.load(tmp_path, config, CPU)
    assert again.step == 0
    assert same(again.net.state_dict(), run.net.state_dict())


def _killed_after(write):
    def killed(*given):
        write(*given)
        raise KeyboardInterrupt

    return killed


def test_another_config_is_not_gone_on_with(tmp_path):
    config, other = Config(schedule=schedule()), Config(schedule=schedule(), note="another")
    state(config).save(tmp_path, config)
    with refused("already-there"):
        state(other).load(tmp_path, other, CPU)


def test_a_run_goes_on_with_what_it_learned_from_only(tmp_path):
    """Names, numbers and their order count."""
    rng, config = np.random.default_rng(0), Config(schedule=schedule())
    one, other = (("01", rng.normal(size=(5, 3))), ("02", rng.normal(size=(5, 3))))
    run = state(config)
    run.learns_from = module.fingerprint([one, other])
    run.step = 4
    run.save(tmp_path, config)
    for wrong in ([one], [other, one], [one, ("03", other[1])], [one, ("02", -other[1])]):
        again = state(config)
        again.learns_from = module.fingerprint(wrong)
        with pytest.raises(InputError, match="other recordings or another split"):
            again.load(tmp_path, config, CPU)
        assert again.step == 0
    again = state(config)
    again.learns_from = module.fingerprint([one, other])
    again.load(tmp_path, config, CPU)
    assert again.step == 4


@pytest.mark.parametrize("what", ["cut", "changed", "pickled", "pickled by torch", "less", "another shape"])
@pytest.mark.filterwarnings("ignore")
def test_a_damaged_checkpoint_and_a_strangers_pickle(tmp_path, what):
    config, folder = Config(schedule=schedule()), tmp_path / "out"
    folder.mkdir()
    state(config).save(folder, config)
    path, kept = folder / "checkpoint.pt", read_checkpoint(folder)
    content = path.read_bytes()
    if what == "cut":
        path.write_bytes(content[:3000])
    elif what == "changed":
        at = content.index(kept["net"]["0.weight"].numpy().tobytes())
        path.write_bytes(content[:at] + bytes(4) + content[at + 4 :])
    elif what == "pickled":
        path.write_bytes(pickle.dumps(Trap(tmp_path / "was-here")))
    else:
        other = torch.nn.Sequential(torch.nn.Linear(4, 9), torch.nn.Dropout(0.5), torch.nn.Linear(9, 1))
        values = {
            "pickled by torch": {"net": Trap(tmp_path / "was-here")},
            "less": {"net": kept["net"]},
            "another shape": {**kept, "net": other.state_dict()},
        }
        torch.save(values[what], path)
    with refused("file-damaged", folder):
        state(config).load(folder, config, CPU)
    assert not (tmp_path / "was-here").exists()


@pytest.mark.parametrize("where", ["loss", "gradient", "validation"])
def test_what_is_no_number_keeps_the_last_good_checkpoint(tmp_path, where):
    config = Config(schedule=schedule(every=1))
    run, calls = state(config), []

    def loss_of(step):
        loss = run.net(torch.ones(16, 4)).square().mean()
        bias = run.net[2].bias
        spoilt = {"loss": loss * float("nan"), "gradient": loss + 0 * (bias - bias).sum().sqrt()}  # 0 x inf
        return spoilt.get(where, loss) if step == 3 else loss

    def look(average):
        calls.append(1)
        return {"score": float("nan") if where == "validation" and len(calls) == 3 else 1.0}

    with pytest.raises(InputError, match=r"at step 3; the last good checkpoint.*stays"):
        module.fit(run, config, loss_of, look, tmp_path)
    kept = read_checkpoint(tmp_path)
    assert kept["step"] == 2
    assert all(torch.isfinite(value).all() for key in ("net", "average") for value in kept[key].values())


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path):
    config = Config(schedule=schedule())
    for name in ("checkpoint.pt", "best.pt"):
        with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("archive/data.pkl", bytes(50_000_000))
    with pytest.raises(InputError, match=r"checkpoint\.pt"):
        state(config).load(tmp_path, config, CPU)
    with pytest.raises(InputError, match=r"best\.pt"):
        module.load_weights(state(config).net, tmp_path / "best.pt")


def test_a_device_without_memory_left_is_told(tmp_path):
    config = Config(schedule=schedule())

    def loss_of(step):
        raise torch.OutOfMemoryError("CUDA out of memory")

    with pytest.raises(
        InputError, match=r"no memory left at step 1; there was no checkpoint yet\. Make the batch"
    ):
        module.fit(state(config), config, loss_of, lambda average: {"score": 0.0}, tmp_path)


@pytest.mark.parametrize("name", ["abacus", "cuda:99", "cpu:banana"])
def test_a_device_that_is_not_here(name):
    with pytest.raises(InputError, match=rf"auto, cpu, cuda.*'{name}'"):
        module.device_of(name)
