"""The benches of whole runs say where all of the time went."""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np
import pytest

from pcnet3d.examples.walker.long_video import write_long_video
from pcnet3d.models.lab.bench.batch import measured_batch
from pcnet3d.models.lab.bench.files import write_inputs, write_walk
from pcnet3d.models.lab.bench.pipeline import _run
from pcnet3d.models.lab.bench.run import measured_run
from pcnet3d.models.rectifier.onnx import PCNetRectifier
from pcnet3d.pipeline.core.measures import grouped, subgroup, value
from pcnet3d.pipeline.reading.load import read_video

# CPU time of a run from files without its network, over that of its network: 3.7 to 5.2 in 15 runs on two busy cores.
OWN_OVER_NETWORK = 8.0


def test_a_long_video_goes_there_and_back_without_a_jump(tmp_path):
    import av

    write_long_video(tmp_path / "long.mp4", 17)
    video = read_video(tmp_path / "long.mp4")
    assert len(video.time_s) == 510
    assert np.allclose(np.diff(video.time_s), 1 / 30, atol=1e-3)
    with av.open(str(tmp_path / "long.mp4")) as container:
        small = [
            frame.reformat(width=64, height=36, format="gray").to_ndarray().astype(float)
            for frame in container.decode(video=0)
        ]
    assert len(small) == 510
    steps = [np.abs(after - before).mean() for before, after in pairwise(small)]
    assert max(steps) < 3  # grey levels on average; another image of the walk is 10 and more away
    np.testing.assert_allclose(small[480], small[0], atol=12)


def test_shares_add_up(toy_detector, numbered_film):
    measured, decoded = _run(numbered_film, toy_detector, "cpu")
    assert decoded > 0
    assert measured.frames == 60
    assert sum(measured.seconds.values()) == pytest.approx(measured.wall_s)
    assert 0 < measured.seconds["the rest"] < measured.wall_s
    assert measured.seconds["2D network"] > 0
    assert measured.devices[toy_detector.name] == "cpu"
    assert f"{toy_detector.name} on cpu" in str(measured)
    assert measured.seconds["images"] > 0
    assert measured.cpu_s > 0
    assert 0 < measured.arrays_mb < measured.peak_mb


def test_a_run_on_files_says_where_its_time_went(tmp_path):
    take, measured = measured_run(write_inputs(tmp_path, 100))
    assert measured.frames == 100 == len(take.need("keypoints"))
    assert next(iter(measured.seconds)) == "read"
    assert list(measured.seconds)[-2:] == ["report", "the rest"]
    assert sum(measured.seconds.values()) == pytest.approx(measured.wall_s)
    assert 0 < measured.seconds["the rest"] < measured.wall_s
    assert 0 < measured.arrays_mb < measured.peak_mb


def test_a_walk_has_steps_and_a_second_lift(tmp_path):
    take, measured = measured_run(write_walk(tmp_path, 600))
    steps = value(subgroup(grouped(take.need("measures")), "walking"), "steps")
    assert steps is not None
    assert steps > 5
    assert "lifter.onnx" in measured.devices


def test_own_work_stays_in_proportion_to_the_networks(tmp_path, monkeypatch):
    """In CPU time within one run, without imports, so that a slow or busy machine slows both alike."""
    (tmp_path / "first").mkdir()
    measured_run(write_inputs(tmp_path / "first", 300))  # imports everything
    spent, rotation = [], PCNetRectifier.rotation

    def timed(self: PCNetRectifier, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        before = time.process_time()
        answer = rotation(self, joints)
        spent.append(time.process_time() - before)
        return answer

    monkeypatch.setattr(PCNetRectifier, "rotation", timed)
    _, measured = measured_run(write_inputs(tmp_path, 3000))
    assert (measured.cpu_s - sum(spent)) / sum(spent) < OWN_OVER_NETWORK


def test_a_study_says_what_a_take_costs():
    measured = measured_batch(3, 1.5, workers=2)
    assert (measured.takes, measured.workers) == (3, 2)
    assert 0 < measured.network_s < measured.wall_s
    assert measured.own_s == pytest.approx(measured.wall_s * 2 / 3 - measured.network_s)
