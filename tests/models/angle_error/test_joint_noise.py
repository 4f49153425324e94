"""The errors of a lifter's angles: their parts, the file that holds them, whose they are; and how they grow with a
posture's distance from standing."""

import json
from dataclasses import replace

import numpy as np
import pytest

from golden.jumps import posed
from pcnet3d.examples.walker.camera import R_camera_from_body, camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_lifter
from pcnet3d.models.angle_error.joint_noise import JointNoise, read_noise, shipped_noise
from pcnet3d.models.angle_error.posture import FEATURES, POSTURES, features, growth, posture
from pcnet3d.models.angle_error.take_angles import MAX_SD_DEG, LiftErrors, TakeJoints, take_angles
from pcnet3d.pipeline import H36M17
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


def test_the_parts_of_a_rates_error_add_as_squares():
    noise = replace(PLAIN, rates={KNEE: (2.0, 0.5, 3.0)})
    model, rate = np.array([0.0, 2.0, 2.0]), np.array([0.0, 0.0, -24.0])
    stated = noise.of_rate(KNEE, model, rate)
    np.testing.assert_allclose(stated, [3, 5, 13])
    np.testing.assert_allclose(noise.of_model(KNEE, stated, rate), model, atol=1e-6)
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
        rates={KNEE: (2.0, 0.5, 3.0)},
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


def test_an_error_is_the_root_of_the_sum_of_what_it_is_made_of():
    noise = JointNoise(np.zeros((1, 14, 3)), postures={"r_knee_flexion": [3.0, 0.0, 0.0, 4.0]})
    parts = [np.full(2, value) for value in (2.0, 1.0, 30.0)]
    whole = noise.whole("r_knee_flexion", *parts, np.array([[0.0, 9, 9, 0], [2.0, 0, 0, 0.5]]))
    assert whole == pytest.approx(np.sqrt([5, 5 + 36 + 4]))
    assert noise.whole("r_knee_flexion", *parts) == pytest.approx(np.sqrt([5, 5]))
