"""A take in a process of its own, so that one that crashes or hangs costs nothing else."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import parent_process
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NamedTuple

from ....pipeline.cli import main
from ....pipeline.core.errors import InputError
from ....pipeline.core.system import kill, leave_terminal, process_context, terminate_self

_TO_END_S = 5.0  # for a take that is asked to leave
# As many processes as there are cores: each computes with one thread, or they get in each other's way. One on every
# machine, since another number of threads rounds otherwise. What they say is read back here.
_ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_ENVIRONMENT |= {"OPENCV_FOR_THREADS_NUM": "1", "PYTHONIOENCODING": "utf-8"}
# What takes most of a run's start and begins no thread, which a process that is forked would lack.
PRELOADED = (
    "scipy.signal", "scipy.stats", "scipy.interpolate", "scipy.ndimage", "scipy.spatial.transform", "cv2", "av",
    *(f"pcnet3d.stages.{stage}" for stage in ("lift", "place", "angles", "trajectories")),
    *(f"pcnet3d.stages.{stage}.stage" for stage in ("measures", "record", "export", "report")),
    "pcnet3d.pipeline.running.command", "pcnet3d.stages.study.batch.process",
)  # fmt: skip


class Ended(NamedTuple):
    """exit_code: negative for the signal that ended it. code: of the refusal, if that was why."""

    exit_code: int
    code: str = ""


_running: set[BaseProcess] = set()
_stopped = threading.Event()


def run_apart(words: Sequence[str], log: Path, timeout_s: float | None) -> Ended:
    """How `pcnet3d WORDS` ended in a process of its own, all of whose words go to the file `log`.

    TimeoutError when it took longer than `timeout_s` seconds, and was ended. OSError for a process that cannot be
    started or a log that cannot be written."""
    log.write_bytes(b"")
    os.environ.update(_ENVIRONMENT)  # which the process inherits
    context = process_context(PRELOADED)
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(list(words), str(log), send))
    with receive:
        with send:
            process.start()
        _running.add(process)
        try:
            if _stopped.is_set():
                process.terminate()
            process.join(timeout_s)
            if process.is_alive():
                kill(process)
                raise TimeoutError
            assert process.exitcode is not None
            with suppress(EOFError):  # it sent nothing
                return Ended(process.exitcode, receive.recv())
            return Ended(process.exitcode)
        finally:
            _running.discard(process)
            process.close()


@contextmanager
def ending_takes() -> Iterator[None]:
    """When the block is left by an exception, the takes that this process runs are ended, and whichever would begin
    after them; each tidies up first."""
    _stopped.clear()
    try:
        yield
    except BaseException:
        _stopped.set()
        running = tuple(_running)
        for process in running:
            with suppress(ValueError):  # it has ended meanwhile
                process.terminate()
        deadline = time.monotonic() + _TO_END_S
        while _running.intersection(running) and time.monotonic() < deadline:
            time.sleep(0.05)
        for process in running:
            with suppress(ValueError):
                kill(process)
        raise


def _run(words: list[str], log: str, answer: Connection) -> None:
    """The command, in its process: says all to the log, and answers with the code of its refusal if there is one."""
    leave_terminal()
    threading.Thread(target=_leave_with_parent, daemon=True).start()
    with open(log, "ab") as file:  # also for what libraries say
        for descriptor in (1, 2):
            os.dup2(file.fileno(), descriptor)
    sys.argv = ["pcnet3d", *words]
    try:
        main()
    except SystemExit as end:
        refusal = end.__context__  # for which `main` ended
        if isinstance(refusal, InputError):
            answer.send(refusal.code)
        raise


def _leave_with_parent() -> None:
    """Leave as on SIGTERM when the batch is gone, or at once if that does not help."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    terminate_self()
    time.sleep(_TO_END_S)
    os._exit(1)
