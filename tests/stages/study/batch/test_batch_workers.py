"""Worker processes: one take after another, each with its own log and exit code, and another process when one dies."""

import os
import signal

import pytest

from pcnet3d.stages.study.batch import workers
from pcnet3d.stages.study.batch.workers import close_workers, run_in_worker


@pytest.fixture(autouse=True)
def ended():
    yield
    close_workers()


def idle() -> list[int]:
    return [worker.process.pid for worker in workers._idle]


def test_one_process_runs_one_take_after_another(tmp_path):
    first, bad, third = (tmp_path / f"{name}.txt" for name in ("first", "bad", "third"))
    bad.write_text("of an earlier run")
    assert run_in_worker(["list", "stages"], first, 60) == (0, "")
    (process,) = idle()
    assert run_in_worker(["run", "-o", str(tmp_path / "out"), "--poses", "nowhere.npy"], bad, 60) == (
        2,
        "cannot-open",
    )
    assert run_in_worker(["list", "writers"], third, None) == (0, "")
    assert idle() == [process]
    assert "trajectories" in first.read_text()
    assert "nowhere.npy" in bad.read_text()
    assert "of an earlier run" not in bad.read_text()
    assert "markers" in third.read_text()
    assert "trajectories" not in third.read_text()


def test_of_one_that_has_died_another_takes_the_place(tmp_path):
    assert run_in_worker(["--version"], tmp_path / "log.txt", 60) == (0, "")
    (process,) = idle()
    os.kill(process, signal.SIGKILL)
    workers._idle[0].process.wait()
    assert run_in_worker(["--version"], tmp_path / "log.txt", 60) == (0, "")
    assert idle() != [process]


def test_a_process_has_so_many_takes_and_no_more(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "_MOST", 2)
    seen = []
    for _ in range(3):
        assert run_in_worker(["--version"], tmp_path / "log.txt", 60) == (0, "")
        seen.append(idle())
    assert [len(each) for each in seen] == [1, 0, 1]
    assert seen[2] != seen[0]


def test_what_takes_too_long_is_ended_and_harms_nobody_else(tmp_path):
    with pytest.raises(TimeoutError):
        run_in_worker(["--version"], tmp_path / "log.txt", 0.01)
    assert not idle()
    assert run_in_worker(["--version"], tmp_path / "log.txt", 60) == (0, "")


def test_closed_processes_are_gone(tmp_path):
    run_in_worker(["--version"], tmp_path / "log.txt", 60)
    (worker,) = workers._idle
    close_workers()
    assert worker.process.poll() is not None
    assert not idle()
