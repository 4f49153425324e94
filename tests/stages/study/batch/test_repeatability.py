"""Repeatability with known answers, and which changes are said of subjects in general."""

import numpy as np
import pytest

from golden.measures import by_place
from pcnet3d.stages.study.batch.repeatability import as_lines, icc, limits, repeatability, sem
from pcnet3d.stages.study.batch.study import changes

# Six subjects and four judges: Shrout & Fleiss 1979, table 2; ICC(2,1) of table 4 and McGraw & Wong's interval of it.
SHROUT_FLEISS = np.array(
    [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float
)
KNEE, CADENCE = "range_of_motion.r_knee_flexion.p05_p95_deg", "walking.cadence_spm"


def row(subject, visit, **values):
    labels = {"subject": subject, "visit": visit, "condition": ""}
    numbers = {KNEE: values.get("knee"), CADENCE: values.get("cadence")}
    numbers = {name: value for name, value in numbers.items() if value is not None}
    return {**labels, "level_ok": True, "judged": False, "gait": "walking", "measures": by_place(numbers)}


def test_the_table_of_shrout_and_fleiss():
    found, lower, upper = icc(SHROUT_FLEISS)
    assert found == pytest.approx(0.29, abs=0.005)
    assert (lower, upper) == pytest.approx((0.02, 0.76), abs=0.005)


def test_what_all_subjects_have_in_common_from_take_to_take_counts_against_agreement():
    subjects = np.arange(8.0)[:, None]
    assert icc(subjects + np.array([0.0, 0.0]))[0] == pytest.approx(1)
    assert icc(subjects + np.array([0.0, 5.0]))[0] < 0.5
    assert np.isnan(icc(np.ones((8, 2)))[0])


def test_an_interval_holds_the_truth_in_nineteen_of_twenty():
    rng = np.random.default_rng(0)
    inside = {"icc": [], "sem": []}
    for _ in range(400):
        values = rng.normal(0, 2, (10, 1)) + rng.normal(0, 1, (10, 3))
        _, lower, upper = icc(values)
        inside["icc"].append(lower <= 0.8 <= upper)
        _, lower, upper = sem(values)
        inside["sem"].append(lower <= 1.0 <= upper)
    assert all(0.91 <= np.mean(of) <= 0.99 for of in inside.values())


def test_limits_of_agreement_with_their_intervals_by_hand():
    mean, low, low_from, low_to, high, *_ = limits(np.array([1.0, 3.0, 5.0]))
    assert (mean, low, high) == pytest.approx((3, 3 - 1.96 * 2, 3 + 1.96 * 2))
    margin = 4.3027 * 2 * np.sqrt(1 / 3 + 1.96**2 / 4)
    assert (low_from, low_to) == pytest.approx((low - margin, low + margin), abs=1e-3)


def test_subjects_with_several_takes_at_a_visit():
    rows = [row(f"s{i}", "1", knee=float(v)) for i, of in enumerate(SHROUT_FLEISS) for v in of]
    rows += [row("s0", "2", knee=100.0), row("alone", "1", knee=50.0)]
    (found,) = repeatability(rows)
    assert (found.measure, found.subjects, found.takes) == (KNEE, 6, 4)
    assert found.icc == pytest.approx(0.29, abs=0.005)
    assert found.mdc95 == pytest.approx(1.96 * np.sqrt(2) * found.sem)
    assert found.sem == pytest.approx(SHROUT_FLEISS.std(axis=1, ddof=1).__pow__(2).mean() ** 0.5)
    assert len(as_lines([found])) == 3
    assert not repeatability(rows[4:])  # of five


def study(subjects: int, knee: float, cadence: float):
    rng = np.random.default_rng(1)
    noise = rng.normal(0, 1, (subjects, 2))
    return [
        row(
            f"s{i}",
            visit,
            knee=60 + later * knee + noise[i, 0] * later,
            cadence=100 + later * (cadence + noise[i, 1]),
        )
        for i in range(subjects)
        for later, visit in enumerate("12")
    ]


def test_nothing_is_said_to_change_of_fewer_than_six():
    assert {change.differs for change in changes(study(5, 50.0, 50.0))} == {None}
    assert {change.differs for change in changes(study(6, 50.0, 50.0))} == {True}


def test_the_primary_outcome_is_tested_without_correction_and_the_others_with():
    rng = np.random.default_rng(2)
    names = [f"range_of_motion.{i}.p05_p95_deg" for i in range(40)]
    values = 50 + rng.normal(0, 1, (8, 2, 40)).round(3)
    values[:, 1] += 0.9 * (np.arange(40) == 0)
    rows = [
        {**row(f"s{s}", "12"[v]), "measures": by_place(dict(zip(names, values[s, v].tolist(), strict=True)))}
        for s in range(8)
        for v in range(2)
    ]
    free = {change.measure: change for change in changes(rows)}
    declared = {change.measure: change for change in changes(rows, names[0])}
    assert declared[names[0]].primary
    assert declared[names[0]].differs == (declared[names[0]].p <= 0.05)
    # No other one is told where nothing changed, though some have p <= 0.05 by chance.
    assert any(change.p <= 0.05 for name, change in free.items() if name != names[0])
    assert not any(change.differs for name, change in declared.items() if name != names[0])
