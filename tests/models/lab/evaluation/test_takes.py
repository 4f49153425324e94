"""Whole takes: a perfect rectifier has no error and the truth's accelerations, from every camera; known errors are
measured as what they are."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.virtual import exact
from pcnet3d.models.lab.beds import simulated_look
from pcnet3d.models.lab.clips import Clip
from pcnet3d.models.lab.evaluation.takes import added, answers, judge, summary
from pcnet3d.pipeline import H36M17

LIMBS = H36M17.indices(("l_wrist", "r_wrist", "l_ankle", "r_ankle"))
SWING_M, FRAMES = 0.1, 75


@pytest.fixture
def seen(standing):
    """Somebody whose wrists and ankles swing up and down once a second, and nothing else."""
    joints = np.repeat(standing[None], FRAMES, axis=0)
    joints[:, LIMBS, 2] += SWING_M * np.sin(2 * np.pi * np.arange(FRAMES) / 30)[:, None]
    return exact(Clip("03_01", "03", "asfamc", 30.0, joints.astype(np.float32))).seen


class Oracle:
    """Knows the camera, and turns its answer by an error in BODY's axes."""

    method = "oracle"

    def __init__(self, seen, error):
        self.seen, self.error = seen, error

    def rotation(self, joints):
        return self.seen.R_camera_from_body @ self.error, np.full(len(joints), 5.0)


def turn(axis, degrees):
    return Rotation.from_rotvec(np.radians(degrees) * np.array(axis)).as_matrix()


def answered(seen, error=0.0):
    """An oracle's answers to the truth, and to what an image says; error: a rotation, or degrees about BODY's y."""
    error = turn([0, 1, 0], error) if np.isscalar(error) else error
    look, lift = simulated_look(seen.up, 0, seen.clip), (seen.truth, None)
    return answers([Oracle(seen, error)], lift, seen.keypoints.times, look, lift)


def test_a_perfect_rectifier_has_no_error(seen):
    judged = {name.removeprefix("oracle, "): judge(seen, answer) for name, answer in answered(seen).items()}
    for per in ("a frame", "a take"):
        assert max(judged[per][name].max() for name in ("tilt", "rotation", "mpjpe")) < 1e-3
    levelled = {per for per, of in judged.items() if "levelled" in of.values and of["levelled"].all()}
    assert levelled == {"a take", "a take, with its image"}


def test_a_tilt_that_all_frames_share_stays_jitter_goes_and_refused_takes_are_counted(seen):
    def judged(error, per="a take"):
        return judge(seen, answered(seen, error)[f"oracle, {per}"])

    jitter = Rotation.from_rotvec(np.random.default_rng(0).normal(0, 0.1, (FRAMES, 3))).as_matrix()
    assert judged(jitter)["tilt"].mean() < 0.3 * judged(jitter, "a frame")["tilt"].mean()
    method = summary([judged(degrees) for degrees in (0, 2, 25, 170)])
    assert method["levelled"] == pytest.approx(3 / 4)  # upside down is refused
    assert method["tilt"].mean == pytest.approx((0 + 2 + 25 + 170) / 4, abs=0.1)


def test_a_known_tilt_adds_a_known_part_to_vertical_and_horizontal(seen):
    swing, perfect = SWING_M * (2 * np.pi) ** 2 / np.sqrt(2), answered(seen)
    of_take = perfect["oracle, a take"]
    level = replace(of_take.levelled, R_camera_from_level=seen.R_camera_from_world @ turn([1, 0, 0], 20))
    of = dict(added({**perfect, "tilted": replace(of_take, levelled=level)}, seen.truth, seen))
    assert of["oracle, a take", "wrist", "vertical"] == pytest.approx(0, abs=1e-5)
    assert of["tilted", "wrist", "vertical"] == pytest.approx(swing * (1 - np.cos(np.radians(20))), rel=0.03)
    off = swing * np.sin(np.radians(20)) / np.sqrt(2)
    assert of["tilted", "wrist", "horizontal"] == pytest.approx(off, rel=0.03)
