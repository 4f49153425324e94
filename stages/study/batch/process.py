"""A take in a process of its own, so that one that crashes or hangs costs nothing else."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import active_children, parent_process
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NamedTuple

from ....pipeline.core.errors import InputError
from ....pipeline.core.system import kill, leave_terminal, limit_opencv, process_context, terminate_self

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
    "pcnet3d.pipeline.running.run", "pcnet3d.stages.study.batch.process",
)  # fmt: skip


class Ended(NamedTuple):
    """exit_code: negative for the signal that ended it. reason: why it failed, in a sentence. code: of the refusal, if
    that was why."""

    exit_code: int
    reason: str = ""
    code: str = ""


def run_apart(work: Callable[[], object], log: Path, timeout_s: float | None) -> Ended:
    """How work() ended in a process of its own; all that it prints goes to the file `log`. work: as multiprocessing can
    send it.

    TimeoutError when it took longer than `timeout_s` seconds, and was ended. OSError for a process that cannot be
    started or a log that cannot be written."""
    log.write_bytes(b"")
    os.environ.update(_ENVIRONMENT)  # which the process inherits
    context = process_context(PRELOADED)
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(work, str(log), send))
    with receive:
        with send:
            process.start()
        process.join(timeout_s)
        if process.is_alive():
            kill(process)
            raise TimeoutError
        with suppress(EOFError):  # it sent nothing
            return receive.recv()
        return _without_words(process.exitcode)


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


def _run(work: Callable[[], object], log: str, answer: Connection) -> None:
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


def _without_words(exit_code: int) -> Ended:
    """How a process ended that did not say it."""
    if exit_code >= 0:
        return Ended(exit_code, f"it ended with exit code {exit_code}" * bool(exit_code))
    names = {sent.value: sent.name for sent in signal.Signals}
    stopped_by = names.get(-exit_code, f"signal {-exit_code}")
    return Ended(exit_code, f"its process was stopped by {stopped_by}; see its log.")


def _leave_with_parent() -> None:
    """Leave as on SIGTERM when the batch is gone, or at once if that does not help."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    terminate_self()
    time.sleep(_TO_END_S)
    os._exit(1)
