"""The limits by which checks decide. models/limits.toml has each with its unit, what it tells, the source that it was
chosen by, and how many people the takes are of that it was chosen on."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

_FILE = Path(__file__).parents[2] / "models" / "limits.toml"


def limit(name: str) -> Any:
    """The value of a limit, such as "joints-exchanged.steadier": a number, or a tuple of several. KeyError for a name
    that the file has not."""
    value = limits()[name]["value"]
    return tuple(value) if isinstance(value, list) else value


@cache
def limits() -> dict[str, dict[str, Any]]:
    """By name, with the fields of the file."""
    checks = tomllib.loads(_FILE.read_text(encoding="utf-8"))
    return {f"{check}.{name}": fields for check, named in checks.items() for name, fields in named.items()}
