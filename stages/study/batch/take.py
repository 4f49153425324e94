"""One take of a batch: skipped when it is done and unchanged, else `pcnet3d run` in a process of its own, so that one
that crashes or hangs costs nothing else."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from glob import escape
from multiprocessing import active_children, current_process, parent_process
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Literal, NamedTuple

from ....pipeline.core.errors import InputError
from ....pipeline.core.pose import package_version
from ....pipeline.core.system import kill, leave_terminal, limit_opencv, process_context, terminate_self
from ....pipeline.files.atomic import add_to_summary, printable, read_summary
from ....pipeline.files.digest import sha256
from ....pipeline.plugins import registry
from ....pipeline.plugins.options import files_among
from ....pipeline.running.recipe import load_recipe
from ....pipeline.running.run import run_people
from .manifest import Entry
from .study import figures

_KEY = "batch"  # in a take's summary.json
_TO_END_S = 5.0  # for a take that is asked to leave
# As many processes as there are cores: each computes with one thread, or they get in each other's way. One on every
# machine, since another number of threads rounds otherwise. What they say is read back here.
_ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_ENVIRONMENT |= {"OPENCV_FOR_THREADS_NUM": "1", "PYTHONIOENCODING": "utf-8"}
# What takes most of a run's start and begins no thread, which a process that is forked would lack.
PRELOADED = (
    "scipy.ndimage", "scipy.spatial.transform", "cv2", "av",
    *(f"pcnet3d.stages.{stage}" for stage in ("lift", "place", "angles", "trajectories")),
    *(f"pcnet3d.stages.{stage}.stage" for stage in ("measures", "record", "export", "report")),
    "pcnet3d.pipeline.running.run", "pcnet3d.stages.study.batch.take",
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """kept: done by an earlier batch and unchanged since. exit_code, reason, code: as of Ended. rows: the figures
    of the take, one row a person."""

    name: str
    state: Literal["done", "kept", "failed"]
    exit_code: int = 0
    reason: str = ""
    code: str = ""
    rows: tuple[dict[str, Any], ...] = ()


def run_take(entry: Entry, output: Path, version: str, timeout_s: float | None = None) -> Outcome:
    """Do it, unless it is done; whatever goes wrong with it, an InputError too, is in the outcome. Safe to call again,
    and at once from several machines that share the disk. output: the batch's folder. version: of the pcnet3d that
    gives the order."""
    from filelock import FileLock

    host, name = socket.gethostname(), entry.name
    folder, log = output / "takes" / name, output / "logs" / f"{name}.txt"
    try:
        if package_version() != version:
            raise InputError(
                "other-version",
                f"{host} has pcnet3d {package_version()}, the batch {version}; install one version.",
            )
        if current_process().daemon:  # which may start no other
            raise InputError(
                "option-conflict",
                f"The workers on {host} have a nanny; start them as dask worker --no-nanny.",
            )
        if not output.is_dir():
            raise InputError(
                "cannot-open",
                f"{host} does not see {output}; the folder must be on a disk that all workers share.",
            )
        with FileLock(output / "locks" / f"{name}.lock"):
            _tidy(folder)
            key = result_key(entry)
            if read_summary(folder).get(_KEY) == key:
                return Outcome(name, "kept", rows=figures(folder))
            ended = run_apart(partial(run_people, entry.options, folder), log, timeout_s)
            if ended.exit_code:
                _tidy(folder)
                return Outcome(name, "failed", *ended)
            add_to_summary(folder, **{_KEY: key})
            log.unlink(missing_ok=True)
            return Outcome(name, "done", rows=figures(folder))
    except (InputError, OSError) as error:
        return Outcome(name, "failed", *failure(error))


def result_key(entry: Entry) -> str:
    """What the take's result depends on, as a hash: options, contents of its files and of those that its recipe names,
    versions of all packages that take part."""
    given = entry.options.model_dump(mode="json", exclude_unset=True)
    settings = given.pop("settings", {})
    values = given | settings
    texts = {name: value for name, value in values.items() if isinstance(value, str) and os.path.isabs(value)}
    files = {name: Path(text) for name, text in texts.items() if os.path.exists(text)}
    if "recipe" in files:
        for number, stage in enumerate(load_recipe(files["recipe"]).stages):
            for option, path in files_among(stage.options).items():
                files[f"recipe {number} {option}"] = path
    content = {
        "options": {name: value for name, value in values.items() if name not in files},
        "files": {column: (printable(path.name), sha256(path)) for column, path in files.items()},
        "versions": registry.packages(),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _tidy(folder: Path) -> None:
    """Remove what killed runs left beside the take's folder; nobody else is at work there, for the lock is ours."""
    for kind in ("partial", "old"):
        for left in folder.parent.glob(f".{escape(folder.name)}.{kind}-*"):
            shutil.rmtree(left, ignore_errors=True)


