"""Opens lifters: the built-in one, or an .onnx file whose kind is told by its inputs and outputs, or by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...pipeline.core.errors import InputError
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.plugins.protocols import LIFTER_TAKES, Lifter
from ...pipeline.plugins.registry import open_model
from ..common.onnx import OnnxFile, open_onnx
from .builtin import KIND, OwnLifter
from .function import FunctionLifter
from .scaling import KINDS
from .sequence import SequenceLifter, channels_of, is_sequence_network, span_of


def load_lifter(
    name: str | Path | Callable[..., Any] = "pcnet3d", kind: str | None = None, unit: str | None = None
) -> Lifter:
    """A lifter by name, one of `pcnet3d list models`: "pcnet3d", the built-in one, or another package's; or the one in
    an .onnx file; or one that is a function (function.py), whose answers are in that unit.

    kind: "pcnet3d" (trained with this project) or one of `scaling.KINDS`; needed where the shapes of inputs and
    outputs leave it open, and refused where they contradict it. A lifter of another package is of the kind of its
    name.
    InputError for an unknown name or kind and for a network that is no lifter.
    """
    kinds = (KIND, *KINDS)
    if kind not in (None, name, *kinds):
        raise InputError(
            "name-unknown", f"There is no kind of lifter '{kind}'; {did_you_mean(str(kind), kinds)}"
        )
    if not isinstance(name, str | Path):
        return _opened(FunctionLifter(name, unit or "arbitrary"), "function", kind)
    if unit is not None:
        raise InputError("option-conflict", "The lifter knows its unit; leave --set lift.unit out.")
    opened = open_model("lifters", name)
    if not isinstance(opened, Path):
        if unknown := [each for each in opened.takes if each not in LIFTER_TAKES]:
            raise InputError(
                "plugin-broken",
                f"The lifter '{name}' takes '{unknown[0]}', which is unknown: "
                f"{did_you_mean(unknown[0], LIFTER_TAKES)}",
            )
        return _opened(opened, str(name), kind)
    network = open_onnx(opened, "a lifter")
    method = f"{network.path.name}@{network.digest}"
    if {"reach", "trained_on"} <= network.session.get_modelmeta().custom_metadata_map.keys():
        return _opened(OwnLifter(str(opened)), KIND, kind)
    if is_sequence_network(network):
        return _sequence_lifter(network, method, kind)
    raise InputError(
        "wrong-network",
        f"{network.path} is not a lifter: expected keypoints (1, frames, 17, 2 or 3) and poses (1, frames, 17, 3), or "
        f"one trained with pcnet3d; got {network.looks}.",
    )


def _sequence_lifter(network: OnnxFile, method: str, kind: str | None) -> Lifter:
    channels = channels_of(network) or 0
    if kind is None and channels == 2:
        kinds = "; ".join(f"{name}: {one.about}" for name, one in KINDS.items())
        raise InputError(
            "needs-input",
            f"{network.path} does not say how its keypoints are scaled and ordered; give its kind with --set "
            f"lift.lifter_kind ({kinds}).",
        )
    kind = kind or "motionbert"
    if kind not in KINDS:
        raise _contradiction(kind, "lifts sequences of keypoints", ", ".join(KINDS))
    return SequenceLifter(network, method, kind, channels, span_of(network))


def _opened(lifter: Lifter, found: str, kind: str | None) -> Lifter:
    if kind not in (None, found):
        raise _contradiction(kind, f"is of the kind {found}", found)
    return lifter


def _contradiction(kind: str, what: str, fitting: str) -> InputError:
    return InputError(
        "option-conflict",
        f"The lifter {what}, not {kind}; leave --set lift.lifter_kind out or pass {fitting}.",
    )
