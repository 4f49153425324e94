"""Processes that run takes one after another, so that Python and its packages start once for many takes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from ....pipeline.core.system import apart, kill
from .child import IDLE_S

# Takes of one process: what packages do not give back ends with it, such as 1.5 MB for each recording.
_MOST = 50
_TO_END_S = 5.0  # for a take that is asked to leave
# As many processes as there are cores: each computes with one thread, or they get in each other's way. One on every
# machine, since another number of threads rounds otherwise. What they say is read back here.
_ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_ENVIRONMENT |= {"OPENCV_FOR_THREADS_NUM": "1", "PYTHONIOENCODING": "utf-8"}


class Worker:
    """A process of child.py."""

    def __init__(self, log: Path) -> None:
        """log: for what it says before its first take, which is why it cannot start."""
        with open(log, "wb") as file:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-m", "pcnet3d.stages.study.batch.child"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=file,
                env={**os.environ, **_ENVIRONMENT},
                **apart(),
            )
        self._takes = 0
        self._since = time.monotonic()

    @property
    def is_ready(self) -> bool:
        """Whether it may have another take."""
        idle_s = time.monotonic() - self._since
        return self.process.poll() is None and self._takes < _MOST and idle_s < IDLE_S / 2

    def run(self, words: Sequence[str], log: Path, timeout_s: float | None) -> int:
        """As `run_in_worker`."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self._takes += 1
        late = threading.Event()
        timer = threading.Timer(timeout_s or 0, lambda: (late.set(), self.kill()))
        if timeout_s is not None:
            timer.start()
        with suppress(OSError, ValueError):  # it has died or is asked to leave, and says below how
            self.process.stdin.write(json.dumps({"words": list(words), "log": str(log)}).encode() + b"\n")
            self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if timeout_s is not None:
            timer.cancel()
            timer.join()
        if late.is_set():
            raise TimeoutError
        self._since = time.monotonic()
        return int(answer) if answer else self.process.wait()

    def kill(self) -> None:
        """End it at once, and what it has started."""
        kill(self.process)

    def ask_to_leave(self) -> None:
        """It tidies up first, as it does when its parent is gone."""
        with suppress(OSError):
            if self.process.stdin:
                self.process.stdin.close()

    def close(self) -> None:
        """End it, which has nothing to do, and let go of its pipes."""
        self.kill()
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                with suppress(BrokenPipeError):
                    pipe.close()


_idle: list[Worker] = []
_busy: set[Worker] = set()
_stopped = threading.Event()


def run_in_worker(words: Sequence[str], log: Path, timeout_s: float | None) -> int:
    """Exit code of `pcnet3d WORDS`, all of whose words go to the file `log`; negative: the signal that ended it.
    TimeoutError when it took longer than `timeout_s` seconds, and was ended. OSError for a process that cannot be
    started or a log that cannot be written."""
    worker = _free_worker(log)
    _busy.add(worker)
    if _stopped.is_set():
        worker.ask_to_leave()
    try:
        return worker.run(words, log, timeout_s)
    finally:
        _busy.discard(worker)
        if worker.is_ready:
            _idle.append(worker)
        else:
            worker.close()


def _free_worker(log: Path) -> Worker:
    """One that has nothing to do, else a new one; the log is empty."""
    log.write_bytes(b"")
    with suppress(IndexError):  # there is none, or another thread was faster
        while True:
            worker = _idle.pop()
            if worker.is_ready:
                return worker
            worker.close()
    return Worker(log)


def stop_takes() -> None:
    """End the takes that this process runs, and whichever would begin after them."""
    _stopped.set()
    for worker in tuple(_busy):
        worker.ask_to_leave()
    deadline = time.monotonic() + _TO_END_S
    for worker in tuple(_busy):
        try:
            worker.process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            worker.kill()


def close_workers() -> None:
    """End the processes that have nothing to do."""
    while _idle:
        _idle.pop().close()
