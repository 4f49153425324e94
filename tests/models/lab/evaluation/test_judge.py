"""The one procedure for stated errors: known answers."""

import numpy as np
import pytest

from pcnet3d.models.lab.common.cases import Cases
from pcnet3d.models.lab.evaluation import judge
from pcnet3d.models.lab.evaluation.errors import of_strangers
from pcnet3d.models.lab.evaluation.judge import fitted, held_out, summed


def stated(person: str, error: np.ndarray, **known: np.ndarray) -> Cases:
    return Cases(person, {"error": error, "half": np.ones(error.shape), **known})


def test_every_person_counts_the_same_and_every_take_of_a_person():
    long, short = stated("a", np.zeros(1000)), stated("b", np.full(10, 2.0))
    assert judge.inside([long, short])["inside"] == pytest.approx(0.5)
    both = [stated("a", np.zeros(1000)), stated("a", np.full(3, 2.0)), short]
    assert judge.inside(both)["inside"] == pytest.approx(0.25)
    assert judge.inside(both)["cases"] == 1013
    rng = np.random.default_rng(0)
    takes = [stated("a", rng.normal(0, 1, 20_000)), stated("b", rng.normal(0, 3, 200))]
    by = judge.factor(takes)
    wider = [take.having(half=by * take["half"]) for take in takes]
    assert judge.inside(wider)["inside"] == pytest.approx(0.9, abs=0.01)
    assert by > 3.0  # b's errors count as much as a's, who was filmed longer


def test_cases_of_many_takes_are_added_up_and_one_without_a_bar_is_not_outside_of_it():
    half, true = np.array([2, 2, np.nan, 1]), np.array([2, 4, 6, 5])
    figures = summed([stated("a", np.array([1, 3, -2, 0]), true=true).having(half=half)])
    assert (figures["count"], figures["true"], figures["bias"]) == (4, 4.5, 0.5)
    assert (figures["error"].p50, figures["error"].mean) == (1.5, 1.5)
    assert figures["inside"] == pytest.approx(2 / 3)


def squares(take: Cases) -> np.ndarray:
    return np.stack([take["own"] ** 2, take["by"] ** 2], axis=1)


def test_fitted_bars_hold_at_every_size_on_people_left_out_and_in_every_unit():
    """A part of metres is as much a part as one of millimetres."""
    rng, takes = np.random.default_rng(2), []
    for person in "abcdef":
        by = rng.uniform(0.5, 4, 600)
        takes.append(stated(person, rng.normal(0, np.hypot(2.0, 1.5 * by)), by=by, own=np.ones(600)))
    weights = fitted(takes, squares)
    assert np.sqrt(weights) / 1.645 == pytest.approx([2.0, 1.5], rel=0.25)
    assert judge.inside(held_out({"all": takes}, squares)["all"])["inside"] == pytest.approx(0.9, abs=0.03)
    own = [take.having(half=np.sqrt(squares(take) @ weights)) for take in takes]
    for low in (0.5, 2.0, 3.5):
        parts = [take.where((take["by"] >= low) & (take["by"] < low + 0.5)) for take in own]
        assert judge.inside(parts)["inside"] > 0.8
    small = [take.having(error=1e-3 * take["error"]) for take in takes]
    np.testing.assert_allclose(fitted(small, squares), 1e-6 * weights, rtol=0.01)


def test_of_strangers_each_person_has_the_bars_of_all_the_others_and_of_one_person_there_are_none():
    def rate(person: str, size: float) -> Cases:
        error = size * np.random.default_rng(0).normal(size=250)
        return stated(person, error, rate=np.zeros(250), model=np.ones(250), faster=np.zeros(250))

    calm, wild, name = rate("a", 1.0), rate("b", 100.0), "rate of knee_flexion"
    groups = {"one": [calm], "other": [wild]}
    found = {group: share for _, group, share in of_strangers({name: groups})}
    assert found["one"] == 1.0  # by the bars of the wild one
    assert found["other"] < 0.1
    assert list(of_strangers({name: {"one": [calm]}})) == []
