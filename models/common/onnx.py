"""A network in an .onnx file, opened on onnxruntime."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import cached_property, partial
from io import StringIO
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from ...pipeline.core.device import AUTO, CPU, KINDS, placement
from ...pipeline.core.errors import InputError, readable
from ...pipeline.core.system import cores


@dataclass(frozen=True, eq=False)
class OnnxFile:
    """digest: the first 12 digits of the file's SHA-256. inputs, outputs: shapes by name, None where any size goes."""

    path: Path
    session: Any
    digest: str

    @cached_property
    def inputs(self) -> dict[str, tuple[int | None, ...]]:
        return _shapes(self.session.get_inputs())

    @property
    def outputs(self) -> dict[str, tuple[int | None, ...]]:
        return _shapes(self.session.get_outputs())

    @cached_property
    def input_dtype(self) -> np.dtype:
        """Of the first input; InputError for one that holds no numbers."""
        name = self.session.get_inputs()[0].type.removeprefix("tensor(").removesuffix(")")
        if name not in _DTYPES:
            raise InputError("wrong-network", f"{self.path}: expected an input of numbers, got {name}.")
        return np.dtype(_DTYPES[name])

    @cached_property
    def stated(self) -> dict[str, str]:
        """What the file says of itself, by name."""
        return self.session.get_modelmeta().custom_metadata_map

    @property
    def looks(self) -> str:
        """Inputs and outputs in words, for a message."""
        return f"inputs {_in_words(self.inputs)}; outputs {_in_words(self.outputs)}"

    def run(self, *values: np.ndarray) -> list[np.ndarray]:
        """Every output, for a value of each input in their order."""
        return self.session.run(None, dict(zip(self.inputs, values, strict=True)))


# Severities of onnxruntime's log, from which it writes; the first one is its default.
_WARNINGS, _SILENT = 2, 4
_DTYPES = {"float": "float32", "float16": "float16", "double": "float64", "uint8": "uint8", "int32": "int32"}


def open_onnx(path: str | Path, what: str = "a network", threads: int = 0) -> OnnxFile:
    """The network in a file, to compute where `pipeline.core.device.placement` says. what: in words, for InputError
    when there is no such file or it is no network, and when the device that was asked for by name cannot open it.
    threads: as of `session_of`."""
    with readable(path, f"{what} in an .onnx file"):
        content = Path(path).read_bytes()
    try:
        session = session_of(content, threads)
    except Exception as error:  # onnxruntime's errors have no common class but Exception
        raise InputError(
            "cannot-open", f"Expected {what} in an .onnx file at {path}: {reason_of(error)}."
        ) from None
    session = _placed(session, content, threads, Path(path).name)
    return OnnxFile(Path(path), session, hashlib.sha256(content).hexdigest()[:12])


def session_of(content: bytes, threads: int = 0, device: str = CPU) -> Any:
    """An onnxruntime session of a file's content, whose errors are its own. threads: within each layer; 0 for as many
    as there are cores. device: one of pipeline.core.device.KINDS; RuntimeError where it cannot be had."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads or cores()
    options.log_severity_level = _SILENT  # what fails is raised as well
    # Threads that wait for the next image in a loop hold the cores that decode it.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.enable_mem_pattern = False  # it costs twice the memory and saves no time, and directml refuses it
    if device == CPU:
        return onnxruntime.InferenceSession(content, options, providers=[KINDS[CPU].provider])
    kind = KINDS[device]
    settings = {
        **kind.options,
        **({"num_of_threads": str(threads or cores())} if device == "openvino" else {}),
    }
    if device == "cuda" and hasattr(onnxruntime, "preload_dlls"):  # from 1.21 on
        with redirect_stdout(StringIO()):  # it prints what it misses
            onnxruntime.preload_dlls()  # those of NVIDIA's packages, which the system does not find by itself
    onnxruntime.set_default_logger_severity(_SILENT)  # it writes lines of its own about what fails
    try:
        session = onnxruntime.InferenceSession(content, options, providers=[(kind.provider, settings)])
    finally:
        onnxruntime.set_default_logger_severity(_WARNINGS)
    if kind.provider not in session.get_providers():  # it has taken the CPU
        raise RuntimeError(f"{kind.provider} cannot start; its driver or libraries are missing or too old")
    return session


class PlacedSession:
    """A session on a device, and the one on the CPU that takes over for good when the device fails at something that
    the CPU can do. One run at a time: not every device takes several. failed: is told the reason."""

    def __init__(self, session: Any, on_cpu: Any, failed: Callable[[str], None]) -> None:
        self._session, self._on_cpu, self._failed, self._lock = session, on_cpu, failed, Lock()

    def __getattr__(self, name: str) -> Any:
        """What is known of the network is the same on both."""
        return getattr(self._on_cpu, name)

    def run(self, names: list[str] | None, values: dict[str, np.ndarray]) -> list[np.ndarray]:
        """As onnxruntime's; errors are those of the CPU, which no device is to blame for."""
        with self._lock:
            if self._session is not self._on_cpu:
                try:
                    return self._session.run(names, values)
                except Exception as error:
                    answers = self._on_cpu.run(names, values)
                    self._session = self._on_cpu
                    self._failed(reason_of(error))
                    return answers
        return self._on_cpu.run(names, values)


def _placed(on_cpu: Any, content: bytes, threads: int, network: str) -> Any:
    """The session on the first device that opens the network; on the CPU where none does."""
    where = placement()
    for device in tuple(where.tried):
        try:
            session = session_of(content, threads, device)
        except Exception as error:
            if where.asked != AUTO:
                raise InputError(
                    "no-device",
                    f"Expected {network} to open on --device {device}, got: {reason_of(error)}; give --device auto.",
                ) from None
            where.fails(device, network, reason_of(error))
            continue
        where.used[network] = device
        return PlacedSession(session, on_cpu, partial(where.fails, device, network))
    where.used[network] = CPU
    return on_cpu


def reason_of(error: Exception) -> str:
    """In one line, why a network cannot be opened or run."""
    return (str(error).strip() or type(error).__name__).splitlines()[0].rstrip(".")


def _shapes(entries: list[Any]) -> dict[str, tuple[int | None, ...]]:
    return {
        entry.name: tuple(size if isinstance(size, int) else None for size in entry.shape)
        for entry in entries
    }


def _in_words(shapes: dict[str, tuple[int | None, ...]]) -> str:
    said = (
        f"{name} ({', '.join('?' if n is None else str(n) for n in shape)})" for name, shape in shapes.items()
    )
    return ", ".join(said)
