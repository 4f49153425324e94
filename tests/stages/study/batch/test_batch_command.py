"""`pcnet3d batch` as a user runs it: trouble in one take, a stop on the way, and folders that are not to be used."""

import contextlib
import json
import os
import resource
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import pandas
import pytest
from pyarrow import parquet

from commands import refused, succeeded
from golden.studies import write_pair, write_study


@pytest.fixture(scope="module")
def finished(pcnet3d, tmp_path_factory):
    """A study with two kinds of trouble, run once: its manifest, its folder, and what the command said."""
    folder = tmp_path_factory.mktemp("finished")
    manifest = write_study(folder / "in", 2, broken=1, crashing=1)
    said = pcnet3d("batch", manifest, "-o", folder / "out", "--workers", 2)
    return manifest, folder / "out", said


def table(folder: Path) -> list[dict]:
    return parquet.read_table(folder / "study.parquet").to_pylist()


def test_each_take_fails_for_itself_and_says_why(finished):
    _, out, said = finished
    assert said.returncode == 2, said.stderr
    takes = {take["name"].split("_")[0]: take for take in table(out)}
    assert {name: (take["state"], take["exit_code"]) for name, take in takes.items()} == {
        "good": ("done", 0), "broken": ("failed", 2), "crash": ("failed", -signal.SIGABRT),
    }  # fmt: skip
    assert ".npy" in takes["broken"]["reason"]
    assert [takes[name]["code"] for name in ("good", "broken", "crash")] == ["", "file-damaged", ""]
    assert "SIGABRT" in takes["crash"]["reason"]
    for name in ("broken", "crash"):
        assert f"failed: {takes[name]['name']}: {takes[name]['reason']}" in said.stderr
        assert (out / "logs" / f"{takes[name]['name']}.txt").exists()
    assert sorted(path.name[:4] for path in (out / "takes").iterdir()) == ["good", "good"]
    assert len(list((out / "logs").iterdir())) == 2


def test_a_take_that_hangs_is_ended(pcnet3d, tmp_path):
    out = tmp_path / "out"
    said = pcnet3d("batch", write_study(tmp_path / "in", 0, hanging=1), "-o", out, "--timeout", 1)
    assert said.returncode == 2, said.stderr
    (take,) = table(out)
    assert (take["state"], take["exit_code"]) == ("failed", 124)
    assert "--timeout" in take["reason"]
    assert not list((out / "takes").iterdir())


def test_the_table_has_a_row_for_every_take(finished):
    manifest, out, _ = finished
    rows = table(out)
    assert [row["name"] for row in rows] == [
        line.split(",")[0] for line in manifest.read_text().splitlines()[1:]
    ]
    for row in rows:
        good = row["name"].startswith("good")
        assert row["state"] == ("done" if good else "failed")
        assert bool(row["reason"]) != good
        assert bool(row["code"]) == row["name"].startswith("broken")
        assert (row["range_of_motion.r_knee_flexion.p05_p95_deg"] is not None) == good
        assert row["subject"].startswith("s")
        if good:
            measures = json.loads((out / "takes" / row["name"] / "summary.json").read_text())["measures"]
            expected = measures["range_of_motion"]["r_knee_flexion"]["p05_p95_deg"]
            assert row["range_of_motion.r_knee_flexion.p05_p95_deg"] == expected
            assert row["frames"] == 45
            assert row["device"] == ""  # of the geometric rectifier, which is no network
            assert row["notices"]
    as_csv = pandas.read_csv(out / "study.csv")
    assert list(as_csv) == list(rows[0])
    assert as_csv["name"].tolist() == [row["name"] for row in rows]
    knee = "range_of_motion.r_knee_flexion.p05_p95_deg"
    assert as_csv[knee].dropna().tolist() == pytest.approx(
        [row[knee] for row in rows if row[knee] is not None]
    )
    assert as_csv["notices"].dropna().str.split().tolist() == [
        [each["code"] for each in row["notices"]] for row in rows if row["notices"]
    ]


def test_a_second_batch_does_what_has_changed_and_keeps_the_rest(finished, pcnet3d, told, tmp_path):
    source, out, _ = finished
    shutil.copytree(source.parent, tmp_path / "in")
    shutil.copytree(out, tmp_path / "out")
    manifest, good = only_good(tmp_path / "in" / "manifest.csv")
    first, second = (tmp_path / "in" / row.split(",")[3] for row in good)
    np.save(first, np.load(first) * 1.01)
    os.utime(second)  # another time, the same content
    names = [row.split(",")[0] for row in good]
    before = [told(tmp_path / "out" / "takes" / name) for name in names]
    result = succeeded(pcnet3d("batch", manifest, "-o", tmp_path / "out"))
    assert "2 takes done (1 of them before)" in result.stdout
    after = [told(tmp_path / "out" / "takes" / name) for name in names]
    assert after[0] != before[0]
    assert after[1] == before[1]
    assert len(parquet.read_table(tmp_path / "out" / "study.parquet")) == 2
    assert "3 takes" not in result.stderr


def only_good(manifest: Path) -> tuple[Path, list[str]]:
    """A manifest without those that fail, and its rows."""
    head, *rows = manifest.read_text(encoding="utf-8").splitlines()
    good = [row for row in rows if row.startswith("good")]
    (manifest.parent / "good.csv").write_text("\n".join([head, *good]) + "\n")
    return manifest.parent / "good.csv", good


