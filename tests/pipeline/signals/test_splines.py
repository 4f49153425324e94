"""Splines against those of scipy.interpolate, which a run does not import."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator

from pcnet3d.pipeline.signals.splines import monotone_slopes, on_spline, smooth_slopes


@pytest.mark.parametrize("rows", [2, 3, 4, 5, 300])
@pytest.mark.parametrize("shape", [(), (3,), (17, 3)])
@pytest.mark.parametrize(
    ("slopes_of", "reference"), [(smooth_slopes, CubicSpline), (monotone_slopes, PchipInterpolator)]
)
def test_curves_and_slopes_are_scipys(rows, shape, slopes_of, reference):
    rng = np.random.default_rng(rows)
    x = np.cumsum(rng.uniform(0.01, 0.1, rows))
    y = np.round(rng.normal(size=(rows, *shape)), 1)  # so coarse that neighbours are equal
    at = np.concatenate([x, rng.uniform(x[0], x[-1], 50)])
    expected, slopes = reference(x, y), slopes_of(x, y)
    np.testing.assert_allclose(on_spline(x, y, slopes, at), expected(at), atol=1e-12)
    np.testing.assert_allclose(slopes, expected(x, 1), rtol=1e-9, atol=1e-9)
