"""Runs beside their floors; no absolute times."""

import pytest

from commands import pcnet3d, refused
from pcnet3d.models.lab.bench import measured, of_poses, of_video


def test_a_floor_reads_asks_and_writes_and_costs_less_than_the_run(tmp_path):
    refused(pcnet3d("lab", "bench", "floors", "--detector", "none.onnx"), "none.onnx")
    run_s, floor_s = measured(of_poses(tmp_path, 100), tmp_path / "out")
    assert 0 < floor_s < run_s
    assert (tmp_path / "out" / "floor.rrd").stat().st_size > 10_000
    assert (tmp_path / "out" / "floor.parquet").exists()


@pytest.mark.data("models")
def test_a_floor_of_a_video_looks_at_every_image(tmp_path, data):
    detector = str(data / "models" / "movenet_lightning_int8.onnx")
    run_s, floor_s = measured(of_video(tmp_path, 1.0, detector), tmp_path / "out")
    assert 0 < floor_s < run_s
