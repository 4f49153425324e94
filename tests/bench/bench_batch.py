"""A study with trouble: `PYTHONPATH=tests python tests/bench/bench_batch.py [TAKES [PART ...]]`. Prints; asserts that
each take ended as it should.

plain: TAKES (200) takes with 10 broken, 2 crashing and 2 hanging ones among them, two at a time.
killed: the same, the batch killed by SIGKILL at random 20 times and run again.
cluster: the same on a Dask cluster of two workers on this machine, one of which is killed on the way.
speed: one worker against two on the same 12 takes.

The first three print a digest of the study's table, which is to be the same. Their takes cost little but the start of
their process, so that it is the batch that is measured; those of `speed` go through angles and measures.
"""

from __future__ import annotations

import contextlib
import hashlib
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

from golden.studies import CHEAP, write_study, write_trouble

TIMEOUT_S = 30
BROKEN, CRASHING, HANGING, KILLS = 10, 2, 2, 20
KILLED_WITHIN_S = 0.3  # times the number of takes


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


def digest(out: Path) -> str:
    """Of the study's table but for the reasons, which name the folder."""
    rows = parquet.read_table(out / "study.parquet").to_pylist()
    kept = [{key: value for key, value in row.items() if key != "reason"} for row in rows]
    return hashlib.sha256(json.dumps(kept).encode()).hexdigest()[:16]


def finished(out: Path) -> dict[str, int]:
    """When each take that is done was done."""
    found = {}
    for path in (out / "takes").glob("[!.]*/summary.json"):
        if "batch" in json.loads(path.read_text()):
            found[path.parent.name] = path.stat().st_mtime_ns
    return found


def killed(folder: Path, manifest: Path) -> Path:
    """The batch killed KILLS times, at random some seconds after it was begun, then finished."""
    latest_s = KILLED_WITHIN_S * len(manifest.read_text(encoding="utf-8").splitlines())
    rng, out, known, twice = random.Random(0), folder / "killed", {}, 0
    for _ in range(KILLS):
        batch = subprocess.Popen(
            command(manifest, "-o", out, "--timeout", TIMEOUT_S, "--workers", 2),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        with contextlib.suppress(subprocess.TimeoutExpired):
            batch.wait(rng.uniform(1, latest_s))
        batch.kill()
        batch.wait()
        now = finished(out) if (out / "takes").is_dir() else {}
        twice += sum(now.get(name) != when for name, when in known.items())
        known = now
    run(manifest, out, "--workers", 2)
    twice += sum(finished(out).get(name) != when for name, when in known.items())
    left = [path.name for path in out.rglob(".*")]
    print(
        f"killed {KILLS} times, the last time after {len(known)} takes: {states(out)}, done twice {twice}, left {left}"
    )
    return out


def on_cluster(folder: Path, manifest: Path) -> Path:
    from distributed import Client, LocalCluster

    out = folder / "cluster"
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        with Client(cluster, set_as_default=False) as client:
            worker = min(client.run(os.getpid).values())
        words = ("--timeout", TIMEOUT_S, "--dask", cluster.scheduler_address)
        batch = subprocess.Popen(
            command(manifest, "-o", out, *words), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        while not out.is_dir() or len(finished(out)) < 10:
            time.sleep(0.2)
        known = finished(out)
        os.kill(worker, signal.SIGKILL)
        batch.wait()
    twice = sum(finished(out).get(name) != when for name, when in known.items())
    print(f"cluster, a worker killed after {len(known)} takes: {states(out)}, done twice {twice}")
    return out


def plain(folder: Path, manifest: Path) -> Path:
    wall_s, used_s = run(manifest, folder / "plain", "--workers", 2)
    print(f"plain: {states(folder / 'plain')}, {wall_s:.0f} s, {used_s:.0f} s of CPU", flush=True)
    wall_s, used_s = run(manifest, folder / "plain", "--workers", 2)
    print(f"  once more, what failed alone: {wall_s:.0f} s, {used_s:.0f} s of CPU", flush=True)
    return folder / "plain"


def speed(folder: Path) -> None:
    """In turns, because what else the machine does changes."""
    few = write_study(folder / "few", 12)
    for turn in range(2):
        for workers in (1, 2):
            wall_s, used_s = run(few, folder / f"few-{turn}-{workers}", "--workers", workers)
            print(f"speed: 12 takes, {workers} at a time: {wall_s:.1f} s, {used_s:.1f} s of CPU", flush=True)


def main() -> None:
    takes = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    parts = sys.argv[2:] or ["plain", "killed", "cluster", "speed"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["PYTHONPATH"] = (
            f"{write_trouble(folder / 'site')}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
        )
        good = takes - BROKEN - CRASHING - HANGING
        manifest = write_study(folder / "in", good, BROKEN, CRASHING, HANGING, CHEAP)
        for part, do in {"plain": plain, "killed": killed, "cluster": on_cluster}.items():
            if part in parts:
                print(f"  table {digest(do(folder, manifest))}", flush=True)
        if "speed" in parts:
            speed(folder)


if __name__ == "__main__":
    main()
