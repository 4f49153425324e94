"""The recipes of docs/visits.md on a study's table, run on published figures."""

import numpy as np
import pandas
import pytest

from pages.blocks import blocks

# Six subjects and four judges: Shrout & Fleiss 1979, table 2; by table 3 mean squares are 11.24 between subjects and
# 1.02 of the rest, by table 4 ICC(2,1) is 0.29.
SHROUT_FLEISS = np.array(
    [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float
)
# Hours of sleep gained by ten patients with each of two drugs: Student 1908, from Cushny & Peebles.
SLEEP = np.array(
    [
        [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0],
        [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4],
    ]
).T


@pytest.fixture
def recipe(tmp_path, monkeypatch):
    """recipe(word, rows): what the recipe in which that word stands makes of a study of these rows."""

    def run(word: str, rows: list[dict]) -> dict:
        (text,) = (block.text for block in blocks("python") if block.page == "visits" and word in block.text)
        levelled = {"state": "done", "level_ok": True, "verdict": "good"}
        lost = {"subject": "lost", "visit": "first", "state": "failed"}
        (tmp_path / "study").mkdir(exist_ok=True)
        study = pandas.DataFrame([*({**levelled, **row} for row in rows), lost])
        study.to_parquet(tmp_path / "study" / "study.parquet")
        monkeypatch.chdir(tmp_path)
        names: dict = {}
        exec(text, names)
        return names

    return run


def rows_of(values: np.ndarray, name: str, visits=("first", "second", "third", "fourth")) -> list[dict]:
    """Of values (subjects, visits)."""
    return [
        {"subject": f"s{i}", "visit": visit, name: value}
        for i, takes in enumerate(values)
        for visit, value in zip(visits, takes, strict=False)
    ]


@pytest.fixture
def repeated(recipe):
    """repeated(values (subjects, takes)): what the recipe of repeated takes makes of a study with these cadences."""

    def run(values: np.ndarray) -> dict:
        rows = rows_of(values, "walking.cadence_spm", ["first"] * values.shape[1])
        no = {"walking.cadence_spm": 1000.0}
        rows += [{**rows[0], "level_ok": False, **no}, {**rows[0], "visit": "second", **no}]
        return recipe("icc", [*rows, {**rows[0], "subject": "alone", **no}])

    return run


def test_the_table_of_shrout_and_fleiss(repeated):
    done = repeated(SHROUT_FLEISS)
    assert done["icc"] == pytest.approx(0.29, abs=0.005)
    assert done["sem"] == pytest.approx(np.sqrt(SHROUT_FLEISS.var(axis=1, ddof=1).mean()))
    assert done["mdc95"] == pytest.approx(1.96 * np.sqrt(2) * done["sem"])
    off = SHROUT_FLEISS[:, 1] - SHROUT_FLEISS[:, 0]
    assert done["limits"] == pytest.approx(
        [off.mean() - 1.96 * off.std(ddof=1), off.mean() + 1.96 * off.std(ddof=1)]
    )


def test_what_all_subjects_have_in_common_from_take_to_take_counts_against_agreement(repeated):
    subjects = np.arange(8.0)[:, None]
    assert repeated(subjects + np.array([0.0, 0.0]))["icc"] == pytest.approx(1)
    assert repeated(subjects + np.array([0.0, 5.0]))["icc"] < 0.5


def test_the_change_of_students_sleepers_among_figures_that_did_not_change(recipe):
    """t is 4.0621 and p 0.002833, the interval 0.7001 to 2.4599; two takes of a visit count as their mean."""
    sleep, other = "range_of_motion.r_knee_flexion.p05_p95_deg", "range_of_motion.l_knee_flexion.p05_p95_deg"
    noise = np.random.default_rng(0).normal(0, 1, SLEEP.shape)
    rows = [{**row, other: value} for row, value in zip(rows_of(SLEEP, sleep), noise.ravel(), strict=True)]
    twice = [{**rows[0], sleep: rows[0][sleep] + off} for off in (-1.0, 1.0)]
    unlevelled = {**rows[0], sleep: 1000.0, "level_ok": False}
    table = recipe("false_discovery_control", [*rows[1:], *twice, unlevelled])["table"]
    found = table.loc[sleep]
    assert (found["n"], found["mean"]) == (10, pytest.approx(1.58))
    assert (found["low"], found["high"]) == (pytest.approx(0.7001, abs=1e-4), pytest.approx(2.4599, abs=1e-4))
    assert found["p"] == pytest.approx(0.002833, abs=1e-6)
    assert table["differs"].to_dict() == {sleep: True, other: False}
