"""`pcnet3d batch` as a user runs it: trouble in one take, a stop on the way, and folders that are not to be used."""

import contextlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

from commands import recipe_of, refused, succeeded
from golden.studies import write_pair, write_study
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_keypoints
from pcnet3d.examples.walker.walk import walker

_LIFTED = ("lift", "rectify", "trajectories", "angles", "export")


@pytest.fixture(scope="module")
def finished(pcnet3d, tmp_path_factory):
    """A study with two kinds of trouble, run once: its manifest, its folder, and what the command said."""
    folder = tmp_path_factory.mktemp("finished")
    manifest = write_study(folder / "in", 2, broken=1, crashing=1)
    said = pcnet3d("batch", manifest, "-o", folder / "out", "--workers", 2)
    return manifest, folder / "out", said


@pytest.fixture
def small(tmp_path) -> Path:
    """The manifest of a study of two good takes."""
    return write_study(tmp_path / "in", 2)


def status(folder: Path) -> dict:
    return json.loads((folder / "batch.json").read_text())


def test_each_take_fails_for_itself_and_says_why(finished):
    _, out, said = finished
    assert said.returncode == 2, said.stderr
    takes = {take["name"].split("_")[0]: take for take in status(out)["takes"]}
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
    assert [len(list((out / "logs").iterdir())), status(out)["owner"]] == [2, ""]


def test_a_take_that_hangs_is_ended(pcnet3d, tmp_path):
    out = tmp_path / "out"
    said = pcnet3d("batch", write_study(tmp_path / "in", 0, hanging=1), "-o", out, "--timeout", 1)
    assert said.returncode == 2, said.stderr
    (take,) = status(out)["takes"]
    assert (take["state"], take["exit_code"]) == ("failed", 124)
    assert "--timeout" in take["reason"]
    assert not list((out / "takes").iterdir())


def test_the_table_has_a_row_for_every_take(finished):
    _, out, _ = finished
    rows = parquet.read_table(out / "study.parquet").to_pylist()
    assert [row["name"] for row in rows] == [take["name"] for take in status(out)["takes"]]
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
    assert [take["state"] for take in status(tmp_path / "out")["takes"]] == ["done", "kept"]
    after = [told(tmp_path / "out" / "takes" / name) for name in names]
    assert after[0] != before[0]
    assert after[1] == before[1]
    assert len(parquet.read_table(tmp_path / "out" / "study.parquet")) == 2
    assert "3 takes" not in result.stderr


def test_a_device_is_for_every_take_and_refused_before_any_runs(small, pcnet3d, tmp_path):
    out = tmp_path / "out"
    refused(pcnet3d("batch", small, "-o", out, "--device", "directml"), "offers here", "--device directml")
    twice = pcnet3d("batch", small, "-o", out, "--device", "cpu", "--set", "device=auto")
    refused(twice, "--device and --set device")
    assert not out.exists()
    succeeded(pcnet3d("batch", small, "-o", out, "--device", "cpu"))
    summaries = [json.loads(path.read_text()) for path in out.glob("takes/*/summary.json")]
    assert [summary["device"]["asked"] for summary in summaries] == ["cpu", "cpu"]


def only_good(manifest: Path) -> tuple[Path, list[str]]:
    """A manifest without those that fail, and its rows."""
    head, *rows = manifest.read_text(encoding="utf-8").splitlines()
    good = [row for row in rows if row.startswith("good")]
    (manifest.parent / "good.csv").write_text("\n".join([head, *good]) + "\n")
    return manifest.parent / "good.csv", good


def test_what_compare_added_to_a_take_stays(finished, pcnet3d, tmp_path):
    source, out, _ = finished
    shutil.copytree(out, tmp_path / "out")
    first, second = sorted((tmp_path / "out" / "takes").iterdir())
    for run in (first, second):
        summary = json.loads((run / "summary.json").read_text())
        (run / "compare").mkdir()
        (run / "summary.json").write_text(json.dumps({**summary, "files": [*summary["files"], "compare"]}))
    manifest, _ = only_good(source)
    result = succeeded(pcnet3d("batch", manifest, "-o", tmp_path / "out"))
    assert (first / "compare").is_dir()
    assert "2 of them before" in result.stdout


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
    succeeded(apart("batch", manifest, "-o", out))
    assert status(out)["kept"] >= 1
    assert sorted(path.name for path in (out / "takes").iterdir()) == ["good_000", "good_001"]
    assert parquet.read_table(out / "study.parquet")["state"].to_pylist() == ["done", "done"]


