"""The kit that networks are trained with: schedule, checkpoints in parts, pieces, and what is refused."""

import hashlib
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
from golden.checkpoints import read_checkpoint, replace_checkpoint, same, saved  # noqa: E402
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


@pytest.mark.parametrize("wrong", [{"steps": 0}, {"rate": 0}, {"cooldown": 0}, {"average": 1}, {"stop": 3}])
def test_what_is_no_schedule(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        schedule(**wrong)


def test_matrices_go_to_muon_and_the_rest_to_adamw_with_decay_for_matrices_only():
    run = state(Config(schedule=schedule()))
    muon, adamw = run.optimisers
    sizes = [[tuple(p.shape) for p in group["params"]] for group in (*muon.param_groups, *adamw.param_groups)]
    assert sizes == [[(8, 4)], [(1, 8)], [(8,), (1,)]]
    assert [group["weight_decay"] for group in adamw.param_groups] == [0.1, 0.0]


def test_adamw_alone_has_all_parameters():
    (adamw,) = state(Config(schedule=schedule(optimiser="adamw"))).optimisers
    assert isinstance(adamw, torch.optim.AdamW)
    sizes = [[tuple(p.shape) for p in group["params"]] for group in adamw.param_groups]
    assert sizes == [[(8, 4), (1, 8)], [(8,), (1,)]]


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


def test_parts_stay_below_16_mib_and_old_ones_go(tmp_path):
    config = Config(schedule=schedule())
    net = torch.nn.Linear(1500, 1500)
    run = module.State(net, module.optimisers_of(net, config.schedule, ()))
    run.save(tmp_path, config)
    run.step = 7
    run.save(tmp_path, config)
    parts = sorted(path.name for path in tmp_path.glob("checkpoint-*"))
    assert parts == ["checkpoint-7.0", "checkpoint-7.1"]
    assert max((tmp_path / part).stat().st_size for part in parts) < 16 * 2**20
    other = module.State(torch.nn.Linear(1500, 1500), module.optimisers_of(net, config.schedule, ()))
    other.load(tmp_path, config, CPU)
    assert other.step == 7
    assert same(other.net.state_dict(), net.state_dict())


def test_a_save_that_is_killed_leaves_the_last_checkpoint(tmp_path, monkeypatch):
    config = Config(schedule=schedule())
    run = state(config)
    run.save(tmp_path, config)
    run.step = 5
    monkeypatch.setattr(module, "write_json", lambda path, content: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        run.save(tmp_path, config)
    again = state(config, seed=9)
    again.load(tmp_path, config, CPU)
    assert again.step == 0
    assert same(again.net.state_dict(), run.net.state_dict())


def test_more_steps_are_no_other_config_before_it_cools_down(tmp_path):
    config = Config(schedule=schedule())
    run = state(config)
    run.step = 6
    run.save(tmp_path, config)
    longer = Config(schedule=schedule(steps=100))
    state(longer).load(tmp_path, longer, CPU)
    run.step = 7
    run.save(tmp_path, config)
    with pytest.raises(InputError, match="step 7 and cools down after 6"):
        state(longer).load(tmp_path, longer, CPU)
    other = Config(schedule=schedule(), note="another")
    with pytest.raises(InputError, match="another config"):
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


@pytest.mark.parametrize("what", ["cut", "elsewhere", "pickled", "pickled by torch", "less", "another shape"])
@pytest.mark.filterwarnings("ignore")
def test_a_damaged_checkpoint_and_a_strangers_pickle(tmp_path, what):
    config, folder = Config(schedule=schedule()), tmp_path / "out"
    folder.mkdir()
    state(config).save(folder, config)
    part, kept = folder / "checkpoint-0.0", read_checkpoint(folder)
    if what == "cut":
        part.write_bytes(part.read_bytes()[:3000])
    elif what == "elsewhere":
        part.rename(tmp_path / part.name)
        replaced = (folder / "checkpoint.json").read_text().replace(part.name, f"../{part.name}")
        (folder / "checkpoint.json").write_text(replaced)
    else:
        other = torch.nn.Sequential(torch.nn.Linear(4, 9), torch.nn.Dropout(0.5), torch.nn.Linear(9, 1))
        content = {
            "pickled": pickle.dumps(Trap(tmp_path / "was-here")),
            "pickled by torch": saved({"net": Trap(tmp_path / "was-here")}),
            "less": saved({"net": kept["net"]}),
            "another shape": saved({**kept, "net": other.state_dict()}),
        }
        replace_checkpoint(folder, content[what])
    with refused("cannot-open" if what == "elsewhere" else "file-damaged", folder):
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
    state(config).save(tmp_path, config)
    listed = json.loads((tmp_path / "checkpoint.json").read_text())
    for path in (tmp_path / listed["parts"][0], tmp_path / "best.pt"):
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("archive/data.pkl", bytes(50_000_000))
    listed["sha256"] = hashlib.sha256((tmp_path / listed["parts"][0]).read_bytes()).hexdigest()
    (tmp_path / "checkpoint.json").write_text(json.dumps(listed))
    with pytest.raises(InputError, match=r"checkpoint\.json"):
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


def test_auto_is_a_gpu_where_there_is_one():
    assert module.device_of("auto").type == ("cuda" if torch.cuda.is_available() else "cpu")
    assert module.device_of("cpu") == CPU
