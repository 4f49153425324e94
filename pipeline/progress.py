"""What a job says on stderr: where it is (a bar on a terminal, else a line a stage or nothing), what it found."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from .people import PersonRun
from .take import Take
from .verdict import verdict_words

_SECONDS_A_LINE = 20.0


@contextmanager
def stages(names: list[str]) -> Iterator[Callable[[str, float], None]]:
    """A callback (stage, seconds) to be called after each of the named stages."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda stage, seconds: print(f"{stage}: {seconds:.2f} s", file=sys.stderr)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>12}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(names[0], total=len(names))

        def done(stage: str, seconds: float) -> None:
            following = names[names.index(stage) + 1 :]
            bar.update(task, advance=1, description=following[0] if following else "done")

        yield done


@contextmanager
def counted(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A callback (how many of the total are done): a bar with rate and time left on a terminal, elsewhere a line now
    and then."""
    if sys.stderr is None or not sys.stderr.isatty():
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

        def done(count: int) -> None:
            speed = bar.tasks[task].speed
            bar.update(task, completed=count, rate=f"{speed:.1f}/s" if speed else "")

        yield done


def _lines(what: str, total: int | None) -> Callable[[int], None]:
    start = said = time.monotonic()
    first: int | None = None

    def done(count: int) -> None:
        nonlocal said, first
        first = count if first is None else first
        now = time.monotonic()
        if now - said < _SECONDS_A_LINE or count == first:
            return
        said, rate = now, (count - first) / (now - start)
        words = f"{what}: {count}, {rate:.1f}/s"
        if total is not None:
            words = f"{what}: {count} of {total}, {rate:.1f}/s, {(total - count) / rate / 60:.0f} min left"
        print(words, file=sys.stderr)

    return done


@contextmanager
def now_and_then(what: str, total: int | None) -> Iterator[Callable[[int], None]]:
    """As `counted`; where nobody knows the total, a line now and then."""
    if total is not None:
        with counted(what, total) as done:
            yield done
        return
    yield _lines(what, None)


def tell(take: Take, who: str = "") -> None:
    """The take's warnings, repairs and notes, one line each."""
    for event in take.events:
        if event.kind in ("warning", "repair", "note"):
            print(f"{event.kind}: {who}{event.text}", file=sys.stderr)


def conclude(take: Take, who: str = "") -> None:
    """What `pcnet3d inspect` says of the take's poses, for the last line of a run."""
    if take.findings is not None:
        print(f"{who}{verdict_words(take.findings)}")


def tell_people(runs: Sequence[PersonRun]) -> None:
    """The same of several people's, and who was left out."""
    for run in runs:
        if run.take is None:
            print(f"warning: person {run.person} was left out: {run.reason}", file=sys.stderr)
        else:
            tell(run.take, f"person {run.person}: ")
