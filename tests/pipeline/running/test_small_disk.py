"""A disk that becomes full, wherever that is, ends a run with a sentence; never with a wait."""

import os
import shutil
import subprocess
import sys

import pytest

from pcnet3d.models.lab.bench.files import write_inputs
from pcnet3d.pipeline import InputError
from pcnet3d.stages.drawing.rerun_file import recording_file

_KB = 1024
_COMMAND = "from pcnet3d.pipeline import cli; import pcnet3d.pipeline.files.atomic as a; from collections import namedtuple; \
a.shutil.disk_usage = lambda p: namedtuple('U', 'total used free')(1 << 40, 0, 1 << 40); cli.main()"
_LIMIT_S = 120  # far more than any of these takes; a run that waits for ever is what is looked for


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


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    return write_inputs(tmp_path_factory.mktemp("inputs"), 2000)


def _run(inputs, place, *arguments):
    """pcnet3d, told that there is room, so that the disk becomes full in the middle of the work."""
    return subprocess.run(
        [sys.executable, "-c", _COMMAND, *arguments],
        capture_output=True, text=True, timeout=_LIMIT_S, check=False, cwd=place,
    )  # fmt: skip


@pytest.mark.parametrize("kilobytes", [64, 512, 1500, 3000, 5000, 6500])
def test_a_run_ends_where_its_disk_becomes_full(small_disk, inputs, kilobytes):
    place = small_disk(kilobytes)
    done = _run(
        inputs, place, "run", "--poses", str(inputs.poses), "--keypoints", str(inputs.keypoints),
        "--fps", "30", "--also", "csv", "-o", str(place / "out"),
    )  # fmt: skip
    print(done.stderr)
    assert done.returncode == 2, done.stderr
    assert "could not be" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (place / "out").exists()


def test_a_recording_tells_a_full_disk_while_it_is_written(small_disk):
    import numpy as np
    import rerun as rr
    import rerun.blueprint as rrb

    path = small_disk(256) / "a.rrd"
    with (
        pytest.raises(InputError) as refusal,
        recording_file(path, rrb.Blueprint(rrb.TimeSeriesView(origin="a"))) as file,
    ):
        for block in range(50):
            frames = np.arange(block * 10_000, (block + 1) * 10_000)
            scalars = rr.Scalars.columns(scalars=np.random.default_rng(block).normal(size=len(frames)))
            file.stream.send_columns("a", [rr.TimeColumn("frame", sequence=frames)], scalars)
            file.stream.flush()
            file.check()
    assert refusal.value.code == "cannot-write"
    assert block < 49  # told on the way, not at the end
