"""What `same_results.py compare` tells of two folders that differ in one thing, and how `make` runs commands."""

import json
from pathlib import Path

import numpy as np
import pytest

from replay.same_results import compare

SUMMARY = {
    "walking": {"steps": 4, "cadence_spm": None, "why": "too few"},
    "up_deg": [1.0, 2.0],
    "notices": [],
    "stages": [{"name": "read", "steps": 1}, {"name": "clean", "steps": 2}, {"name": "clean", "steps": 3}],
}
TABLE = "measure,value,text\ncadence,112.0,\nsteps,4,counted\ngait,,walking\n"


def end(folder: Path, name: str, code: int, *said: str) -> None:
    """As `make` leaves it of a command."""
    path = folder / "said" / f"{name}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps({"exit_code": code, "said": said}))


@pytest.fixture
def folders(tmp_path):
    for name in "ab":
        folder = tmp_path / name / "take"
        folder.mkdir(parents=True)
        np.savez(folder / "poses.npz", level=np.array([[0.0, np.nan], [1.0, 2.0]]), unit=np.array("m"))
        (folder / "summary.json").write_text(json.dumps(SUMMARY))
        (folder / "measures.csv").write_text(TABLE)
        end(tmp_path / name, "take", 0, "it went well")
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
    [("112.0", "112.1", False), ("112.0", "many", False), ("counted", "seen", True)],
)
def test_columns_of_csv(folders, old, new, same, capsys):
    (folders[1] / "take/measures.csv").write_text(TABLE.replace(old, new))
    assert compare(*folders) == same
    assert "0 differences of numbers, 0 of text" not in capsys.readouterr().out


def test_an_object_that_goes_from_a_list_makes_no_other_differ(folders, capsys):
    (folders[1] / "take/summary.json").write_text(json.dumps(SUMMARY | {"stages": SUMMARY["stages"][1:]}))
    assert not compare(*folders)
    said = capsys.readouterr().out
    assert "summary.json: stages[read]: is in A only (take/summary.json)" in said
    assert "clean" not in said


def test_a_group_that_goes_is_one_line_of_all_takes(folders, capsys):
    kicks = {"count": 1, "left": {"frames": 30, "outcome": "none"}}
    for take in ("take", "take/second"):
        (folders[0] / take).mkdir(exist_ok=True)
        (folders[1] / take).mkdir(exist_ok=True)
        (folders[0] / take / "summary.json").write_text(json.dumps(SUMMARY | {"kicks": kicks}))
        (folders[1] / take / "summary.json").write_text(json.dumps(SUMMARY))
    assert not compare(*folders)
    said = capsys.readouterr().out
    assert said.count("kicks: is in A only (take/second/summary.json and 1 more)") == 1
    assert "4 differences of numbers, 0 of text" in said
    assert compare(*folders, {"*/summary.json:kicks.*": "no longer counted"})


def test_a_table_with_more_rows_is_one_line(folders, capsys):
    for folder, rows in zip(folders, (3, 4), strict=True):
        (folder / "take/strides.csv").write_text("side,time_s,knee_deg,hip_deg\n" + "left,1,2,3\n" * rows)
    assert not compare(*folders)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "strides.csv: 4 keys: shape (3,) against (4,) (take/strides.csv)"
    assert len(lines) == 3, "this, the words, and the sum"


def test_a_command_that_one_version_refuses_is_one_line(folders, capsys):
    end(folders[1], "take", 2, "usage", "there is no such option")
    (folders[1] / "take/poses.npz").unlink()
    (folders[1] / "take/measures.csv").write_text(TABLE.replace("112", "113"))
    assert not compare(*folders)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "take: exit code 0 in A, 2 (there is no such option) in B"
    assert len(lines) == 2
    end(folders[0], "take", 2, "another sentence")
    (folders[0] / "take/poses.npz").unlink()
    assert not compare(*folders), "refused by both, which is no reason to pass over what they left"


def test_a_command_that_only_one_folder_has(folders, capsys):
    end(folders[0], "compare/visits", 0)
    end(folders[1], "compare/truth", 2, "usage")
    assert not compare(*folders)
    lines = capsys.readouterr().out.splitlines()
    assert "compare/visits: exit code 0 in A, not run in B" in lines
    assert "compare/truth: exit code not run in A, 2 (usage) in B" in lines


@pytest.mark.parametrize(
    ("pattern", "same", "count"),
    [
        ("take/summary.json:walking.*", True, 1),
        ("*:walking.cadence_spm", True, 1),
        ("take/summary.json:stages[clean#2].*", False, 0),
        ("summary.json:walking.*", False, 0),
    ],
)
def test_what_is_expected(folders, pattern, same, count, capsys):
    walking = SUMMARY["walking"] | {"cadence_spm": 112.0}
    (folders[1] / "take/summary.json").write_text(json.dumps(SUMMARY | {"walking": walking}))
    assert compare(*folders, {pattern: "cadence is told", "*:never": "nothing has it"}) == same
    said = capsys.readouterr().out
    assert f"{count} expected: {pattern}: cadence is told" in said
    assert "0 expected: *:never: nothing has it" in said
    assert ("walking.cadence_spm: " in said.replace(pattern, "")) != same
