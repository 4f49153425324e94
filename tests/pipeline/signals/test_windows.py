"""Ranks and means of the rows around each are those of scipy.ndimage."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d, percentile_filter

from pcnet3d.pipeline.signals.windows import gaussian, ranked

# Of numpy's name for what is beyond the ends scipy's.
BEYOND = {"edge": "nearest", "symmetric": "reflect"}


@pytest.mark.parametrize("beyond", BEYOND)
@given(rows=st.integers(10, 60), half=st.integers(0, 9), percent=st.sampled_from([20, 50]))
def test_ranks_are_those_of_scipy(beyond, rows, half, percent):
    """Of as many rows as are around one to a side: with fewer, scipy 1.17 reads memory that is none of theirs."""
    x = np.random.default_rng(rows).normal(size=rows)
    x[::7] = np.inf
    width = 2 * half + 1
    found = ranked(x, width, width * percent // 100, beyond)
    np.testing.assert_array_equal(found, percentile_filter(x, percent, size=width, mode=BEYOND[beyond]))


def test_a_long_take_has_the_ranks_of_its_rows():
    x = np.random.default_rng(0).normal(size=9000)
    np.testing.assert_array_equal(ranked(x, 13, 6, "edge"), percentile_filter(x, 50, size=13, mode="nearest"))


@given(rows=st.integers(1, 60), sd=st.floats(0.1, 20), columns=st.sampled_from([(), (3,)]))
def test_means_are_those_of_scipy(rows, sd, columns):
    x = np.random.default_rng(rows).normal(size=(rows, *columns))
    np.testing.assert_allclose(gaussian(x, sd), gaussian_filter1d(x, sd, axis=0), rtol=1e-12, atol=1e-13)
