"""`pcnet3d train` from the command line, on a data folder as small as it gets: several processes train the same
network as one, and what is wrong gets one sentence and exit code 2."""

import json
import subprocess
import sys

import numpy as np
import pytest

from golden.trainings import tiny
from pcnet3d.pipeline import H36M17, InputError, rotate
from pcnet3d.pipeline.cli import main

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
training = pytest.importorskip("pcnet3d.models.pcnet_train")

CONFIG = tiny(("steps = 6", "steps = 3"), ('residual = "off"\nalign = true', 'residual = "free"'))


def write_mocap(path, names, joints):
    """Clips of one person each, who stands at the world's origin."""
    count = len(joints)
    np.savez(
        path,
        joints=np.concatenate([joints] * len(names)).astype(np.float32),
        root=np.tile(np.float32([0, 0, 0.9]), (count * len(names), 1)),
        clip_start=np.arange(len(names) + 1) * count,
        clip_name=np.array([f"{name}_01" for name in names]),
        subject=np.array(names),
        source=np.array(["asfamc"] * len(names)),
        fps=30,
        joint_names=np.array(H36M17.joints),
    )


@pytest.fixture
def folder(tmp_path, facing_camera, monkeypatch):
    """A data folder with one subject for every part, and a config beside it."""
    standing = rotate(np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]), facing_camera)
    joints = standing + np.random.default_rng(0).normal(0, 0.03, (40, 17, 3))
    data = tmp_path / "data"
    data.mkdir()
    write_mocap(data / "cmu_mocap.npz", ["01", "07", "03"], joints - joints[:, :1])
    write_mocap(data / "hdm05_subset.npz", ["bd"], joints - joints[:, :1])
    split = {"cmu_mocap": {"train": ["01"], "val": ["07"], "test": ["03"]}}
    (data / "splits.json").write_text(json.dumps(split))
    (tmp_path / "tiny.toml").write_text(CONFIG)
    monkeypatch.setenv("PCNET3D_DATA", str(data))
    monkeypatch.chdir(tmp_path)
    # Export takes seconds and has tests of its own.
    monkeypatch.setattr(training, "export", lambda deployed, path, **said: path.write_bytes(b""))
    return tmp_path


