"""The one error a user should ever see."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from .messages import in_one_line

_LONGEST = 1000  # characters; names and values out of a file may be of any length


@cache
def refusals() -> dict[str, dict[str, str]]:
    """By every code of a refusal, "why" an input cannot be used, and how a program may "act" (refusals.toml)."""
    return tomllib.loads(Path(__file__).with_name("refusals.toml").read_text(encoding="utf-8"))


def listed() -> list[dict[str, str]]:
    """Rows of `pcnet3d list refusals`, each with three texts."""
    rows = refusals().items()
    return [{"code": code, "why": each["why"], "what to do": each["act"]} for code, each in rows]


class InputError(ValueError):
    """Input or options that cannot be used.

    code: why, for programs (refusals.toml); TypeError for one that there is not. The message is one sentence for
    the user: what was expected, what came, what to do. It often quotes a file, so that it is kept to one line of
    printable characters, and its middle is left out when it is long. The command line prints it and exits with code 2.
    """

    code: str

    def __init__(self, code: str, message: str) -> None:
        if code not in refusals():
            raise TypeError(f"Expected a code of {', '.join(refusals())}; got '{code}'.")
        shown = in_one_line(message)
        if len(shown) > _LONGEST:
            shown = f"{shown[: _LONGEST - 303]} ... {shown[-298:]}"
        super().__init__(shown)
        self.code = code

    def __reduce__(self) -> tuple[Any, ...]:  # that of exceptions would give the message alone
        return type(self), (self.code, str(self)), self.__dict__


@contextmanager
def readable(path: object, what: str) -> Iterator[None]:
    """InputError, saying that `what` was expected, where a file that is read inside cannot be opened or is no text in
    UTF-8."""
    try:
        yield
    except OSError as error:
        raise InputError("cannot-open", f"Expected {what} at {path}: {error.strerror or error}.") from None
    except UnicodeDecodeError:
        raise InputError(
            "format-unknown", f"Expected {what} in {path}, got bytes that are not UTF-8 text."
        ) from None


@contextmanager
def naming(place: object) -> Iterator[None]:
    """An InputError of what is inside begins with the place, a file or a line of it, unless it names that already."""
    try:
        yield
    except InputError as error:
        if str(place) in str(error):
            raise
        raise InputError(
            error.code, f"{place}: {error}"
        ) from error.__cause__  # what a user's own function raised


@contextmanager
def needed_for(what: str, extra: str = "train") -> Iterator[None]:
    """Around imports of an extra of pyproject.toml: InputError that says what needs the package that is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise InputError(
            "needs-package",
            f"{what} needs {error.name}, which is not installed: pip install 'pcnet3d[{extra}]'.",
        ) from None
