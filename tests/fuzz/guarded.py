"""Readings in a process of their own that are watched: how they ended, how long they took, how much memory they took.

Memory is the rise of the process's peak resident set (VmHWM of /proc/self/status, which a 5 written to
/proc/self/clear_refs sets back) over what it held before; its address space is limited to 4 GiB more than it had at the
start. Time is the process's CPU time, as other programs may hold the cores; a reading of more than a minute of it is
killed.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import time
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

KILLED_S = 60.0
_ROOM = 4 << 30
_LONGEST = 1500  # characters of a sentence


@dataclass(frozen=True)
class Outcome:
    """ended: "valid", "refused" (InputError) or the kind of finding: "error", "words" (an InputError that is no one
    printable line, or hides a lack of memory), "crash", "hang". said: the message or the traceback's end."""

    ended: str
    said: str = ""
    seconds: float = 0.0
    peak: int = 0


def _memory(key: str) -> int:
    with open("/proc/self/status", encoding="utf-8") as status:
        return next(int(line.split()[1]) * 1024 for line in status if line.startswith(key))


def watched(reading: Callable[[], object]) -> Outcome:
    """The reading, done here."""
    from pcnet3d.pipeline import InputError

    with suppress(OSError), open("/proc/self/clear_refs", "w", encoding="utf-8") as file:
        file.write("5")
    before, start = _memory("VmRSS"), time.process_time()
    ended, said = "valid", ""
    try:
        reading()
    except InputError as error:
        said = str(error)
        ended = "refused" if said.isprintable() and len(said) < _LONGEST and not _starved(error) else "words"
    except BaseException as error:
        places = [f"{Path(at.filename).name}:{at.lineno}" for at in traceback.extract_tb(error.__traceback__)]
        said = f"{type(error).__name__}: {str(error)[:300]} at {' '.join(places[-6:])}"
        ended = "error"
    seconds = time.process_time() - start
    return Outcome(ended, said, seconds, max(_memory("VmHWM") - before, 0))


def _starved(error: BaseException | None) -> bool:
    """Whether a lack of memory lies behind an error: then something was allocated before it was checked."""
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        error = error.__context__
    return False


def _serve(read: Callable[[Any], object], pipe: Connection) -> None:
    warnings.simplefilter("ignore")  # of libraries about damaged files
    limit = _memory("VmSize") + _ROOM
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    pipe.send(None)
    while (file := pipe.recv()) is not None:
        pipe.send(watched(partial(read, file)))


class Worker:
    """A process that reads one file after the other; `ended` once one of them has ended it, until `start`."""

    def __init__(self, read: Callable[[Any], object]) -> None:
        """read: a function of a module, which is called there with each file."""
        self._read = read
        self.start()

    def start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(self._read, theirs), daemon=True)
        self.process.start()
        theirs.close()
        self.pipe.recv()
        self.ended = False

    def read(self, file: Any) -> Outcome:
        self.pipe.send(file)
        if self._answers():
            try:
                return self.pipe.recv()
            except EOFError:
                outcome = "crash"
        else:
            self.process.kill()
            outcome = "hang"
        self.process.join()
        self.ended = True
        return Outcome(outcome, f"exit code {self.process.exitcode}", KILLED_S if outcome == "hang" else 0.0)

    def _answers(self) -> bool:
        """Waits for an answer, or the end of the process; not when it has computed for too long."""
        start = self._computed_s()
        while not self.pipe.poll(0.5):
            if self._computed_s() - start > KILLED_S:
                return False
        return True

    def _computed_s(self) -> float:
        with suppress(OSError):
            status = Path(f"/proc/{self.process.pid}/stat").read_text(encoding="utf-8")
            user, system = status.rpartition(")")[2].split()[11:13]
            return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")
        return 0.0  # it has ended

    def close(self) -> None:
        with suppress(OSError):
            self.pipe.send(None)
        self.process.join(5)
        if self.process.is_alive():
            self.process.kill()
