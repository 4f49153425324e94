"""A disk that becomes full, wherever that is, ends a run with a sentence; never with a wait."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb

from pcnet3d.stages.drawing.rerun_file import recording_file
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
