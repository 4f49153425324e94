"""Packages that only training needs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ....pipeline.core.errors import InputError


@contextmanager
def needed_for(what: str) -> Iterator[None]:
    """Around imports of the extra "train": InputError that says what needs the package that is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise InputError(
            "needs-package",
            f"{what} needs {error.name}, which is not installed: pip install 'pcnet3d[train]'.",
        ) from None
