"""The command in a process of its own, with stages that crash and hang installed beside it."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from golden.studies import write_trouble

PCNET3D = [sys.executable, "-c", "from pcnet3d.pipeline.cli import main; main()"]


@pytest.fixture(scope="session")
def beside(tmp_path_factory) -> dict[str, str]:
    """The environment of every process, which imports pcnet3d from where this one does."""
    site, before = str(write_trouble(tmp_path_factory.mktemp("site"))), os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([site, before] if before else [site])}


@pytest.fixture(scope="session")
def begun(beside) -> Callable[..., subprocess.Popen]:
    """begun("batch", ...): the command, running."""

    def begin(*words: object, **options) -> subprocess.Popen:
        command = [*PCNET3D, *map(str, words)]
        return subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=beside, **options
        )

    return begin


@pytest.fixture(scope="session")
def pcnet3d(begun) -> Callable[..., subprocess.CompletedProcess]:
    """pcnet3d("batch", ...): exit code and what it said."""

    def run(*words: object, **options) -> subprocess.CompletedProcess:
        with begun(*words, **options) as process:
            out, err = process.communicate(timeout=120)
        return subprocess.CompletedProcess(words, process.returncode, out, err)

    return run


@pytest.fixture(scope="session")
def told() -> Callable[[Path], dict[str, float]]:
    """told(folder): when each file in it was written."""

    def times(folder: Path) -> dict[str, float]:
        found = {}
        # os.walk, unlike rglob, passes over a folder that a running batch renames meanwhile.
        for root, _, names in os.walk(folder):
            for path in (Path(root, name) for name in names):
                with contextlib.suppress(FileNotFoundError):
                    found[str(path.relative_to(folder))] = path.stat().st_mtime_ns
        return found

    return times
