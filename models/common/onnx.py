"""A network in an .onnx file, opened on onnxruntime."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.errors import InputError
from ...pipeline.running.cores import cores


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

    @property
    def only_input(self) -> tuple[int | None, ...]:
        """Its input's shape; empty when it has several."""
        shapes = tuple(self.inputs.values())
        return shapes[0] if len(shapes) == 1 else ()

    @cached_property
    def input_dtype(self) -> np.dtype:
        """Of the first input; InputError for one that holds no numbers."""
        name = self.session.get_inputs()[0].type.removeprefix("tensor(").removesuffix(")")
        if name not in _DTYPES:
            raise InputError(f"{self.path}: expected an input of numbers, got {name}.")
        return np.dtype(_DTYPES[name])

    @property
    def looks(self) -> str:
        """Inputs and outputs in words, for a message."""
        return f"inputs {_words(self.inputs)}; outputs {_words(self.outputs)}"

    def run(self, value: np.ndarray) -> list[np.ndarray]:
        """Every output for the value of the first input."""
        return self.session.run(None, {next(iter(self.inputs)): value})


_DTYPES = {"float": "float32", "float16": "float16", "double": "float64", "uint8": "uint8", "int32": "int32"}


def open_onnx(path: str | Path, what: str = "a network", threads: int = 0) -> OnnxFile:
    """The network in a file. what: in words, for InputError when there is no such file or it is no network. threads:
    as of `session_of`."""
    try:
        content = Path(path).read_bytes()
        session = session_of(content, threads)
    except OSError as error:
        raise InputError(f"Expected {what} in an .onnx file at {path}: {error.strerror}.") from None
    except Exception as error:  # onnxruntime's errors have no common class but Exception
        raise InputError(
            f"Expected {what} in an .onnx file at {path}: {str(error).splitlines()[0]}."
        ) from None
    return OnnxFile(Path(path), session, hashlib.sha256(content).hexdigest()[:12])


def session_of(content: bytes, threads: int = 0) -> Any:
    """An onnxruntime session of a file's content, whose errors are its own. threads: within each layer; 0 for as many
    as there are cores."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads or cores()
    options.log_severity_level = 3
    # Threads that wait for the next image in a loop hold the cores that decode it.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])


def _shapes(entries: list[Any]) -> dict[str, tuple[int | None, ...]]:
    return {
        entry.name: tuple(size if isinstance(size, int) else None for size in entry.shape)
        for entry in entries
    }


def _words(shapes: dict[str, tuple[int | None, ...]]) -> str:
    said = (
        f"{name} ({', '.join('?' if n is None else str(n) for n in shape)})" for name, shape in shapes.items()
    )
    return ", ".join(said)
