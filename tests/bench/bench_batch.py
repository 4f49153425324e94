"""A study with trouble: `PYTHONPATH=tests python tests/bench/bench_batch.py [TAKES]`. Prints; asserts what must hold.

1. TAKES (200) takes with 10 broken, 2 crashing and 2 hanging ones among them, two at a time.
2. The same, the batch killed by SIGKILL at random 20 times and run again: the same table, nothing done twice.
3. The same on a Dask cluster of two workers on this machine, one of which is killed on the way.
4. One worker against two on the same 16 takes, in turns.
"""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from pyarrow import parquet

from golden.studies import write_study, write_trouble

TIMEOUT_S = 30
BROKEN, CRASHING, HANGING, KILLS = 10, 2, 2, 20


def command(*words: object) -> list[str]:
    return [sys.executable, "-c", "from pcnet3d.pipeline.cli import main; main()", "batch", *map(str, words)]


def cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(manifest: Path, out: Path, *words: object) -> tuple[float, float]:
    """Wall seconds, and seconds of CPU of all processes."""
    start, before = time.perf_counter(), cpu_s()
    subprocess.run(
        command(manifest, "-o", out, "--timeout", TIMEOUT_S, *words), capture_output=True, check=False
    )
    return time.perf_counter() - start, cpu_s() - before


def states(out: Path) -> dict[str, int]:
    rows = parquet.read_table(out / "study.parquet").to_pylist()
    wrong = [row["name"] for row in rows if (row["state"] == "done") != row["name"].startswith("good")]
    assert not wrong, f"good takes that failed, or bad ones that did not: {wrong}"
    assert all(row["reason"] for row in rows if row["state"] == "failed")
    assert sorted(path.name for path in (out / "takes").iterdir()) == sorted(
        row["name"] for row in rows if row["state"] == "done"
    )
    return {state: sum(row["state"] == state for row in rows) for state in ("done", "failed")}


def table(out: Path) -> list[dict]:
    """All but the reasons' paths, which differ from folder to folder."""
    rows = parquet.read_table(out / "study.parquet").to_pylist()
    return [{key: value for key, value in row.items() if key != "reason"} for row in rows]


def finished(out: Path) -> dict[str, int]:
    """When each take that is done was done."""
    found = {}
    for path in (out / "takes").glob("[!.]*/summary.json"):
        if "batch" in json.loads(path.read_text()):
            found[path.parent.name] = path.stat().st_mtime_ns
    return found


def killed(manifest: Path, out: Path, seconds: float) -> int:
    """The batch killed KILLS times, then finished; how many takes were done twice."""
    rng, known, twice = random.Random(0), {}, 0
    for _ in range(KILLS):
        batch = subprocess.Popen(
            command(manifest, "-o", out, "--timeout", TIMEOUT_S, "--workers", 2),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        time.sleep(rng.uniform(1, 1.6 * seconds / KILLS))
        batch.kill()
        batch.wait()
        now = finished(out) if (out / "takes").is_dir() else {}
        twice += sum(now.get(name) != when for name, when in known.items())
        known = now
    before = len(known)
    run(manifest, out, "--workers", 2)
    now = finished(out)
    twice += sum(now.get(name) != when for name, when in known.items())
    print(f"   {before} takes were done before the last run")
    return twice


def on_cluster(manifest: Path, out: Path) -> None:
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        with Client(cluster, set_as_default=False) as client:
            worker = min(client.run(os.getpid).values())
        words = ("--timeout", TIMEOUT_S, "--dask", cluster.scheduler_address)
        batch = subprocess.Popen(
            command(manifest, "-o", out, *words), stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        while not out.is_dir() or len(finished(out)) < 10:
            time.sleep(0.2)
        os.kill(worker, signal.SIGKILL)
        print(f"   a worker killed after {len(finished(out))} takes")
        batch.communicate()


def main() -> None:
    takes = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["PYTHONPATH"] = (
            f"{write_trouble(folder / 'site')}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
        )
        good = takes - BROKEN - CRASHING - HANGING
        manifest = write_study(folder / "in", good, BROKEN, CRASHING, HANGING)
        wall_s, used_s = run(manifest, folder / "plain", "--workers", 2)
        print(
            f"1. {takes} takes, 2 workers: {states(folder / 'plain')}, {wall_s:.0f} s, {used_s:.0f} s of CPU",
            flush=True,
        )
        again_s, used_s = run(manifest, folder / "plain", "--workers", 2)
        print(f"   once more, what failed alone: {again_s:.0f} s, {used_s:.0f} s of CPU", flush=True)
        twice = killed(manifest, folder / "killed", wall_s)
        same = table(folder / "killed") == table(folder / "plain")
        left = [path.name for path in (folder / "killed").rglob(".*")]
        print(
            f"2. killed {KILLS} times: {states(folder / 'killed')}, the same table: {same}, "
            f"done twice: {twice}, left: {left}",
            flush=True,
        )
        on_cluster(manifest, folder / "dask")
        same = table(folder / "dask") == table(folder / "plain")
        print(f"3. on a cluster: {states(folder / 'dask')}, the same table: {same}", flush=True)
        few = write_study(folder / "few", 16)
        for turn in range(2):
            for workers in (1, 2):
                wall_s, used_s = run(few, folder / f"few-{turn}-{workers}", "--workers", workers)
                print(f"4. 16 takes, {workers} at a time: {wall_s:.1f} s, {used_s:.1f} s of CPU", flush=True)


if __name__ == "__main__":
    main()