def wait_for(condition, batch=None):
    """Until it is so; fails where the batch ended before."""
    while not condition():
        assert batch is None or batch.poll() is None
        time.sleep(0.05)


def descendants(process: int) -> list[int]:
    """Processes that a process has started, and those that these have."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if int(path.read_text().rpartition(")")[2].split()[1]) == process:
                found += [int(path.parent.name), *descendants(int(path.parent.name))]
    return found


def alive(process: int) -> bool:
    """Whether it still runs; what has ended and waits for its parent has no command line."""
    with contextlib.suppress(OSError):
        return bool(Path(f"/proc/{process}/cmdline").read_bytes())
    return False


@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="looks at processes through /proc")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_stopped_on_the_way_it_goes_on_where_it_was(begun, apart, told, tmp_path, how):
    manifest, out = write_study(tmp_path / "in", 2, hanging=1), tmp_path / "out"
    batch = begun("batch", manifest, "-o", out, "--workers", 2)
    wait_for(
        lambda: any("good" in f for f in told(out / "takes")) and list((out / "logs").glob("hang*")), batch
    )
    workers = descendants(batch.pid)
    assert workers
    batch.send_signal(how)
    _, err = batch.communicate()
    assert batch.returncode == {signal.SIGKILL: -9, signal.SIGTERM: 143, signal.SIGINT: 130}[how], err
    assert "Traceback" not in err
    wait_for(lambda: not any(map(alive, workers)))
    rows = [line for line in manifest.read_text().splitlines() if not line.startswith("hang")]
    manifest.write_text("\n".join(rows) + "\n")
    again = succeeded(apart("batch", manifest, "-o", out))
    assert "2 takes done (0 of them before)" not in again.stdout
    assert sorted(path.name for path in (out / "takes").iterdir()) == ["good_000", "good_001"]
    assert parquet.read_table(out / "study.parquet")["state"].to_pylist() == ["done", "done"]


def test_a_folder_of_another_version_is_left_alone(finished, pcnet3d, told, tmp_path):
    manifest, out, _ = finished
    shutil.copytree(out, tmp_path / "out")
    content = (tmp_path / "out" / "batch.json").read_text().replace('"pcnet3d": "', '"pcnet3d": "0.', 1)
    (tmp_path / "out" / "batch.json").write_text(content)
    before = told(tmp_path / "out" / "takes")
    refused(pcnet3d("batch", manifest, "-o", tmp_path / "out"), "was made by pcnet3d 0.", "choose another -o")
    assert told(tmp_path / "out" / "takes") == before


def test_a_full_disk_fails_what_does_not_fit_and_keeps_the_rest(finished, apart, told, tmp_path):
    """A limit on the size of files, as a stand-in: a take's poses do not fit."""
    manifest, out, _ = finished
    shutil.copytree(out, tmp_path / "out")
    before = told(tmp_path / "out" / "takes")
    lines = manifest.read_text().splitlines()
    good = [line for line in lines if line.startswith("good")]
    more = manifest.parent / "more.csv"
    more.write_text(
        "\n".join([lines[0], *good, good[0].replace("good_", "late_").replace(",30,", ",25,")]) + "\n"
    )

    def little_room() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (12_000, 12_000))

    result = apart("batch", more, "-o", tmp_path / "out", preexec_fn=little_room)
    assert result.returncode == 2
    assert "Traceback" not in result.stderr
    assert "could not be read or written" in result.stderr
    assert told(tmp_path / "out" / "takes") == before


def test_everybody_of_a_take_has_a_row(pcnet3d, tmp_path):
    write_pair(tmp_path / "pair.json")
    study = write_study(tmp_path, 1)
    study.write_text("name,poses,fps,everyone,recipe,subject\nboth,pair.json,30,yes,quick.toml,s\n")
    succeeded(pcnet3d("batch", study, "-o", tmp_path / "out"))
    rows = parquet.read_table(tmp_path / "out" / "study.parquet").to_pylist()
    assert [(row["name"], row["subject"], row["person"], row["frames"]) for row in rows] == [
        ("both", "s", "0", 45), ("both", "s", "1", 45),
    ]  # fmt: skip
    kept = pcnet3d("batch", study, "-o", tmp_path / "out")
    assert "1 take done (1 of them before)" in kept.stdout


def test_options_for_every_take_are_checked_before_any_runs(pcnet3d, tmp_path):
    small, out = write_study(tmp_path / "in", 2), tmp_path / "out"
    refused(pcnet3d("batch", small, "-o", out, "--device", "directml"), "offers here", "--device directml")
    twice = pcnet3d("batch", small, "-o", out, "--device", "cpu", "--set", "device=auto")
    refused(twice, "--device and --set device")
    refused(pcnet3d("batch", small, "-o", out, "--fps", 30, "--set", "fps=25"), "--fps and --set fps")
    refused(pcnet3d("batch", small, "-o", out, "--dask", "tcp://x:1", "--workers", 2), "--workers", "--dask")
    assert not out.exists()
    succeeded(pcnet3d("batch", small, "-o", out, "--device", "cpu"))
    summaries = [json.loads(path.read_text()) for path in out.glob("takes/*/summary.json")]
    assert [summary["device"]["asked"] for summary in summaries] == ["cpu", "cpu"]
