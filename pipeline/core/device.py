"""Where networks compute: on the CPU, or on what else onnxruntime offers on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, Literal

from .errors import InputError
from .messages import say

Device = Literal["auto", "cpu", "cuda", "coreml", "openvino", "directml"]

AUTO, CPU = "auto", "cpu"


@dataclass(frozen=True)
class Kind:
    """provider: what onnxruntime calls it. install: the package that offers it. options: given to onnxruntime."""

    provider: str
    install: str
    options: dict[str, str] = field(default_factory=dict)


# In the order in which "auto" tries them. TF32 keeps ten bits of a number: poses would differ from the CPU's.
KINDS = {
    "cuda": Kind("CUDAExecutionProvider", "onnxruntime-gpu[cuda,cudnn], for NVIDIA", {"use_tf32": "0"}),
    "directml": Kind("DmlExecutionProvider", "onnxruntime-directml, for Windows"),
    "coreml": Kind("CoreMLExecutionProvider", "onnxruntime, on macOS"),
    "openvino": Kind("OpenVINOExecutionProvider", "onnxruntime-openvino, for Intel"),
    CPU: Kind("CPUExecutionProvider", "onnxruntime"),
}


@dataclass(eq=False)
class Placement:
    """Where the networks of one run compute. tried: devices besides the CPU that a network is to be opened on, the
    first one first. used: by the file name of each network, the device that it computes on. notes: what failed."""

    asked: Device
    tried: list[str]
    used: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def fails(self, name: str, network: str, reason: str) -> None:
        """No network is opened on this device any more, and this one computes on the CPU."""
        self.used[network] = CPU
        if name in self.tried:
            self.tried.remove(name)
        text = f"{network} fails on {name} and runs on the CPU: {reason.rstrip('.')}."
        self.notes.append(text)
        say("note", text)

    def summary(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {"asked": self.asked, "networks": self.used, "notes": self.notes}


_placement: ContextVar[Placement | None] = ContextVar("placement", default=None)
_ON_CPU = Placement(CPU, [])


def placement() -> Placement:
    """Where a network that is opened now computes: as `computing_on` says, on the CPU outside of it."""
    return _placement.get() or _ON_CPU


@contextmanager
def computing_on(asked: Device) -> Iterator[Placement]:
    """Networks that are opened inside the block compute on this device. "auto": the first of KINDS that is offered and
    that opens them; a block inside another with the same device uses what that one found. InputError for a device that
    onnxruntime does not offer here."""
    outer = _placement.get()
    if outer is not None and outer.asked == asked:
        yield outer
        return
    devices = offered()
    if asked not in (AUTO, *devices):
        raise InputError(
            "no-device",
            f"Expected a device that onnxruntime offers here ({', '.join(devices)}), got --device {asked}; install "
            f"{KINDS[asked].install}, in place of the installed onnxruntime.",
        )
    tried = devices if asked == AUTO else [asked]
    token = _placement.set(Placement(asked, [name for name in tried if name != CPU]))
    try:
        yield placement()
    finally:
        _placement.reset(token)


def offered() -> list[str]:
    """The names of KINDS that the installed onnxruntime offers, in their order."""
    import onnxruntime

    providers = onnxruntime.get_available_providers()
    return [name for name, kind in KINDS.items() if kind.provider in providers]


def listed() -> list[dict[str, str]]:
    """Rows of `pcnet3d list devices`, each with three texts."""
    devices = offered()
    return [
        {"name": name, "is": "offered" if name in devices else "not offered", "install": kind.install}
        for name, kind in KINDS.items()
    ]
