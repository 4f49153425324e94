"""One take of a batch: skipped when it is done and unchanged, else `pcnet3d run` in a process of its own."""

from __future__ import annotations

import hashlib
import json
import shutil
import socket
import time
from dataclasses import dataclass, field
from functools import partial
from glob import escape
from multiprocessing import current_process
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ValidationError

from ....pipeline.core.errors import InputError
from ....pipeline.core.pose import package_version
from ....pipeline.files.atomic import add_to_summary, printable, read_summary
from ....pipeline.files.digest import sha256
from ....pipeline.plugins import registry
from ....pipeline.plugins.options import files_among
from ....pipeline.running.recipe import load_recipe
from ....pipeline.running.run import run_files, run_people
from .manifest import Entry
from .process import Ended, failure, run_apart
from .study import figures

_KEY = "batch"  # in a take's summary.json


@dataclass(frozen=True)
class Job:
    """A take and where it goes. version: of the pcnet3d that gave the order."""

    entry: Entry
    output: Path
    timeout_s: float | None = None
    version: str = field(default_factory=package_version)

    @property
    def folder(self) -> Path:
        return self.output / "takes" / self.entry.name

    @property
    def log(self) -> Path:
        return self.output / "logs" / f"{self.entry.name}.txt"

    @property
    def lock(self) -> Path:
        return self.output / "locks" / f"{self.entry.name}.lock"


@dataclass(frozen=True)
class Outcome:
    """kept: done by an earlier batch and unchanged since. rows: the take's figures, one row a person. code: of the
    refusal (InputError) for which it failed, if that is why."""

    name: str
    state: Literal["done", "kept", "failed"]
    exit_code: int = 0
    reason: str = ""
    seconds: float = 0.0
    host: str = ""
    rows: tuple[dict[str, Any], ...] = ()
    code: str = ""

    @property
    def status(self) -> dict[str, Any]:
        """As batch.json has it."""
        return {name: value for name, value in vars(self).items() if name != "rows"}


class _Kept(BaseModel):
    """What a summary keeps of the batch that did the take."""

    key: str = ""
    files: dict[str, dict[str, str]] = {}
    seconds: float = 0.0


def run_take(job: Job) -> Outcome:
    """Do it, unless it is done; whatever goes wrong with it, an InputError too, is in the outcome. Safe to call again,
    and at once from several machines that share the disk."""
    from filelock import FileLock

    start = time.perf_counter()
    host = socket.gethostname()
    name = job.entry.name
    try:
        if package_version() != job.version:
            raise InputError(
                "other-version",
                f"{host} has pcnet3d {package_version()}, the batch {job.version}; install one version.",
            )
        if current_process().daemon:  # which may start no other
            raise InputError(
                "option-conflict",
                f"The workers on {host} have a nanny; start them as dask worker --no-nanny.",
            )
        if not job.output.is_dir():
            raise InputError(
                "cannot-open",
                f"{host} does not see {job.output}; the folder must be on a disk that all workers share.",
            )
        with FileLock(job.lock):
            _tidy(job.folder)
            kept = _kept(job.folder)
            files = _hashes(job.entry, kept.files)
            key = _key(job.entry, files)
            if kept.key == key:
                return Outcome(name, "kept", seconds=kept.seconds, host=host, rows=figures(job.folder))
            ended = _run(job)
            seconds = round(time.perf_counter() - start, 2)
            if ended.exit_code:
                _tidy(job.folder)
                return _failed(job, ended, seconds)
            add_to_summary(job.folder, **{_KEY: {"key": key, "files": files, "seconds": seconds}})
            job.log.unlink(missing_ok=True)
            return Outcome(name, "done", seconds=seconds, host=host, rows=figures(job.folder))
    except (InputError, OSError) as error:
        return _failed(job, failure(error))


def _failed(job: Job, ended: Ended, seconds: float = 0.0) -> Outcome:
    host = socket.gethostname()
    return Outcome(job.entry.name, "failed", ended.exit_code, ended.reason, seconds, host, code=ended.code)


def _kept(folder: Path) -> _Kept:
    """Of an earlier batch; nothing where there is none, or where somebody has changed it."""
    try:
        return _Kept.model_validate(read_summary(folder).get(_KEY, {}))
    except ValidationError:
        return _Kept()


def _hashes(entry: Entry, earlier: dict[str, dict[str, str]]) -> dict[str, dict[str, str]]:
    """Of every file of the take, and of those that its recipe names: its name, a stamp of size and time, and its
    SHA-256; the hash is taken from the last time where the stamp is still the same."""
    paths = dict(entry.files)
    if "recipe" in paths:
        for number, stage in enumerate(load_recipe(paths["recipe"]).stages):
            for option, path in files_among(stage.options).items():
                paths[f"recipe {number} {option}"] = path
    hashes = {}
    for column, path in paths.items():
        stamp = _stamp(path)
        before = earlier.get(column, {})
        digest = before.get("sha256") if before.get("stamp") == stamp else None
        hashes[column] = {"file": printable(path.name), "stamp": stamp, "sha256": digest or sha256(path)}
    return hashes


def _stamp(path: Path) -> str:
    digest = hashlib.sha256()
    for part in [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file()):
        status = part.stat()
        digest.update(
            f"{part.relative_to(path)}\0{status.st_size}\0{status.st_mtime_ns}\n".encode(errors="replace")
        )
    return digest.hexdigest()


def _key(entry: Entry, files: dict[str, dict[str, str]]) -> str:
    """What the take's result depends on: options, contents of files, versions of all packages that take part."""
    content = {
        "options": _without_paths(entry),
        "files": {column: (file["file"], file["sha256"]) for column, file in files.items()},
        "versions": registry.packages(),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _without_paths(entry: Entry) -> dict[str, Any]:
    """The options that a user gave, but for those that are files."""
    given = entry.options.model_dump(mode="json", exclude_unset=True)
    settings = given.pop("settings", {})
    return {name: value for name, value in {**given, **settings}.items() if name not in entry.files}


def _tidy(folder: Path) -> None:
    """Remove what killed runs left beside the take's folder; nobody else is at work there, for the lock is ours."""
    for kind in ("partial", "old"):
        for left in folder.parent.glob(f".{escape(folder.name)}.{kind}-*"):
            shutil.rmtree(left, ignore_errors=True)


def _run(job: Job) -> Ended:
    """How the take ended. What it says goes to the log."""
    go = run_people if job.entry.options.everyone else run_files
    try:
        return run_apart(partial(go, job.entry.options, job.folder), job.log, job.timeout_s)
    except TimeoutError:
        return Ended(124, f"took longer than the {job.timeout_s:g} s of --timeout, and was stopped")
