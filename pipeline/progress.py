"""Where a long job is: a bar when stderr is a terminal, a line now and then when it is not."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def stages(names: list[str]) -> Iterator[Callable[[str, float], None]]:
    """A callback (stage, seconds) to be called after each of the named stages."""
    if not sys.stderr.isatty():
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
