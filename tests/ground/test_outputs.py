"""Writing: all or nothing, and nobody else's folder."""

import json

import pytest

from pcnet3d.pipeline.errors import InputError
from pcnet3d.pipeline.outputs import whole_file, whole_folder


def test_a_failed_file_leaves_nothing_and_keeps_the_old_one(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError), whole_file(path) as partial:  # noqa: PT012
        partial.write_text("half")
        raise RuntimeError
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert path.read_text() == "old"


def test_a_failed_folder_leaves_the_old_one(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "summary.json").write_text(json.dumps({"pcnet3d": "0"}))
    with pytest.raises(RuntimeError), whole_folder(out) as partial:  # noqa: PT012
        (partial / "half").write_text("x")
        raise RuntimeError
    assert [p.name for p in out.iterdir()] == ["summary.json"]
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_our_own_folder_is_replaced_whole(tmp_path):
    out = tmp_path / "deep" / "out"
    for name in ("first", "second"):
        with whole_folder(out) as partial:
            (partial / "summary.json").write_text(json.dumps({"pcnet3d": "0"}))
            (partial / name).write_text(name)
    assert sorted(p.name for p in out.iterdir()) == ["second", "summary.json"]
    assert [p.name for p in out.parent.iterdir()] == ["out"]


@pytest.mark.parametrize("summary", [None, "{}", "not json", "[]"])
def test_somebody_elses_folder_needs_force(tmp_path, summary):
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.txt").write_text("years of work")
    if summary:
        (out / "summary.json").write_text(summary)
    with pytest.raises(InputError, match="--force"), whole_folder(out):
        pass
    assert (out / "thesis.txt").exists()
    with whole_folder(out, force=True):
        pass
    assert not (out / "thesis.txt").exists()


def test_a_file_in_the_way_is_refused_even_with_force(tmp_path):
    (tmp_path / "out").write_text("x")
    with pytest.raises(InputError, match="is a file"), whole_folder(tmp_path / "out", force=True):
        pass


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="Cannot write"), whole_folder(tmp_path / "file" / "out"):
        pass
