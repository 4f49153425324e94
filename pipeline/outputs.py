"""Writing without leaving half a file: everything gets a temporary name first and is renamed when complete."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError

SUMMARY = "summary.json"


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A temporary path beside `path`; renamed to it when the block ends, removed when it fails."""
    partial = path.with_name(f".{path.name}.partial-{os.getpid()}")
    try:
        yield partial
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def whole_folder(path: Path, force: bool = False) -> Iterator[Path]:
    """A temporary folder that takes the place of `path` when the block ends and vanishes when it fails.

    An existing folder is replaced only when an earlier run of ours made it (it has our summary.json) or
    with `force`; otherwise, and where nothing can be written, InputError.
    """
    path = Path(os.path.abspath(path))
    _check_replaceable(path, force)
    partial = path.with_name(f".{path.name}.partial-{os.getpid()}")
    old = path.with_name(f".{path.name}.old-{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.mkdir()
    except OSError as error:
        raise InputError(
            f"Cannot write into {path.parent}: {error.strerror}; choose another -o DIR."
        ) from None
    try:
        yield partial
        if path.exists():
            os.replace(path, old)
        os.replace(partial, path)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        if path.exists():
            shutil.rmtree(old, ignore_errors=True)
        elif old.exists():
            os.replace(old, path)


def _check_replaceable(path: Path, force: bool) -> None:
    """InputError unless `path` is free, empty, or ours to replace."""
    if path.is_dir():
        if force or not any(path.iterdir()) or _ours(path):
            return
        raise InputError(
            f"{path} exists and was not made by pcnet3d; choose another -o DIR, or pass --force to replace it."
        )
    if path.exists() or path.is_symlink():
        raise InputError(f"Expected a folder to write into, but {path} is a file; choose another -o DIR.")


def _ours(path: Path) -> bool:
    try:
        return "pcnet3d" in json.loads((path / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError, TypeError):
        return False
