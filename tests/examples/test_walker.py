"""The walker's stated truth against what its positions say, and against published gait; the signs of its camera."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import Camera, aimed
from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.pipeline.core.anthropometry import ANKLE_HEIGHT, SEGMENTS
from pcnet3d.pipeline.core.layouts import HALPE26
from refusals import refused

# Ends of the phases of the gait cycle: percent, thigh to the vertical, knee flexion (Perry & Burnfield 2010).
PERRY = np.array(
    [[0, 20, 5], [12, 20, 15], [31, 0, 5], [50, -20, 5], [62, -10, 40], [75, 15, 60], [87, 25, 25]]
)
STRAIGHT = {"turn_deg": 0.0}


def bone(walk: Walk, start: str, end: str) -> np.ndarray:
    return walk.joint(end) - walk.joint(start)


def left_of(walk: Walk) -> np.ndarray:
    heading = np.radians(walk.heading_deg)
    return np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=-1)


def cycles(walk: Walk, side: str) -> np.ndarray:
    """(T,) gait cycles since the side's first heel strike; walking at full speed only, else NaN."""
    first, second = walk.heel_strikes_s[side][:2]
    share = (walk.time_s - first) / (second - first)
    return np.where(walk.time_s < walk.heel_strikes_s[side][-1], share, np.nan)


@pytest.mark.parametrize("stature_m", [1.55, 1.9])
def test_bones_have_the_lengths_of_the_table_in_every_frame(stature_m):
    walk = walker(stature_m=stature_m)
    for (start, end), fraction in SEGMENTS.items():
        length = np.linalg.norm(bone(walk, start, end), axis=-1)
        np.testing.assert_allclose(length, fraction * stature_m, atol=1e-9, err_msg=f"{start} {end}")
    for start, end in (("thorax", "nose"), ("nose", "head")):
        assert np.ptp(np.linalg.norm(bone(walk, start, end), axis=-1)) < 1e-9


@pytest.mark.parametrize("heading_deg", [0.0, 130.0])
@pytest.mark.parametrize("turn_deg", [-45.0, 0.0, 60.0])
def test_facing_is_the_stated_heading_and_the_way_of_walking(heading_deg, turn_deg):
    walk = walker(heading_deg=heading_deg, turn_deg=turn_deg)
    heading = np.radians(walk.heading_deg)
    ahead = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=-1)
    R = R_world_from_body(walk.world)
    np.testing.assert_allclose(-R[:, :, 0], ahead, atol=1e-9)
    np.testing.assert_allclose(-R[:, :, 1], left_of(walk), atol=1e-9)
    assert walk.heading_deg[-1] == pytest.approx(heading_deg)
    assert walk.heading_deg[0] == pytest.approx(heading_deg - turn_deg)
    velocity = np.gradient(walk.root[:, :2], walk.time_s, axis=0)
    moving = (np.linalg.norm(velocity, axis=-1) > 0.5) & walk.during("walk")
    course = velocity[moving] / np.linalg.norm(velocity[moving], axis=-1, keepdims=True)
    np.testing.assert_allclose(course, ahead[moving, :2], atol=0.02)
    np.testing.assert_allclose(walk.root[-1, :2], 0, atol=1e-9)


def test_accelerations_are_the_second_derivatives():
    fine, step = walker(fps=1000.0), 1e-3
    second = (fine.world[2:] - 2 * fine.world[1:-1] + fine.world[:-2]) / step**2
    np.testing.assert_allclose(fine.acceleration_mps2[1:-1], second, atol=0.15)


@pytest.mark.parametrize("side", ["l", "r"])
def test_gait_is_the_published_one(side):
    walk = walker(fps=1000.0, seconds=10.0)
    cycle = cycles(walk, side)
    thigh = walk.angles_deg[f"{side}_thigh_trunk_flexion_deg"] - walk.angles_deg["trunk_lean_deg"]
    rows = [np.nanargmin(np.abs(cycle - percent / 100)) for percent in PERRY[:, 0]]
    np.testing.assert_allclose(thigh[rows], PERRY[:, 1], atol=3.5)
    np.testing.assert_allclose(walk.angles_deg[f"{side}_knee_flexion_deg"][rows], PERRY[:, 2], atol=3.5)
    walking = np.isfinite(cycle)
    lift = np.ptp(walk.root[walking, 2])
    assert 0.03 < lift < 0.05  # metres


@pytest.mark.parametrize("side", ["l", "r"])
def test_the_standing_foot_stays_put_and_heel_strikes_are_where_they_are_said_to_be(side):
    walk = walker(fps=200.0, **STRAIGHT)
    cycle, ankle = cycles(walk, side) % 1, walk.joint(f"{side}_ankle")
    first = walk.time_s < walk.heel_strikes_s[side][1]
    first &= walk.time_s >= walk.heel_strikes_s[side][0]
    flat = first & (cycle > 0.06) & (cycle < 0.37)
    assert np.ptp(ankle[flat], axis=0).max() < 0.005
    assert ankle[flat, 2].mean() == pytest.approx(ANKLE_HEIGHT * walk.stature_m, abs=0.003)
    swing = first & (cycle > 0.65) & (cycle < 0.9)
    assert ankle[swing, 2].min() > ANKLE_HEIGHT * walk.stature_m + 0.02
    # The heel comes down to the floor at the strike, and is well above it shortly before.
    heel = halpe26(walk)[:, HALPE26.index(f"{side}_heel"), 2]
    strike = np.searchsorted(walk.time_s, walk.heel_strikes_s[side][1])
    assert heel[strike] < 0.03 < 0.10 < heel[strike - int(0.25 * 200)]


@pytest.mark.parametrize("wrong", [{"fps": 0}, {"seconds": 0.01}, {"speed_mps": -1.0}, {"stature_m": 0.0}])
def test_impossible_takes_are_refused(wrong):
    with refused("bad-value"):
        walker(**wrong)


TARGET = np.array([1.0, 2.0, 1.0])
UP, EAST = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])


def pixel(camera: Camera, point: np.ndarray) -> np.ndarray:
    return camera.project(point[None, None])[0, 0]


@pytest.mark.parametrize("angles", [(0, 0, 0), (70, 15, 5), (-160, -30, 40)])
def test_aiming(angles):
    camera = aimed(TARGET, 5.0, *angles)
    R = camera.R_camera_from_world
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    np.testing.assert_allclose(pixel(camera, TARGET), [320, 180], atol=1e-9)
    np.testing.assert_allclose(camera.points(TARGET[None, None])[0, 0], [0, 0, 5], atol=1e-12)


def test_looking_north_east_is_right_and_up_is_up():
    camera = aimed(TARGET, 5.0, heading_deg=0, pitch_deg=0, roll_deg=0)
    east, up = pixel(camera, TARGET + EAST), pixel(camera, TARGET + UP)
    np.testing.assert_allclose(east, [320 + 640 / 5, 180], atol=1e-9)
    np.testing.assert_allclose(up, [320, 180 - 640 / 5], atol=1e-9)
