"""Ctrl-C asks a long computation to stop after its present part, so that what was done so far is kept."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_KEEP_S = 60.0
_KEEP_RARELY = 20  # times as long as the last writing took


class Keeper:
    """To be called often: it calls `keep` once a minute, or more rarely, so that writing, which takes seconds after
    hours of work, is a small part of the time."""

    def __init__(self, keep: Callable[[], None]) -> None:
        self._keep, self._at = keep, time.monotonic() + _KEEP_S

    def __call__(self) -> None:
        start = time.monotonic()
        if start >= self._at:
            self._keep()
            now = time.monotonic()
            self._at = now + max(_KEEP_S, _KEEP_RARELY * (now - start))


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """A callback that says whether Ctrl-C was pressed meanwhile; pressed again, it interrupts as usual. Only the main
    thread gets Ctrl-C; in others nothing changes."""
    asked = False

    def note(number: int, frame: object) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)
