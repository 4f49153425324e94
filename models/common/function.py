"""Functions of a user's own in place of networks: how they are named, and what is said when they fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...pipeline.core.errors import InputError


def name_of(function: Callable[..., Any]) -> str:
    """As results name it."""
    return str(getattr(function, "__name__", type(function).__name__))


def failed(role: str, function: Callable[..., Any], what: str | Exception) -> InputError:
    """That a function raised, or answered something else. role: what it was given as. what: it did, in words; or what
    it raised."""
    if isinstance(what, Exception):
        what = f"it raised {type(what).__name__}: {what or 'without a reason'}"
    return InputError("plugin-broken", f"The function {name_of(function)}, given as {role}, failed: {what}")
