"""Writing without leaving half a file: everything gets a temporary name first and is renamed when complete."""

from __future__ import annotations

import csv
import errno
import json
import os
import re
import shutil
import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, is_dataclass
from glob import escape
from pathlib import Path
from secrets import token_hex
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.pose import package_version
from ..core.system import is_running

SUMMARY, REPORT = "summary.json", "report.html"
_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))  # Windows has no quota of that name


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A temporary path beside `path`, with its suffix (some writers would add it); renamed to it when the block ends,
    removed when it fails, or at the next writing when its process was killed. InputError where the disk fills."""
    _remove_dead(path.parent, ".partial-", f"-{path.name}")
    partial = path.with_name(f".partial-{_us()}-{path.name}")
    try:
        yield partial
        os.replace(partial, path)
    except OSError as error:
        if error.errno not in _FULL:
            raise
        raise InputError(
            "cannot-write",
            f"{path} could not be written: {error.strerror}; make room there or choose another folder.",
        ) from None
    finally:
        partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """A text in UTF-8 as a whole file."""
    with whole_file(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_rows(path: Path, names: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """A line of names, then the rows, as a whole CSV file: UTF-8, commas between, a point in numbers, None is empty."""
    with whole_file(path) as partial, open(partial, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)


def plain(value: Any) -> Any:
    """Nested figures as what JSON knows; NaN and infinity become null."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, dict):
        return {str(key): plain(part) for key, part in value.items()}
    return [plain(part) for part in value] if isinstance(value, list | tuple) else value


def write_json(path: Path, content: object) -> None:
    """Plain values without NaN as a whole JSON file; what JSON does not know as its text."""
    write_text(path, json.dumps(content, indent=1, allow_nan=False, default=str) + "\n")


def refuse_unwritable(path: Path) -> None:
    """InputError when no folder can be made at `path`, so that it is said before the work and not after it."""
    there = _there(path)
    if not there.is_dir():
        raise InputError(
            "cannot-write", f"Expected a folder to write into, but {there} is a file; choose another -o."
        )
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError("cannot-write", f"Cannot write into {there}: permission denied; choose another -o.")


def _there(path: Path) -> Path:
    """The path itself or the nearest of its parents that exists."""
    return next(place for place in (path.absolute(), *path.absolute().parents) if place.exists())


def require_space(folder: Path, needed: int, what: str) -> None:
    """InputError when the disk of a folder, which need not be there yet, has less than that many bytes left."""
    there = _there(folder)
    free = shutil.disk_usage(there).free
    if free < needed:
        raise InputError(
            "cannot-write",
            f"{what} needs about {needed / 1e6:.0f} MB and {there} has {free / 1e6:.0f} MB left; make room there or "
            "choose another folder.",
        )


