"""Writing: all or nothing, and nobody else's folder."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys

import pytest

from pcnet3d.pipeline.core.errors import InputError
from pcnet3d.pipeline.files.atomic import (
    refuse_unwritable,
    require_space,
    whole_file,
    whole_folder,
)
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.run import run_people
from refusals import refused


def test_a_run_that_is_ended_while_its_folder_is_made_leaves_none(tmp_path, monkeypatch):
    made = os.mkdir

    def ended(path, *mode):
        made(path, *mode)
        raise SystemExit

    monkeypatch.setattr(os, "mkdir", ended)
    with pytest.raises(SystemExit), whole_folder(tmp_path / "out"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_failed_file_leaves_nothing_and_keeps_the_old_one(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError), whole_file(path) as partial:  # noqa: PT012
        partial.write_text("half")
        raise RuntimeError
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert path.read_text() == "old"


def run(out, *names, **options):
    with whole_folder(out, **options) as partial:
        for name in names:
            (partial / name).write_text(name)


def test_a_failed_folder_leaves_the_old_one(tmp_path):
    out = tmp_path / "out"
    run(out, "first")
    with pytest.raises(RuntimeError), whole_folder(out) as partial:  # noqa: PT012
        (partial / "half").write_text("x")
        raise RuntimeError
    assert sorted(p.name for p in out.iterdir()) == ["first", "summary.json"]
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_our_own_folder_is_replaced_whole(tmp_path):
    out = tmp_path / "deep" / "out"
    for name in ("first", "second"):
        run(out, name)
    assert sorted(p.name for p in out.iterdir()) == ["second", "summary.json"]
    assert [p.name for p in out.parent.iterdir()] == ["out"]
    assert json.loads((out / "summary.json").read_text())["files"] == ["second", "summary.json"]


def test_a_link_to_a_folder_stays_a_link(tmp_path):
    run(tmp_path / "disk", "first")
    (tmp_path / "link").symlink_to(tmp_path / "disk")
    run(tmp_path / "link", "second")
    assert (tmp_path / "link").is_symlink()
    assert sorted(p.name for p in (tmp_path / "disk").iterdir()) == ["second", "summary.json"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["disk", "link"]


@pytest.mark.parametrize("summary", [None, "{}", "not json", "[]", '{"pcnet3d": "0"}'])
def test_somebody_elses_folder_needs_force(tmp_path, summary):
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.txt").write_text("years of work")
    if summary:
        (out / "summary.json").write_text(summary)
    with pytest.raises(InputError, match="--force"):
        run(out)
    assert (out / "thesis.txt").exists()
    run(out, force=True)
    assert not (out / "thesis.txt").exists()


def test_a_file_put_beside_our_results_is_not_ours_to_delete(tmp_path):
    run(tmp_path / "out", "first")
    (tmp_path / "out" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="--force"):
        run(tmp_path / "out", "second")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["first", "notes.txt", "summary.json"]


def test_a_file_that_appears_during_the_run_is_kept(tmp_path):
    out = tmp_path / "out"
    with pytest.raises(InputError, match="--force"), whole_folder(out):  # noqa: PT012
        out.mkdir()
        (out / "mine.txt").write_text("x")
    assert (out / "mine.txt").exists()


def test_a_folder_with_an_input_is_never_replaced(tmp_path):
    (tmp_path / "X3D.npy").write_text("x")
    with pytest.raises(InputError, match=r"X3D\.npy"):
        run(tmp_path, force=True, inputs=[tmp_path / "X3D.npy"])
    assert (tmp_path / "X3D.npy").exists()


@pytest.mark.parametrize(
    ("recipe", "told"),
    [
        ('[[stages]]\nuse = "rectify"', {"poses": "x.npy", "recipe": "out/mine"}),
        ('[[stages]]\nuse = "rectify"\nrectifier = "out/mine"', {"poses": "x.npy", "recipe": "recipe.toml"}),
        ("", {"keypoints": "x.json", "lifter": "out/mine"}),
        ("", {"video": "x.mp4", "detector": "out/mine"}),
        ("", {"video": "x.mp4", "settings": {"calibrate.camera_file": "out/mine"}}),
        ("", {"poses": "x.pkl", "options": {"regressor": "out/mine"}}),
        ("", {"keypoints": "x.json", "keypoints_options": {"regressor": "out/mine"}}),
    ],
)
def test_no_file_that_an_option_names_is_replaced(tmp_path, monkeypatch, recipe, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    for file in ("recipe.toml", "out/mine"):
        (tmp_path / file).write_text(recipe)
    for everyone in (False, True):
        with pytest.raises(InputError, match=r"out holds out.mine, which this run needs"):
            run_people(RunOptions(everyone=everyone, **told), tmp_path / "out", force=True)


@pytest.mark.parametrize("inside", ["", "in/it"])
def test_the_folder_that_one_is_in_is_refused_as_what_it_is(tmp_path, monkeypatch, inside):
    (tmp_path / "out" / inside).mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "out" / inside)
    for force in (False, True):
        with pytest.raises(InputError, match="is or contains the current folder"):
            run(tmp_path / "out", force=force)


@pytest.mark.parametrize(("inside", "words"), [(".", "is a file"), ("out", "Cannot write")])
def test_a_file_in_the_way_is_refused_even_with_force(tmp_path, inside, words):
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match=words), whole_folder(tmp_path / "file" / inside, force=True):
        pass


def test_what_cannot_be_written_is_said_before_the_work_and_nothing_is_made(tmp_path):
    (tmp_path / "file").write_text("x")
    for folder in (tmp_path / "file", tmp_path / "file" / "deep" / "out"):
        with refused("cannot-write", "is a file"):
            refuse_unwritable(folder)
    refuse_unwritable(tmp_path / "new" / "out")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def killed(tmp_path, block: str) -> None:
    """A process that is killed while it writes."""
    script = f"""
