"""How a file begins, which is all that recognising it may read."""

from __future__ import annotations

from pathlib import Path


def first_bytes(path: Path, count: int) -> bytes:
    """At most `count` bytes of a file; none of anything else and of what cannot be read. Never raises."""
    try:
        if not path.is_file():
            return b""
        with path.open("rb") as file:
            return file.read(count)
    except OSError:
        return b""
