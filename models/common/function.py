"""Functions of a user's own in place of networks: how they are named, what they answer, and what is said when they
fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.reading.given import numbers


def name_of(function: Callable[..., Any]) -> str:
    """As results name it."""
    return str(getattr(function, "__name__", type(function).__name__))


def answer_of(role: str, function: Callable[..., Any], what: str, *given: Any) -> np.ndarray:
    """(...,) what the function answers, of no elements where that is None. role: what it was given as. what: it has to
    answer, in words. InputError where it raises, and for anything but numbers."""
    try:
        answer = function(*given)
    except Exception as error:
        reason = f"it raised {type(error).__name__}: {error or 'without a reason'}"
        raise failed(role, function, reason) from error
    try:
        return numbers([] if answer is None else answer, what)
    except InputError as error:
        raise failed(role, function, str(error)) from None


def failed(role: str, function: Callable[..., Any], what: str) -> InputError:
    """That a function, given as `role`, failed. what: it did, in words."""
    return InputError("plugin-broken", f"The function {name_of(function)}, given as {role}, failed: {what}")
