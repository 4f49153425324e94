"""A disk that becomes full, wherever that is, ends a run with a sentence; never with a wait."""

import resource
import shutil

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pcnet3d.pipeline import RunOptions
from pcnet3d.pipeline.running.run import run_files
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
    with recording_file(path, rrb.Vertical(rrb.TimeSeriesView(origin="a")), path) as file:
        for block in range(50):
            frames = np.arange(block * 10_000, (block + 1) * 10_000)
            scalars = rr.Scalars.columns(scalars=np.random.default_rng(block).normal(size=len(frames)))
            file.stream.send_columns("a", [rr.TimeColumn("frame", sequence=frames)], scalars)
            file.stream.flush()
            file.check()
            written.append(block)


def test_a_video_that_the_disk_has_no_room_for_is_told_before_it_is_read(tmp_path, monkeypatch):
    """After an hour of detection the recording was refused."""
    video, done = tmp_path / "video.mp4", []
    video.write_bytes(bytes(2000))
    monkeypatch.setattr(shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 10**9, 1000))
    with refused("cannot-write"):
        run_files(RunOptions(video=video), tmp_path / "out", done=lambda *stage: done.append(stage))
    assert (done, [path.name for path in tmp_path.iterdir()]) == ([], ["video.mp4"])
    with refused("format-unknown"):  # without the video in it, no room is asked for
        run_files(RunOptions(video=video, no_frames=True), tmp_path / "out")
