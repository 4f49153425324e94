"""The walker's stated truth against what its positions say, and against published gait."""

import numpy as np
import pytest

from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.anthropometry import ANKLE_HEIGHT, SEGMENTS
from pcnet3d.pipeline.core.layouts import HALPE26
from pcnet3d.pipeline.core.rotations import angle_deg
from pcnet3d.pipeline.signals.checks import chirality
from refusals import refused

# Ends of the phases of the gait cycle: percent, thigh to the vertical, knee flexion (Perry & Burnfield 2010).
PERRY = np.array(
    [[0, 20, 5], [12, 20, 15], [31, 0, 5], [50, -20, 5], [62, -10, 40], [75, 15, 60], [87, 25, 25]]
)
STRAIGHT = {"turn_deg": 0.0}


@pytest.fixture(scope="module")
def fine() -> Walk:
    """The same take, a frame every millisecond."""
    return walker(fps=1000.0)


def bone(walk: Walk, start: str, end: str) -> np.ndarray:
    return walk.joint(end) - walk.joint(start)


def signed_deg(a: np.ndarray, b: np.ndarray, left: np.ndarray) -> np.ndarray:
    """(T,) degrees from a to b about the axis that points left (right-handed)."""
    return np.degrees(np.arctan2((np.cross(a, b) * left).sum(-1), (a * b).sum(-1)))


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


def test_the_table_is_symmetric_and_adds_up_to_the_stature():
    for (start, end), length in SEGMENTS.items():
        mirrored = tuple(joint.replace("r_", "l_") for joint in (start, end))
        assert SEGMENTS[mirrored] == length
        assert (start, end) in H36M17.bones
    standing = walker(seconds=4.0).world[-1]
    head, spine_share = standing[H36M17.index("head"), 2], SEGMENTS["pelvis", "spine"]
    assert head == pytest.approx(1.75, abs=0.01)
    assert ANKLE_HEIGHT + 0.245 + 0.246 + 2 * spine_share == pytest.approx(0.818)


@pytest.mark.parametrize("side", ["l", "r"])
def test_joint_angles_recomputed_from_positions(walk, side):
    left = left_of(walk)
    trunk, thigh = bone(walk, "pelvis", "thorax"), bone(walk, f"{side}_hip", f"{side}_knee")
    shank = bone(walk, f"{side}_knee", f"{side}_ankle")
    upper_arm, forearm = (
        bone(walk, f"{side}_{start}", f"{side}_{end}")
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist"))
    )
    # Right-handed about left, a segment that hangs down swings backwards.
    found = {
        "thigh_trunk_flexion": -signed_deg(-trunk, thigh, left),
        "knee_flexion": signed_deg(thigh, shank, left),
        "shoulder_flexion": -signed_deg(-trunk, upper_arm, left),
        "elbow_flexion": -signed_deg(upper_arm, forearm, left),
    }
    for name, angle in found.items():
        np.testing.assert_allclose(angle, walk.angles_deg[f"{side}_{name}_deg"], atol=1e-6, err_msg=name)
    np.testing.assert_allclose(
        angle_deg(thigh, shank), walk.angles_deg[f"{side}_knee_flexion_deg"], atol=1e-6
    )


def test_trunk_lean_and_pelvis_turn_recomputed_from_positions(walk):
    left, up = left_of(walk), np.array([0.0, 0.0, 1.0])
    lean = signed_deg(np.broadcast_to(up, left.shape), bone(walk, "pelvis", "thorax"), left)
    np.testing.assert_allclose(lean, walk.angles_deg["trunk_lean_deg"], atol=1e-6)
    hips, shoulders = bone(walk, "r_hip", "l_hip"), bone(walk, "r_shoulder", "l_shoulder")
    np.testing.assert_allclose(signed_deg(left, hips, up), walk.angles_deg["pelvis_turn_deg"], atol=1e-6)
    np.testing.assert_allclose(
        signed_deg(left, shoulders, up), -walk.angles_deg["pelvis_turn_deg"], atol=1e-6
    )


def test_the_body_is_anatomically_right(walk):
    evidence = chirality(walk.poses)
    assert evidence.verdict == "good"
    assert (evidence.nose, evidence.knees, evidence.arms_legs) == (1, 1, 1)
    assert evidence.knee_votes > 100
    for side in "lr":
        assert walk.angles_deg[f"{side}_knee_flexion_deg"].min() > 2
        assert walk.angles_deg[f"{side}_elbow_flexion_deg"].min() > 5


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
    velocity = walk.velocity_mps[:, H36M17.index("pelvis"), :2]
    moving = np.linalg.norm(velocity, axis=-1) > 0.5
    moving &= walk.during("walk")
    course = velocity[moving] / np.linalg.norm(velocity[moving], axis=-1, keepdims=True)
    np.testing.assert_allclose(course, ahead[moving, :2], atol=1e-6)
    np.testing.assert_allclose(walk.root[-1, :2], 0, atol=1e-9)


