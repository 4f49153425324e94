"""A take that is probably far off is told, by what the lifter says or by how far it is from another."""

from types import SimpleNamespace

import numpy as np
import pytest

from golden.jumps import STATURE_M, standing
from pcnet3d.models.angle_error.take_error import FAR_OFF_MM, far_off
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence
from pcnet3d.pipeline.core.anthropometry import implied_stature

FRAMES = 20
UPRIGHT = SimpleNamespace(R_source_from_body=np.repeat(np.eye(3)[None], FRAMES, axis=0))


def lifted(error_m: float | None, off_m: float = 0.0, tilted_deg: float = 0.0) -> PoseSequence:
    """A standing man, each joint off_m off, whose lifter says that it is off by error_m along each axis."""
    rng = np.random.default_rng(1)
    way = rng.normal(size=(1, 17, 3))
    joints = standing() + off_m * way / np.linalg.norm(way, axis=-1, keepdims=True)
    c, s = np.cos(np.radians(tilted_deg)), np.sin(np.radians(tilted_deg))
    joints = np.repeat(joints @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T, FRAMES, axis=0)
    stated = (
        None if error_m is None else np.tile(error_m**2 * np.eye(3, dtype=np.float32), (FRAMES, 17, 1, 1))
    )
    return PoseSequence(joints, H36M17, CAMERA.with_(origin="pelvis", unit="m"), covariance=stated)


@pytest.mark.parametrize(("error_m", "far"), [(0.025, False), (0.08, True), (None, False)])
def test_a_lifter_that_is_unsure_of_a_take_is_believed(error_m, far):
    """Parkour that was off by 111 mm was good, and so was a lunge that was off by 146."""
    said = far_off(lifted(error_m), UPRIGHT)
    assert (said is not None) == far
    assert said is None or said.code == "poses-far-off"
    assert said is None or said.values["mm"] == pytest.approx(1.25 * 80, rel=0.05)


def test_who_lies_is_off_by_more():
    """The axes of a body that lies: its legs are no lower than the pelvis."""
    lies = SimpleNamespace(
        R_source_from_body=np.repeat(np.array([[[0, 0, -1], [0, 1, 0], [1, 0, 0]]]), FRAMES, axis=0)
    )
    assert far_off(lifted(0.05), UPRIGHT) is None
    assert far_off(lifted(0.05), lies) is not None


@pytest.mark.parametrize(("off_m", "far"), [(0.03, False), (0.12, True)])
def test_another_lifters_poses_are_held_against_the_built_in_ones(off_m, far):
    """That the body is turned or of another size does not count."""
    second = lifted(0.02)
    other = lifted(None, off_m, tilted_deg=20)
    assert (far_off(other, UPRIGHT, second) is not None) == far
    smaller = other.with_(joints=0.5 * other.joints, frame=other.frame.with_(unit="arbitrary"))
    assert (far_off(smaller, UPRIGHT, second) is not None) == far
    assert far_off(other.rows(0, 5), UPRIGHT, second) is None  # too little to tell
    assert implied_stature(second.joints) == pytest.approx(STATURE_M, abs=0.15)
    assert FAR_OFF_MM < 100
