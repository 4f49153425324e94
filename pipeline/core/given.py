"""Arrays that a caller gives in memory, whatever library made them."""

from __future__ import annotations

from typing import Any

import numpy as np

from .errors import InputError


def numbers(values: Any, what: str) -> np.ndarray:
    """The values (...,) as float32 or, if they are finer, float64: an array, nested lists, or a torch tensor, from
    whichever device. what: they are, for the error. InputError for anything but numbers, and for infinite ones."""
    if hasattr(values, "detach"):  # a torch tensor
        values = values.detach().cpu()
        values = (values.float() if "bfloat16" in str(values.dtype) else values).numpy()
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as error:
        raise InputError("wrong-content", f"Expected {what} as an array of numbers: {error}.") from None
    if array.dtype.kind not in "fiu":
        raise InputError("wrong-content", f"Expected {what} as an array of numbers, got {array.dtype}.")
    array = array.astype(np.result_type(np.float32, array.dtype), copy=False)
    if np.isinf(array).any():
        raise InputError("wrong-content", f"Expected {what} as finite numbers or NaN, got infinite ones.")
    return array
