"""One take of a batch: skipped when it is done and unchanged, else `pcnet3d run` in a process of its own."""

from __future__ import annotations

import hashlib
import json
import shutil
import socket
from dataclasses import dataclass, field
from functools import partial
from glob import escape
from multiprocessing import current_process
from pathlib import Path
from typing import Any, Literal

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
    rows: tuple[dict[str, Any], ...] = ()
    code: str = ""


def run_take(job: Job) -> Outcome:
    """Do it, unless it is done; whatever goes wrong with it, an InputError too, is in the outcome. Safe to call again,
    and at once from several machines that share the disk."""
    from filelock import FileLock

    host, name = socket.gethostname(), job.entry.name
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
            key = result_key(job.entry)
            if read_summary(job.folder).get(_KEY) == key:
                return Outcome(name, "kept", rows=figures(job.folder))
            if (ended := _run(job)).exit_code:
                _tidy(job.folder)
                return _failed(name, ended)
            add_to_summary(job.folder, **{_KEY: key})
            job.log.unlink(missing_ok=True)
            return Outcome(name, "done", rows=figures(job.folder))
    except (InputError, OSError) as error:
        return _failed(name, failure(error))


def _failed(name: str, ended: Ended) -> Outcome:
    return Outcome(name, "failed", ended.exit_code, ended.reason, code=ended.code)


def result_key(entry: Entry) -> str:
    """What the take's result depends on, as a hash: options, contents of its files and of those that its recipe names,
    versions of all packages that take part."""
    given = entry.options.model_dump(mode="json", exclude_unset=True)
    settings = given.pop("settings", {})
    files = dict(entry.files)
    if "recipe" in files:
        for number, stage in enumerate(load_recipe(files["recipe"]).stages):
            for option, path in files_among(stage.options).items():
                files[f"recipe {number} {option}"] = path
    content = {
        "options": {name: value for name, value in {**given, **settings}.items() if name not in entry.files},
        "files": {column: (printable(path.name), sha256(path)) for column, path in files.items()},
        "versions": registry.packages(),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


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
