"""Adapters, stages, commands and models by name, found through entry points; a third party's package is found alike."""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from ..errors import InputError
from ..messages import say
from .options import did_you_mean

# What pcnet3d asks of an object before it is used (pipeline/plugins/protocols.py).
_SOCKETS = {
    "adapters": ("name", "gives", "reads", "sniff", "read"),
    "stages": ("name", "needs", "gives", "__call__"),
    "models": ("name", "kind", "what"),
}


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
    or its package when it cannot be imported or lacks what every one of its group has."""
    points = registered(group)
    if name not in points:
        raise InputError(f"There is no {group[:-1]} '{name}'; {did_you_mean(name, points)}")
    try:
        loaded = points[name].load()
    except Exception as error:
        raise _broken(group, points[name], str(error)) from error
    missing = [attribute for attribute in _SOCKETS.get(group, ()) if not hasattr(loaded, attribute)]
    if missing:
        raise _broken(group, points[name], f"it has no {', '.join(missing)}")
    return loaded


@cache
def load_all(group: str) -> dict[str, Any]:
    """Every object of the group by name; one that cannot be loaded is left out with a warning on stderr, so that a
    broken package does not keep the others from working."""
    found = {}
    for name in registered(group):
        try:
            found[name] = load(group, name)
        except InputError as error:
            say("warning", str(error))
    return found


def _broken(group: str, point: EntryPoint, reason: str) -> InputError:
    return InputError(
        f"The {group[:-1]} '{point.name}' ({point.value}) cannot be loaded: {reason}; "
        "repair or uninstall its package."
    )
