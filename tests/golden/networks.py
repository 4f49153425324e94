"""Tiny ONNX networks as files."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import onnx
from onnx import helper, numpy_helper


def save_graph(path: Path, graph: str, held: Mapping | None = None) -> Path:
    """An .onnx file of a graph in ONNX's own text, whose nodes may name arrays that are held."""
    parsed = onnx.parser.parse_graph(graph)
    parsed.initializer.extend(
        numpy_helper.from_array(np.asarray(array), name) for name, array in (held or {}).items()
    )
    model = helper.make_model(parsed, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(model)
    onnx.save(model, path)
    return path
