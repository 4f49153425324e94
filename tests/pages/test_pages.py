"""Every sh and python block of README.md and docs/*.md works as it is written.

A block that is not run has a comment before it, `<!-- not run: why -->`; test_what_is_not_run lists them all.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from pages.blocks import PAGES, Block, blocks

FENCE = re.compile(r"^ *```(?:sh|python)$", re.MULTILINE)
BLOCKS = blocks("sh", "python")
RUN = [block for block in BLOCKS if not block.reason]
ENVIRONMENT = {
    "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
    "OMP_NUM_THREADS": "1",  # they run side by side
}


def test_every_fence_is_seen():
    assert len(BLOCKS) == sum(len(FENCE.findall(page.read_text(encoding="utf-8"))) for page in PAGES)
    assert len(RUN) >= 20


def test_what_is_not_run():
    """Nothing joins or leaves this list unseen."""
    assert {f"{block.page}: {block.reason}" for block in BLOCKS if block.reason} == {
        "README: installs packages from the network",
        "python: needs the template installed; tests/plugin does that and runs it",
        "research: needs the project's own data, and minutes",
        "start: installs packages from the network",
        "start: opens a window",
        "training: needs the project's own data, a lifter, and ten minutes",
        "training: needs a machine on which nothing is installed",
        "training: needs motion capture that is downloaded by hand",
        "training: needs the MM-Fi data set, and hours",
        "training: needs the motion capture that the shipped networks were trained on, and hours",
        "training: needs the project's own data",
        "training: needs the project's own data, and a lifter",
        "training: needs the project's own data, and hours",
        "training: needs the project's own data, and most of an hour",
        "up: needs a video and a network's time",
        "up: needs a video of a built place",
        "video: downloads networks",
        "video: needs networks that others publish; tests/models/lifter runs small ones of their forms",
        "visits: needs a cluster; tests/stages/study/batch starts one",
        "visits: needs a study; tests/pages/test_recipes.py runs it on published figures",
        "visits: needs subjects with several takes at a visit; tests/pages/test_recipes.py runs it on published "
        "figures",
    }


def test_every_page_is_in_the_index():
    index = (PAGES[0].parent / "docs" / "README.md").read_text(encoding="utf-8")
    assert [page.name for page in PAGES if page.name != "README.md" and f"]({page.name})" not in index] == []


def run(block: Block, here: Path) -> subprocess.CompletedProcess[str]:
    command = ["bash", "-euo", "pipefail", "-c"] if block.language == "sh" else [sys.executable, "-c"]
    return subprocess.run(
        [*command, block.text], cwd=here, env=os.environ | ENVIRONMENT, capture_output=True, text=True,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip


@pytest.fixture(scope="module")
def runs(files, request, tmp_path_factory) -> Iterator[dict[Block, tuple[Path, Future]]]:
    """The folder of each block that is tested, with files of its own, and the run there; side by side, for most of a
    command's time is one processor's."""
    tested = [
        item.callspec.params["block"] for item in request.session.items if item.originalname == "test_block"
    ]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        folders = {block: tmp_path_factory.mktemp(str(block)) / "here" for block in tested}
        yield {
            block: (shutil.copytree(files, folder), pool.submit(run, block, folder))
            for block, folder in folders.items()
        }


@pytest.mark.parametrize("block", RUN, ids=str)
def test_block(block, files, runs):
    here, future = runs[block]
    done = future.result()
    assert done.returncode == 0, done.stdout + done.stderr
    assert block.language == "sh" or not re.search(r"\bnan\b", done.stdout), done.stdout
    for name in re.findall(r" -o (\S+)", block.text):
        written, before = here / name, files / name
        assert not before.exists() or written.stat().st_mtime_ns > before.stat().st_mtime_ns, name
        for poses in written.glob("**/poses.npz"):
            assert {"take.rrd", "report.html"} <= {path.name for path in poses.parent.iterdir()}
            with np.load(poses) as file:
                assert len(file["body"]) == (31 if "--time-range 0.5:1.5" in block.text else 60)
                assert np.isfinite(file["body"]).any(axis=(1, 2)).mean() > 0.9