@contextmanager
def whole_folder(path: Path, force: bool = False, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """A temporary folder that takes the place of `path` when the block ends and vanishes when it fails, or at the next
    writing when its process was killed.

    Its summary.json is given (or becomes) the list of the run's files. An existing folder is replaced only when
    an earlier run of ours made all that is in it, or with `force`; never when it holds one of the `inputs` or the
    current directory. InputError otherwise, and where nothing can be written.
    """
    path = path.resolve()
    _tidy_up(path)
    check_replaceable(path, force, inputs)
    partial = path.with_name(f".{path.name}.partial-{_us()}-{token_hex(4)}")
    try:  # the signal that ends a process may come while the folder is made
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            partial.mkdir()
        except OSError as error:
            raise InputError(
                "cannot-write", f"Cannot write into {path.parent}: {error.strerror}; choose another -o DIR."
            ) from None
        yield partial
        sign(partial)
        check_replaceable(path, force, inputs)  # somebody may have put something there meanwhile
        _exchange(partial, path)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _exchange(new: Path, path: Path) -> None:
    if not path.exists():
        os.replace(new, path)
        return
    # Not there: Windows renames onto no folder.
    old = path.with_name(f".{path.name}.old-{_us()}-{token_hex(4)}")
    os.replace(path, old)
    try:
        os.replace(new, path)
    except BaseException:
        os.replace(old, path)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _tidy_up(path: Path) -> None:
    """Remove what killed processes left beside a folder, and put back what one had moved out of the way there."""
    if not path.exists():
        for old in _dead(path.parent, f".{path.name}.old-")[:1]:
            os.replace(old, path)
    for kind in ("partial", "old"):
        _remove_dead(path.parent, f".{path.name}.{kind}-")


def _us() -> str:
    """This process, in the name of what it has not finished: its number and its machine."""
    return f"{os.getpid()}@{re.sub('[^A-Za-z0-9.]', '_', socket.gethostname())}"


def _remove_dead(folder: Path, prefix: str, suffix: str = "") -> None:
    for left in _dead(folder, prefix, suffix):
        if left.is_dir():
            shutil.rmtree(left, ignore_errors=True)
        else:
            left.unlink(missing_ok=True)


def _dead(folder: Path, prefix: str, suffix: str = "") -> list[Path]:
    """What processes of this machine that are no more left unfinished; of other machines nobody can tell."""
    here = _us().partition("@")[2]
    unfinished = []
    for left in folder.glob(f"{escape(prefix)}*{escape(suffix)}"):
        owner = re.match(r"(\d+)@([A-Za-z0-9._]*)-", left.name.removeprefix(prefix))
        if owner and owner[2] == here and not is_running(int(owner[1])):
            unfinished.append(left)
    return unfinished


def check_replaceable(path: Path, force: bool = False, inputs: Iterable[Path] = ()) -> None:
    """InputError unless `path` is free, empty, or ours to replace."""
    path = path.resolve()
    if Path.cwd().resolve().is_relative_to(path):
        raise InputError(
            "already-there",
            f"{path} is or contains the current folder and cannot be replaced; choose another -o DIR, such as a new "
            "one inside it.",
        )
    for used in inputs:
        if used.resolve().is_relative_to(path):
            raise InputError(
                "already-there", f"{path} holds {used}, which this run needs; choose another -o DIR."
            )
    if path.is_dir():
        if os.path.ismount(path):
            raise InputError(
                "already-there",
                f"{path} is a mount point and cannot be replaced; choose a folder inside it for -o DIR.",
            )
        if force or not any(path.iterdir()) or _ours(path):
            return
        raise InputError(
            "already-there",
            f"{path} holds files that pcnet3d did not make; choose another -o DIR, or pass --force to replace it all.",
        )
    if path.exists():
        raise InputError(
            "cannot-write", f"Expected a folder to write into, but {path} is a file; choose another -o DIR."
        )


def _ours(path: Path) -> bool:
    """Whether everything in the folder, and in the runs inside it, is listed as the work of an earlier run."""
    summary = read_summary(path)
    listed = "pcnet3d" in summary and {file.name for file in path.iterdir()} <= set(summary.get("files", ()))
    return listed and all(_ours(run.parent) for run in path.glob(f"*/{SUMMARY}"))


def read_summary(folder: Path) -> dict[str, Any]:
    """A run's summary.json; empty where there is none."""
    return read_object(folder / SUMMARY)


def add_to_summary(folder: Path, **entries: object) -> None:
    """Put entries into a run's summary.json, which is there before and after."""
    write_json(folder / SUMMARY, {**read_summary(folder), **entries})


def add_to_list(folder: Path, name: str) -> None:
    """Note in a run's summary.json that this file or folder in it is ours too, so that a later run may replace it."""
    add_to_summary(folder, files=sorted({*read_summary(folder).get("files", ()), name}))


def sign(folder: Path) -> None:
    """Add the list of the folder's files to its summary, so that a later run may replace them."""
    summary = {"pcnet3d": package_version(), **read_summary(folder)}
    summary["files"] = sorted({SUMMARY, *(file.name for file in folder.iterdir())})
    write_json(folder / SUMMARY, summary)


def read_object(path: Path) -> dict[str, Any]:
    """What a JSON file holds; empty where there is none, or one that is damaged or holds something else."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def printable(name: str) -> str:
    """A file name in characters that every writer takes; those that are no text become question marks."""
    return name.encode("utf-8", "replace").decode()
