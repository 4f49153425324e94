"""Bounds at the door: times, rates and sizes that no recording of a person has."""

from pathlib import Path

import numpy as np
import pytest

from golden.bodies import Person
from pcnet3d.adapters import read
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, PoseSequence, Told
from pcnet3d.pipeline.inspect.inspect import inspect
from pcnet3d.pipeline.reading.bounds import check_size, check_times, image_size_doubts
from pcnet3d.pipeline.reading.load import Source
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import Files, open_take
from refusals import refused


@pytest.mark.parametrize(
    "time_s",
    [np.arange(30) / 30, np.arange(30) / 1000, np.arange(30.0), np.zeros(1), 1e5 + np.arange(9) / 30],
)
def test_times_of_recordings_pass(time_s):
    check_times(time_s, "a file")


@pytest.mark.parametrize(
    "time_s",
    [np.arange(9) * 33.3, np.arange(9) * 1e-300, np.arange(9) / 1500, 1e15 + np.arange(9), np.r_[0, 1e300]],
)
def test_other_times_are_refused(time_s):
    with refused("times-broken"):
        check_times(time_s, "a file")


@pytest.mark.parametrize(
    ("scale", "passes"), [(1, True), (1e-3, True), (1e4, True), (1e-42, False), (1e20, False)]
)
def test_sizes(scale, passes):
    poses = PoseSequence(scale * Person().turning(30), H36M17, CAMERA)
    if passes:
        check_size(poses, "a file")
        return
    with refused("wrong-axes"):
        check_size(poses, "a file")


def test_a_size_that_many_keypoints_exceed_is_doubted_not_the_keypoints():
    """Feet of a boxer were "not in the image", which was told to be 640 x 360 and was 854 x 480."""
    rng = np.random.default_rng(0)
    points = rng.uniform((200, 70), (600, 470), (30, 17, 2))
    seen = np.full((30, 17), 0.9)
    keypoints = PoseSequence(points, H36M17, IMAGE, seen)
    (doubt,) = image_size_doubts(keypoints, (640, 360))
    assert doubt.code == "image-size-doubtful"
    hardly = keypoints.with_(confidence=np.full((30, 17), 0.1))
    for rows, size in ((keypoints, (854, 480)), (keypoints, None), (hardly, (640, 360))):
        assert image_size_doubts(rows, size) == []
    files = Files(
        None, Source(Path("a"), "", (keypoints,), "a"), None, Told(fps=30, image_size=(640, 360)), None
    )
    assert files.joined(None, keypoints)[2] == [doubt]


def test_a_size_that_most_keypoints_exceed_is_refused_with_the_smallest_that_fits():
    """Every pose was thrown away as out of the image: 320 x 240 was told, which was 854 x 480."""
    points = np.random.default_rng(0).uniform((200, 70), (599.5, 469.5), (30, 17, 2))
    points[0, 0] = 599.5, 469.5
    keypoints = PoseSequence(points, H36M17, IMAGE, np.full((30, 17), 0.9))
    with refused("bad-value", "320x240", "600x470"):
        image_size_doubts(keypoints, (320, 240))
    image_size_doubts(keypoints, (600, 470))


TOLD = {"layout": "H36M17", "frame": "CAMERA", "unit": "m"}


def test_run_read_and_inspect_agree(tmp_path):
    path, joints = tmp_path / "a.npz", Person().turning(30)
    np.savez(path, joints=joints, time_s=np.arange(30) * 33.3)
    with refused("times-broken"):
        read(path, "arrays", **TOLD)
    with refused("times-broken"):
        open_take(RunOptions(poses=path, adapter="arrays", options=TOLD))
    assert inspect(path, "arrays", TOLD).verdict == "unusable"
    assert open_take(RunOptions(poses=path, adapter="arrays", options=TOLD, fps=30)).poses is not None
    np.savez(path, joints=1e-42 * joints, time_s=np.arange(30) / 30)
    with refused("wrong-axes"):
        open_take(RunOptions(poses=path, adapter="arrays", options=TOLD))
    assert inspect(path, "arrays", TOLD).verdict == "unusable"
