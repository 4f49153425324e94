"""Adapters, stages, commands and models by name, found through entry points; a third party's package is found alike."""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from .errors import InputError
from .options import did_you_mean


@cache
def registered(group: str) -> dict[str, EntryPoint]:
    """The entry points of "adapters", "stages", "commands" or "models" by name; two of one name are refused."""
    found: dict[str, EntryPoint] = {}
    for point in entry_points(group=f"pcnet3d.{group}"):
        other = found.setdefault(point.name, point)
        if other.value != point.value:
            raise InputError(
                f"Two packages register {group[:-1]} '{point.name}': {other.value} and {point.value}; "
                "uninstall one of them."
            )
    return dict(sorted(found.items()))


def load(group: str, name: str) -> Any:
    """The object registered under that name; InputError naming its nearest neighbours when there is none,
    or its package when it cannot be imported."""
    points = registered(group)
    if name not in points:
        raise InputError(f"There is no {group[:-1]} '{name}'; {did_you_mean(name, points)}")
    try:
        return points[name].load()
    except Exception as error:
        raise InputError(
            f"The {group[:-1]} '{name}' ({points[name].value}) cannot be loaded: {error}; "
            "repair or uninstall its package."
        ) from error
