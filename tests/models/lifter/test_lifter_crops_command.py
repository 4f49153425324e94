"""`pcnet3d run --lifter rtmw3d|instanthmr`: what a run says about them, where their files are, and how it goes on."""

import json
from html import unescape
from pathlib import Path

import numpy as np
import pytest

from commands import pcnet3d, recipe_of, refused, succeeded
from golden.films import noting, pressing_ctrl_c
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_files
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lifter import images
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.layouts import COCO23, MHR70
from pcnet3d.pipeline.plugins.registry import listed


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    walk = walker(seconds=1)
    return write_files(tmp_path_factory.mktemp("walk"), walk, side_camera(walk))


@pytest.fixture
def make(facing_camera, rtmw3d, instanthmr):
    """make(kind, **changes) -> file of a network that always sees someone who faces the camera, 4 m away."""
    own = dict(zip(H36M17.joints, facing_camera, strict=True))
    near = {"eye": "nose", "ear": "head", "toe": "ankle", "heel": "ankle"}

    def point(name):
        side, _, part = name.partition("_")
        part = part.split("_")[-1]
        if name in own:
            return own[name]
        stand_in = near.get(part, "thorax")
        return own.get(f"{side}_{stand_in}", own.get(stand_in))

    def build(kind, **changes):
        if kind == "rtmw3d":
            joints = np.array([point(name) for name in COCO23.joints])
            return rtmw3d(joints * [1 / 1.5, 1 / 2, 1] + [0.5, 0.45, 0], **changes)
        return instanthmr(np.array([point(name) for name in MHR70.joints]), (0, 0, 4.0), **changes)

    return build


@pytest.fixture
def quick(tmp_path):
    """A recipe without recording and report."""
    stages = ("lift", "clean", "scale", "rectify", "trajectories", "export")
    return recipe_of(tmp_path / "quick.toml", *stages)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """The folder that networks with a name lie in."""
    monkeypatch.setattr("pooch.os_cache", lambda name: tmp_path / "cache" / name)
    (tmp_path / "cache/pcnet3d").mkdir(parents=True)
    return tmp_path / "cache/pcnet3d"


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    ("kind", "licence"), [("rtmw3d", "Apache-2.0"), ("instanthmr", "SAM License (Meta)")]
)
def test_a_run_names_network_licence_and_device(files, make, tmp_path, kind, licence):
    out = tmp_path / "out"
    words = ("run", files.video, "--keypoints", files.keypoints, "--lifter", make(kind), "--focal", 640)
    succeeded(pcnet3d(*words, "--device", "cpu", "-o", out))
    summary = json.loads((out / "summary.json").read_text())
    (step,) = (step for step in summary["history"] if step["name"] == "lift")
    assert step["options"]["kind"] == kind
    assert step["options"]["model"].startswith(f"{kind}.onnx@")
    assert step["options"]["licence"].startswith(licence)
    assert summary["device"]["networks"][f"{kind}.onnx"] == "cpu"
    report = unescape((out / "report.html").read_text())
    assert step["options"]["model"] in report
    assert f"published under {licence}" in report
    with np.load(out / "poses.npz") as poses:
        assert np.isfinite(poses["level"]).all()
        assert (str(poses["unit"]) == "m") == (kind == "instanthmr")
        assert np.isfinite(poses["root"]).all() or kind == "rtmw3d"  # that body fits no walker
    assert ("own_camera" in step["options"]) == (kind == "instanthmr")
    assert not (tmp_path / ".out.lift.npz").exists()


def test_instanthmr_is_never_downloaded(files, make, quick, cache, tmp_path):
    words = ("run", files.video, "--keypoints", files.keypoints, "--recipe", quick, "--lifter", "instanthmr")
    told = ("never downloaded", "SAM License", "momolesang/InstantHMR", cache / "instanthmr.onnx")
    refused(pcnet3d(*words, "-o", tmp_path / "out"), *told)
    assert not (tmp_path / "out").exists()
    assert "not there" in _line("instanthmr")

    (cache / "instanthmr.onnx").write_bytes(Path(make("instanthmr")).read_bytes())
    assert "; there:" in _line("instanthmr")
    assert "lifted by instanthmr.onnx@" in succeeded(pcnet3d(*words, "-o", tmp_path / "out")).stderr

    (cache / "instanthmr.onnx").write_bytes(Path(make("rtmw3d")).read_bytes())
    refused(pcnet3d(*words, "-o", tmp_path / "other"), "is not the network instanthmr")


