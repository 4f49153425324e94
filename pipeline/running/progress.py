"""How far long work is, and Ctrl-C, which asks it to stop after its present part so that what was done is kept."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from ..core.errors import InputError
from ..core.messages import is_verbose, on_terminal, say

_SECONDS_A_LINE = 20.0
Item = TypeVar("Item")
Done = Callable[..., None]  # told how many are done, and more words for the line


@contextmanager
def stages(names: list[str]) -> Iterator[Callable[[str, float], None]]:
    """A callback (stage, seconds) to be called after each of the named stages, as of `counted`; with -v a line each."""
    with counted("run", len(names)) as count:

        def done(stage: str, seconds: float) -> None:
            if is_verbose():
                say(stage, f"{seconds:.2f} s")
            count(1 + names.index(stage), f", {stage}")

        yield done


def each(items: Iterable[Item], what: str, total: int) -> Iterator[Item]:
    """The items one after another, while `counted` tells how many of the total are done."""
    with counted(what, total) as done:
        for number, item in enumerate(items, 1):
            yield item
            done(number)


@contextmanager
def counted(what: str, total: int | None) -> Iterator[Done]:
    """A callback (how many of the total are done, more words): a bar with rate and time left on a terminal, elsewhere,
    and where nobody knows the total, a line now and then."""
    if total is None or not on_terminal():
        yield _lines(what, total)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    # What is printed meanwhile goes above the bar, but a redirected stdout keeps its lines.
    show = sys.stdout is not None and sys.stdout.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=show) as bar:
        task = bar.add_task(what, total=total, rate="")

        def done(count: int, more: str = "") -> None:
            speed = bar.tasks[task].speed
            bar.update(task, completed=count, rate=f"{speed:.1f}/s{more}" if speed else "")

        yield done


def _lines(what: str, total: int | None) -> Done:
    start = last_line = time.monotonic()
    first: int | None = None

    def done(count: int, more: str = "") -> None:
        nonlocal last_line, first
        first = count if first is None else first
        now = time.monotonic()
        if now - last_line < _SECONDS_A_LINE or count == first:
            return
        last_line, rate = now, (count - first) / (now - start)
        line = f"{count}, {rate:.1f}/s"
        if total is not None:
            line = f"{count} of {total}, {rate:.1f}/s, {(total - count) / rate / 60:.0f} min left"
        say(what, line + more)

    return done


@contextmanager
def telling_of_kept(checkpoint: Path | None, resumed: bool) -> Iterator[None]:
    """Say what there is to go on from: before a run that would begin anew, and after one that failed. checkpoint:
    where a run keeps what it has detected, None if it detects nothing."""
    if checkpoint is not None and checkpoint.is_file() and not resumed:
        kept = (
            f"an interrupted run left its work in {checkpoint}, which this run replaces once it has found "
            "somebody; --resume continues from there"
        )
        say("note", kept)
    try:
        yield
    except BaseException as error:
        if checkpoint is not None and checkpoint.is_file():
            the = "put right what is named below, and the" if isinstance(error, InputError) else "the same"
            say("note", f"finished work is kept; {the} command with --resume continues from there")
        raise


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
