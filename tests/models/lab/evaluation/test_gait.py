"""The gait report on takes whose answer is known, and the fit of stated errors to errors that are known."""

import numpy as np
import pytest

from golden.virtual import exact, walked
from pcnet3d.models.lab.evaluation.gait import SIDES_APART, Judged, JudgedGait, judge, one_kind
from pcnet3d.models.lab.evaluation.judge import STRANGERS
from pcnet3d.models.lab.fits.gait_errors import fit_differences, fit_errors
from pcnet3d.models.rectifier.geometric import Geometric


@pytest.fixture(scope="module")
def judged():
    """The walker with its true joints in the place of a lift."""
    return judge(Geometric(), exact(walked("walker", seconds=8, turn_deg=0), scale=1))


def of_person(person, name, found, *counts, **others):
    """A walk that is judged by one figure alone, whose truth is 0."""
    judged = Judged(found, 0.0, 0.7, counts, "walking", 0.9, **others)
    return JudgedGait(person, "walking", (1, 1), {}, {"true path": {name: judged}})


def test_true_joints_have_true_steps(judged):
    assert judged.kind == "walking"
    assert judged.steps[0] == judged.steps[1] >= 3
    means = judged.figures["true path"]
    assert means["step_time_s"].found == pytest.approx(means["step_time_s"].true, abs=0.02)
    assert means["step_length"].found == pytest.approx(means["step_length"].true, abs=0.03)
    assert means["walking_speed"].true == pytest.approx(1.25, rel=0.04)
    difference = means["step_length" + SIDES_APART]
    assert difference.size == pytest.approx(means["step_length"].true, rel=0.02)
    assert abs(difference.true) < 0.02
    assert abs(difference.found) < 1.645 * difference.sd("step_length")


def test_the_report_has_every_row(judged):
    figures = one_kind([judged])["figures"]
    assert {"step_width, focal known", "step_length, right less left, focal known", "stance_percent"} <= set(
        figures
    )
    assert set(one_kind([judged])["events"]) == {"initial contact", "toe-off"}


def test_fitted_errors_hold_nine_in_ten():
    rng = np.random.default_rng(1)
    count, scatters = rng.integers(3, 40, 600), rng.uniform(0, 0.2, 600)
    errors = rng.normal(0, np.hypot(0.01, 2.0 * scatters / count))
    takes = [
        of_person(f"person {i % 7}", "step_time_s", e, int(n), scatter=scatter)
        for i, (e, n, scatter) in enumerate(zip(errors, count, scatters, strict=True))
    ]
    parts = fit_errors(takes)["walking"]["step_time_s"]
    assert parts["shared"] == pytest.approx(0.01, rel=0.3)
    assert parts["scatter"] == pytest.approx(2.0, rel=0.3)
    sd = np.sqrt(parts["shared"] ** 2 + (parts["each"] ** 2 + (parts["scatter"] * scatters) ** 2) / count**2)
    assert (np.abs(errors) <= 1.645 * sd).mean() == pytest.approx(STRANGERS, abs=0.01)


def test_gaits_far_from_the_usual_err_by_more_and_every_person_counts_the_same():
    """Found stances are drawn towards the usual one; somebody filmed a hundred times decides nothing."""
    rng = np.random.default_rng(3)
    stance = rng.uniform(50, 74, 800)
    errors = rng.normal(0, np.hypot(1.0, 0.5 * (stance - 62)))

    def take(person: str, error: float, share: float) -> JudgedGait:
        return of_person(person, "stance_percent", error, 10, scatter=0.0, style={"stance_percent": share})

    takes = [take(f"person {i % 20}", e, at) for i, (e, at) in enumerate(zip(errors, stance, strict=True))]
    parts = fit_errors(takes)["walking"]["stance_percent"]
    assert parts["apart"] == pytest.approx(0.5, rel=0.2)
    still = [take("one", 0.001, 62.0) for _ in range(2000)]
    again = fit_errors([*takes, *still])["walking"]["stance_percent"]
    assert again["apart"] == pytest.approx(parts["apart"], rel=0.2)


def test_people_with_few_walks_do_not_narrow_the_errors_of_all_others():
    """Four people with two good walks each, and one with a hundred: nine in ten of the walks are inside too."""
    rng = np.random.default_rng(4)
    people = [*(f"person {i % 4}" for i in range(8)), *["often filmed"] * 100]
    errors = [*rng.normal(0, 0.002, 8), *rng.normal(0, 0.02, 100)]
    takes = [
        of_person(person, "stance_time_s", error, 5, scatter=0.0)
        for person, error in zip(people, errors, strict=True)
    ]
    parts = fit_errors(takes)["walking"]["stance_time_s"]
    sd = np.hypot(parts["shared"], parts["each"] / np.sqrt(5))
    assert (np.abs(errors) <= 1.645 * sd).mean() == pytest.approx(STRANGERS, abs=0.01)


def test_fitted_errors_of_differences_hold_nine_in_ten_from_every_side():
    """A lifter's error of the farther leg: the more of a step is depth, the larger the difference."""
    rng = np.random.default_rng(2)
    counts = rng.integers(2, 20, (900, 2))
    depth = rng.uniform(0, 1, 900)
    sd = np.sqrt((0.1 * depth) ** 2 + 0.04**2 * (1 / counts).sum(axis=1))
    errors = rng.normal(0, sd)
    takes = [
        of_person(f"person {i % 7}", "step_length" + SIDES_APART, 0.9 * e, *n, depth=far)
        for i, (e, n, far) in enumerate(zip(errors, counts, depth, strict=True))
    ]
    parts = fit_differences(takes)["walking"]["step_length"]
    assert parts["each"] == pytest.approx(0.04, rel=0.3)
    assert parts["depth"] == pytest.approx(0.1, rel=0.15)
    assert parts["shared"] < 0.015
