"""The same takes on a Dask cluster of this machine: a worker that is killed, none at all, and no scheduler."""

import json
import os
import signal
import socket
from dataclasses import replace
from types import SimpleNamespace

import pytest
from pyarrow import parquet

from golden.studies import write_study
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.pose import package_version
from pcnet3d.stages.study.batch.manifest import read_entries
from pcnet3d.stages.study.batch.pool import connected, on_cluster
from pcnet3d.stages.study.batch.take import Job, Outcome, run_take

distributed = pytest.importorskip("distributed")


@pytest.fixture
def cluster(beside, monkeypatch):
    """cluster(workers): a cluster of that many processes of one thread."""
    monkeypatch.setenv("PYTHONPATH", beside["PYTHONPATH"])
    made = []

    def make(workers: int):
        made.append(
            distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                silence_logs=50,
            )
        )
        return made[-1]

    yield make
    for one in made:
        one.close(timeout=10)


def jobs(folder, **kinds) -> list[Job]:
    entries = read_entries(write_study(folder / "in", **kinds), {})
    for name in ("takes", "logs", "locks"):
        (folder / "out" / name).mkdir(parents=True, exist_ok=True)
    return [Job(entry, folder / "out", 20.0) for entry in entries]


def test_a_worker_that_is_killed_costs_nothing_but_time(cluster, pcnet3d, tmp_path):
    """Killed while both are at work; whatever it had finished or begun is there once, and the command finds it."""
    workers = cluster(2)
    with distributed.Client(workers, set_as_default=False) as client:
        pids = list(client.run(os.getpid).values())
    with connected(workers.scheduler_address) as client:
        coming = on_cluster(jobs(tmp_path, good=3, crashing=1), client)
        first = next(coming)
        os.kill(min(pids), signal.SIGKILL)
        outcomes = [first, *coming]
    assert sorted(outcome.name for outcome in outcomes) == ["crash_003", "good_000", "good_001", "good_002"]
    assert {outcome.name.split("_")[0]: outcome.exit_code for outcome in outcomes} == {"good": 0, "crash": -6}
    assert sorted(path.name for path in (tmp_path / "out/takes").iterdir()) == [
        "good_000",
        "good_001",
        "good_002",
    ]
    (tmp_path / "out" / "batch.json").write_text(json.dumps({"pcnet3d": package_version()}))
    words = (
        "batch",
        tmp_path / "in/manifest.csv",
        "-o",
        tmp_path / "out",
        "--dask",
        workers.scheduler_address,
    )
    result = pcnet3d(*words)
    assert result.returncode == 2, result.stderr
    assert "failed: crash_003" in result.stderr
    assert "3 takes done (3 of them before)" in result.stdout
    rows = parquet.read_table(tmp_path / "out" / "study.parquet").to_pylist()
    assert [row["state"] for row in rows] == ["done"] * 3 + ["failed"]


def test_an_answer_that_is_lost_with_its_worker_is_waited_for_again(monkeypatch, tmp_path):
    """A take was done, and its worker died before anybody asked for the outcome; another worker finds it done."""

    class Future:
        key, status = "a", "lost"

        def result(self):
            return Outcome("good_000", "kept")

    class Waiting(list):
        def __init__(self, futures):
            super().__init__(futures)
            self.again = 0

        def is_empty(self):
            return not self

        def next_batch(self, block):
            return [self.pop()]

        def add(self, future):
            self.again += 1
            future.status = "pending" if self.again == 1 else "finished"
            self.append(future)

    class Client:
        scheduler = SimpleNamespace(address="tcp://here")

        def map(self, function, jobs, pure):
            return [Future()]

        def cancel(self, futures):
            pass

    monkeypatch.setattr(distributed, "as_completed", Waiting)
    (outcome,) = on_cluster(jobs(tmp_path, good=1), Client())
    assert (outcome.name, outcome.state) == ("good_000", "kept")


def test_a_cluster_without_workers_is_given_up(cluster, tmp_path):
    workers = cluster(0)
    with connected(workers.scheduler_address) as client, pytest.raises(InputError, match="no worker for 1 s"):
        list(on_cluster(jobs(tmp_path, good=1), client, patience_s=1.0))


def test_a_scheduler_that_goes_away_is_said(cluster, tmp_path):
    workers = cluster(1)
    with connected(workers.scheduler_address) as client:
        coming = on_cluster(jobs(tmp_path, good=1, hanging=1), client)
        assert next(coming).state == "done"
        workers.close(timeout=10)
        with pytest.raises(InputError, match="was lost"):
            next(coming)


def test_a_scheduler_that_cannot_be_reached_is_said(pcnet3d, tmp_path):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    manifest = write_study(tmp_path / "in", 1)
    for address in (f"tcp://127.0.0.1:{port}", "no address"):
        result = pcnet3d("batch", manifest, "-o", tmp_path / "out", "--dask", address)
        assert result.returncode == 2, result.stderr
        assert "Traceback" not in result.stderr
        assert address in result.stderr
        assert "tcp://HOST:8786" in result.stderr
        assert not (tmp_path / "out").exists()


def test_a_worker_of_another_version_does_nothing(tmp_path):
    (job,) = jobs(tmp_path, good=1)
    outcome = run_take(replace(job, version="0.0"))
    assert (outcome.state, outcome.exit_code) == ("failed", 2)
    assert "install one version" in outcome.reason
    outcome = run_take(replace(job, output=tmp_path / "nowhere"))
    assert "does not see" in outcome.reason
    assert not any((tmp_path / "out" / "takes").iterdir())
