"""Constants of known errors."""

from dataclasses import astuple

import numpy as np
import pytest

from pcnet3d.models.gravity.votes import USUAL_DEG, USUAL_SPREAD, Votes
from pcnet3d.models.lab.fits.gravity_constants import constants, lean, share, stated_lean
from pcnet3d.pipeline.core.errors import InputError


def test_a_share_is_that_of_the_errors():
    expected = np.random.default_rng(0).uniform(3, 9, 1000)
    assert share(0.6 * expected, expected) == pytest.approx(0.6)
    assert share(np.append(0.6 * expected, np.nan), np.append(expected, 5.0)) == pytest.approx(0.6)


@pytest.mark.parametrize("true_deg", [2.0, 6.0])
def test_the_lean_is_that_of_takes_that_lean(true_deg):
    """Takes off by a Gaussian in two dimensions of that root mean square, stated without any error of the frames."""
    rng = np.random.default_rng(1)
    tilt = np.hypot(*rng.normal(0, true_deg / np.sqrt(2), (2, 20_000)))
    assert lean(tilt, np.full(20_000, 3.8), 3.8) == pytest.approx(true_deg, rel=0.03)


def test_another_file_is_refused(tmp_path):
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(InputError, match="file of pcnet3d lab testbed"):
        constants([tmp_path / "other.npz"])


def test_takes_that_are_too_short_are_refused(tmp_path):
    joints = np.random.default_rng(0).normal(size=(40, 17, 3))
    np.savez(
        tmp_path / "short.npz", lifted=joints, truth=joints, R_camera_from_body=np.tile(np.eye(3), (40, 1, 1)),
        lying=np.zeros(40, bool), take_start=[0, 40],
    )  # fmt: skip
    with pytest.raises(InputError, match="upright takes of 60 frames or more"):
        constants([tmp_path / "short.npz"])


def test_frames_without_a_person_change_no_constant(tmp_path):
    """Of takes whose frames are all alike."""
    rng = np.random.default_rng(3)
    joints = np.repeat(rng.normal(size=(4, 1, 17, 3)), 80, axis=1)
    spread = np.repeat(rng.uniform(0.01, 0.02, (4, 1)), 80, axis=1)

    def of(unseen):
        lifted, stated = joints.copy(), spread.copy()
        lifted[:, unseen], stated[:, unseen] = np.nan, np.nan
        np.savez(
            tmp_path / "takes.npz", lifted=lifted.reshape(-1, 17, 3), truth=joints.reshape(-1, 17, 3),
            R_camera_from_body=np.tile(np.eye(3), (320, 1, 1)), lying=np.zeros(320, bool),
            take_start=np.arange(5) * 80, spread=stated.ravel(),
        )  # fmt: skip
        return astuple(constants([tmp_path / "takes.npz"]))

    assert of([7, 8, 30]) == pytest.approx(of([]), rel=1e-3)


def test_a_stated_lean_is_that_of_takes_made_by_it():
    rng = np.random.default_rng(2)
    spread = USUAL_SPREAD * rng.uniform(0.6, 1.8, 20_000)
    size = 4.0 * (spread / USUAL_SPREAD) ** 1.5
    tilt = np.hypot(*(rng.normal(size=(2, 20_000)) * size / np.sqrt(2)))
    still = Votes(np.array([0.0, -1.0, 0.0]), 0.0, np.ones(1), 1.0, 0.0)
    assert stated_lean(tilt, np.full(20_000, USUAL_DEG**2), spread, [still] * 20_000) == pytest.approx(
        4.0, rel=0.03
    )
