"""Options by name: unknown ones are refused with their nearest neighbours, values are checked by type."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from difflib import get_close_matches
from typing import Any, get_type_hints

from pydantic import TypeAdapter, ValidationError

from ..errors import InputError


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A sentence that names the nearest of the known words, or all of them."""
    known = sorted(known)
    near = get_close_matches(word, known, n=3, cutoff=0.5)
    if near:
        return f"did you mean {' or '.join(near)}?"
    return f"known are {', '.join(known)}." if known else "none are known."


def pairs(given: Iterable[str] | None) -> dict[str, str]:
    """Options as a command line gives them, KEY=VALUE each, by key; InputError for anything else."""
    found = {}
    for text in given or ():
        key, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"Expected KEY=VALUE after --option, got '{text}'.")
        found[key.strip()] = value
    return found


def call(function: Callable[..., Any], *args: Any, what: str, options: dict[str, Any]) -> Any:
    """function(*args, **options) after checking each option's name and type against the signature.

    Text values, as a command line gives them, become numbers and booleans where the signature asks for them.
    InputError for an unknown option, one that is missing, or a value of another type.
    """
    parameters = list(inspect.signature(function).parameters.values())[len(args) :]
    open_ended = any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters)
    known = {parameter.name for parameter in parameters if parameter.kind is not parameter.VAR_KEYWORD}
    hints = get_type_hints(function.__init__ if inspect.isclass(function) else function)
    checked = {}
    for name, value in options.items():
        if name not in known and not open_ended:
            raise InputError(f"{what} has no option '{name}'; {did_you_mean(name, known)}")
        try:
            checked[name] = TypeAdapter(hints[name]).validate_python(value) if name in hints else value
        except ValidationError as error:
            raise InputError(f"{what}: option {name}={value!r}: {error.errors()[0]['msg']}.") from None
    missing = [
        parameter.name
        for parameter in parameters
        if parameter.default is parameter.empty and parameter.name in known and parameter.name not in checked
    ]
    if missing:
        raise InputError(f"{what} needs the option{'s' * (len(missing) > 1)} {', '.join(missing)}.")
    return function(*args, **checked)
