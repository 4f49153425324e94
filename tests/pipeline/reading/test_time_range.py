"""A part of a take: chosen by the seconds of its clock, which stay what they were."""

import numpy as np
import pytest

from golden.detections import drawn_tracks
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.files import write_video
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.pose import RootPath
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_people, open_take


@pytest.fixture(scope="module")
def poses(tmp_path_factory):
    """3 s of the walker at 30 frames a second, from the second 0 on."""
    path = tmp_path_factory.mktemp("part") / "poses.npy"
    walk = walker(seconds=3)
    np.save(path, camera_poses(walk, side_camera(walk)).joints[:90])
    return path


@pytest.fixture
def opened(poses):
    def call(**more):
        return open_take(RunOptions(poses=poses, adapter="videopose3d", fps=30, **more))

    return call


@pytest.mark.parametrize(
    ("told", "first", "last"), [("1:2", 30, 60), ("2:", 60, 89), (":0.5", 0, 15), ("0:99", 0, 89)]
)
def test_the_part_has_the_whole_takes_numbers_and_times(opened, told, first, last):
    whole, part = opened(), opened(time_range=told)
    assert part.poses.frame_index.tolist() == list(range(first, last + 1))
    np.testing.assert_array_equal(part.poses.times, whole.poses.times[first : last + 1])
    np.testing.assert_array_equal(part.poses.joints, whole.poses.joints[first : last + 1])
    assert any("as asked" in event.text for event in part.notices if event.weight == "note")
    assert part.poses.history[-1].name == "time range"


@pytest.mark.parametrize("told", ["3:1", "2:2", "5", "a:b", "nan:2", "inf:", ":-1"])
def test_what_is_no_range(opened, told):
    with pytest.raises(InputError, match="--time-range"):
        opened(time_range=told)


@pytest.mark.parametrize("told", ["3:4", "1.001:1.002"])
def test_where_nothing_was_recorded(opened, told):
    with pytest.raises(InputError, match=r"the take lasts from 0\.00 to 2\.97 s"):
        opened(time_range=told)


def test_rows_carry_all_that_belongs_to_them(opened):
    whole = opened().poses
    root = np.arange(270.0).reshape(90, 3)
    part = whole.with_(path=RootPath(root), seams=(20, 35, 60)).rows(30, 60)
    np.testing.assert_array_equal(part.root, root[30:60])
    assert part.seams == (5,)
    assert len(part) == 30


def test_data_that_end_before_the_part_does_are_told(poses, tmp_path):
    """The part's end once counted from the video's beginning, so that most of a late part could lack unsaid."""
    walk = walker(seconds=3)
    write_video(tmp_path / "walk.mp4", walk, side_camera(walk))
    np.save(tmp_path / "poses.npy", np.load(poses)[:87])
    told = {"poses": tmp_path / "poses.npy", "adapter": "videopose3d", "video": tmp_path / "walk.mp4"}
    for part, notes in (
        (None, []),
        ("2:", ["The data cover video frames 60 to 86; the whole recording has 90 frames."]),
        ("2:2.8", []),
    ):
        take = open_take(RunOptions(**told, first_frame=0, time_range=part))
        assert [event.text for event in take.notices if "cover" in event.text] == notes
        for said in (event.text for event in take.notices if event.text.startswith("Only")):
            assert "2.97 s" in said  # the video's last frame, not that of the data


def test_who_is_not_in_the_part_is_left_out(tmp_path):
    path = drawn_tracks(tmp_path / "ap.json", {1: range(60), 2: range(20)})
    stays, leaves = open_people(RunOptions(keypoints=path, fps=30, time_range="1:1.5"))
    assert stays.take.keypoints.frame_index.tolist() == list(range(30, 46))
    assert isinstance(leaves.refusal, InputError)
