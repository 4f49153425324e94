"""A disk that becomes full, wherever that is, ends a run with a sentence; never with a wait."""

import resource

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pcnet3d.stages.drawing.rerun_file import recording_file
from refusals import refused


def test_a_recording_tells_a_full_disk_while_it_is_written(tmp_path):
    written = []
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (256_000, limits[1]))  # as of a disk, no file may grow further
    try:
        with refused("cannot-write"):
            _log_until_full(tmp_path / "a.rrd", written)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
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
