"""How far a posture is from standing, and that errors grow with it."""

import numpy as np
import pytest

from golden.jumps import posed
from pcnet3d.models.angle_error.joint_noise import JointNoise
from pcnet3d.models.angle_error.posture import FEATURES, POSTURES, features, growth, posture
from pcnet3d.pipeline import H36M17

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
