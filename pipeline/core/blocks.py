"""A long take some minutes at a time: what is made on the way takes many times the memory of the answer."""

from __future__ import annotations

from collections.abc import Iterator


def blocks(rows: int, most: int = 4096) -> Iterator[slice]:
    """Slices of at most so many rows, which together are all of them."""
    return (slice(start, min(start + most, rows)) for start in range(0, rows, most))


def overlapping(rows: int, most: int, margin: int) -> Iterator[tuple[slice, slice, slice]]:
    """The same; each with `margin` rows more on either side, as far as there are any, and where it lies among those."""
    for kept in blocks(rows, most):
        wide = slice(max(kept.start - margin, 0), min(kept.stop + margin, rows))
        yield kept, wide, slice(kept.start - wide.start, kept.stop - wide.start)
