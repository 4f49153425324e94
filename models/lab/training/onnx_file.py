"""Networks of torch as ONNX files: written for the run time, and read back as weights to go on from."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ....pipeline.core.extras import needed_for
from ....pipeline.files.atomic import whole_file
from .loop import reading


def write_onnx(
    net: nn.Module,
    path: Path,
    inputs: Mapping[str, Tensor],
    free: Sequence[Any],
    outputs: Sequence[str],
    said: Mapping[str, object],
    half: bool = False,
) -> None:
    """inputs: examples by name, in the order that the network takes them. free: for each input, {axis:
    torch.export.Dim} of those that may have any size. outputs: names. said: kept in the file's metadata. half: matrices
    are kept in half precision; the file computes with them in float32."""
    with needed_for("The network is trained; writing it as ONNX"):
        import onnx
        import onnxscript  # noqa: F401  (torch's exporter needs it, and says so in many lines)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of torch's exporter, about torch's own code
        program = torch.onnx.export(
            net.cpu().eval(),
            tuple(inputs.values()),
            input_names=list(inputs),
            output_names=list(outputs),
            dynamic_shapes=tuple(free),
            dynamo=True,
            external_data=False,
            verbose=False,
        )
    assert program is not None
    model = program.model_proto
    for node in model.graph.node:
        del node.metadata_props[:]  # its place in the source files, by their paths on this machine
    onnx.helper.set_model_props(model, {key: str(value) for key, value in said.items()})
    if half:
        _halve(model)
    with whole_file(path) as partial:
        partial.write_bytes(model.SerializeToString())


def _halve(model: Any) -> None:
    """The matrices of an onnx.ModelProto in half precision, which it makes float32 when it is opened."""
    from onnx import TensorProto, helper, numpy_helper

    casts = []
    for each in model.graph.initializer:
        matrix = numpy_helper.to_array(each)
        if matrix.dtype == np.float32 and matrix.ndim > 1:
            kept = f"{each.name}.half"
            casts.append(helper.make_node("Cast", [kept], [each.name], to=TensorProto.FLOAT))
            each.CopyFrom(numpy_helper.from_array(matrix.astype(np.float16), kept))
    nodes = [*casts, *model.graph.node]
    del model.graph.node[:]
    model.graph.node.extend(nodes)


def read_onnx(path: Path) -> tuple[Sequence[Any], dict[str, Tensor]]:
    """The nodes of a network's file, in the order in which they compute, and its tensors by their names. InputError
    when it cannot be read."""
    with needed_for("Reading weights out of an ONNX file"):
        import onnx
        from onnx import numpy_helper

    with reading(path, "a network"):
        graph = onnx.load(str(path), load_external_data=False).graph
        tensors = {
            each.name: torch.from_numpy(numpy_helper.to_array(each).copy()) for each in graph.initializer
        }
        return tuple(graph.node), tensors