def command(monkeypatch, *words):
    """Exit code of `pcnet3d WORDS`."""
    monkeypatch.setattr(sys, "argv", ["pcnet3d", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code


@pytest.fixture
def train(folder, monkeypatch, capsys):
    """Runs `pcnet3d train` in the folder -> exit code and stderr."""

    def run(config="tiny.toml", output="out"):
        code = command(monkeypatch, "train", config, "-o", output)
        return code, capsys.readouterr().err

    return run


def refused(answer, *words):
    """One sentence, exit code 2, no traceback."""
    code, said = answer
    assert code == 2, said
    assert said.startswith("pcnet3d: ")
    assert said.count("\n") == 1
    assert len(said) < 500
    for word in words:
        assert word in said, said


def change(folder, before, after):
    text = (folder / "tiny.toml").read_text()
    assert before in text
    (folder / "tiny.toml").write_text(text.replace(before, after))


def test_two_processes_train_the_same_network_as_one(folder, train):
    change(folder, "batch = 32", "batch = 33")  # not in equal parts
    assert train(output="one") == (0, "")
    words = ["--nproc-per-node", "2", "-m", "pcnet3d.models.train", "tiny.toml", "-o", "two"]
    done = subprocess.run(
        [sys.executable, "-m", "torch.distributed.run", "--standalone", *words],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("2 x cpu") == 1  # one process speaks for both
    one, two = (torch.load(folder / run / "last.pt", weights_only=True) for run in ("one", "two"))
    start = training.PCNet(training.read_config(folder / "tiny.toml").net).state_dict()
    for key in ("net", "average"):
        for name, value in one[key].items():
            np.testing.assert_allclose(two[key][name], value, atol=1e-6, err_msg=name)
    moved = max(float((one["net"][name] - value).abs().max()) for name, value in start.items())
    assert moved > 1e-3  # they did learn
    lines = [json.loads((folder / run / "log.jsonl").read_text()) for run in ("one", "two")]
    assert lines[0]["loss"] == pytest.approx(lines[1]["loss"], rel=1e-4)
    assert (folder / "two" / "pcnet.onnx").stat().st_size > 1000


@pytest.mark.parametrize(("count", "size"), [(32, 2), (33, 2), (7, 4), (4, 4)])
def test_processes_share_a_batch_without_gaps(count, size):
    from pcnet3d.models.parallel import Ranks

    parts = [Ranks(rank, size, torch.device("cpu")).part(count) for rank in range(size)]
    rows = [row for part in parts for row in range(count)[part]]
    assert rows == list(range(count))
    assert all(range(count)[part] for part in parts)
    with pytest.raises(InputError, match=f"each of {size} processes, got {size - 1}"):
        Ranks(0, size, torch.device("cpu")).part(size - 1)


@pytest.mark.parametrize("kind", ["lifter", "ablations"])
def test_only_the_rectifier_trains_in_several_processes(folder, train, monkeypatch, kind):
    monkeypatch.setenv("WORLD_SIZE", "2")
    change(folder, 'kind = "pcnet"', f'kind = "{kind}"')
    refused(train(), "only the kind 'pcnet'", kind)


def test_a_checkpoint_of_another_shape(folder, train):
    """The config is the same, as after a change of the code."""
    assert train()[0] == 0
    text = (folder / "tiny.toml").read_text()
    change(folder, "width = 16", "width = 24")
    assert train(output="wide")[0] == 0
    (folder / "tiny.toml").write_text(text)
    saved, other = (torch.load(folder / run / "last.pt", weights_only=True) for run in ("out", "wide"))
    torch.save({**saved, "net": other["net"]}, folder / "out" / "last.pt")
    refused(train(), "out/last.pt", "size mismatch", "remove it")
    torch.save(saved, folder / "out" / "last.pt")
    (folder / "out" / "pcnet.pt").write_bytes((folder / "wide" / "pcnet.pt").read_bytes())
    refused(train(), "out/pcnet.pt", "size mismatch")
    torch.save({"net": saved["net"]}, folder / "out" / "last.pt")
    refused(train(), "out/last.pt", "config")
    (folder / "out" / "pcnet.pt").unlink()
    torch.save(saved, folder / "out" / "last.pt")
    refused(train(), "out/pcnet.pt", "No such file")


class Pickled:
    """Runs a command when it is unpickled."""

    def __reduce__(self):
        import os

        return os.system, ("touch was-here",)


@pytest.mark.parametrize("what", ["cut", "pickled"])
@pytest.mark.filterwarnings("ignore")
def test_a_damaged_checkpoint_and_a_strangers_pickle(folder, train, what):
    assert train()[0] == 0
    last = folder / "out" / "last.pt"
    if what == "cut":
        last.write_bytes(last.read_bytes()[:3000])
    else:
        import pickle

        last.write_bytes(pickle.dumps(Pickled()))
    refused(train(), "last.pt is damaged", "remove it")
    assert not (folder / "was-here").exists()


def test_a_resume_with_another_config_loses_nothing(folder, train):
    assert train()[0] == 0
    before = {path.name: path.read_bytes() for path in (folder / "out").iterdir()}
    change(folder, "rate = 1e-3", "rate = 2e-3")
    refused(train(), "another config", "another -o DIR")
    assert {path.name: path.read_bytes() for path in (folder / "out").iterdir()} == before


def test_a_checkpoint_from_before_a_new_option_goes_on(folder, train):
    """An option that was not there has its default."""
    assert train()[0] == 0
    saved = torch.load(folder / "out" / "last.pt", weights_only=True)
    config = json.loads(saved["config"])
    del config["targets"]
    torch.save({**saved, "config": json.dumps(config)}, folder / "out" / "last.pt")
    assert train() == (0, "")


def test_a_rate_far_too_high_stops_the_training(folder, train):
    change(folder, "rate = 1e-3", "rate = 1e6")
    change(folder, "steps = 3", "steps = 60")
    refused(train(), "The loss became nan at step", "no checkpoint yet", "Lower `rate`")
    assert not (folder / "out" / "last.pt").exists()


@pytest.mark.parametrize("where", ["loss", "gradient", "validation"])
def test_what_is_no_number_keeps_the_last_good_checkpoint(folder, train, monkeypatch, where):
    monkeypatch.setattr(training, "_EVERY", 1)
    broken = {"loss": "total", "gradient": "total", "validation": "look"}[where]
    real, calls = getattr(training, broken), []

    def spoil(*args):
        calls.append(1)
        value = real(*args)
        if len(calls) < 3:
            return value
        if where == "validation":
            return {name: float("nan") for name in value}
        if where == "loss":
            return value * float("nan")
        return (
            value + 0 * (args[0].rotation.bias - args[0].rotation.bias).sum().sqrt()
        )  # 0, with a slope of 0 x inf

    monkeypatch.setattr(training, broken, spoil)
    refused(train(), "at step 3", "the last good checkpoint, out/last.pt, stays")
    saved = torch.load(folder / "out" / "last.pt", weights_only=True)
    assert saved["step"] == 2
    assert all(torch.isfinite(value).all() for key in ("net", "average") for value in saved[key].values())
    monkeypatch.setattr(training, broken, real)
    assert train()[0] == 0  # goes on from there
    assert torch.load(folder / "out" / "last.pt", weights_only=True)["step"] == 3


@pytest.mark.parametrize(
    ("lists", "words"),
    [
        ({"train": ["01", "03"], "val": ["07"], "test": ["03"]}, ("train and test", "03")),
        ({"train": ["01"], "val": ["01"], "test": ["03"]}, ("train and val", "01")),
        ({"train": [], "val": ["07"], "test": ["03"]}, ("train subjects", "none")),
        ({"train": ["01"], "val": ["99"], "test": ["03"]}, ("val subjects", "none")),
        ({"train": ["01"], "val": ["07"]}, ("splits.json", "test")),
        (7, ("splits.json",)),
    ],
)
def test_a_split_that_shares_or_lacks_subjects(folder, train, lists, words):
    (folder / "data" / "splits.json").write_text(json.dumps({"cmu_mocap": lists}))
    refused(train(), *words)
    assert not (folder / "out").exists()


@pytest.mark.parametrize("name", ["cmu_mocap.npz", "hdm05_subset.npz", "splits.json"])
def test_a_data_folder_without_its_files(folder, train, name):
    (folder / "data" / name).unlink()
    refused(train(), name)
    assert not (folder / "out").exists()


def test_motion_capture_with_a_nan(folder, train):
    with np.load(folder / "data" / "cmu_mocap.npz") as file:
        arrays = {key: file[key].copy() for key in file.files}
    arrays["joints"][5, 3, 1] = np.nan
    np.savez(folder / "data" / "cmu_mocap.npz", **arrays)
    refused(train(), "cmu_mocap.npz", "NaN")


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("steps = 3", "steps = 0", ("tiny.toml", "steps")),
        ("batch = 32", "batch = 0", ("batch",)),
        ("threads = 1", "threads = 0", ("threads",)),
        ("rate = 1e-3", "rate = nan", ("rate",)),
        ("seed = 1", "seed = -1", ("seed",)),
        ("wide = 0.5", "wide = 7", ("mixture", "between 0 and 1", "wide")),
        ("width = 16", "width = 0", ("net", "width")),
        ('net = "mlp"', "heads = 3", ("net", "3 heads", "16")),
        ('kind = "pcnet"', 'kind = "pcnett"', ("kind", "pcnett", "ablations")),
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


@pytest.mark.parametrize("shape", [([16, 3], [16], [3, 3], []), ([17, 3], [17], [17, 3], [17])])
def test_onnx_files_of_another_shape(folder, monkeypatch, capsys, shape):
    onnx = pytest.importorskip("onnx", reason="needs onnx, the extra 'train'")
    helper, single = onnx.helper, onnx.TensorProto.FLOAT
    joints, valid, R, error_deg = (
        helper.make_tensor_value_info(name, single, ["batch", *rest])
        for name, rest in zip(("joints", "valid", "R", "error_deg"), shape, strict=True)
    )
    nodes = [
        helper.make_node("Identity", ["joints"], ["R"]),
        helper.make_node("Identity", ["valid"], ["error_deg"]),
    ]
    graph = helper.make_graph(nodes, "g", [joints, valid], [R, error_deg])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    (folder / "other.onnx").write_bytes(model.SerializeToString())
    code = command(monkeypatch, "evaluate", "--rectifier", "other.onnx", "-o", "out")
    refused((code, capsys.readouterr().err), "other.onnx", "rectifier")


@pytest.mark.parametrize("residual", ["off", "bones", "free"])
@pytest.mark.parametrize("net", ["hybrid", "gcn", "transformer", "mlp"])
def test_nothing_stays_on_another_device(net, residual):
    """The meta device computes no numbers, but refuses to mix tensors of two devices, as a GPU does."""
    from pcnet3d.models.pcnet import NetConfig, PCNet
    from pcnet3d.models.pcnet_export import Deployed
    from pcnet3d.models.pcnet_losses import Truth, Weights, total

    config = NetConfig(net=net, width=16, output=8, heads=2, blocks=1, residual=residual, align=True)
    device = torch.device("meta")
    network = PCNet(config).to(device)
    joints, R = torch.zeros(4, 17, 3, device=device), torch.zeros(4, 3, 3, device=device)
    valid = torch.ones(4, 17, device=device)
    answer = network(joints, valid)
    total(network, answer, joints, Truth(joints, R, valid), Weights()).backward()
    assert all(p.grad.device == device for p in network.parameters())
    assert Deployed(network, symmetric=True)(joints, valid)[0].device == device


def test_bf16_learns_much_the_same(folder, train):
    """Not to the last digit, or it was not used."""
    assert train(output="single")[0] == 0
    change(folder, "bf16 = false", "bf16 = true")
    assert train(output="half")[0] == 0
    one, other = (
        torch.load(folder / run / "last.pt", weights_only=True)["net"] for run in ("single", "half")
    )
    apart = max(float((one[name] - other[name]).abs().max()) for name in one)
    assert 0 < apart < 3 * 2 * 1e-3  # three steps of at most the rate, each way
    assert all(value.dtype == torch.float32 for value in other.values())


def test_a_bar_on_a_terminal_and_lines_of_the_log_elsewhere(folder):
    """On a pseudo terminal stderr has the bar; stdout, which is a pipe, keeps its lines."""
    pty = pytest.importorskip("pty", reason="no pseudo terminals here")
    import os

    change(folder, "steps = 3", "steps = 40")
    ours, theirs = pty.openpty()
    words = [
        sys.executable,
        "-c",
        "from pcnet3d.pipeline.cli import main; main()",
        "train",
        "tiny.toml",
        "-o",
        "out",
    ]
    done = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=theirs, text=True, env={**os.environ, "TERM": "xterm"}
    )
    os.close(theirs)
    shown = b""
    while True:
        try:
            part = os.read(ours, 10_000)
        except OSError:  # Linux's way to say that the other end is closed
            break
        if not part:
            break
        shown += part
    told = done.communicate(timeout=120)[0]
    os.close(ours)
    assert done.returncode == 0, shown.decode()
    assert "/40" in shown.decode()
    assert "'step': 40" in told
    assert "'step': 40" not in shown.decode()
