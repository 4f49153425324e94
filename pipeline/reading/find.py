"""Which adapter reads a file: the one that is named, or the only one that recognises its content."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from ..core.errors import InputError
from ..core.messages import say
from ..plugins import registry
from ..plugins.options import did_you_mean
from ..plugins.protocols import Adapter
from .describe import in_words, refuse_damaged, why_no_input

_WORDS = {  # what it is, and how a run is given it
    "poses": ("3D poses", "give them with --poses"),
    "keypoints": ("2D keypoints", "give them with --keypoints"),
    "video": ("a video", "give it by itself, without an option's name before it"),
    "imu": (
        "an inertial sensor's recording",
        "compare a finished run with it by pcnet3d compare RESULTS --imu FILE",
    ),
}
Gives = Literal["poses", "keypoints", "video", "imu"]


def adapters(gives: str | None = None) -> dict[str, Adapter]:
    """The registered adapters by name, those that give "poses", "keypoints", "video" or "imu" when asked."""
    loaded = registry.load_all("adapters")
    return {name: adapter for name, adapter in loaded.items() if gives in (None, adapter.gives)}


def find_adapter(path: Path, name: str = "auto", gives: str | None = None) -> Adapter:
    """The adapter of that name, or with "auto" the only one that recognises the file's content.

    gives: "poses", "keypoints", "video" or "imu"; without it, 3D poses come before anything else that fits.
    InputError when the name is unknown, when no adapter fits, or when several do.
    """
    if not (path.is_file() or path.is_dir()):
        there = "a device or a pipe" if path.exists() else "nothing"
        raise InputError("cannot-open", f"Expected a file or folder at {path}, found {there} there.")
    candidates = adapters(gives)
    if name != "auto":
        if name not in candidates:
            if name not in adapters():
                registry.load("adapters", name)  # says that there is none, or what is wrong with it
            raise InputError(
                "name-unknown",
                f"There is no adapter '{name}' for {gives}; {did_you_mean(name, candidates)}",
            )
        return candidates[name]
    fits = [adapter for adapter in candidates.values() if recognises(adapter, path)]
    if gives is None:  # a folder of a vis.py holds both its 2D input and its 3D output
        fits = [adapter for adapter in fits if adapter.gives == "poses"] or fits
    fits = [adapter for adapter in fits if not getattr(adapter, "general", False)] or fits
    if len(fits) == 1:
        return fits[0]
    flag = "--set read.keypoints_adapter" if gives == "keypoints" else "--adapter"
    if fits:
        names = "; ".join(f"{adapter.name} ({adapter.reads})" for adapter in fits)
        raise InputError(
            "format-ambiguous",
            f"{path} fits several adapters, whose files look alike: {names}. Name the right one with {flag}.",
        )
    if reason := exchanged(path, gives) or why_no_input(path, gives):
        raise InputError("format-unknown", reason)
    refuse_damaged(path)
    reasons = [
        f" Adapter {adapter.name} does not take it: {lacking}."
        for adapter in candidates.values()
        if (lacking := getattr(adapter, "lacks", lambda path: "")(path))
    ]
    raise InputError(
        "format-unknown",
        f"No adapter recognises {path}: it is {in_words(path)}.{''.join(reasons)} `pcnet3d list adapters` says what "
        f"each reads; name one with {flag}.",
    )


def exchanged(path: Path, gives: str | None) -> str:
    """A sentence that names what the file is when it is not what was expected, and how to give it; "" when unknown."""
    others = [
        adapter for adapter in adapters().values() if adapter.gives != gives and recognises(adapter, path)
    ]
    if gives is None or not others:
        return ""
    what, how = _WORDS[others[0].gives]
    return f"Expected {_WORDS[gives][0]} in {path}, got {what} ({others[0].name}); {how}."


def recognises(adapter: Adapter, path: Path) -> bool:
    """Whether the adapter takes the file for one of its own. One that fails, which it never should, does not, with a
    warning on stderr: somebody's faulty package must not keep the others from reading."""
    try:
        with np.errstate(all="ignore"):  # whatever numbers a stranger's file has
            return adapter.sniff(path)
    except Exception as error:
        say("warning", f"adapter '{adapter.name}' failed at {path}: {error!r}")
        return False
