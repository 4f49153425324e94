"""A take of a batch whose detection was cut off goes on from it, and only if it is still the same take."""

from pathlib import Path

import pytest

from pcnet3d.pipeline.running.run import checkpoint_of
from pcnet3d.stages.study.batch import take as _batch_take
from pcnet3d.stages.study.batch.manifest import Entry
from pcnet3d.stages.study.batch.process import Ended
from pcnet3d.stages.study.batch.take import Job, run_take


@pytest.fixture
def job(tmp_path) -> Job:
    video = tmp_path / "v.mp4"
    video.write_bytes(b"pictures")
    for name in ("takes", "logs", "locks"):
        (tmp_path / "out" / name).mkdir(parents=True)
    return Job(Entry("v", {"video": (str(video),)}, ("video",), {}), tmp_path / "out")


def begin(job: Job, monkeypatch, code: int = 1) -> bool:
    """Whether the take's process would go on from what an earlier one had detected."""
    resumed = []
    ended = Ended(code), "killed"
    monkeypatch.setattr(_batch_take, "_run", lambda job, resume: resumed.append(resume) or ended)
    run_take(job)
    return resumed[0]


def test_a_take_goes_on_from_what_was_detected(job, monkeypatch):
    assert not begin(job, monkeypatch)
    assert not begin(job, monkeypatch)  # nothing was detected
    checkpoint_of(job.folder).write_bytes(b"keypoints")
    assert begin(job, monkeypatch)


def test_another_video_of_that_name_begins_anew(job, monkeypatch):
    begin(job, monkeypatch)
    checkpoint_of(job.folder).write_bytes(b"keypoints")
    Path(job.entry.options["video"][0]).write_bytes(b"other pictures")
    assert not begin(job, monkeypatch)
    assert not checkpoint_of(job.folder).exists()


def test_what_lies_there_from_who_knows_whom_is_not_taken(job, monkeypatch):
    checkpoint_of(job.folder).write_bytes(b"keypoints")
    assert not begin(job, monkeypatch)


def test_the_process_is_told(job, monkeypatch):
    orders = []

    def refuse(words, *_):
        orders.append(words)
        raise OSError(12, "no memory", "v")

    monkeypatch.setattr(_batch_take, "run_apart", refuse)
    run_take(job)
    checkpoint_of(job.folder).write_bytes(b"keypoints")
    run_take(job)
    assert ["--resume" in words for words in orders] == [False, True]
