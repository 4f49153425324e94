"""The recipes of docs/visits.md on a study's table, run on published figures."""

import numpy as np
import pandas
import pytest

from pages.blocks import blocks

# Six subjects and four judges: Shrout & Fleiss 1979, table 2; ICC(2,1) is 0.29 by their table 4.
SHROUT_FLEISS = np.array(
    [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float
)


@pytest.fixture
def repeated(tmp_path, monkeypatch):
    """repeated(values (subjects, takes)): what the recipe of repeated takes makes of a study with these cadences."""
    (recipe,) = (block.text for block in blocks("python") if block.page == "visits" and "icc" in block.text)

    def run(values: np.ndarray) -> dict:
        rows = [
            {
                "subject": f"s{i}",
                "visit": "first",
                "state": "done",
                "level_ok": True,
                "walking.cadence_spm": value,
            }
            for i, takes in enumerate(values)
            for value in takes
        ]
        no = {"walking.cadence_spm": 1000.0}
        rows += [{**rows[0], "level_ok": False, **no}, {**rows[0], "visit": "second", **no}]
        rows += [{**rows[0], "subject": "alone", **no}]
        (tmp_path / "study").mkdir(exist_ok=True)
        pandas.DataFrame(rows).to_parquet(tmp_path / "study" / "study.parquet")
        monkeypatch.chdir(tmp_path)
        names: dict = {}
        exec(recipe, names)
        return names

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