class Ended(NamedTuple):
    """exit_code: negative for the signal that ended it. reason: why it failed, in a sentence. code: of the refusal, if
    that was why."""

    exit_code: int
    reason: str = ""
    code: str = ""


def run_apart(work: Callable[[], object], log: Path, timeout_s: float | None) -> Ended:
    """How work() ended in a process of its own, which is stopped after `timeout_s` seconds; all that it prints goes to
    the file `log`. work: as multiprocessing can send it. OSError for a process that cannot be started or a log that
    cannot be written."""
    log.write_bytes(b"")
    os.environ.update(_ENVIRONMENT)  # which the process inherits
    context = process_context(PRELOADED)
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_work_apart, args=(work, str(log), send))
    with receive:
        with send:
            process.start()
        process.join(timeout_s)
        if process.is_alive():
            kill(process)
            return Ended(124, f"took longer than the {timeout_s:g} s of --timeout, and was stopped")
        with suppress(EOFError):  # it sent nothing
            return receive.recv()
        code = process.exitcode
        if code >= 0:
            return Ended(code, f"it ended with exit code {code}" * bool(code))
        names = {sent.value: sent.name for sent in signal.Signals}
        stopped_by = names.get(-code, f"signal {-code}")
        return Ended(code, f"its process was stopped by {stopped_by}; see its log.")


def end_takes() -> None:
    """End the takes that this process runs; each tidies up first."""
    asked, late_s = set[BaseProcess](), time.monotonic() + _TO_END_S
    while running := active_children():
        for process in running:
            if process not in asked:
                process.terminate()
                asked.add(process)
            elif time.monotonic() > late_s:
                kill(process)
        time.sleep(0.05)


def failure(error: Exception) -> Ended:
    """Why a take failed: exit code 2 for its input, 1 for a fault of a program."""
    if isinstance(error, InputError):
        return Ended(2, str(error), error.code)
    if isinstance(error, OSError):
        return Ended(
            2, f"{error.filename or 'A file'} could not be read or written: {error.strerror or error}."
        )
    return Ended(
        1,
        f"a fault of pcnet3d or of a package that adds to it: {type(error).__name__}: {error}; see its log.",
    )


def _work_apart(work: Callable[[], object], log: str, answer: Connection) -> None:
    """The work, in its process: says all to the log, and answers why it failed if it did."""
    leave_terminal()
    threading.Thread(target=_leave_with_parent, daemon=True).start()
    with open(log, "ab") as file:  # also for what libraries say
        for descriptor in (1, 2):
            os.dup2(file.fileno(), descriptor)
    limit_opencv()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))  # so that half-made files go
    try:
        work()
    except Exception as error:
        traceback.print_exc()
        answer.send(failure(error))


def _leave_with_parent() -> None:
    """Leave as on SIGTERM when the batch is gone, or at once if that does not help."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    terminate_self()
    time.sleep(_TO_END_S)
    os._exit(1)
