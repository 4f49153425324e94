"""What `same_results.py compare` tells of two folders that differ in one thing."""

import json

import numpy as np
import pytest

from replay.same_results import compare

SUMMARY = {
    "walking": {"steps": 4, "cadence_spm": None, "why": "too few"},
    "up_deg": [1.0, 2.0],
    "notices": [],
}
TABLE = "measure,value,text\ncadence,112.0,\nsteps,4,counted\ngait,,walking\n"


@pytest.fixture
def folders(tmp_path):
    for name in "ab":
        folder = tmp_path / name / "take"
        folder.mkdir(parents=True)
        np.savez(folder / "poses.npz", level=np.array([[0.0, np.nan], [1.0, 2.0]]), unit=np.array("m"))
        (folder / "summary.json").write_text(json.dumps(SUMMARY))
        (folder / "measures.csv").write_text(TABLE)
    return tmp_path / "a", tmp_path / "b"


def test_the_same_is_the_same(folders, capsys):
    assert compare(*folders)
    assert "0 differences of numbers, 0 of text" in capsys.readouterr().out


@pytest.mark.parametrize("change", [1e-7, 1e-3, np.nan])
def test_numbers_of_an_array(folders, change, capsys):
    level = np.array([[0.0, np.nan], [1.0, 2.0 + change]])
    np.savez(folders[1] / "take/poses.npz", level=level, unit=np.array("m"))
    assert compare(*folders) == (change < 1e-6)
    said = capsys.readouterr().out
    assert ("poses.npz: level: 1 of 4 values, in 1 rows from 1 to 1" in said) == (not change < 1e-6)


@pytest.mark.parametrize(
    ("summary", "same"),
    [
        (SUMMARY | {"notices": [{"text": "another"}]}, True),
        (SUMMARY | {"walking": {"steps": 4, "cadence_spm": None, "why": "other words"}}, True),
        ({key: value for key, value in SUMMARY.items() if key != "notices"}, True),
        ({key if key != "walking" else "gait": value for key, value in SUMMARY.items()}, True),
        (SUMMARY | {"walking": {"steps": "none", "cadence_spm": None, "why": "too few"}}, False),
        (SUMMARY | {"walking": {"steps": 4, "cadence_spm": 112.0, "why": "too few"}}, False),
        (SUMMARY | {"walking": {"cadence_spm": None, "why": "too few"}}, False),
        (SUMMARY | {"up_deg": [1.0, 2.0, 3.0]}, False),
        (SUMMARY | {"up_deg": []}, False),
    ],
)  # fmt: skip
def test_leaves_of_json(folders, summary, same, capsys):
    (folders[1] / "take/summary.json").write_text(json.dumps(summary))
    assert compare(*folders) == same
    assert "0 differences of numbers, 0 of text" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [("112.0", "112.1", False), ("112.0", "many", False), ("counted", "seen", True), ("value", "mean", True)],
)
def test_columns_of_csv(folders, old, new, same, capsys):
    (folders[1] / "take/measures.csv").write_text(TABLE.replace(old, new))
    assert compare(*folders) == same
    assert "0 differences of numbers, 0 of text" not in capsys.readouterr().out


def test_a_file_that_is_missing(folders):
    (folders[1] / "take/poses.npz").unlink()
    assert not compare(*folders)
