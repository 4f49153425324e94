"""Every sh and python block of README.md and docs/*.md works as it is written.

A block that is not run has a comment before it, `<!-- not run: why -->`; test_every_fence_is_seen counts them.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from commands import pcnet3d, succeeded
from pages.blocks import PAGES, Block, blocks
from pcnet3d.models.lab.training import rectifier

FENCE = re.compile(r"^ *```(?:sh|python)$", re.MULTILINE)
BLOCKS = blocks("sh", "python")
RUN = [block for block in BLOCKS if not block.reason]
COMMAND = re.compile(r"pcnet3d [^|<>&;$*?\\#]*(#.*)?")  # without a shell's own signs


def test_every_fence_is_seen():
    assert len(BLOCKS) == sum(len(FENCE.findall(page.read_text(encoding="utf-8"))) for page in PAGES)
    assert len(RUN) == 39  # a block that joins or leaves those that are not run is noticed


def test_every_page_is_in_the_index():
    index = (PAGES[0].parent / "docs" / "README.md").read_text(encoding="utf-8")
    assert [page.name for page in PAGES if page.name != "README.md" and f"]({page.name})" not in index] == []


def run(block: Block, here: Path) -> str:
    """What a block of Python, or one of shell, prints. In this process, but for what only a shell can read."""
    if block.language == "python":
        return run_python(block.text, here)
    lines = block.text.splitlines()
    if not all(COMMAND.fullmatch(line) for line in lines):
        shell = ["bash", "-euo", "pipefail", "-c", block.text]
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        done = subprocess.run(
            shell, cwd=here, env=os.environ | {"PATH": path}, capture_output=True, text=True
        )
        return succeeded(done).stdout
    words = (shlex.split(line, comments=True)[1:] for line in lines)
    return "".join(succeeded(pcnet3d(*each, cwd=here)).stdout for each in words)


def run_python(text: str, here: Path) -> str:
    """As `python -c` in that folder, whose modules come first and are gone again behind it."""
    with (
        contextlib.chdir(here),
        contextlib.redirect_stdout(io.StringIO()) as printed,
        patch.object(sys, "path", ["", *sys.path]),
        patch.object(sys, "stdin", io.StringIO()),
    ):
        exec(text, {"__name__": "__main__"})
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None)).startswith(str(here)):
            del sys.modules[name]
    return printed.getvalue()


@pytest.mark.parametrize("block", RUN, ids=str)
def test_block(block, files, tmp_path, monkeypatch):
    monkeypatch.setattr(rectifier, "export", lambda *given, **said: None)  # tested there, and takes seconds
    here = shutil.copytree(files, tmp_path / "here")
    if block.page == "training":
        monkeypatch.setenv("PCNET3D_DATA", str(here / "own"))
    printed = run(block, here)
    assert block.language == "sh" or not re.search(r"\bnan\b", printed), printed
    for name in re.findall(r" -o (\S+)", block.text):
        written, before = here / name, files / name
        assert not before.exists() or written.stat().st_mtime_ns > before.stat().st_mtime_ns, name
        for poses in written.glob("**/poses.npz"):
            assert {"take.rrd", "report.html"} <= {path.name for path in poses.parent.iterdir()}
            with np.load(poses) as file:
                assert len(file["body"]) == (31 if "--time-range 0.5:1.5" in block.text else 60)
                assert np.isfinite(file["body"]).any(axis=(1, 2)).mean() > 0.9
