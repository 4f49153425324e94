"""Frame rates: refused where no camera has them, told where the file or the movement contradicts them."""

from pathlib import Path

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, LEVEL, InputError, PoseSequence, Video
from pcnet3d.pipeline.core.notices import Notice
from pcnet3d.pipeline.signals.rates import check_fps, pace_doubts, rate_doubts, timed


@pytest.mark.parametrize("fps", [0, -30, 0.5, 3000, float("nan"), float("inf")])
def test_rates_of_no_camera(fps):
    with pytest.raises(InputError, match="1 to 1000 a second"):
        check_fps(fps)


def video(fps: float, captured: float | None = None) -> Video:
    return Video(Path("clip.mp4"), 64, 48, np.arange(30) / fps, "h264", capture_fps=captured)


@pytest.mark.parametrize(
    ("given", "shown", "captured", "said"),
    [
        (None, 30, None, None),
        (30, 29.97, None, None),
        (60, 30, None, {"used_fps": 60, "source": "video", "shown_fps": 30, "times": 2}),
        (None, 30, 240, {"captured_fps": 240, "shown_fps": 30, "used_fps": 30, "times": 8}),
        (240, 30, 240, None),
        (60, 30, 240, {"used_fps": 60, "captured_fps": 240}),
        (None, 240, 240, None),
    ],
)
def test_what_the_video_says(given, shown, captured, said):
    doubts = rate_doubts(given, video(shown, captured))
    assert len(doubts) == (said is not None)
    if said:
        assert doubts[0].code == ("slow-motion-stated" if captured else "fps-contradicts")
        assert {key: doubts[0].values[key] for key in said} == pytest.approx(said)


def test_a_clock_of_the_file_that_is_contradicted_is_told():
    poses = PoseSequence(np.zeros((9, 17, 3)), H36M17, LEVEL, time_s=np.arange(9) / 30)
    (said,) = timed(poses, 60).notices
    assert (said.code, said.values["source"], said.values["shown_fps"]) == ("fps-contradicts", "file", 30)
    assert not timed(poses, 30).notices


def walking(times_as_fast: float) -> PoseSequence:
    walk = walker(seconds=8.0)
    joints = walk.world - walk.root[:, None]
    return PoseSequence(joints, H36M17, LEVEL, time_s=walk.time_s / times_as_fast)


@pytest.mark.parametrize("unit", [1.0, 700.0])
def test_slow_motion_and_time_lapse_are_noticed_by_the_movement(unit):
    def doubts(times_as_fast: float) -> list[Notice]:
        poses = walking(times_as_fast)
        return pace_doubts(poses.with_(joints=poses.joints * unit))

    assert not doubts(1)
    assert not doubts(0.6)
    assert not doubts(1.3)
    for slow in (1 / 4, 1 / 8, 1 / 16):
        assert doubts(slow)[0].code in ("moves-slowly", "gait-against-rate")
        assert "--fps" in doubts(slow)[0].text
    for fast in (4, 8, 100):
        assert doubts(fast)[0].code in ("moves-fast", "gait-against-rate")


@pytest.mark.parametrize(("told", "way"), [(2.0, "quickly"), (0.4, "slowly")])
def test_a_walk_at_twice_or_two_fifths_of_its_rate_is_told_with_the_rate_that_fits(told, way):
    (said,) = pace_doubts(walking(told))
    assert said.code == "gait-against-rate"
    assert said.values["way"] == way
    assert said.values["fits"] == pytest.approx(30, rel=0.35)


def test_who_glides_is_not_in_slow_motion():
    """A skater's legs pass each other 34 times a minute; her arms are as fast as anybody's."""
    poses = walking(1 / 3)
    joints, ankles = poses.joints.copy(), H36M17.indices(("r_ankle", "l_ankle"))
    middle = joints[:, ankles].mean(axis=1, keepdims=True)
    shorter = np.interp(poses.times, [0, 6], [1, 0.4])[:, None, None]  # no even steps
    joints[:, ankles] = middle + shorter * (joints[:, ankles] - middle)
    slow = poses.with_(joints=joints.copy())
    assert [each.code for each in pace_doubts(slow)] == ["moves-slowly"]
    joints[:, H36M17.index("r_wrist"), 2] += 0.4 * np.sin(6 * poses.times)
    assert pace_doubts(poses.with_(joints=joints)) == []


def test_who_hardly_moves_is_not_in_slow_motion(facing_camera):
    sway = 0.01 * np.sin(np.arange(300) / 40)[:, None, None]
    poses = PoseSequence(facing_camera * (1 + sway), H36M17, LEVEL, time_s=np.arange(300) / 30)
    assert pace_doubts(poses) == []


def test_gaps_and_lost_joints_are_borne():
    poses = walking(1 / 8)
    joints = poses.joints.copy()
    joints[20:40] = np.nan
    joints[:, H36M17.index("l_wrist")] = np.nan
    assert len(pace_doubts(poses.with_(joints=joints))) == 1
    assert pace_doubts(poses.with_(joints=np.full_like(joints, np.nan))) == []


def test_ankles_that_a_detector_exchanges_in_one_row_are_no_fault():
    """Both changes of sides were nearest to each other in the same row."""
    walk = walker(seconds=6.0, fps=10.0)
    ankles = H36M17.indices(("r_ankle", "l_ankle"))
    for row in range(len(walk)):
        joints = walk.world - walk.root[:, None]
        middle = joints[row, ankles].mean(axis=0)
        joints[row, ankles] = middle - 0.6 * (joints[row, ankles] - middle)
        pace_doubts(PoseSequence(joints, H36M17, LEVEL, time_s=walk.time_s))
