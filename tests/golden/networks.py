"""Tiny ONNX networks as files."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def save_graph(
    path: Path, nodes: list, inputs: Mapping, outputs: Mapping, held: Mapping | None = None, metadata=()
) -> Path:
    """An .onnx file. inputs, outputs: shape of floats, or (type, shape), by name; held: arrays by name."""

    def values(entries: Mapping) -> list:
        typed = {
            name: entry if _is_typed(entry) else (TensorProto.FLOAT, entry) for name, entry in entries.items()
        }
        return [helper.make_tensor_value_info(name, kind, shape) for name, (kind, shape) in typed.items()]

    constants = [numpy_helper.from_array(np.asarray(array), name) for name, array in (held or {}).items()]
    graph = helper.make_graph(nodes, "toy", values(inputs), values(outputs), constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    helper.set_model_props(model, dict(metadata))
    onnx.checker.check_model(model)
    onnx.save(model, path)
    return path


def _is_typed(entry: Sequence) -> bool:
    return len(entry) == 2 and not isinstance(entry[1], int | str | None)
