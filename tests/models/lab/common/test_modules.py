"""Modules that are commands: bad input and a full disk end in a sentence and exit code 2."""

import sys

import pytest

import commands
from pcnet3d.models.lab.common.modules import run_command


def test_a_missing_file_and_a_full_disk_are_told_in_a_sentence(tmp_path, monkeypatch, capsys):
    pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
    ended = commands.module("models.lab.train", "none.toml", "-o", "out", cwd=tmp_path)
    commands.refused(ended, "pcnet3d: Expected ")
    assert not list(tmp_path.iterdir())

    def full():
        raise OSError(28, "No space left on device", "out.json")

    monkeypatch.setattr(sys, "argv", ["module"])
    with pytest.raises(SystemExit) as ended:
        run_command(full)
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert said == "pcnet3d: out.json could not be read or written: No space left on device.\n"
