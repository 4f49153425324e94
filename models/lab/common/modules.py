"""Modules of this package that are commands:  python -m pcnet3d.models....fit"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, TypeVar

import typer

from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import say

T = TypeVar("T")


def run_command(command: Callable[..., None]) -> None:
    """Run a module's command. Bad input and files that cannot be read or written end as those of pcnet3d do: with one
    sentence and exit code 2."""
    try:
        typer.run(command)
    except InputError as error:
        reason = str(error)
    except OSError as error:
        reason = f"{error.filename or 'A file'} could not be read or written: {error.strerror or error}."
    else:
        return
    say("pcnet3d", reason)
    raise SystemExit(2)


def in_own_process(function: Callable[..., T], *arguments: Any) -> T:
    """function(*arguments) in a new process, whose memory and whose files read once are its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()
