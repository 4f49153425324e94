"""Ablations: every run differs by what its name says, is trained once, and is judged on the pose it answers."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.trainings import tiny
from pcnet3d.models import evaluation_sets
from pcnet3d.pipeline import H36M17, InputError, rotate

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
module = pytest.importorskip("pcnet3d.models.pcnet_ablations")
training = pytest.importorskip("pcnet3d.models.pcnet_train")
from pcnet3d.models.pcnet import NetConfig, PCNet  # noqa: E402
from pcnet3d.models.pcnet_evaluate import Take, clean_takes, judge  # noqa: E402

PLAN = (
    tiny(
        ('kind = "pcnet"', 'kind = "ablations"\nevery = 2'),
        ("steps = 6", "steps = 4"),
        ("batch = 32", "batch = 16"),
        ('net = "mlp"\n', ""),
        ("output = 8", "output = 8\nheads = 2"),
    )
    + """
[[runs]]
name = "MLP"
net.net = "mlp"
[[runs]]
name = "GCN only, residual free"
net.net = "gcn"
net.residual = "free"
weights.cycle = 0.0
symmetric = false
"""
)


@pytest.fixture
def plan(tmp_path, clips, monkeypatch):
    """A plan's file, with one clip for every part of the data and clean takes in place of lifted ones."""
    monkeypatch.setattr(training, "read_clips", lambda part: clips[part])
    monkeypatch.setattr(evaluation_sets, "read_clips", lambda part: clips[part])
    monkeypatch.setattr(module, "lifted", lambda of, seed: clean_takes(clips[of.subjects], "wide", seed))
    monkeypatch.setattr(training, "_EVERY", 2)
    monkeypatch.setattr(training, "_VALIDATION_FRAMES", 40)
    monkeypatch.setattr(training, "export", lambda deployed, path, **said: path.write_bytes(b"slow"))
    path = tmp_path / "plan.toml"
    path.write_text(PLAN)
    return path


def test_each_run_is_the_base_with_its_changes(plan):
    every, runs = module.read_plan(plan)
    assert every == 2
    mlp, gcn = runs.values()
    assert (mlp.net.net, mlp.net.residual, mlp.weights.cycle, mlp.symmetric) == ("mlp", "off", 0.25, True)
    assert (gcn.net.net, gcn.net.residual, gcn.weights.cycle, gcn.symmetric) == ("gcn", "free", 0.0, False)
    changed = {"net", "weights", "symmetric"}
    assert mlp.model_dump(exclude=changed) == gcn.model_dump(exclude=changed)
    assert (mlp.net.width, gcn.net.width, mlp.kind) == (16, 16, "pcnet")


def test_runs_train_once_and_their_tables_are_written(plan, tmp_path, capsys, monkeypatch):
    out = tmp_path / "out"
    module.train_ablations(plan, out)
    assert {path.name for path in out.iterdir()} == {
        "mlp", "gcn-only-residual-free", "ablations.md", "ablations.json"
    }  # fmt: skip
    # A run's folder says how to make it alone.
    for name, config in module.read_plan(plan)[1].items():
        assert training.read_config(out / module.slug(name) / "pcnet.toml") == config
    report = json.loads((out / "ablations.json").read_text())
    assert report["budget"] == {"batch": 16, "seed": 1, "steps": 4}
    mlp, gcn = report["runs"].values()
    for label, about in report["sets"].items():
        assert about["frames"] == 30  # every second of 60
        figures = mlp["sets"][label]
        assert figures["pa_mpjpe change"]["mean"] == pytest.approx(0, abs=0.01)  # no residual
        assert figures["bones"]["mean"] == pytest.approx(0, abs=0.01)
        assert gcn["sets"][label]["bones"]["mean"] > 0
        assert about["geometric"]["pa_mpjpe change"]["mean"] == pytest.approx(0, abs=0.01)
        # Where nothing is averaged with the mirrored body, one pass is all there is.
        assert gcn["sets"][label]["rotation"] == gcn["sets"][label]["rotation, one pass"]
        assert figures["rotation"] != figures["rotation, one pass"]
    log = [json.loads(line) for line in (out / "mlp" / "log.jsonl").read_text().splitlines()]
    assert mlp["val"]["paper"] == min(line["paper"] for line in log)
    text = (out / "ablations.md").read_text()
    assert "## HDM05, clean, upright" in text
    assert text.count("| GCN only, residual free |") == 5  # its parameters, and four sets
    assert text in capsys.readouterr().out

    monkeypatch.setattr(module, "train", lambda *args: pytest.fail("a finished run was trained again"))
    module.train_ablations(plan, out)
    assert json.loads((out / "ablations.json").read_text()) == report


