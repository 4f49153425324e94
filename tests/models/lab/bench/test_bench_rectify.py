"""The speed command says all that it promises; no absolute times."""

import json

import pytest

from commands import pcnet3d, succeeded
from pcnet3d.models import load_rectifier
from pcnet3d.pipeline import InputError

pytest.importorskip("onnx", reason="measuring needs onnx, the extra 'train'")
bench = pytest.importorskip("pcnet3d.models.lab.bench.rectify")
quantising = pytest.importorskip("pcnet3d.models.lab.training.rectifier.quantise")


def test_it_measures_a_network_and_its_int8_form(tmp_path, monkeypatch):
    for name, few in {"_SINGLES": 20, "_STARTS": 1}.items():
        monkeypatch.setattr(bench, name, few)
    monkeypatch.setattr(quantising, "_POSES", 500)
    command = ["bench", "rectify", "--count", "80", "--rounds", "1", "--threads", "1", "-o", "speed.json"]
    result = succeeded(pcnet3d(*command, cwd=tmp_path))
    assert "matrix products" in result.stdout
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
