"""People in the air fall at 9.81 m/s2, and at 9.81 / k^2 where a take is shown k times too slowly; the rise of lifted
jumps by heights and by speed."""

from itertools import pairwise

import numpy as np
import pytest

from golden.jumps import STATURE_M, jumping, standing
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.gait.clock import clock_doubts
from pcnet3d.models.place.flights import flown, lifted_rise
from pcnet3d.pipeline import H36M17, LEVEL, PoseSequence
from pcnet3d.pipeline.core.path import RootPath


def falls(poses: PoseSequence) -> list[float]:
    return [flight.fall for flight in flown(poses).flights]


def squats(slowed: float = 1.0) -> PoseSequence:
    """Four squats on feet that stay, as a cosine."""
    time_s = np.arange(0, 8 * slowed, 1 / 30)
    lower = 0.2 * (1 - np.cos(2 * np.pi * time_s / slowed / 2))
    joints = np.repeat(standing()[None], len(time_s), axis=0)
    joints[:, H36M17.indices(("r_ankle", "l_ankle")), 2] += lower[:, None]
    root = np.stack([0 * lower, 0 * lower, 0.9 - lower], axis=-1)
    return PoseSequence(joints, H36M17, LEVEL, time_s=time_s, path=RootPath(root))


@pytest.mark.parametrize("slowed", [1, 4, 8])
@pytest.mark.parametrize("unit", [1.0, 300.0])
def test_a_ballistic_path_falls_with_the_square_of_the_pace(slowed, unit):
    poses = jumping(slowed)
    found = falls(poses.with_(joints=poses.joints * unit, path=RootPath(poses.root * unit)))
    np.testing.assert_allclose(found, 9.81 / STATURE_M / slowed**2, rtol=0.06)
    assert len(found) == 2


@pytest.mark.parametrize("slowed", [1, 4, 8])
def test_a_squat_is_no_flight(slowed):
    assert not len(falls(squats(slowed)))


def test_what_is_not_well_seen_says_nothing():
    assert not len(falls(jumping(4, noise_m=0.1)))
    assert not len(falls(jumping().with_(path=None)))
    assert not len(falls(jumping(fps=8)))  # too few frames in the air
    walk = walker(seconds=6.0)
    poses = PoseSequence(
        walk.world - walk.root[:, None], H36M17, LEVEL, time_s=walk.time_s, path=RootPath(walk.root)
    )
    assert not len(falls(poses))
    gap = jumping(4).joints.copy()
    gap[::7] = np.nan
    assert not len(falls(jumping(4).with_(joints=gap)))


def test_a_flight_whose_beginning_or_end_was_not_seen_is_none():
    poses = jumping()
    first, second = flown(poses).flights
    for seen_from_s, seen_to_s in (
        (first.off_s - 0.1, first.off_s + 0.06),
        (first.land_s - 0.06, first.land_s + 0.1),
    ):
        joints = poses.joints.copy()
        lost = (poses.times >= seen_from_s) & (poses.times <= seen_to_s)
        joints[lost, H36M17.index("r_ankle")] = np.nan
        (found,) = flown(poses.with_(joints=joints)).flights
        assert found.apex_s == pytest.approx(second.apex_s, abs=0.01)
        assert np.isfinite([found.off_s, found.land_s, found.rise]).all()


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "fewest"),
    [
        ("cmu_mocap", 0.155),
        pytest.param("hdm05_subset", 0.14, marks=pytest.mark.data("hdm05_subset.npz")),
        pytest.param("accad_mocap", 0.044, marks=pytest.mark.data("accad_mocap.npz")),
    ],
)
def test_real_people_fall_in_real_time(data, name, fewest):
    found = np.load(data / f"{name}.npz")
    joints, root, start = found["joints"], found["root"], found["clip_start"]
    flying = 0
    for a, b in pairwise(start):
        poses = PoseSequence(
            joints[a:b], H36M17, LEVEL, time_s=np.arange(b - a) / 30, path=RootPath(root[a:b])
        )
        assert clock_doubts(poses) == []
        flying += len(falls(poses)) > 0
    assert flying >= fewest * (len(start) - 1)


# --- rises of lifted jumps: a countermovement, a known fall, a landing on toes

FALL = 9.81 / 1.7  # statures / s2
TOES = 0.054  # statures by which standing on the toes lifts the ankles
# Statures: the body over the ankles, ankles over the floor, how far the knees give.
LEGS, ANKLE, DEEP = 0.5, 0.04, 0.2
APEX_S = 2.0


def jump(high: float, fps: float = 60.0, box: float = 0.0) -> dict:
    """Arguments of a jump so high, in statures: the body sinks, speeds up evenly, flies and lands likewise. box: how
    much higher it lands."""
    time_s = np.arange(0, 4, 1 / fps)
    up_s, down_s = np.sqrt(2 * high / FALL), np.sqrt(2 * (high - box) / FALL)
    leaves = LEGS + ANKLE + TOES
    push_s = 2 * (DEEP + TOES) / (FALL * up_s)
    way = time_s - APEX_S
    centre = leaves + high - FALL / 2 * way**2
    stretch = [np.clip((s - abs(way)) / push_s + 1, 0, 1) for s in (up_s, down_s)]  # 1 in the air
    lowest, floor = leaves - DEEP - TOES, np.where(way < 0, 0.0, box)
    pushing = lowest + (DEEP + TOES) * np.where(way < 0, *stretch) ** 2 + floor
    resting = abs(way) > np.where(way < 0, up_s, down_s) + push_s
    air = (-up_s < way) & (way < down_s)
    centre = np.where(air, centre, np.where(resting, LEGS + ANKLE + floor, pushing))
    toes = np.where(resting, 0.0, np.clip(centre - floor - LEGS - ANKLE, 0, TOES))
    ankle = np.where(air, centre - LEGS, ANKLE + floor + toes)
    rows = np.flatnonzero(air)
    return {
        "time_s": time_s, "centre": centre, "ankle": ankle, "stands": ~air, "rows": slice(rows[0], rows[-1] + 1),
        "off_s": APEX_S - up_s, "apex_s": APEX_S, "fall": FALL,
    }  # fmt: skip


def test_when_the_feet_leave_hardly_matters():
    """At the take-off 20 ms are 0.02 statures of the path."""
    one = jump(0.12)
    rises = [lifted_rise(**{**one, "off_s": one["off_s"] + late_s}) for late_s in (-0.02, 0.0, 0.02)]
    assert np.ptp(rises) < 0.004


def test_where_the_take_off_was_not_seen_heights_alone_tell():
    """The row before the take-off is in each line of 0.4 s from before it to the highest point."""
    one = jump(0.06)
    centre = one["centre"].copy()
    centre[one["rows"].start - 1] = np.nan
    seen, unseen = lifted_rise(**one), lifted_rise(**{**one, "centre": centre})
    assert seen != unseen
    assert unseen == pytest.approx(0.06, abs=0.005)


def test_onto_a_box_the_rise_is_over_the_floor_that_the_feet_leave():
    assert lifted_rise(**jump(0.3, box=0.2)) == pytest.approx(0.3, abs=0.025)
