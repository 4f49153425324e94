"""Options by name: unknown ones are refused with their nearest neighbours, values are checked by type."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from ..core.errors import InputError


def did_you_mean(word: str, names: Iterable[str]) -> str:
    """A sentence that names the nearest of the names, or all of them."""
    names = sorted(names)
    near = get_close_matches(word, names, n=3, cutoff=0.5)
    if near:
        return f"did you mean {' or '.join(near)}?"
    return f"known are {', '.join(names)}." if names else "none are known."


def pairs(given: Iterable[str] | None, flag: str = "--option") -> dict[str, str]:
    """Options as a command line gives them, KEY=VALUE each, by key; InputError for anything else."""
    options = {}
    for text in given or ():
        key, equals, value = text.partition("=")
        if not equals:
            raise InputError("bad-value", f"Expected KEY=VALUE after {flag}, got '{text}'.")
        options[key.strip()] = value
    return options


def files_among(options: Mapping[str, Any]) -> dict[str, Path]:
    """The options whose value is the path of a file that is there, as seen from the current folder."""
    return {
        name: Path(value)
        for name, value in options.items()
        if isinstance(value, str | Path) and os.path.isfile(value)  # False too for a text that can be no path
    }


def call(function: Callable[..., Any], *args: Any, what: str, options: dict[str, Any]) -> Any:
    """function(*args, **options) after checking each option's name and type against the signature.

    Text values, as a command line gives them, become numbers and booleans where the signature asks for them.
    InputError for an unknown option, one that is missing, or a value of another type.
    """
    given = checked(function, *args, what=what, options=options)
    try:
        inspect.signature(function).bind(*args, **given)
    except TypeError as error:
        raise InputError("needs-input", f"{what}: {error}; give it as an option.") from None
    return function(*args, **given)


def checked(function: Callable[..., Any], *args: Any, what: str, options: dict[str, Any]) -> dict[str, Any]:
    """The options in the types that the signature asks for; several values in one text stand between commas.
    InputError for an unknown option or a value of another type."""
    from pydantic import ConfigDict, PydanticUserError, TypeAdapter, ValidationError

    parameters = list(inspect.signature(function).parameters.values())[len(args) :]
    names = {parameter.name for parameter in parameters if parameter.kind is not parameter.VAR_KEYWORD}
    hints, open_ended = option_types(function), len(names) < len(parameters)
    values, finite = {}, ConfigDict(allow_inf_nan=False)
    for name, value in options.items():
        if name not in names and not open_ended:
            raise InputError("name-unknown", f"{what} has no option '{name}'; {did_you_mean(name, names)}")
        hint = hints.get(name, Any)
        kinds = [get_origin(part) or part for part in (hint, *get_args(hint))]
        listed = value.split(",") if isinstance(value, str) and tuple in kinds else value
        try:
            adapter = TypeAdapter(hint, config=finite)
        except PydanticUserError:  # of a type that has a configuration of its own
            adapter = TypeAdapter(hint)
        try:
            values[name] = adapter.validate_python(listed)
        except ValidationError as error:
            raise InputError(
                "bad-value", f"{what}: option {name}={value!r}: {error.errors()[0]['msg']}."
            ) from None
    return values


def option_types(function: Callable[..., Any]) -> dict[str, Any]:
    """The types of a function's or a class's options by name."""
    return get_type_hints(function.__init__ if inspect.isclass(function) else function)
