"""Everything that has a name, found through entry points; a third party's package is found alike."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import nullcontext
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from itertools import chain
from pathlib import Path
from typing import Any

from ..core.errors import InputError, needed_for
from ..core.messages import say
from .options import did_you_mean
from .removed import refuse_removed

# What pcnet3d asks of an object before it is used (protocols.py), by the group it is registered in; of a model also
# what it asks of the object that the model opens as.
_SOCKETS = {
    "adapters": ("name", "gives", "reads", "sniff", "read"),
    "stages": ("name", "needs", "gives", "__call__"),
    "commands": ("__call__",),
    "lab": ("__call__",),
    "writers": ("file", "what", "write"),
}
_MODEL = ("what", "open")
_OPENED = {
    "rectifiers": ("method", "rotation"),
    "lifters": ("method", "unit", "takes", "lift"),
    "detectors": ("method", "layout", "people"),
    "person_detectors": ("method", "boxes"),
}
_LISTED = {"adapters": ("gives", "reads"), "writers": ("file", "what"), "stages": ("needs", "gives")}
_WEIGHTS = (".pth", ".pt", ".ckpt", ".safetensors")
GROUPS = (*_SOCKETS, *_OPENED)


@cache
def installed() -> dict[str, Iterable[EntryPoint]]:
    """The entry points of all packages by group of GROUPS. One look for all groups: it opens a file of each package,
    which with 150 of them takes as long as filtering a take."""
    every = entry_points()
    return {group: every.select(group=f"pcnet3d.{group}") for group in GROUPS}


@cache
def registered(group: str) -> dict[str, EntryPoint]:
    """The entry points of one of GROUPS by name; InputError where two packages use one name."""
    points: dict[str, EntryPoint] = {}
    for point in installed()[group]:
        other = points.setdefault(point.name, point)
        if other.value != point.value:
            raise InputError(
                "plugin-broken",
                f"Two packages register {_one(group)} '{point.name}': {other.value} and {point.value}; "
                "uninstall one of them.",
            )
    return dict(sorted(points.items()))


def packages() -> dict[str, str]:
    """The version of every installed package that registers something, by its name; pcnet3d's own is one of them."""
    points = chain(*installed().values())
    return {point.dist.name: point.dist.version for point in points if point.dist}


def load(group: str, name: str) -> Any:
    """The object registered under that name; InputError naming its nearest neighbours when there is none,
    or its package when it cannot be imported or lacks what every one of its group has."""
    points = registered(group)
    if name not in points:
        raise _unknown(group, name)
    try:
        with needed_for(f"pcnet3d lab {name}") if group == "lab" else nullcontext():
            loaded = points[name].load()
    except InputError:  # which says what to do
        raise
    except Exception as error:
        raise _broken(group, name, str(error)) from error
    return _checked(group, name, loaded, _SOCKETS.get(group, _MODEL))


@cache
def load_all(group: str) -> dict[str, Any]:
    """Every object of the group by name; one that cannot be loaded is left out with a warning on stderr, so that a
    broken package does not keep the others from working."""
    loaded = {}
    for name in registered(group):
        try:
            loaded[name] = load(group, name)
        except InputError as error:
            say("warning", str(error))
    return loaded


def open_model(group: str, name: str | Path) -> Any:
    """The model of that name, opened: an object of its group's protocol, or the path of an .onnx file.

    group: "rectifiers", "lifters", "detectors" or "person_detectors". name: of a registered model,
    or a file of the user's, whose path is returned. InputError when there is neither, and when the model's package is
    broken.
    """
    name_ = str(name)
    if name_ not in registered(group):
        if Path(name).suffix.lower() in _WEIGHTS and Path(name).is_file():
            raise InputError(
                "wrong-network",
                f"{name_} holds weights of torch without the network that they belong to; make the network in Python, "
                "load them into it, write it with torch.onnx.export (docs/python.md), and give the .onnx file.",
            )
        if name_.endswith(".onnx") or Path(name).is_file():
            return Path(name)
        raise _unknown(group, name_, " A network of yours is given as its .onnx file.")
    model = load(group, name_)
    try:
        opened = model.open()
    except InputError:
        raise
    except Exception as error:
        raise _broken(group, name_, str(error)) from error
    return opened if isinstance(opened, Path) else _checked(group, name_, opened, _OPENED[group])


def listed(what: str) -> list[dict[str, str]]:
    """Rows of `pcnet3d list WHAT`, each with three texts: of "adapters", "stages", "models" (of every kind) or
    "writers"."""
    if what == "models":
        return [
            {"name": name, "is": _one(group), "what": model.what}
            for group in _OPENED
            for name, model in load_all(group).items()
        ]
    columns = _LISTED[what]
    parts = load_all(what).items()
    return [
        {"name": name} | {column: _text(getattr(part, column)) for column in columns} for name, part in parts
    ]


def _text(value: str | tuple[str, ...]) -> str:
    return value if isinstance(value, str) else " ".join(value)


def _checked(group: str, name: str, loaded: Any, socket: tuple[str, ...]) -> Any:
    # A property of the class is there without being asked for: `what` of a network reads its whole file.
    missing = [
        attribute
        for attribute in socket
        if not any(hasattr(each, attribute) for each in (type(loaded), loaded))
    ]
    if missing:
        raise _broken(group, name, f"it has no {', '.join(missing)}")
    return loaded


def _unknown(group: str, name: str, hint: str = "") -> InputError:
    refuse_removed(group, name)
    near = did_you_mean(name, registered(group))
    return InputError("name-unknown", f"There is no {_one(group)} '{name}'; {near}{hint}")


def _broken(group: str, name: str, reason: str) -> InputError:
    return InputError(
        "plugin-broken",
        f"The {_one(group)} '{name}' ({registered(group)[name].value}) cannot be loaded: {reason}; "
        "repair or uninstall its package.",
    )


def _one(group: str) -> str:
    """What one of the group is called."""
    return "command of the laboratory" if group == "lab" else group[:-1].replace("_", " ")
