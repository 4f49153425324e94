"""Accelerations by smoother: a perfect lift has the truth's; saying that nothing moves is as wrong as what moves."""

import numpy as np
import pytest

from pcnet3d.models.lab.evaluation.acceleration import NO_MOTION
from pcnet3d.models.lab.evaluation.motion import ESTIMATED, PAGE, STATED, judged, one_set
from pcnet3d.models.lab.evaluation.tables import written
from pcnet3d.models.lab.evaluation.testbed import LiftedTake, see
from pcnet3d.pipeline import CAMERA, H36M17
from pcnet3d.pipeline.reading.mocap.clip import Clip

FPS, SWING = 30.0, 0.1
LIMBS = H36M17.indices(("l_wrist", "r_wrist", "l_ankle", "r_ankle"))


@pytest.fixture
def take(standing):
    """Builds a take of somebody whose wrists and ankles swing up and down once a second, lifted at another scale with
    an error that changes slowly."""

    def build(sd: float, stated: float | None, frames: int = 150) -> LiftedTake:
        rng = np.random.default_rng(0)
        joints = np.repeat(standing[None], frames, axis=0)
        joints[:, LIMBS, 2] += SWING * np.sin(2 * np.pi * np.arange(frames) / FPS)[:, None]
        seen = see(Clip("03_01", "03", "asfamc", FPS, joints.astype(np.float32)), 0)
        error = (
            np.cumsum(rng.normal(0, sd * np.sqrt(2 / 45), joints.shape), axis=0)
            * (np.arange(17) > 0)[:, None]
        )
        covariance = None
        if stated is not None:
            covariance = np.broadcast_to((0.7 * stated) ** 2 * np.eye(3), (*joints.shape, 3))
        frame = CAMERA.with_(unit="arbitrary", origin="pelvis")
        poses = seen.keypoints.with_(joints=0.7 * (seen.truth + error), frame=frame, covariance=covariance)
        return LiftedTake(poses, seen)

    return build


def test_a_perfect_lift_has_the_truths_acceleration(take):
    (scores,) = judged([take(0.0, 1e-4)])
    size = SWING * (2 * np.pi) ** 2 / np.sqrt(2)
    assert scores.errors[NO_MOTION]["wrist"]["vertical"][0] == pytest.approx(size, rel=0.05)
    assert scores.errors[NO_MOTION]["wrist"]["horizontal"][0] < 0.05
    assert scores.speed["ankle"] == pytest.approx(SWING * 2 * np.pi / np.sqrt(2), rel=0.05)
    for name, row in scores.errors.items():
        if name != NO_MOTION:
            rmse, r = row["wrist"]["vertical"]
            assert rmse < 0.1 * size
            assert r > 0.99


def test_a_known_error_is_smoothed_better_than_by_a_filter(take):
    table = one_set(judged([take(0.02, 0.02)]))
    errors = {name: row["wrist"]["vertical"]["rmse"].p50 for name, row in table["errors"].items()}
    assert errors[STATED] < 0.8 * errors["Butterworth 6 Hz"]
    assert errors[STATED] < 0.8 * errors[NO_MOTION]
    text = written({
        "pcnet3d": "0", "lifter": "l", "seed": 0, "bed": "wild", "sets": {"S": table}
    }, PAGE)  # fmt: skip
    assert "| S | 1 |" in text
    assert STATED in text


def test_without_a_stated_error_it_is_estimated_and_short_takes_are_left_out(take):
    (scores,) = judged([take(0.0, None), take(0.0, None, frames=45)])
    assert STATED not in scores.errors
    assert ESTIMATED in scores.errors
    assert one_set([])["takes"] == 0
