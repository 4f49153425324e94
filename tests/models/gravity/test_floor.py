"""Where feet stood lies on the floor: known answers on a walker whose path and camera are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.ups import stated_deg, take_up
from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.gravity.evidence import direction, fuse
from pcnet3d.models.gravity.levelling import level_static, why_not
from pcnet3d.models.gravity.votes import (
    TILT_SHARE,
    PersonFrames,
    floor_plane,
    level_feet,
)
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence
from pcnet3d.pipeline.core.rotations import angle_deg, rotate, unit
from pcnet3d.stages import rectify

Z = np.array([0.0, 0.0, 1.0])
UP = np.array([0.0, -1.0, 0.0])  # of a camera that stands straight
GUESS_DEG = 10.2  # error of a guess that is equally sure in all directions
TURNING = walker(seconds=10, turn_deg=-110)  # A walk around a corner; its feet stand in two directions.


def camera_of(walk):
    return aimed(walk.root.mean(axis=0), 6, heading_deg=70, pitch_deg=25, roll_deg=6)


def seen(walk):
    camera = camera_of(walk)
    return camera.points(walk.world), camera.up


def leaning(up, degrees, about) -> np.ndarray:
    return Rotation.from_rotvec(np.radians(degrees) * unit(np.asarray(about, dtype=float))).apply(up)


def test_a_walk_around_a_corner_tells_up_whatever_the_guess_leans():
    joints, up = seen(TURNING)
    for about in np.eye(3):
        guess = leaning(up, 8, np.cross(up, about))
        floor = floor_plane(joints, guess, TURNING.time_s)
        fused = fuse([direction("guess", guess, GUESS_DEG), floor])
        assert angle_deg(guess, up) > 7.9
        assert angle_deg(fused.up, up) < 1.5
        assert fused.error_deg < 4
        assert fused.shares["floor"] > 0.8


def test_a_walk_along_a_line_tells_the_angle_along_it_only():
    """As on a tightrope; what feet apart tell about the angle across it is known worse than that along it."""
    straight = walker(seconds=10, turn_deg=0)
    joints, up = seen(straight)
    path = unit(joints[-1, 0] - joints[0, 0])
    across = np.cross(up, path)
    apart = floor_plane(joints, up, straight.time_s)
    feet = H36M17.indices(("r_ankle", "l_ankle"))
    rope = joints.copy()
    rope[:, feet] -= (((joints[:, feet] - joints[:1, :1]) @ across)[..., None]) * across
    floor = floor_plane(rope, up, straight.time_s)
    assert across @ floor.information @ across < 0.01 * across @ apart.information @ across
    assert across @ apart.information @ across < 0.2 * path @ apart.information @ path
    for about, corrects in ((across, True), (path, False)):
        guess = leaning(up, 8, about)
        fused = fuse([direction("guess", guess, GUESS_DEG), floor])
        assert angle_deg(fused.up, up) < 1.5 if corrects else angle_deg(fused.up, up) > 7


def test_it_turns_with_the_camera_and_knows_no_unit():
    joints, up = seen(TURNING)
    Q = Rotation.random(random_state=1).as_matrix()
    here = floor_plane(joints, up, TURNING.time_s)
    there = floor_plane(1000 * rotate(Q, joints) + 5, Q @ up, TURNING.time_s)
    np.testing.assert_allclose(there.information, Q @ here.information @ Q.T, rtol=1e-6, atol=1e-6)


def test_noise_and_an_uneven_floor_widen_the_error():
    joints, up = seen(TURNING)
    trace = [np.trace(floor_plane(joints, up, TURNING.time_s).information)]
    rough = joints + 0.1 * np.sin(3 * joints[:, :1] @ np.array([1.0, 0.5, 2.0]))[..., None] * up
    trace.append(np.trace(floor_plane(rough, up, TURNING.time_s).information))
    assert trace[1] < 0.8 * trace[0]


def test_stairs_are_no_floor():
    """Half a metre up for each metre ahead."""
    joints, up = seen(TURNING)
    ahead = unit(joints[-1, 0] - joints[0, 0])
    climbing = joints + 0.5 * ((joints[:, :1] - joints[:1, :1]) @ ahead)[..., None] * up
    assert floor_plane(climbing, up, TURNING.time_s) is None


@pytest.mark.parametrize("change", ["no path", "gone", "short", "upside down"])
def test_without_feet_in_several_places_there_is_no_floor(change):
    joints, up = seen(TURNING)
    time_s = TURNING.time_s
    if change == "no path":
        joints = joints - joints[:, :1]
        joints, time_s = joints[: len(joints) // 3], time_s[: len(time_s) // 3]  # on foot all the time
    elif change == "gone":
        joints = joints.copy()
        joints[:, H36M17.indices(("r_ankle", "l_ankle"))] = np.nan
    elif change == "short":
        joints, time_s = joints[:2], time_s[:2]
    else:
        up = -up
    assert floor_plane(joints, up, time_s) is None


def test_a_place_without_a_scale_or_that_never_changes_is_no_path():
    camera = camera_of(TURNING)
    relative = camera_poses(TURNING, camera)
    arbitrary = relative.with_(
        joints=camera.points(TURNING.world), frame=CAMERA.with_(origin="camera", unit="arbitrary")
    )
    still = relative.with_(joints=relative.joints + 3.0, frame=CAMERA.with_(origin="camera"))
    for poses in (arbitrary, still):
        assert isinstance(poses, PoseSequence)
        assert "floor" not in rectify(poses, "geometric").up_shares


def test_level_feet_correct_votes_that_lean_sideways_and_not_those_that_lean_forward(standing):
    """Sideways by as much as they know of the roll beside what the votes know of it."""
    time_s = np.arange(90) / 30
    for axis, corrects in (("z", True), ("x", False)):
        leaning = Rotation.from_euler(axis, 6, degrees=True).apply(UP)
        votes = np.tile(leaning, (90, 1))
        feet = level_feet(standing, leaning, time_s)
        alone, helped = (take_up(votes, np.full(90, 8.0), time_s, e) for e in ([], [feet]))
        before, after = angle_deg(alone.up, UP), angle_deg(helped.up, UP)
        assert before == pytest.approx(6)
        votes_know = np.radians(stated_deg(leaning, TILT_SHARE * 8)[1]) ** -2
        feet_know = feet.information[0, 0]  # along x, which is roll
        left = votes_know / (votes_know + feet_know)
        assert after == (pytest.approx(6 * left, rel=0.02) if corrects else pytest.approx(6, abs=0.1))
        assert helped.error_deg < alone.error_deg
        assert sum(helped.shares.values()) == pytest.approx(1)


def test_feet_of_somebody_who_has_no_trunk_leave_what_is_told(standing):
    """A file of legs alone: they stand, and no frame has a rotation. A level line tells no up by itself."""
    legs = PersonFrames(standing, np.full((90, 3, 3), np.nan), np.full(90, np.nan), np.arange(90) / 30)
    feet = level_feet(standing, UP, legs.time_s)
    assert np.isnan(fuse([feet]).up).all()
    levelled = level_static(legs, [direction("told", UP, 1.0)])
    np.testing.assert_allclose(levelled.up.up, UP, atol=0.01)
    assert levelled.up.error_deg == pytest.approx(1.0)
    assert levelled.up.shares == {"told": 1.0}  # bodies have no say beside what a lifter may have been told
    assert "torso" in why_not(levelled)
    vague = level_static(legs, [direction("told", UP, 5.0)]).up
    assert vague.error_deg < 5.0
    assert vague.shares.keys() == {"told", "feet"}


def test_copies_of_one_stance_are_one_look(standing):
    few, many = (level_feet(np.tile(standing[:1], (n, 1, 1)), UP, np.arange(n) / 30) for n in (10, 300))
    np.testing.assert_allclose(many.information, few.information, rtol=1e-9)


@pytest.mark.parametrize("change", ["a leg lifted", "feet together", "feet that move", "sitting low", "gone"])
def test_other_postures_are_no_evidence(standing, change):
    ankle, other = (H36M17.index(f"{side}_ankle") for side in "rl")
    joints = standing.copy()
    if change == "a leg lifted":
        joints[:, ankle, 1] -= 0.4
    elif change == "feet together":
        joints[:, [ankle, other], 0] *= 0.3
    elif change == "feet that move":
        joints[:, ankle, 2] += np.linspace(-0.6, 0.6, 90)
    elif change == "sitting low":
        joints[:, [ankle, other], 1] -= 0.5
    else:
        joints[:, ankle] = np.nan
    assert level_feet(standing, UP, np.arange(90) / 30) is not None
    assert level_feet(joints, UP, np.arange(90) / 30) is None