def test_a_stopped_run_goes_on_and_finished_ones_stay(plan, tmp_path, monkeypatch):
    module.train_ablations(plan, tmp_path / "whole")
    save, stopped = training.State.save, []

    def stop_in_the_second(self, path, config):
        save(self, path, config)
        if "gcn" in str(path) and not stopped:
            stopped.append(self.step)
            raise KeyboardInterrupt

    monkeypatch.setattr(training.State, "save", stop_in_the_second)
    with pytest.raises(KeyboardInterrupt):
        module.train_ablations(plan, tmp_path / "broken")
    assert stopped == [2]
    first = json.loads((tmp_path / "broken" / "ablations.json").read_text())
    assert list(first["runs"]) == ["MLP"]  # what is finished is told
    module.train_ablations(plan, tmp_path / "broken")
    one, other = (json.loads((tmp_path / run / "ablations.json").read_text()) for run in ("whole", "broken"))
    assert one == other


def test_a_folder_of_another_plan_is_refused(plan, tmp_path):
    module.train_ablations(plan, tmp_path / "out")
    before = (tmp_path / "out" / "mlp" / "pcnet.pt").read_bytes()
    plan.write_text(PLAN.replace("rate = 1e-3", "rate = 2e-3"))
    with pytest.raises(InputError, match="another config"):
        module.train_ablations(plan, tmp_path / "out")
    assert (tmp_path / "out" / "mlp" / "pcnet.pt").read_bytes() == before


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("weights.cycle", "weights.cykle"), "GCN only.*weights"),
        (lambda text: text.replace('net.net = "gcn"', 'net.net = "cnn"'), r"GCN only.*net\.net"),
        (lambda text: text.replace('net.net = "gcn"\nnet.residual = "free"', "net = 3"), "GCN only.*net"),
        (lambda text: text.replace('net.net = "gcn"', "steps = 8"), "same steps for all"),
        (lambda text: text.replace('name = "MLP"', 'name = "gcn only residual-FREE"'), "name of its own"),
        (lambda text: text.replace('name = "MLP"', 'name = "?"'), "name of its own"),
        (lambda text: text.replace('name = "MLP"', ""), "name"),
        (lambda text: text[: text.index("[[runs]]")], "runs"),
        (lambda text: text.replace("every = 2", "every = 0"), "every"),
        (lambda text: text.replace("warmup = 2", "warm = 2"), "MLP.*warm"),
        (lambda text: text + "]", "TOML"),
    ],
)
def test_a_wrong_plan_is_refused_before_anything_is_trained(plan, tmp_path, change, words):
    plan.write_text(change(PLAN))
    with pytest.raises(InputError, match=words):
        module.train_ablations(plan, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.fixture
def take(clips):
    """Every frame with its joints moved by a few centimetres, as a lifter would."""
    clean = clean_takes(clips["test"], "wide")[0]
    joints = clean.truth + np.random.default_rng(3).normal(0, 0.03, clean.truth.shape)
    joints -= joints[:, :1]
    return Take(joints, clean.truth, clean.R, clean.lying, clean.source)


class Telling(PCNet):
    """Answers the truth of the take, whose first frames come first: rotation and a corrected pose."""

    def __init__(self, take, corrected):
        super().__init__(NetConfig(net="mlp", width=8, output=8, blocks=1))
        self.take, self.corrected, self.at = take, corrected, {}

    def forward(self, joints, valid):
        answer = super().forward(joints, valid)
        rows = [int(np.argmin(np.abs(self.take.joints - x).sum((1, 2)))) for x in joints.double().numpy()]
        R = torch.from_numpy(self.take.R[rows]).float()
        return answer._replace(R=R, canonical=torch.from_numpy(self.corrected[rows]).float())


def canonical(take, joints):
    return np.einsum("tji,tkj->tki", take.R, joints)


def test_a_residual_that_takes_all_noise_away_is_seen(take):
    judged = module.judge_net(Telling(take, canonical(take, take.truth)).eval(), take, symmetric=False)
    assert judged.pa_mpjpe.max() < 0.01
    own = module._own_error(take)
    assert own.mean() > 20
    change = module._figures(judged, take)["pa_mpjpe change"]
    assert change.mean == pytest.approx(-own.mean(), abs=0.01)
    assert judged.bones.mean() > 1  # the noise had changed them


def test_a_residual_that_does_nothing_changes_nothing(take):
    judged = module.judge_net(Telling(take, canonical(take, take.joints)).eval(), take, symmetric=False)
    figures = module._figures(judged, take)
    assert max(abs(figures["pa_mpjpe change"].mean), figures["bones"].mean, judged.rotation.max()) < 0.1


def test_a_residual_that_makes_it_worse_is_seen(take):
    wrong = canonical(take, take.joints)
    wrong[:, H36M17.index("l_wrist")] += 0.3
    figures = module._figures(module.judge_net(Telling(take, wrong).eval(), take, symmetric=False), take)
    assert figures["pa_mpjpe change"].mean > 5


@pytest.mark.parametrize(("residual", "symmetric"), [("off", True), ("free", True), ("bones", False)])
def test_it_judges_what_the_deployed_network_answers(take, residual, symmetric, monkeypatch):
    class InTorch:
        """What is exported, as a Rectifier: it tells a rotation only."""

        @torch.no_grad()
        def rotation(self, joints):
            joints = torch.from_numpy(joints.astype(np.float32))
            return [x.double().numpy() for x in deployed(joints, torch.ones(joints.shape[:2]))]

    monkeypatch.setattr(module, "_CHUNK", 7)
    torch.manual_seed(0)
    config = NetConfig(net="mlp", width=16, output=8, blocks=1, residual=residual, align=True)
    net = PCNet(config).eval()
    torch.nn.init.normal_(net.rotation.weight, std=0.3)
    if residual != "off":
        torch.nn.init.normal_(net.residual.weight, std=0.1)
    deployed = module.Deployed(net, symmetric)
    one, other = judge(InTorch(), [take]), module.judge_net(net, take, symmetric)
    np.testing.assert_allclose(one.rotation, other.rotation, atol=0.02)
    np.testing.assert_allclose(one.expected, other.expected, rtol=1e-3)
    moved = np.abs(one.pa_mpjpe - other.pa_mpjpe).max()
    assert moved < 0.01 if residual == "off" else moved > 1
    assert other.bones.max() > 1 if residual == "free" else other.bones.max() < 0.01  # bones are only turned


def test_the_shipped_plan_is_the_shipped_recipe_but_narrower_and_shorter():
    from importlib.resources import files

    folder = files("pcnet3d.models")
    _, runs = module.read_plan(folder.joinpath("ablations.toml"))
    base, shipped = next(iter(runs.values())), training.read_config(folder.joinpath("pcnet.toml"))
    for part in ("subjects", "lifted", "lifted_val", "seed", "batch", "mixture", "weights", "symmetric"):
        assert getattr(base, part) == getattr(shipped, part), part
    assert (base.net.net, base.net.residual, base.net.align) == ("hybrid", "off", True)
    assert len({config.model_dump_json() for config in runs.values()}) == len(runs) == 12
    for config in runs.values():
        PCNet(config.net)


def test_a_turn_of_the_whole_world_changes_no_pa_mpjpe(take):
    """The own error, which every change is measured against, is the lift's and not the view's."""
    Q = Rotation.from_rotvec([1, 2, 0.5]).as_matrix()
    turned = Take(rotate(Q, take.joints), take.truth, take.R, take.lying, take.source)
    np.testing.assert_allclose(module._own_error(turned), module._own_error(take), rtol=1e-6)