import os, signal, sys
from pathlib import Path
from pcnet3d.pipeline.files import atomic as outputs
out = Path(sys.argv[1])
{block}
"""
    end = subprocess.run([sys.executable, "-c", script, tmp_path / "out"], capture_output=True, text=True)
    assert end.returncode == -signal.SIGKILL, end.stderr


_KILL = "os.kill(os.getpid(), signal.SIGKILL)"


def test_what_a_killed_process_left_goes_with_the_next_writing(tmp_path):
    killed(tmp_path, f"with outputs.whole_folder(out) as folder:\n    (folder / 'half').touch(); {_KILL}")
    (left,) = tmp_path.iterdir()
    others = left.name.replace("@", "@other."), left.name.replace(left.name.split("-")[1], f"{os.getpid()}@x")
    for name in (*others, ".out.partial-older"):  # nobody can tell whose that is, or its process is at work
        (tmp_path / name).mkdir()
    run(tmp_path / "out", "first")
    assert not left.exists()
    assert {path.name for path in tmp_path.iterdir()} == {"out", *others, ".out.partial-older"}


def test_a_process_that_is_at_work_keeps_its_partial_folder(tmp_path):
    with whole_folder(tmp_path / "out") as folder:
        with whole_folder(tmp_path / "out") as other:
            assert other != folder
        assert folder.is_dir()


def test_a_file_that_a_killed_process_left_half_goes_too(tmp_path):
    """It would make the folder somebody else's."""
    run(tmp_path / "out", "first")
    killed(tmp_path, f"with outputs.whole_file(out / 'summary.json') as f:\n    f.touch(); {_KILL}")
    assert len(list((tmp_path / "out").iterdir())) == 3
    with whole_file(tmp_path / "out" / "summary.json") as partial:
        shutil.copy(tmp_path / "out" / "summary.json", partial)
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["first", "summary.json"]


def test_results_that_a_killed_process_moved_out_of_the_way_come_back(tmp_path):
    run(tmp_path / "out", "first")
    killed(
        tmp_path,
        "replace = os.replace\n"
        f"outputs.os.replace = lambda a, b: {_KILL} if b == out and '.partial-' in str(a) else replace(a, b)\n"
        "with outputs.whole_folder(out): pass",
    )
    assert not (tmp_path / "out").exists()
    with pytest.raises(RuntimeError), whole_folder(tmp_path / "out"):
        raise RuntimeError
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    assert (tmp_path / "out" / "first").read_text() == "first"


def test_room_is_asked_for_on_the_disk_that_the_folder_will_be_on(tmp_path, monkeypatch):
    asked = []
    free = shutil._ntuple_diskusage(100, 50, 50)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: asked.append(path) or free)
    require_space(tmp_path / "new" / "out", 50, "It")
    with pytest.raises(InputError, match=r"It needs about 0 MB and .* choose another folder"):
        require_space(tmp_path / "new" / "out", 51, "It")
    assert asked == [tmp_path, tmp_path]


def test_a_full_disk_is_said_with_the_file_and_leaves_nothing(tmp_path):
    with refused("cannot-write"), whole_file(tmp_path / "poses.npz") as partial:
        partial.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")
    assert not [*tmp_path.iterdir()]
