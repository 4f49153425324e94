"""Opens lifters: the built-in one, a file of one that was trained here, another package's, or a function."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...pipeline.core.errors import InputError
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.plugins.protocols import LIFTER_TAKES, Lifter
from ...pipeline.plugins.registry import open_model
from .builtin import OwnLifter, network
from .function import FunctionLifter


def load_lifter(name: str | Path | Callable[..., Any] = "pcnet3d", unit: str | None = None) -> Lifter:
    """A lifter by name, one of `pcnet3d list models`: "pcnet3d", the built-in one, or another package's; the one in an
    .onnx file that `pcnet3d lab train` wrote; or one that is a function (function.py), whose answers are in that unit.

    InputError for an unknown name and for a network of another kind.
    """
    if not isinstance(name, str | Path):
        return FunctionLifter(name, unit or "arbitrary")
    if unit is not None:
        raise InputError("option-conflict", "The lifter knows its unit; leave --set lift.unit out.")
    opened = open_model("lifters", name)
    if isinstance(opened, Path):
        network(opened)
        return OwnLifter(str(opened))
    if unknown := [each for each in opened.takes if each not in LIFTER_TAKES]:
        raise InputError(
            "plugin-broken",
            f"The lifter '{name}' takes '{unknown[0]}', which is unknown: "
            f"{did_you_mean(unknown[0], LIFTER_TAKES)}",
        )
    return opened
