"""Poses out of live while it runs: a line of JSON each on standard output."""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many, say
from .frames import LivePose

_WAITING = 64  # lines for a program that reads slowly: 2 s
_END_S = 2.0  # that it gets for the last ones

Send = Callable[[LivePose], None]


@contextmanager
def json_lines() -> Iterator[Send]:
    """A callback that prints a pose on standard output, and does not wait. A reader that is gone is told of once, and
    nothing else changes. InputError where standard output is closed."""
    if sys.stdout is None:
        raise InputError("not-reached", "--json prints on standard output, but that is closed.")
    lines = _Lines(sys.stdout.fileno())
    try:
        yield lambda pose: lines.put(as_json(pose))
    finally:
        lines.close()


def as_json(pose: LivePose) -> bytes:
    """One object and a line's end."""
    return json.dumps(pose.as_dict(), allow_nan=False, separators=(",", ":")).encode() + b"\n"


class _Lines:
    """Lines into a pipe by a thread of its own, so that a program that reads slowly, or has ended, stops nobody."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._waiting: queue.Queue[bytes | None] = queue.Queue(_WAITING)
        self._gone = threading.Event()
        self._lost = 0
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def put(self, line: bytes) -> None:
        if self._gone.is_set():
            return
        try:
            self._waiting.put_nowait(line)
        except queue.Full:
            if not self._lost:
                say("warning", "standard output is read too slowly: poses are left out of it.")
            self._lost += 1

    def close(self) -> None:
        try:
            self._waiting.put(None, timeout=_END_S)
            self._thread.join(_END_S)
        except queue.Full:
            pass
        if self._lost:
            say(
                "live",
                f"{how_many(self._lost, 'pose')} left out of standard output, which was read too slowly",
            )

    def _write(self) -> None:
        while (line := self._waiting.get()) is not None:
            try:
                while line:  # past Python's own buffer, whose lock a writer that waits would keep for good
                    line = line[os.write(self._descriptor, line) :]
            except OSError as error:
                self._gone.set()
                say("warning", f"standard output is closed ({error.strerror}); live goes on without it.")
                return
