"""Whether a movement was seen, was not there, cannot be told, or was not looked for."""

from __future__ import annotations

from collections.abc import Sequence

from ...pipeline.core.measures import CANNOT_BE_TOLD, NONE, NOT_LOOKED_FOR, SEEN, Measure, Remark, Row


def with_outcome(rows: Sequence[Row], looked: bool = True) -> list[Row]:
    """The rows of a movement with the remark `outcome` in front of them, a code of pipeline/core/measures.py. looked:
    False where something is lacking without which nobody can look for it.

    A count of 0 says that there was none, unless its `reason` says where one may be hidden.
    """
    counts = [row for row in rows if isinstance(row, Measure) and row.name in ("count", "steps")]
    hidden = any(isinstance(row, Remark) and row.name == "reason" for row in rows)
    if any(row.value for row in counts):
        code = SEEN
    elif not looked:
        code = NOT_LOOKED_FOR
    else:
        code = NONE if counts and not hidden else CANNOT_BE_TOLD
    return [Remark("outcome", code), *rows]


def never_looked_for() -> list[Row]:
    """The rows of a movement that no part of the program recognises."""
    return [Remark("outcome", NOT_LOOKED_FOR)]
