"""The same takes on a Dask cluster of this machine: a worker that is killed, none at all, and no scheduler."""

import json
import os
import signal
import socket

import pytest
from pyarrow import parquet

from golden.studies import write_study
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.pose import package_version
from pcnet3d.stages.study.batch import take
from pcnet3d.stages.study.batch.command import on_cluster, outcomes_of
from pcnet3d.stages.study.batch.manifest import Entry, read_entries
from pcnet3d.stages.study.batch.take import run_take

distributed = pytest.importorskip("distributed")
import dask  # noqa: E402


@pytest.fixture
def cluster(site, monkeypatch):
    """cluster(workers): a cluster of that many processes of one thread."""
    monkeypatch.syspath_prepend(site)  # workers import from where this process does
    made = []
    no_nanny = dask.config.set(
        {"distributed.worker.daemon": False}
    )  # as with --no-nanny: takes have processes

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

    with no_nanny:
        yield make
    for one in made:
        one.close()


def takes(folder, **kinds) -> tuple[Entry, ...]:
    entries = read_entries(write_study(folder / "in", **kinds), {})
    for name in ("takes", "logs", "locks"):
        (folder / "out" / name).mkdir(parents=True, exist_ok=True)
    return entries


def test_a_worker_that_is_killed_costs_nothing_but_time(cluster, pcnet3d, tmp_path):
    """Killed while both are at work; whatever it had finished or begun is there once, and the command finds it."""
    workers = cluster(2)
    with distributed.Client(workers, set_as_default=False) as client:
        pids = list(client.run(os.getpid).values())
    with on_cluster(workers.scheduler_address) as executor:
        coming = outcomes_of(takes(tmp_path, good=3, crashing=1), tmp_path / "out", executor)
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


def test_a_cluster_without_workers_is_given_up(cluster, tmp_path):
    workers = cluster(0)
    with (
        pytest.raises(InputError, match="no worker for 1 s"),
        on_cluster(workers.scheduler_address, patience_s=1.0),
    ):
        pass


def test_a_scheduler_that_goes_away_is_said(cluster, tmp_path):
    workers = cluster(1)
    with on_cluster(workers.scheduler_address) as executor:
        coming = outcomes_of(takes(tmp_path, good=1, hanging=1), tmp_path / "out", executor)
        assert next(coming).state == "done"
        workers.close()
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


def test_workers_that_may_start_no_process_say_how_to_start_them(monkeypatch, tmp_path):
    (entry,) = takes(tmp_path, good=1)
    monkeypatch.setattr(take.current_process(), "_config", {"daemon": True})
    outcome = run_take(entry, tmp_path / "out", package_version())
    assert (outcome.state, outcome.code) == ("failed", "option-conflict")
    assert "--no-nanny" in outcome.reason


def test_a_worker_of_another_version_does_nothing(tmp_path):
    (entry,) = takes(tmp_path, good=1)
    outcome = run_take(entry, tmp_path / "out", "0.0")
    assert (outcome.state, outcome.exit_code) == ("failed", 2)
    assert "install one version" in outcome.reason
    outcome = run_take(entry, tmp_path / "nowhere", package_version())
    assert "does not see" in outcome.reason
    assert not any((tmp_path / "out" / "takes").iterdir())
