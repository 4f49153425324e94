"""The speed command says all that it promises; no absolute times."""

import pytest

from commands import pcnet3d
from pcnet3d.models.lab.bench import rectify as bench
from pcnet3d.pipeline import InputError


def test_it_says_what_it_measured(monkeypatch, capsys):
    monkeypatch.setattr(bench, "_POSES", 240)
    bench.rectify()
    said = capsys.readouterr().out
    for each in ("matrix products", "pcnet: ", "poses/s", "live, a frame"):
        assert each in said
    found = bench.measure("pcnet")
    assert min(found["poses_per_s"], found["gemm_gflops"], found["threads"]) > 0
    p50, p95 = found["live_ms"]
    assert 0 < p50 <= p95


def test_what_is_no_network_or_no_bench_is_refused():
    with pytest.raises(InputError, match="geometric"):
        bench.measure("geometric")
    with pytest.raises(InputError, match=r"none\.onnx"):
        bench.measure("none.onnx")
    result = pcnet3d("lab", "bench", "lift")
    assert result.returncode == 2
    assert "No such command 'lift'" in result.stderr
