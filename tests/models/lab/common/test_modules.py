"""Modules that are commands: bad input ends in a sentence and exit code 2; files of lifted takes are checked."""

import sys

import numpy as np
import pytest

import commands
from pcnet3d.models.lab.common.modules import run_command
from pcnet3d.models.lab.synthetic.views import read_testbed
from pcnet3d.pipeline import InputError

HELD = {
    "lifted": np.zeros((5, 17, 3)), "truth": np.zeros((5, 17, 3)), "R_camera_from_body": np.zeros((5, 3, 3)),
    "lying": np.zeros(5, bool), "spread": np.zeros(5), "take_start": [0, 2, 5], "clip": ["01_01", "02_01"],
}  # fmt: skip

NAMES = [name for name in HELD if name != "take_start"]


def test_a_missing_file_is_told_in_a_sentence(tmp_path):
    pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
    ended = commands.module("models.lab.train", "none.toml", "-o", "out", cwd=tmp_path)
    commands.refused(ended, "pcnet3d: Expected ")
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_told_and_a_fault_of_ours_stays_a_traceback(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["module"])

    def full():
        raise OSError(28, "No space left on device", "out.json")

    with pytest.raises(SystemExit) as ended:
        run_command(full)
    assert ended.value.code == 2
    assert (
        capsys.readouterr().err
        == "pcnet3d: out.json could not be read or written: No space left on device.\n"
    )

    def broken():
        raise KeyError("ours")

    with pytest.raises(KeyError):
        run_command(broken)


def test_a_file_of_takes_is_read_as_it_was_written(tmp_path):
    np.savez(tmp_path / "takes.npz", **HELD)
    found = read_testbed(tmp_path / "takes.npz", *NAMES)
    for name, array in HELD.items():
        np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"lifted": np.zeros((5, 17, 2))}, r"lifted of shape \(5, 17, 3\)"),
        ({"truth": np.zeros((4, 17, 3))}, "truth of shape"),
        ({"R_camera_from_body": np.zeros((5, 9))}, "R_camera_from_body"),
        ({"lying": np.array(["no"] * 5)}, "lying"),
        ({"clip": ["01_01"]}, "clip"),
        ({"take_start": [0, 3, 2, 5]}, "go up from 0"),
        ({"take_start": [1, 5]}, "go up from 0"),
        ({"take_start": [0]}, "go up from 0"),
        ({"take_start": np.zeros(0)}, "go up from 0"),
    ],
)
def test_a_file_of_takes_of_other_shapes_is_refused(tmp_path, wrong, words):
    np.savez(tmp_path / "takes.npz", **HELD | wrong)
    with pytest.raises(InputError, match=words):
        read_testbed(tmp_path / "takes.npz", *NAMES)


@pytest.mark.parametrize("content", [None, b"", b"nothing"])
def test_what_is_no_file_of_takes_is_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "takes.npz").write_bytes(content)
    with pytest.raises(InputError, match="file of pcnet3d lab testbed"):
        read_testbed(tmp_path / "takes.npz", "lifted")
