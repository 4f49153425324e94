"""Angles from a neutral: what is constant goes, with the error of a difference."""

import numpy as np
import pytest

from pcnet3d.models.angle_error.neutral import SHARE, less_neutral, moves_deg, neutral_deg
from pcnet3d.models.angle_error.take_angles import AngleSeries
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.signals.angles import ANGLES, FINE, NO_NEUTRAL
from refusals import refused

TIMES = np.arange(100) / 25.0
MOTION = np.where(TIMES < 2, 0.0, 30 * np.sin(TIMES - 2))


def series(offset=0.0, sd=5.0, **changed):
    one = AngleSeries(MOTION + offset, np.full(100, sd), np.full(100, FINE, np.int8), np.full(100, sd / 2))
    return {name: one for name in ANGLES} | changed


def test_what_is_constant_in_a_take_goes():
    found = [
        less_neutral(of, neutral_deg(of, TIMES, (0, 1.9)), judged=True) for of in (series(0.0), series(13.0))
    ]
    for name in ANGLES:
        np.testing.assert_allclose(found[0][name].value_deg, MOTION, atol=1e-9)
        np.testing.assert_allclose(found[1][name].value_deg, MOTION, atol=1e-9)


def test_the_neutrals_own_error_comes():
    of = series()
    neutral = neutral_deg(of, TIMES, (0, 1.9))
    assert neutral["r_knee_flexion"] == (0.0, 5.0)
    found = less_neutral(of, neutral, judged=True)["r_knee_flexion"]
    np.testing.assert_allclose(found.sd_deg, SHARE * 5 * np.sqrt(2))
    others = less_neutral(of, neutral, judged=False)["r_knee_flexion"]
    np.testing.assert_allclose(others.sd_deg, 5 * np.sqrt(2))
    measured = less_neutral(series(sd=np.nan), neutral_deg(series(sd=np.nan), TIMES, (0, 1.9)), judged=False)
    assert np.isnan(measured["r_knee_flexion"].sd_deg).all()


def test_a_neutral_across_the_end_of_the_circle():
    around = AngleSeries(*(np.full(100, x) for x in (0.0, 5.0)), np.zeros(100, np.int8), np.zeros(100))
    values = np.where(np.arange(100) % 2, 179.0, -179.0)
    of = series(r_shoulder_flexion=AngleSeries(values, around.sd_deg, around.reason, around.noise_deg))
    found = less_neutral(of, neutral_deg(of, TIMES, (0, 1.9)), judged=False)
    assert np.abs(found["r_shoulder_flexion"].value_deg).max() <= 2.0


def test_an_angle_that_the_neutral_lacks_is_missing_for_that_reason():
    hidden = AngleSeries(np.where(TIMES < 2, np.nan, MOTION), *(series()["r_knee_flexion"].__dict__[k] for k in
                         ("sd_deg", "reason", "noise_deg")))  # fmt: skip
    of = series(r_knee_flexion=hidden)
    found = less_neutral(of, neutral_deg(of, TIMES, (0, 1.9)), judged=True)["r_knee_flexion"]
    assert np.isnan(found.value_deg).all()
    assert set(found.reason) == {NO_NEUTRAL}


def test_who_moves_does_not_stand():
    assert moves_deg(series(), TIMES, (0, 1.9)) == 0
    assert moves_deg(series(), TIMES, (2, 4)) > 20


def test_a_span_without_frames_is_refused():
    with refused("bad-value", "--neutral"):
        neutral_deg(series(), TIMES, (50, 60))


@pytest.mark.parametrize(
    ("told", "seconds"), [("0:00-0:02", (0, 2)), ("1.5-3", (1.5, 3)), ("1:01-1:02.5", (61, 62.5))]
)
def test_what_is_told(told, seconds):
    assert RunOptions(video="x.mp4", neutral=told).told.neutral == seconds


@pytest.mark.parametrize("told", ["2", "2-1", "a-b", "1-2-3"])
def test_what_is_no_span_is_refused(told):
    with refused("bad-value", told):
        RunOptions(video="x.mp4", neutral=told)
