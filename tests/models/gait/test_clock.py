"""A clock is doubted where a body falls, or legs swing, as none does; and never where nothing of that is seen."""

import numpy as np
import pytest

from golden.jumps import jumping
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.gait.clock import clock_doubts
from pcnet3d.pipeline import H36M17, LEVEL, PoseSequence
from pcnet3d.pipeline.core.pose import RootPath


@pytest.mark.parametrize("slowed", [1, 4, 8])
def test_a_fall_tells_how_slow_the_clock_is(slowed):
    found = clock_doubts(jumping(slowed))
    assert len(found) == (slowed > 1)
    if found:
        assert found[0].values["way"] == "slowly"
        assert found[0].values["fits"] == pytest.approx(30 * slowed, rel=0.05)


def test_an_estimated_path_is_no_evidence():
    poses = jumping(8)
    assert clock_doubts(poses.with_(path=RootPath(poses.root, np.tile(np.eye(3), (len(poses), 1, 1))))) == []


def test_a_time_lapse_falls_too_fast():
    poses = jumping(1, fps=60)
    (found,) = clock_doubts(poses.with_(time_s=np.arange(len(poses)) / 240))
    assert found.values["way"] == "quickly"
    assert found.values["fits"] == pytest.approx(60, rel=0.05)


def walking(times_as_fast: float) -> PoseSequence:
    walk = walker(seconds=8.0)
    joints = walk.world - walk.root[:, None]
    return PoseSequence(joints, H36M17, LEVEL, time_s=walk.time_s / times_as_fast)


@pytest.mark.parametrize("unit", [1.0, 700.0])
def test_slow_motion_and_time_lapse_are_told_by_the_legs(unit):
    def found(times_as_fast: float) -> list:
        poses = walking(times_as_fast)
        return clock_doubts(poses.with_(joints=poses.joints * unit))

    for sound in (0.7, 1.0, 1.3):
        assert not found(sound)
    for times in (1 / 16, 1 / 8, 1 / 4, 0.4, 0.6, 2, 4, 8, 100):
        (said,) = found(times)
        assert said.values["way"] == ("quickly" if times > 1 else "slowly")
        assert said.values["fits"] == pytest.approx(30, rel=0.35)


def test_legs_that_tremble_from_row_to_row_do_not_walk():
    """Of two seconds: "the legs of a walk or run swing for 0.03 s, 13 times too quickly"."""
    poses = walking(1.0)
    for seed in range(30):
        trembling = poses.joints[:45].copy()
        noise = np.random.default_rng(seed).normal(0, 0.3, (45, 2, 3))
        trembling[:, H36M17.indices(("l_ankle", "r_ankle"))] += noise
        assert clock_doubts(PoseSequence(trembling, H36M17, LEVEL, time_s=poses.time_s[:45])) == []


def test_who_hardly_moves_is_not_in_slow_motion(facing_camera):
    sway = 0.01 * np.sin(np.arange(300) / 40)[:, None, None]
    poses = PoseSequence(facing_camera * (1 + sway), H36M17, LEVEL, time_s=np.arange(300) / 30)
    assert clock_doubts(poses) == []


def test_gaps_and_lost_joints_are_borne():
    poses = walking(1 / 8)
    joints = poses.joints.copy()
    joints[20:30] = np.nan
    joints[:, H36M17.index("l_wrist")] = np.nan
    assert len(clock_doubts(poses.with_(joints=joints))) == 1
    assert clock_doubts(poses.with_(joints=np.full_like(joints, np.nan))) == []


def test_ankles_that_a_detector_exchanges_in_one_row_are_no_fault():
    """Both changes of sides were nearest to each other in the same row."""
    walk = walker(seconds=6.0, fps=10.0)
    ankles = H36M17.indices(("r_ankle", "l_ankle"))
    for row in range(len(walk)):
        joints = walk.world - walk.root[:, None]
        middle = joints[row, ankles].mean(axis=0)
        joints[row, ankles] = middle - 0.6 * (joints[row, ankles] - middle)
        poses = PoseSequence(joints, H36M17, LEVEL, time_s=walk.time_s)
        clock_doubts(poses)


def test_who_walks_backwards_is_no_fault_of_the_clock():
    poses = walking(1.0)
    assert clock_doubts(poses.with_(joints=poses.joints[::-1])) == []
