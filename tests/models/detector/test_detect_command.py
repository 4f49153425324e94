"""`pcnet3d run VIDEO`: what it writes, Ctrl-C and --resume, networks by name, and what bad input gets."""

import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from commands import pcnet3d, refused, succeeded
from golden.films import pressing_ctrl_c
from pcnet3d.models.detector import video as detect_video
from pcnet3d.pipeline.files.detections import load_detections
from pcnet3d.stages.export.stage import Export


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
        ("--set detect.looks=0", "Expected 1 or 2 looks"),
        ("--fps 3000", "Expected a rate of 1 to 1000"),
    ],
)
def test_what_cannot_be_used_is_refused_before_the_video_is_looked_at(
    walk_film, toy, tmp_path, call, monkeypatch, given, said
):
    monkeypatch.setattr(detect_video, "images_ahead", lambda *_: pytest.fail("was detected before"))
    refused(call(walk_film.path, "--detector", toy, *given.split(), "-o", tmp_path / "out"), said)
    assert not list(tmp_path.glob("*out*"))


def test_interrupted_and_resumed(walk_film, toy, quick, whole, tmp_path, call, monkeypatch):
    words = (walk_film.path, "--detector", toy, "--recipe", quick)
    shown = detect_video.images_ahead
    monkeypatch.setattr(detect_video, "images_ahead", pressing_ctrl_c(shown, 25))
    stopped = call(*words, "-o", tmp_path / "part")
    assert stopped.returncode == 130
    assert "Interrupted at frame 26 of 40; --resume continues from there." in stopped.stderr
    summary = json.loads((tmp_path / "part/summary.json").read_text())
    assert {"frame": 26, "frames": 40} in [said["values"] for said in summary["notices"]]
    with np.load(tmp_path / "part/poses.npz") as poses:
        assert len(poses["source"]) == 26
    monkeypatch.setattr(detect_video, "images_ahead", shown)
    succeeded(call(*words, "-o", tmp_path / "part", "--resume"))
    _same(tmp_path / "part", whole)
    succeeded(call(*words, "-o", tmp_path / "part", "--resume"))  # nothing is left to detect


def test_interrupted_before_anybody_was_found(film, toys, toy, quick, tmp_path, monkeypatch):
    """Then there is nothing to keep."""
    from pcnet3d.pipeline.reading.settings import RunOptions
    from pcnet3d.pipeline.running.recipe import load_recipe
    from pcnet3d.pipeline.running.run import run_files

    video = film([toys.scene(None)] * 5)
    monkeypatch.setattr(detect_video, "images_ahead", pressing_ctrl_c(detect_video.images_ahead, 0))
    recipe = load_recipe(quick).with_options("detect", detector=str(toy))
    with pytest.raises(KeyboardInterrupt):
        run_files(RunOptions(video=video.path), tmp_path / "out", recipe)
    assert not (tmp_path / "out").exists()


def test_resume_with_another_video(whole, film, toys, toy, quick, tmp_path, call):
    words = ("--detector", toy, "--recipe", quick, "-o", tmp_path / "out")
    shutil.copytree(whole, tmp_path / "out")
    before = (tmp_path / "out/summary.json").read_bytes()
    other = film([toys.scene(box, seed=5) for box in toys.walking(40)], name="other.mp4")
    refused(call(other.path, *words, "--resume"), "leave --resume out to start again")
    assert (tmp_path / "out/summary.json").read_bytes() == before


def test_a_video_that_is_cut_off(walk_film, toy, tmp_path, call):
    path = tmp_path / "bad.mp4"
    path.write_bytes(walk_film.path.read_bytes()[: walk_film.path.stat().st_size // 2])
    refused(call(path, "--detector", toy, "-o", tmp_path / "out"), path.name)
    assert not (tmp_path / "out").exists()
    assert not [left for left in tmp_path.iterdir() if ".partial-" in left.name]


@pytest.mark.parametrize(
    ("detector", "more", "words"),
    [
        ("movenett", (), "no detector 'movenett'; did you mean movenet or movenet-thunder?"),
        (None, ("--resume",), "There is no interrupted run in"),
    ],
)
def test_neither_a_detector_nor_a_run_of_that_name(walk_film, toy, tmp_path, call, detector, more, words):
    refused(call(walk_film.path, "--detector", detector or toy, "-o", tmp_path / "out", *more), words)


def _same(a: Path, b: Path) -> None:
    with np.load(a / "poses.npz") as one, np.load(b / "poses.npz") as other:
        for name in one.files:
            np.testing.assert_array_equal(one[name], other[name])


def test_what_was_detected_survives_a_later_failure(
    walk_film, toy, quick, whole, tmp_path, call, monkeypatch
):
    def full(*_):
        raise OSError(28, "No space left on device")

    words = (walk_film.path, "--detector", toy, "--recipe", quick)
    with monkeypatch.context() as patched:
        patched.setattr(Export, "__call__", full)
        for said in ("--resume continues from there", "an interrupted run left its work"):
            refused(again := call(*words, "-o", tmp_path / "part"), said)
    assert "--resume continues from there" in again.stderr  # which began anew
    assert not (tmp_path / "part").exists()
    (tmp_path / "part" / "of somebody else").mkdir(parents=True)
    refused(stopped := call(*words, "-o", tmp_path / "part"), "pcnet3d did not make")
    assert "kept" not in stopped.stderr
    assert "left its work" not in stopped.stderr
    shutil.rmtree(tmp_path / "part")
    monkeypatch.setattr(detect_video.Search, "look", lambda *_: pytest.fail("was detected again"))
    succeeded(call(*words, "-o", tmp_path / "part", "--resume"))
    _same(tmp_path / "part", whole)
    assert not [left.name for left in tmp_path.iterdir() if left.name.startswith(".")]


def test_killed_and_resumed(walk_film, toy, quick, whole, tmp_path, call):
    words = [walk_film.path, "--detector", toy, "--recipe", quick]
    script = """
import os, signal
from pcnet3d.models.detector import video as detect_video
from pcnet3d.pipeline.cli import main
from pcnet3d.pipeline.running import progress
shown = detect_video.images_ahead
def killing(*asked):
    for number, picture in shown(*asked):
        if number == 25:
            os.kill(os.getpid(), signal.SIGKILL)
        yield number, picture
detect_video.images_ahead, progress._KEEP_S, progress._KEEP_RARELY = killing, 0.0, 0
main()
"""
    out = tmp_path / "part"
    end = subprocess.run([sys.executable, "-c", script, "run", *words, "-o", out], capture_output=True)
    assert end.returncode == -signal.SIGKILL, end.stderr
    assert load_detections(tmp_path / ".part.keypoints.npz").frames_seen == 25
    with np.load(tmp_path / ".part.keypoints.npz") as kept:  # a small image was in it, and in the result
        assert not [name for name in kept.files if kept[name].dtype == np.uint8]
    assert [left for left in tmp_path.iterdir() if ".part.partial-" in left.name]
    succeeded(call(*words, "-o", out, "--resume"))
    assert not [left.name for left in tmp_path.iterdir() if left.name.startswith(".")]
    _same(out, whole)
    with np.load(out / "keypoints.npz") as found:
        assert not [name for name in found.files if found[name].dtype == np.uint8]
