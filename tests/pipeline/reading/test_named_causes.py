"""Mistakes that users make with files, and whether the sentence they get names them."""

import json
import os

import numpy as np
import pytest

from golden.detections import drawn_tracks
from golden.films import film
from pcnet3d.adapters import read
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.reading.load import find_adapter
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.pipeline.signals.checks import upside_down
from refusals import refused


@pytest.fixture
def bodies(facing_camera):
    """(60, 17, 3) metres, pelvis at the origin, as many lifters write them."""
    noise = np.random.default_rng(0).normal(0, 0.003, (60, 17, 3))
    noise[:, 0] = 0
    return (facing_camera + noise).astype(np.float32)


def test_millimetres(save, bodies):
    """About the pelvis they may be pixels; a body that is metres in front of the camera in them is read."""
    path = save(1000 * bodies)
    with refused("format-unknown", "--adapter arrays", "unit=mm"):
        read(path)
    with refused("wrong-axes", "unit=mm"):
        read(path, "motionbert")
    mended = read(path, "arrays", layout="H36M17", frame="CAMERA", unit="mm")
    np.testing.assert_allclose(mended.joints, bodies, atol=1e-3)
    placed = read(save(1000 * bodies + np.float32([0, 0, 4000])))
    np.testing.assert_allclose(placed.joints, bodies, atol=1e-3)


def test_nothing_but_nan(save, bodies):
    with refused("nothing-usable"):
        read(save(np.full_like(bodies, np.nan)))


def test_y_up(save, bodies):
    path = save(bodies * np.float32([1, -1, -1]))
    options = RunOptions(poses=path, adapter="motionbert", fps=30)
    for reading in (lambda: read(path, "motionbert"), lambda: open_take(options)):
        with refused("wrong-axes", "frame=GL_CAMERA", "unit=arbitrary if it has no scale", "read.check=off"):
            reading()
    (said,) = upside_down(read(path, "motionbert", check="off"))
    assert said.code == "upside-down"
    assert said in open_take(options.with_(check="off")).said
    assert upside_down(read(path, "arrays", layout="H36M17", frame="GL_CAMERA", unit="m")) == []


def test_a_lift_that_is_upside_down_has_its_cause_in_the_picture(save, bodies):
    """A lifter's axes are its own, and there is no file of poses to be read in another way."""
    poses = read(save(bodies * np.float32([1, -1, -1])), "motionbert", check="off")
    poses = poses.with_(made_by=MadeBy("estimated", in_run=True))
    (said,) = upside_down(poses)
    assert "turn the image" in said.values["what"]


def test_who_lies_or_bends_is_not_upside_down(save, bodies):
    poses = read(save(bodies), "motionbert")
    lying = poses.joints[..., [1, 0, 2]]  # head to the side
    assert upside_down(poses.with_(joints=lying)) == []
    bent = poses.joints.copy()
    bent[:, H36M17.index("head")] = bent[:, H36M17.index("l_ankle")]
    assert upside_down(poses.with_(joints=bent)) == []


def test_exchanged_arguments(save, bodies, tmp_path):
    keypoints = drawn_tracks(tmp_path / "ap.json", {1: range(60)})
    poses, clip = (
        save(bodies + np.float32([0.1, 0, 0])),
        tmp_path / "clip.mp4",
    )  # as MotionBERT: depth 0 at first
    film(clip, range(0, 330, 33))
    for sources, said in (
        (
            RunOptions(poses=keypoints),
            "Expected 3D poses in .* got 2D keypoints .json2d.; give them with --keypoints",
        ),
        (
            RunOptions(poses=keypoints, adapter="motionbert"),
            "got 2D keypoints .json2d.; give them with --keypoints",
        ),
        (RunOptions(poses=clip), "got a video .video.; give it by itself"),
        (RunOptions(keypoints=clip), "got a video .video.; give it by itself"),
        (
            RunOptions(keypoints=poses),
            "Expected 2D keypoints in .* got 3D poses .motionbert.; give them with --poses",
        ),
        (RunOptions(video=poses), "Expected a video in .* got 3D poses .motionbert.; give them with --poses"),
        (RunOptions(video=keypoints), "Expected a video in .* got 2D keypoints"),
    ):
        with pytest.raises(InputError, match=said):
            open_take(sources)


@pytest.mark.parametrize("name", ["", "poses.npz"])
@pytest.mark.parametrize("gives", ["poses", "keypoints", None])
def test_results_of_a_run_are_told_from_files_of_others(tmp_path, name, gives):
    """Each was answered by the names of all adapters."""
    np.savez(tmp_path / "poses.npz", source=np.zeros((5, 17, 3)), level=np.zeros((5, 17, 3)))
    for empty in ("keypoints.npz", "take.rrd", "own.npz"):
        (tmp_path / empty).touch()
    files = ["keypoints.npz", "poses.npz", "take.rrd"]
    (tmp_path / "summary.json").write_text(json.dumps({"pcnet3d": "1.0.0", "files": files}))
    with refused("format-unknown", tmp_path / "keypoints.npz", f"pcnet3d view {tmp_path}"):
        find_adapter(tmp_path / name, gives=gives)
    with refused("format-unknown", f"--keypoints {tmp_path / 'keypoints.npz'}"):
        open_take(RunOptions(video=tmp_path / name))  # a folder was called no video file, and no more
    for other in ("keypoints.npz", "own.npz"):  # damaged, and put there by the user
        with refused("file-damaged", "is empty"):
            find_adapter(tmp_path / other, gives=gives)


def test_a_file_of_many_takes_is_not_read_as_one(tmp_path):
    """That of `lab data` was read as one person of AMASS, who leaps where a take ends."""
    np.savez(tmp_path / "takes.npz", joints=np.zeros((5, 17, 3), np.float32), clip_start=[0, 2, 5], fps=30.0)
    with refused("format-unknown", "'clip_start'"):
        find_adapter(tmp_path / "takes.npz")


def test_devices_and_pipes_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with refused("cannot-open"):
        find_adapter(tmp_path / "pipe")
