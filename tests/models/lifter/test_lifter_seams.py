"""Takes longer or shorter than a network's window."""

import numpy as np
import pytest

from pcnet3d.models.lifter.seams import blended, slid

RNG = np.random.default_rng(0)
X = RNG.normal(size=(100, 4, 2))


@pytest.mark.parametrize("window", [1, 2, 7, 27, 99, 100, 243])
def test_a_linear_network_gives_the_same_with_and_without_windows(window):
    matrix = RNG.normal(size=(2, 3))
    seen = []

    def network(part):
        seen.append(len(part))
        return part @ matrix + 1

    np.testing.assert_allclose(blended(network, X, window), X @ matrix + 1, atol=1e-12)
    assert set(seen) == {window}


def test_a_shorter_take_of_a_network_for_any_length_is_not_continued():
    assert blended(lambda part: part - len(part), X, 243, any_length=True)[0, 0, 0] == X[0, 0, 0] - 100


def test_windows_that_disagree_fade_into_each_other():
    """Every window answers with a number of its own; no step is as large as between windows set side by side."""
    levels = iter([0.0, 10.0, 0.0, 10.0, 0.0, 10.0, 0.0])
    answers = blended(lambda part: np.full((len(part), 1), next(levels)), X[..., 0], 40)
    assert np.ptp(answers) > 7
    assert np.abs(np.diff(answers[:, 0])).max() < 10 / 20 + 1e-9


@pytest.mark.parametrize("field", [1, 2, 9, 27])
def test_sliding_equals_the_convolution_of_the_continued_take(field):
    kernel = RNG.normal(size=field)

    def network(part):
        return np.apply_along_axis(lambda values: np.convolve(values, kernel[::-1], "valid"), 0, part)

    before = (field - 1) // 2
    expected = network(np.pad(X, [(before, field - 1 - before), (0, 0), (0, 0)], mode="edge"))
    for answers in [None, 1, 13, 200]:
        window = None if answers is None else answers + field - 1
        np.testing.assert_allclose(slid(network, X, field, window), expected, atol=1e-12)


def test_a_long_take_slides_in_chunks():
    long = RNG.normal(size=(2500, 1))
    expected = (np.pad(long, [(1, 1), (0, 0)], mode="edge")[2:] + long) / 2
    seen = []

    def network(part):
        seen.append(len(part))
        return (part[2:] + part[1:-1]) / 2

    np.testing.assert_allclose(slid(network, long, 3), expected)
    assert max(seen) < 1100
