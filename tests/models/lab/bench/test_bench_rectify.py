"""The speed command counts operations right and says all that it promises; no absolute times."""

import json
from functools import partial

import pytest

from commands import pcnet3d
from pcnet3d.models import load_rectifier
from pcnet3d.pipeline import InputError

onnx = pytest.importorskip("onnx", reason="measuring needs onnx, the extra 'train'")
bench = pytest.importorskip("pcnet3d.models.lab.bench.rectify")
quantising = pytest.importorskip("pcnet3d.models.lab.training.rectifier.quantise")


def graph(*nodes, weights, output):
    """A model of one input x (batch, 3, 5)."""
    helper = onnx.helper
    x, y = (
        helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, shape)
        for name, shape in (("x", ["batch", 3, 5]), ("y", output))
    )
    constants = [
        helper.make_tensor(name, onnx.TensorProto.FLOAT, dims, [0.5] * (dims[0] * dims[1]))
        for name, dims in weights.items()
    ]
    made = helper.make_graph(
        [helper.make_node(kind, inputs, outputs, **options) for kind, inputs, outputs, options in nodes],
        "g", [x], [y], constants,
    )  # fmt: skip
    return helper.make_model(made, opset_imports=[helper.make_opsetid("", 18)])


def test_operations_of_known_graphs():
    product = graph(("MatMul", ["x", "w"], ["y"], {}), weights={"w": (5, 7)}, output=["batch", 3, 7])
    assert bench.flops(product) == 2 * 3 * 5 * 7
    summed = graph(
        ("Einsum", ["x", "w"], ["y"], {"equation": "bij, jk -> bik"}),
        weights={"w": (5, 7)}, output=["batch", 3, 7],
    )  # fmt: skip
    assert bench.flops(summed) == 2 * 3 * 5 * 7
    layer = graph(
        ("Flatten", ["x"], ["flat"], {}),
        ("Gemm", ["flat", "w"], ["z"], {"transB": 1}),
        ("Gemm", ["w", "z"], ["y"], {"transA": 1, "transB": 1}),
        weights={"w": (7, 15)}, output=[15, "batch"],
    )  # fmt: skip
    assert bench.flops(layer) == 2 * (15 * 7 + 15 * 7)


def test_a_symmetric_network_works_twice(tmp_path):
    torch = pytest.importorskip("torch", reason="export needs torch, the extra 'train'")
    pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
    from pcnet3d.models.lab.training.rectifier.export import Deployed, export
    from pcnet3d.models.lab.training.rectifier.net import NetConfig, PCNet

    torch.manual_seed(0)
    width, output = 64, 32
    net = PCNet(NetConfig(net="mlp", width=width, output=output, blocks=1, residual="off", align=True))
    counted = []
    for symmetric in (False, True):
        export(Deployed(net, symmetric), tmp_path / "net.onnx")
        counted.append(bench.flops(onnx.load(tmp_path / "net.onnx")))
    entering = 17 * 4 + 9
    layers = entering * width + 2 * width * width + width * output + output * 6 + output * 64 + 64
    assert counted == [2 * layers, 4 * layers]


def test_it_measures_a_network_and_its_int8_form(tmp_path, monkeypatch):
    for name, few in {"_GEMM_RUNS": 1, "_SINGLES": 20, "_STARTS": 1}.items():
        monkeypatch.setattr(bench, name, few)
    for module in (bench, quantising):
        monkeypatch.setattr(module, "rotation_change", partial(quantising.rotation_change, count=500))
    command = ["bench", "rectify", "--count", "80", "--rounds", "1", "--threads", "1", "-o", "speed.json"]
    result = pcnet3d(*command, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "GEMM" in result.stdout
    assert "poses/s" in result.stdout
    assert "live, a frame" in result.stdout
    assert "round 1 of 1" in result.stderr
    found = json.loads((tmp_path / "speed.json").read_text())
    assert found["threads"] == 1
    assert found["gemm_gflops"] > 0
    plain, int8 = found["rectifiers"]["pcnet"], found["rectifiers"]["pcnet int8"]
    assert plain["method"] == load_rectifier("pcnet").method
    for row in (plain, int8):
        assert row["poses_per_s"] > 0
        assert row["start_s"] > 0
        for taken in (row["single_ms"], row["live_ms"]):
            assert 0 < taken["p50"] <= taken["p95"]
    assert plain["share_of_gemm"] == pytest.approx(
        plain["poses_per_s"] * plain["mflop"] / 1e3 / found["gemm_gflops"]
    )
    assert int8["of"] == "pcnet"
    assert int8["speed_ratio"] > 0
    assert 0 < int8["rotation_change_deg"]["mean"] < 0.2


def test_what_is_no_network_or_no_bench_is_refused():
    with pytest.raises(InputError, match="geometric"):
        bench.measure(["geometric"], 1, 1)
    with pytest.raises(InputError, match=r"none\.onnx"):
        bench.measure(["none.onnx"], 1, 1)
    result = pcnet3d("bench", "lift")
    assert result.returncode == 2
    assert "No such command 'lift'" in result.stderr
