"""What a command says besides its results, on stderr: wrapped and coloured on a terminal, plain lines elsewhere."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence

_STYLES = {
    "warning": "bold yellow",
    "repair": "magenta",
    "note": "cyan",
    "failed": "bold red",
    "pcnet3d": "bold red",
}
_verbose = False


def in_one_line(text: str) -> str:
    """A text of a stranger's file in one line of printable characters, which no terminal takes for a command."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in " ".join(text.split()))


def how_many(count: int, one: str, more: str = "") -> str:
    """A count in a sentence: how_many(1, "row") is "1 row", and of 2 "2 rows". more: the words behind any other
    count, where they are not `one` with an s."""
    return f"{count} {one if count == 1 else more or one + 's'}"


def first_few(values: Iterable[object], most: int = 5) -> str:
    """The first of them for a sentence: "3, 5, 7, 9, 11 and 4 more"."""
    texts = [str(value) for value in values]
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return ", ".join(texts[:most]) + more


def rate_in_words(fps: float, before: str) -> str:
    """Frames a second behind the words before them, such as " at 30 a second"; empty where one frame has no rate."""
    return f"{before}{fps:.4g} a second" if math.isfinite(fps) else ""


def spans_in_words(spans: Sequence[tuple[float, float]], most: int = 3) -> str:
    """Times from one second to another, such as "0.50 to 1.00 s, 2.00 to 3.00 s and 2 more times", of which so many are
    told; those that overlap as one, but not two that meet at an image."""
    apart: list[list[float]] = []
    for begin, end in sorted(map(tuple, spans)):
        if apart and begin < apart[-1][1]:
            apart[-1][1] = max(end, apart[-1][1])
        else:
            apart.append([begin, end])
    listed = ", ".join(f"{begin:.2f} to {end:.2f} s" for begin, end in apart[:most])
    more = len(apart) - most
    return f"{listed} and {how_many(more, 'more time')}" if more > 0 else listed


def bound_in_words(bound: float) -> str:
    """A bound or an error in degrees, to the digits that it leaves: "0.8", "8"."""
    return f"{bound:.1f}" if round(bound, 1) < 3 else f"{bound:.0f}"


def set_verbose(verbose: bool) -> None:
    """Whether this process also says what only somebody who looks for a fault wants to know, and all notices."""
    global _verbose
    _verbose = verbose


def is_verbose() -> bool:
    """Whether this process says that too."""
    return _verbose


def on_terminal() -> bool:
    """Whether stderr is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()


def say(kind: str, text: str) -> None:
    """A line "KIND: TEXT" on stderr. kind: "warning", "repair", "note" or another word."""
    if not on_terminal():
        print(f"{kind}: {text}", file=sys.stderr)
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    style = _STYLES.get(kind, "bold")
    line = Table.grid()
    line.add_row(Text(f"{kind}: ", style), Text(text, style if kind == "warning" else ""))
    Console(stderr=True).print(line)
