"""A disk that becomes full, wherever that is, ends a run with a sentence; never with a wait."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb

from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.stages.drawing.rerun_file import recording_file
from pcnet3d.stages.study.live.frames import LivePose
from pcnet3d.stages.study.live.recording import live_recording
from pcnet3d.stages.study.live.source import Shot
from refusals import refused


@pytest.fixture
def small_disk(tmp_path):
    """Mounts a file system of so many KB; skips where that is not allowed."""
    mounted = []

    def mount(kilobytes):
        place = tmp_path / f"disk{kilobytes}"
        place.mkdir()
        if sys.platform != "linux" or os.geteuid() != 0 or shutil.which("mount") is None:
            pytest.skip("only root mounts a file system")
        order = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(place)]
        if subprocess.run(order, check=False, capture_output=True).returncode:
            pytest.skip("a file system cannot be mounted here")
        mounted.append(place)
        return place

    yield mount
    for place in mounted:
        subprocess.run(["umount", str(place)], check=True)


def test_a_recording_tells_a_full_disk_while_it_is_written(small_disk):
    written = []
    with refused("cannot-write"):
        _log_until_full(small_disk(256) / "a.rrd", written)
    assert len(written) < 49  # told on the way, not at the end


def _log_until_full(path, written):
    with recording_file(path, rrb.Vertical(rrb.TimeSeriesView(origin="a"))) as file:
        for block in range(50):
            frames = np.arange(block * 10_000, (block + 1) * 10_000)
            scalars = rr.Scalars.columns(scalars=np.random.default_rng(block).normal(size=len(frames)))
            file.stream.send_columns("a", [rr.TimeColumn("frame", sequence=frames)], scalars)
            file.stream.flush()
            file.check()
            written.append(block)


@pytest.mark.parametrize("kept", [False, True])
def test_live_ends_where_its_disk_becomes_full(small_disk, kept):
    place, shown = small_disk(256), []
    with refused("cannot-write"):
        _live_until_full(place / "live.rrd", place / "video.ts" if kept else None, shown)
    assert len(shown) < 499


def _live_until_full(path, video, shown):
    rng = np.random.default_rng(0)
    joints = rng.normal(size=(17, 3))
    pose = LivePose(
        frame=0,
        time_s=0.0,
        captured_s=0.0,
        person=0,
        body=joints,
        level=joints,
        R_camera_from_body=np.eye(3),
        R_camera_from_level=np.eye(3),
        error_deg=1.0,
        up=np.array([0.0, -1.0, 0.0]),
        up_bound_deg=1.0,
        latency_ms=1.0,
        dropped=0,
    )
    with live_recording(path, COCO17, video, True) as recording:
        for number in range(500):
            image = rng.integers(0, 255, (120, 160, 3), dtype=np.uint8)
            recording.log(Shot(number, number / 30, image), None, pose)
            shown.append(number)
