"""Every sh and python block of README.md and docs/*.md works as it is written.

A block that is not run has a comment before it, `<!-- not run: why -->`; test_what_is_not_run lists them all.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pages.blocks import BLOCK, PAGES, blocks

FENCE = re.compile(r"^```(?:sh|python)$", re.MULTILINE)
BLOCKS = blocks("sh", "python")
RUN = [block for block in BLOCKS if not block.reason]
NOT_RUN = {
}


def test_every_fence_is_seen():
    assert len(BLOCKS) == sum(len(FENCE.findall(page.read_text(encoding="utf-8"))) for page in PAGES)
    assert len(BLOCKS) > 20


def test_what_is_not_run():
    """A block that comes to this list needs a reason; nothing leaves or joins it unseen."""
    left_out = {f"{block.page} {block.number}: {block.reason}" for block in BLOCKS if block.reason}
    print(*sorted(left_out), sep="\n")
    assert left_out == NOT_RUN


@pytest.mark.parametrize("block", RUN, ids=lambda block: f"{block.page}-{block.number}")
def test_block(block, files, tmp_path):
    here = shutil.copytree(files, tmp_path / "here")
    before = {path: path.stat().st_mtime_ns for path in here.iterdir()}
    command = ["bash", "-euo", "pipefail", "-c"] if block.language == "sh" else [sys.executable, "-c"]
    done = subprocess.run(
        [*command, block.text],
        cwd=here,
        env=os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert block.language == "sh" or not re.search(r"\bnan\b", done.stdout), done.stdout
    for name in re.findall(r" -o (\S+)", block.text):
        assert (here / name).stat().st_mtime_ns != before.get(here / name), f"{name} is not written anew"
    for poses in (path for path in here.glob("**/poses.npz") if path.parent not in before):
        with np.load(poses) as file:
            assert np.isfinite(file["body"]).any()