def test_velocities_and_rates_are_the_derivatives(fine):
    step = 1e-3
    inner = slice(1, -1)
    central = (fine.world[2:] - fine.world[:-2]) / (2 * step)
    np.testing.assert_allclose(fine.velocity_mps[inner], central, atol=2e-3)
    second = (fine.world[2:] - 2 * fine.world[1:-1] + fine.world[:-2]) / step**2
    np.testing.assert_allclose(fine.acceleration_mps2[inner], second, atol=0.15)
    for name, angle in fine.angles_deg.items():
        slope = (angle[2:] - angle[:-2]) / (2 * step)
        np.testing.assert_allclose(fine.rates_degps[name][inner], slope, atol=0.1, err_msg=name)


def test_accelerations_do_not_jump(fine):
    jumps = np.abs(np.diff(fine.acceleration_mps2, axis=0)).max()
    assert jumps < 1.0  # in a millisecond, of accelerations up to 30


def test_frames_do_not_depend_on_the_rate(walk):
    twice = walker(fps=60.0)
    np.testing.assert_allclose(twice.world[::2], walk.world, atol=1e-12)
    np.testing.assert_allclose(twice.acceleration_mps2[::2], walk.acceleration_mps2, atol=1e-5)


def test_walking_speed_stride_and_cadence_fit_each_other(walk):
    steady = walk.time_s < walk.heel_strikes_s["r"][-1]
    speed = np.linalg.norm(walk.velocity_mps[steady, H36M17.index("pelvis"), :2], axis=-1)
    np.testing.assert_allclose(speed, walk.speed_mps, atol=1e-5)
    steps = np.sort(np.concatenate([walk.heel_strikes_s["l"], walk.heel_strikes_s["r"]]))
    np.testing.assert_allclose(60 / np.diff(steps), walk.cadence_spm)
    stride_m = 2 * walk.speed_mps * 60 / walk.cadence_spm
    assert stride_m == pytest.approx(0.77 * walk.stature_m)
    assert 100 < walk.cadence_spm < 125  # Perry & Burnfield: 113 steps a minute


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
def test_arms_swing_against_the_legs(walk, side):
    walking = np.isfinite(cycles(walk, side))
    arm = walk.angles_deg[f"{side}_shoulder_flexion_deg"][walking]
    leg = walk.angles_deg[f"{side}_thigh_trunk_flexion_deg"][walking]
    assert np.corrcoef(arm, leg)[0, 1] < -0.7


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


def test_nothing_sinks_below_the_floor(walk):
    assert halpe26(walk)[..., 2].min() >= 0
    for side in "lr":
        assert walk.joint(f"{side}_ankle")[:, 2].min() > ANKLE_HEIGHT * walk.stature_m - 0.001


def test_in_the_squat_the_ankles_stay_and_the_hips_go_down_and_back(walk):
    squat = walk.during("squat")
    for side in "lr":
        ankle = walk.joint(f"{side}_ankle")[squat]
        np.testing.assert_allclose(ankle, np.broadcast_to(ankle[0], ankle.shape), atol=1e-9)
        assert ankle[0, 2] == pytest.approx(ANKLE_HEIGHT * walk.stature_m)
        assert walk.angles_deg[f"{side}_knee_flexion_deg"][squat].max() == pytest.approx(100, abs=0.01)
    assert walk.root[squat, 2].min() < 0.65 * walk.root[squat, 2].max()
    assert walk.root[squat, 0].min() == pytest.approx(-0.24, abs=0.05)
    assert walk.angles_deg["trunk_lean_deg"][squat].max() == pytest.approx(40, abs=0.01)


def test_both_arms_rise_to_170_degrees(walk):
    arms = walk.during("arms")
    for side in "lr":
        assert walk.angles_deg[f"{side}_shoulder_flexion_deg"][arms].max() == pytest.approx(170, abs=0.01)
        over_head = walk.joint(f"{side}_wrist")[arms, 2] - walk.joint("head")[arms, 2]
        assert over_head.max() > 0.2


def test_phases_follow_each_other_through_the_whole_take(walk):
    masks = np.array([walk.during(phase) for phase in ("walk", "squat", "arms")])
    np.testing.assert_array_equal(masks.sum(axis=0), 1)
    assert len(walk) == 240


@pytest.mark.parametrize("wrong", [{"fps": 0}, {"seconds": 0.01}, {"speed_mps": -1.0}, {"stature_m": 0.0}])
def test_impossible_takes_are_refused(wrong):
    with refused("bad-value"):
        walker(**wrong)
