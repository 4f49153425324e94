"""`pcnet3d run VIDEO`: what it writes, Ctrl-C, networks by name, and what bad input gets."""

import json
import resource
import shutil
import subprocess
import sys

import numpy as np
import pytest

from commands import pcnet3d, refused, succeeded
from golden.films import pressing_ctrl_c
from pcnet3d.models.detector import video as detect_video
from pcnet3d.pipeline.files.detections import load_detections


@pytest.fixture(scope="module")
def whole(walk_film, toy, quick, tmp_path_factory):
    """The folder of a quick run that nothing interrupted."""
    folder = tmp_path_factory.mktemp("whole") / "out"
    succeeded(pcnet3d("run", walk_film.path, "--detector", toy, "--recipe", quick, "-o", folder))
    return folder


def test_a_video_alone_gives_everything(walk_film, toy, tmp_path, call):
    said = succeeded(call(walk_film.path, "--detector", toy, "-o", tmp_path / "out"))
    assert (
        len((said.stdout + said.stderr).split()) <= 120
    )  # it was 430 words, and the result the last of them
    summary = json.loads((tmp_path / "out/summary.json").read_text())
    assert {"keypoints.npz", "poses.npz", "take.rrd", "report.html"} <= set(summary["files"])
    assert [entry["role"] for entry in summary["inputs"]] == ["video"]
    made_by = summary["keypoints"]["made_by"]
    assert (made_by["kind"], made_by["by"].partition("@")[0]) == ("estimated", "movenet")
    assert "others-missed" in [said["code"] for said in summary["notices"]]
    with np.load(tmp_path / "out/poses.npz") as poses:
        np.testing.assert_array_equal(poses["frame_index"], np.arange(40))


def test_a_part_of_a_video_keeps_its_clock(walk_film, toy, quick, tmp_path, call):
    part = ["--detector", toy, "--recipe", quick, "--time-range", "0.3:1"]
    succeeded(call(walk_film.path, *part, "-o", tmp_path / "out"))
    with np.load(tmp_path / "out/poses.npz") as poses:
        np.testing.assert_array_equal(poses["frame_index"], np.arange(9, 31))
        np.testing.assert_allclose(poses["time_s"], np.arange(9, 31) / 30, atol=1e-3)
    keypoints = load_detections(tmp_path / "out/keypoints.npz")
    np.testing.assert_array_equal(keypoints.frame_index, np.arange(9, 31))


def test_its_keypoints_can_be_given_again(walk_film, whole, quick, tmp_path, call):
    recipe = tmp_path / "rest.toml"
    recipe.write_text(quick.read_text().replace('[[stages]]\nuse = "detect"\n', ""))
    given = (walk_film.path, "--keypoints", whole / "keypoints.npz")
    succeeded(call(*given, "--recipe", recipe, "-o", tmp_path / "out"))
    with np.load(whole / "poses.npz") as a, np.load(tmp_path / "out/poses.npz") as b:
        np.testing.assert_array_equal(a["source"], b["source"])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("--stature 175", "--stature"),
        ("--focal -5", "--focal"),
        ("--set rectify.rectifier=foo", "no rectifier 'foo'"),
        ("--set calibrate.camera_file=foo.toml", "foo.toml"),
        ("--set trajectories.cutoff_hz=20", "got 20 Hz"),
        ("--set detect.looks=0", "Expected 1 to 4 looks"),
        ("--fps 3000", "Expected a rate of 1 to 1000"),
    ],
)
def test_what_cannot_be_used_is_refused_before_the_video_is_looked_at(
    walk_film, toy, tmp_path, call, monkeypatch, given, said
):
    monkeypatch.setattr(detect_video, "images_ahead", lambda *_: pytest.fail("was detected before"))
    refused(call(walk_film.path, "--detector", toy, *given.split(), "-o", tmp_path / "out"), said)
    assert not list(tmp_path.glob("*out*"))


def test_interrupted_nothing_is_written(walk_film, toy, quick, tmp_path, call, monkeypatch):
    monkeypatch.setattr(detect_video, "images_ahead", pressing_ctrl_c(detect_video.images_ahead, 25))
    stopped = call(walk_film.path, "--detector", toy, "--recipe", quick, "-o", tmp_path / "out")
    assert stopped.returncode == 130
    assert not any(tmp_path.glob("*out*"))


@pytest.mark.parametrize(
    ("kind", "words"), [("nobody", "Nobody was found in any of the 5 frames"), ("truncated", "bad.mp4")]
)
def test_bad_videos(walk_film, film, toys, toy, tmp_path, call, kind, words):
    path = tmp_path / "bad.mp4"
    if kind == "nobody":
        film([toys.scene(None)] * 5, name="bad.mp4")
    else:
        path.write_bytes(walk_film.path.read_bytes()[: walk_film.path.stat().st_size // 2])
    refused(call(path, "--detector", toy, "-o", tmp_path / "out"), words)
    assert not (tmp_path / "out").exists()
    assert not [left for left in tmp_path.iterdir() if ".partial-" in left.name]


def test_a_detector_that_there_is_not(walk_film, tmp_path, call):
    said = "no detector 'movenett'; did you mean movenet or movenet-thunder?"
    refused(call(walk_film.path, "--detector", "movenett", "-o", tmp_path / "out"), said)


@pytest.mark.parametrize("limit", [1_000, 28_000])
def test_a_full_disk(walk_film, toy, quick, tmp_path, limit):
    """No file may grow beyond a limit: first the keypoints cannot be written, then the poses."""
    command = ["-c", "from pcnet3d.pipeline.cli import main; main()", "run", walk_film.path]
    done = subprocess.run(
        [sys.executable, *command, "--detector", toy, "--recipe", quick, "-o", tmp_path / "out"],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
    assert not [left for left in tmp_path.iterdir() if ".partial-" in left.name]


def test_room_is_asked_for_before_the_detection(walk_film, toy, tmp_path, call, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 10**9, 1000))
    monkeypatch.setattr(detect_video, "images_ahead", lambda *_: pytest.fail("was detected before"))
    refused(call(walk_film.path, "--detector", toy, "-o", tmp_path / "out"), "The run needs about 4 MB")
    assert not (tmp_path / "out").exists()
