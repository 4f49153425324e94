"""The errors of a lifter's angles and joints: their parts, the file that holds them, whose they are, how they grow with
a posture's distance from standing; and ellipsoids by known turns."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.jumps import posed
from pcnet3d.examples.walker.camera import R_camera_from_body, camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_lifter
from pcnet3d.models.angle_error.joint_noise import (
    JointNoise,
    LiftErrors,
    Turns,
    joint_covariance,
    levers,
    read_noise,
    shipped_noise,
    turns_of,
)
from pcnet3d.models.angle_error.posture import FEATURES, POSTURES, features, folding, growth, posture
from pcnet3d.models.angle_error.take_angles import MAX_SD_DEG, TakeJoints, take_angles
from pcnet3d.pipeline import CAMERA, H36M17, Take
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.measures import SD_90
from pcnet3d.pipeline.core.pose import PoseSequence
from pcnet3d.pipeline.core.rotations import rotate, transpose, unit
from pcnet3d.pipeline.signals.angles import ANGLES, FINE, UNTRUSTED
from refusals import refused

KNEE = "r_knee_flexion"
PLAIN = replace(shipped_noise(), more={})


def with_more(found_deg: list[float], sd_deg: list[float]) -> JointNoise:
    return replace(PLAIN, more={KNEE: (found_deg, sd_deg)})


def test_the_part_by_the_found_angle_is_added_as_squares_and_lies_on_lines_of_squares():
    noise = with_more([0.0, 40.0], [3.0, 5.0])
    found, own = np.array([-20.0, 0.0, 20.0, 40.0, 90.0]), np.full(5, 4.0)
    tilt = np.zeros(5)
    np.testing.assert_allclose(noise.whole(KNEE, own, tilt, found), np.sqrt([25, 25, 33, 41, 41]))
    np.testing.assert_allclose(noise.whole(KNEE, own, tilt + 12, found), np.sqrt([169, 169, 177, 185, 185]))
    np.testing.assert_array_equal(noise.whole("l_knee_flexion", own, tilt, found), own)
    assert np.isnan(noise.whole(KNEE, own, tilt, np.full(5, np.nan))).all()
    unusual = replace(noise, postures={KNEE: [3.0, 0.0, 0.0, 4.0]})
    grown = unusual.whole(KNEE, own, tilt, found, np.tile([2.0, 9, 9, 0.5], (5, 1)))
    np.testing.assert_allclose(grown, np.sqrt(np.array([25, 25, 33, 41, 41]) + 36 + 4))


def test_the_parts_of_a_rates_error_add_as_squares():
    noise = replace(PLAIN, rates={KNEE: (2.0, 0.5, 3.0, 12.0)})
    model, rate = np.array([0.0, 2.0, 2.0]), np.array([0.0, 0.0, -24.0])
    stated = noise.of_rate(KNEE, model, rate)
    np.testing.assert_allclose(stated, [3, 5, 13])
    np.testing.assert_allclose(noise.of_model(KNEE, stated, rate), model, atol=1e-6)
    in_fast_motion = noise.of_rate(KNEE, model, rate, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(in_fast_motion, [3, 13, 13])
    np.testing.assert_allclose(
        noise.of_model(KNEE, in_fast_motion, rate, np.array([0, 1, 0])), model, atol=1e-6
    )
    np.testing.assert_array_equal(noise.of_rate("l_knee_flexion", model, rate), model)


def test_what_is_stated_of_a_take_is_the_whole_and_rates_are_smoothed_by_the_noise_alone():
    walk = walker(seconds=2)
    camera = side_camera(walk)
    joints = camera_poses(walk, camera).joints.astype(float)
    R = R_camera_from_body(walk, camera)
    error = np.full(len(walk), 5.0)
    plain, more, vague = (
        take_angles(TakeJoints(joints, joints, R), LiftErrors(error, error, noise))
        for noise in (PLAIN, with_more([0.0, 60.0], [2.0, 9.0]), with_more([0.0], [2 * MAX_SD_DEG]))
    )
    knee = plain[KNEE]
    at = np.interp(knee.value_deg, [0.0, 60.0], [4.0, 81.0])
    np.testing.assert_allclose(more[KNEE].sd_deg, np.sqrt(knee.sd_deg**2 + at))
    for series in (knee, more[KNEE]):
        np.testing.assert_allclose(series.noise_deg, knee.sd_deg)
    np.testing.assert_array_equal(more["l_knee_flexion"].sd_deg, plain["l_knee_flexion"].sd_deg)
    assert (knee.reason == FINE).all()
    assert (vague[KNEE].reason == UNTRUSTED).all()  # nothing is known of such an angle
    assert np.isnan([vague[KNEE].value_deg, vague[KNEE].sd_deg, vague[KNEE].noise_deg]).all()


def test_the_shipped_errors_are_of_the_shipped_lifter():
    noise = shipped_noise()
    assert noise.lifter == load_lifter("pcnet3d").method
    assert set(noise.rates) == set(ANGLES)
    assert set(noise.more) <= set(ANGLES)
    for at, sd in noise.more.values():
        assert len(at) == len(sd)
        assert (np.diff(at) > 0).all()
        assert min(sd) >= 0


def test_a_file_holds_all_of_it(tmp_path):
    noise = replace(
        with_more([0.0, 40.0], [3.0, 5.0]),
        rates={KNEE: (2.0, 0.5, 3.0, 20.0)},
        lifter="toy@1",
        factors={KNEE: 1.25},
        tilts={KNEE: 0.5},
        turn=(0.9, 1.1, 0.04),
    )
    path = tmp_path / "noise.json"
    path.write_text(noise.as_json(), encoding="utf-8")
    back = read_noise(path)
    np.testing.assert_allclose(back.modes, noise.modes, atol=1e-6)
    assert (back.usual, back.powers) == (pytest.approx(noise.usual), pytest.approx(noise.powers))
    assert (back.factors, back.tilts) == (noise.factors, noise.tilts)
    assert (back.more, back.rates, back.turn) == (noise.more, noise.rates, noise.turn)
    assert back.lifter == "toy@1"


LACKING = ("lifter", "modes", "usual", "powers", "factors", "tilts", "more", "rates", "turn")


@pytest.mark.parametrize("content", [None, "", "[]", "no JSON", '{"modes": [1, 2]}', *LACKING])
def test_another_file_or_one_that_lacks_something_is_refused(content, tmp_path):
    path = tmp_path / "other.json"
    if content in LACKING:
        held = json.loads(shipped_noise().as_json())
        del held[content]
        content = json.dumps(held)
    if content is not None:
        path.write_text(content, encoding="utf-8")
    with refused("format-unknown"):
        read_noise(path)


TIMES = np.arange(60) / 30


def held(body: np.ndarray) -> np.ndarray:
    """(60, 17, 3) relative to the pelvis."""
    return np.repeat((body - body[H36M17.index("pelvis")])[None], len(TIMES), axis=0)


def turned(body: np.ndarray, deg: float) -> np.ndarray:
    """Everything over the hips tilted to the front, about the pelvis."""
    cosine, sine = np.cos(np.radians(deg)), np.sin(np.radians(deg))
    R = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    body = body - body[H36M17.index("pelvis")]
    legs = [name.endswith(("knee", "ankle")) for name in H36M17.joints]
    return np.where(np.array(legs)[:, None], body, body @ R.T)


def raised(body: np.ndarray) -> np.ndarray:
    body = body.copy()
    for part in ("elbow", "wrist"):
        at = H36M17.index(f"r_{part}")
        body[at, 2] = 2 * body[H36M17.index("r_shoulder"), 2] - body[at, 2]
    return body


STANDING = posed(0.0, 0.0)


@pytest.mark.parametrize(
    ("body", "name"),
    [
        (STANDING, "upright"),
        (turned(STANDING, 45), "bent"),
        (raised(STANDING), "arms overhead"),
        (posed(1.2, 0.0), "crouched"),
        (turned(STANDING, 80), "lying"),
    ],
)
def test_postures_are_told_by_what_a_run_knows(body, name):
    of = features(held(body), TIMES)
    assert {POSTURES[place] for place in posture(of)} == {name}
    grown = growth(of)
    assert grown.shape == (len(TIMES), len(FEATURES))
    assert (grown.max() > 0.1) == (name != "upright")


def test_folded_legs_and_raised_arms_are_told_whichever_way_is_up():
    for body, legs, arms in ((STANDING, 0, 0), (raised(STANDING), 0, 1), (posed(1.2, 0.0), 1, 0)):
        for leaning in (body, turned(body, 80)):
            assert ((folding(held(leaning)) > 0.1) == (legs, arms)).all()
    assert (folding(np.full((2, 17, 3), np.nan)) == 0).all()


def test_fast_motion_grows_and_a_walks_does_not():
    still = held(STANDING)
    for statures, grows in ((0.2, False), (1.5, True)):
        moving = still.copy()
        moving[:, :, 0] += statures * 1.6 * TIMES[:, None]
        assert (growth(features(moving, TIMES))[:, FEATURES.index("speed")].max() > 0) == grows


def test_what_is_not_known_counts_as_standing():
    lost = held(turned(STANDING, 80))
    lost[10:20] = np.nan
    assert (growth(features(lost, TIMES))[12:18] == 0).all()
    one = features(held(STANDING)[:1], TIMES[:1])
    assert (growth(one) == 0).all()


NOISE = JointNoise(np.zeros((0, 14, 3)), turn=(0.9, 1.1, 0.04))
DOWN = Rotation.from_euler(
    "x", -90, degrees=True
).as_matrix()  # R_camera_from_level of a camera that looks level
STEEP = DOWN @ Rotation.from_euler("x", 30, degrees=True).as_matrix()


def test_levers_are_the_covariance_of_drawn_turns_across_the_ray():
    rng = np.random.default_rng(0)
    joints, ray = rng.normal(size=(1, 5, 3)), unit(rng.normal(size=(1, 3)))
    drawn = rng.normal(0, 0.01, (200_000, 3))
    drawn -= (drawn @ ray[0])[:, None] * ray[0]
    moved = np.cross(drawn[:, None], joints)
    found = np.einsum("nji,njk->jik", moved, moved) / len(drawn)
    np.testing.assert_allclose(levers(joints, ray)[0] * 1e-4, found, atol=2e-6)


def test_the_parts_add_as_squares():
    own = np.broadcast_to(np.eye(3) * 0.01, (2, 3, 3, 3))
    joints = np.random.default_rng(1).normal(size=(2, 3, 3))
    turning = Turns(np.array([[0.0, 1, 0]] * 2), np.array([0.0, 0.03]), np.zeros(2), np.array([0.0, 0.5]))
    found = joint_covariance(own, joints, turning, NOISE)
    np.testing.assert_allclose(found[0], 0.81 * own[0], rtol=1e-6)
    by = ((1.1 * 0.03) ** 2 + (0.04 * 0.5) ** 2) * levers(joints, turning.ray)[1]
    np.testing.assert_allclose(found[1], 0.81 * own[1] + by, rtol=1e-5)


def seen_at(off_px: float, focal_sd_px: float = 200.0, below_px: float = 0.0) -> Turns:
    pixels = np.full((4, 17, 2), np.nan)
    pixels[:3] = (
        np.array([1000.0 + off_px, 500.0 + below_px]) + np.linspace(-50, 50, 17)[:, None]
    )  # nobody in the last frame
    keypoints = PoseSequence(pixels, H36M17, IMAGE)
    camera = Camera((2000, 1000), 1000.0, focal_sd_px, "prior")
    poses = PoseSequence(np.zeros((4, 17, 3)), H36M17, CAMERA, frame_index=np.array([0, 2, 3, 7]))
    rectified = SimpleNamespace(R_source_from_level=STEEP)  # all of it that is looked at
    return turns_of(Take("t", poses=poses, keypoints=keypoints, camera=camera, rectified=rectified))


def test_the_focal_length_turns_whom_it_shows_beside_the_axis_by_its_share_of_the_angle():
    share = 0.2 / (1 + SD_90 * 0.2)
    np.testing.assert_allclose(seen_at(500.0).focal, share * 0.5)  # missed frames too: where the others are
    np.testing.assert_allclose(seen_at(0.0).focal, 0.0, atol=1e-12)
    np.testing.assert_allclose(seen_at(500.0, focal_sd_px=0.0).focal, 0.0)
    np.testing.assert_array_less(SD_90 * seen_at(500.0, focal_sd_px=5000.0).focal, 0.5)  # not past the axis
    np.testing.assert_allclose(np.abs(seen_at(0.0).pitch), np.radians(30))


def test_of_that_turn_the_heading_takes_what_is_about_the_vertical():
    share = 0.2 / (1 + SD_90 * 0.2)
    below = seen_at(0.0, below_px=300.0)
    np.testing.assert_allclose(below.heading, 0, atol=1e-9)
    np.testing.assert_allclose(below.focal, share * 0.3)
    np.testing.assert_allclose(seen_at(-500.0).heading, share * 0.5 * np.cos(np.radians(30)))


def test_the_ray_points_at_the_person():
    camera = rotate(STEEP, seen_at(500.0).ray[:, None])[:, 0]
    np.testing.assert_allclose(camera, unit(np.array([[0.5, 0, 1]] * 4)), atol=1e-12)
    np.testing.assert_allclose(
        rotate(transpose(STEEP), camera[:, None])[:, 0], seen_at(500.0).ray, atol=1e-12
    )
