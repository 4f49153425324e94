"""Constants of known errors."""

import numpy as np
import pytest

from pcnet3d.models.evaluation.gravity_constants import constants, lean, share
from pcnet3d.pipeline.errors import InputError


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
    with pytest.raises(InputError, match="file of pcnet3d testbed"):
        constants([tmp_path / "other.npz"])
