"""The speed command says all that it promises; no absolute times."""

import pytest

from commands import pcnet3d, succeeded
from pcnet3d.models.lab.bench import rectify as bench
from pcnet3d.pipeline import InputError


@pytest.fixture(autouse=True)
def few(monkeypatch):
    for name, few in {"_SINGLES": 20, "_STARTS": 1}.items():
        monkeypatch.setattr(bench, name, few)


def test_it_says_what_it_measured():
    result = succeeded(pcnet3d("bench", "rectify", "--count", "80", "--rounds", "1", "--threads", "1"))
    assert "matrix products" in result.stdout
    assert "poses/s" in result.stdout
    assert "live, a frame" in result.stdout
    assert "round 1 of 1" in result.stderr


def test_it_measures_networks_in_turns():
    found = bench.measure(["pcnet", "paper"], 80, 1, 1)
    assert found["threads"] == 1
    assert found["gemm_gflops"] > 0
    for row in found["rectifiers"].values():
        assert row["poses_per_s"] > 0
        assert row["start_s"] > 0
        for taken in (row["single_ms"], row["live_ms"]):
            assert 0 < taken["p50"] <= taken["p95"]
    both = found["rectifiers"]
    apart = both["paper"]["poses_per_s"] / both["pcnet"]["poses_per_s"]
    assert both["paper"]["times_the_first"] == pytest.approx(apart)


def test_what_is_no_network_or_no_bench_is_refused():
    with pytest.raises(InputError, match="geometric"):
        bench.measure(["geometric"], 1, 1)
    with pytest.raises(InputError, match=r"none\.onnx"):
        bench.measure(["none.onnx"], 1, 1)
    result = pcnet3d("bench", "lift")
    assert result.returncode == 2
    assert "No such command 'lift'" in result.stderr