def test_two_batches_do_not_share_a_folder(begun, pcnet3d, tmp_path):
    manifest, out = write_study(tmp_path / "in", 0, hanging=1), tmp_path / "out"
    first = begun("batch", manifest, "-o", out)
    wait_for((out / "batch.json").exists, first)
    refused(pcnet3d("batch", manifest, "-o", out), out, f"process {first.pid}", "wait for it")
    first.terminate()
    first.communicate()


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


def test_a_disk_that_cannot_be_written_is_said_at_once(finished, told, beside, tmp_path):
    manifest, out, _ = finished
    unshare = ["unshare", "--mount", "--map-root-user", "sh", "-c"]
    probe = f"mount --bind {out} {out} && mount -o remount,bind,ro {out}"
    if shutil.which("unshare") is None or subprocess.run([*unshare, probe], capture_output=True).returncode:
        pytest.skip("no file system can be mounted read-only here")
    before = told(out)
    program = "from pcnet3d.pipeline.cli import main; main()"
    command = f"{probe} && exec {sys.executable} -c '{program}' batch {manifest} -o {out}"
    with subprocess.Popen(
        [*unshare, command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=beside
    ) as process:
        err = process.stderr.read()
        process.wait()
    refused(subprocess.CompletedProcess(command, process.returncode, "", err), out)
    assert told(out) == before


def test_everybody_of_a_take_has_a_row(pcnet3d, tmp_path):
    write_pair(tmp_path / "pair.json")
    study = write_study(tmp_path, 1)
    study.write_text("name,poses,fps,person,recipe,subject\nboth,pair.json,30,all,quick.toml,s\n")
    succeeded(pcnet3d("batch", study, "-o", tmp_path / "out"))
    rows = parquet.read_table(tmp_path / "out" / "study.parquet").to_pylist()
    assert [(row["name"], row["subject"], row["person"], row["frames"]) for row in rows] == [
        ("both", "s", "0", 45), ("both", "s", "1", 45),
    ]  # fmt: skip
    kept = pcnet3d("batch", study, "-o", tmp_path / "out")
    assert "1 take done (1 of them before)" in kept.stdout


def test_a_subject_filmed_at_two_frame_rates_is_warned_of(pcnet3d, tmp_path):
    walk = walker(seconds=1.5)
    camera = side_camera(walk)
    write_keypoints(tmp_path / "walk.json", walk, camera, np.arange(len(walk)), 0.5, np.random.default_rng(0))
    recipe_of(tmp_path / "quick.toml", *_LIFTED)
    size = f"{camera.width}x{camera.height}"
    lines = [f"{rate},s,{rate},walk.json,{rate},{size},quick.toml" for rate in (30, 60)]
    (tmp_path / "manifest.csv").write_text(
        "\n".join(["name,subject,visit,keypoints,fps,image-size,recipe", *lines]) + "\n"
    )
    result = succeeded(pcnet3d("batch", tmp_path / "manifest.csv", "-o", tmp_path / "out"))
    assert "warning: The takes of 1 subject were lifted at 30 to 60 frames per second" in result.stderr
    assert "lifted at 30 to 60 frames per second" in (tmp_path / "out/study.html").read_text(encoding="utf-8")


def test_a_cluster_and_workers_at_once_are_refused(small, pcnet3d, tmp_path):
    refused(
        pcnet3d("batch", small, "-o", tmp_path / "o", "--dask", "tcp://x:1", "--workers", 2),
        "--workers",
        "--dask",
    )


def test_a_primary_outcome_that_no_take_has_is_refused_after_the_tables(pcnet3d, small, tmp_path):
    """Hours of takes are not lost by a slip of the pen."""
    out = tmp_path / "out"
    refused(pcnet3d("batch", small, "-o", out, "--primary", "walking.cadance"), "walking.cadance")
    assert (out / "study.html").exists()
    assert len(parquet.read_table(out / "study.parquet")) == 2
