"""Packages that only an extra of pyproject.toml brings."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .errors import InputError


@contextmanager
def needed_for(what: str, extra: str = "train") -> Iterator[None]:
    """Around imports of an extra: InputError that says what needs the package that is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise InputError(
            "needs-package",
            f"{what} needs {error.name}, which is not installed: pip install 'pcnet3d[{extra}]'.",
        ) from None
