"""Functions of a user's own in place of networks: how they are named, and what is said when they fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...pipeline.core.errors import InputError


def name_of(function: Callable[..., Any]) -> str:
    """As results name it."""
    return str(getattr(function, "__name__", type(function).__name__))


class FunctionError(Exception):
    """That a function raised, or answered something else. role: what it was given as. what: it did, in words; or what
    it raised."""

    def __init__(self, role: str, function: Callable[..., Any], what: str | Exception) -> None:
        reason = what
        if isinstance(what, Exception):
            reason = f"it raised {type(what).__name__}: {what or 'without a reason'}"
        super().__init__(f"The function {name_of(function)}, given as {role}, failed at {{where}}: {reason}")

    def at(self, where: str) -> InputError:
        """For the user. where: in which frames it failed."""
        return InputError("plugin-broken", str(self).replace("{where}", where, 1))