def test_the_list_says_what_was_downloaded(make, cache):
    assert "downloaded when first used" in _line("rtmw3d")
    (cache / "rtmw3d.onnx").write_bytes(Path(make("rtmw3d")).read_bytes())
    assert "downloaded)" in _line("rtmw3d")


def _line(name: str) -> str:
    (row,) = (row for row in listed("models") if row["name"] == name)
    assert row["is"] == "lifter"
    return row["what"]


@pytest.mark.parametrize("changes", [{"left_out": "joints_3d"}, {"left_out": "cam_trans"}])
def test_a_network_of_other_shapes_is_one_sentence(files, make, tmp_path, changes):
    lifter = make("instanthmr", **changes)
    words = ("run", files.video, "--keypoints", files.keypoints, "--lifter", lifter, "-o", tmp_path / "out")
    refused(pcnet3d(*words))
    assert not (tmp_path / "out").exists()


def test_a_network_that_fails_half_way_leaves_no_results(files, make, quick, tmp_path):
    """The walker goes to the right, beyond what it can do."""
    words = ("run", files.video, "--keypoints", files.keypoints, "--recipe", quick, "-o", tmp_path / "out")
    kept = "finished work is kept; put right what is named below, and the command with --resume continues"
    result = pcnet3d(*words, "--lifter", make("instanthmr", fails_from=0.0))
    refused(result, "instanthmr.onnx@", "failed at video frame", kept)
    assert not (tmp_path / "out").exists()
    with np.load(tmp_path / ".out.lift.npz") as kept:
        assert kept["looked"] == 7


def test_interrupted_and_resumed(files, make, quick, tmp_path, monkeypatch):
    lifter = make("instanthmr")
    words = ("run", files.video, "--keypoints", files.keypoints, "--recipe", quick, "--lifter", lifter)
    succeeded(pcnet3d(*words, "-o", tmp_path / "whole"))
    given, asked = images.images_ahead, []
    monkeypatch.setattr(images, "images_ahead", pressing_ctrl_c(given, 11))
    stopped = pcnet3d(*words, "-o", tmp_path / "part")
    assert stopped.returncode == 130
    assert "finished work is kept" in stopped.stderr
    assert not (tmp_path / "part").exists()
    monkeypatch.setattr(images, "images_ahead", noting(given, asked))
    succeeded(pcnet3d(*words, "-o", tmp_path / "part", "--resume"))
    assert asked[0] == 12
    with np.load(tmp_path / "part/poses.npz") as a, np.load(tmp_path / "whole/poses.npz") as b:
        for name in b.files:
            np.testing.assert_array_equal(a[name], b[name])
    assert not [left.name for left in tmp_path.iterdir() if left.name.startswith(".")]
    refused(pcnet3d(*words, "-o", tmp_path / "part", "--resume"), "There is no interrupted run in")


@pytest.mark.data
@pytest.mark.parametrize("kind", ["rtmw3d", "instanthmr"])
def test_from_a_real_video_alone(data, make, tmp_path, kind):
    """Detection, crops and recording; the toy's body is always the same, but where it is looked at is not."""
    out = tmp_path / "out"
    detector = data / "models/movenet_lightning_int8.onnx"
    words = ("run", data / "video/walk_crop.mp4", "--detector", detector, "--lifter", make(kind))
    succeeded(pcnet3d(*words, "--time-range", "0:1", "-o", out))
    summary = json.loads((out / "summary.json").read_text())
    assert {"take.rrd", "report.html", "keypoints.npz"} <= set(summary["files"])
    assert kind in [said["values"].get("kind") for said in summary["notices"]]
