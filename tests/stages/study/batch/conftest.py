"""The command, with stages that crash and hang installed beside it."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import pytest

import commands
from golden.studies import write_trouble


@pytest.fixture(scope="session")
def site(tmp_path_factory) -> str:
    """A folder of packages, with that of the stages."""
    return str(write_trouble(tmp_path_factory.mktemp("site")))


@pytest.fixture(scope="session")
def begun(site) -> Callable[..., subprocess.Popen]:
    """begun("batch", ...): the command, running; it imports pcnet3d from where this process does."""
    before = os.environ.get("PYTHONPATH")
    beside = {**os.environ, "PYTHONPATH": os.pathsep.join([site, before] if before else [site])}

    def begin(*words: object, **options) -> subprocess.Popen:
        command = [*commands.APART, *map(str, words)]
        return subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=beside, **options
        )

    return begin


@pytest.fixture(scope="session")
def apart(begun) -> Callable[..., subprocess.CompletedProcess]:
    """apart("batch", ...): exit code and what it said, in a process of its own."""

    def run(*words: object, **options) -> subprocess.CompletedProcess:
        with begun(*words, **options) as process:
            out, err = process.communicate()
        return subprocess.CompletedProcess(words, process.returncode, out, err)

    return run


@pytest.fixture(scope="session")
def pcnet3d(site) -> Callable[..., subprocess.CompletedProcess]:
    """pcnet3d("batch", ...): the same in this process; those of the takes import from where it does."""

    def run(*words: object, **options) -> subprocess.CompletedProcess:
        with patch.object(sys, "path", [site, *sys.path]):
            return commands.pcnet3d(*words, **options)

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
