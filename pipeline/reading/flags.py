"""The options of a run (reading/settings.py) on the command line, and those that stand beside them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import typer

from .settings import PLACES, RunOptions


def _output(text: str, *names: str) -> Any:
    return typer.Option(*names, help=text, rich_help_panel="Output")


Output = Annotated[Path, _output("Folder for the results.", "-o", "--output")]
Force = Annotated[bool, _output("Overwrite the output folder even if pcnet3d did not create it.", "--force")]
Resume = Annotated[bool, _output("Continue an interrupted detection in this output folder.", "--resume")]
Strict = Annotated[
    bool,
    _output(
        "Exit with code 3 if the poses are suspicious, 4 if they are unusable or up was not found.",
        "--strict",
    ),
]


def offering(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator of a command whose first parameter is the RunOptions: on the command line it has those fields as
    options, besides its own; without names all of them."""

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        shown = names or tuple(PLACES)
        own = list(inspect.signature(function, eval_str=True).parameters.values())[1:]
        shared = [_parameter(name) for name in shown]
        own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in own]

        @wraps(function)
        def command(*args: Any, **given: Any) -> None:
            shared_values = {name: given.pop(name) for name in shown if name in given}
            function(
                RunOptions(**{name: value for name, value in shared_values.items() if value is not None}),
                *args,
                **given,
            )

        command.__signature__ = inspect.Signature([*shared, *own])  # type: ignore[attr-defined]
        command.__annotations__ = {parameter.name: parameter.annotation for parameter in (*shared, *own)}
        return command

    return decorate


def is_repeatable(name: str) -> bool:
    """Whether a field may be given several times on the command line."""
    return _typer_type(RunOptions.model_fields[name].annotation) == list[str] | None


def _typer_type(hint: Any) -> Any:
    """What typer is to read for a field of that type: pairs and lists one by one, and sizes and vectors as text."""
    parts = [hint, *get_args(hint)]
    kinds = [get_origin(part) or part for part in parts]
    if dict in kinds or Ellipsis in get_args(hint):
        return list[str] | None
    return str | None if tuple in kinds else hint


def _parameter(name: str) -> inspect.Parameter:
    field = RunOptions.model_fields[name]
    default = None if isinstance(field.default, dict | tuple) else field.default
    annotation = Annotated[_typer_type(field.annotation), PLACES[name]]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
