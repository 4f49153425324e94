"""Networks of torch as ONNX files: written for the run time, and read back as weights to go on from."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from ....pipeline.core.extras import needed_for
from .training import reading


class Stored(NamedTuple):
    """nodes: of the graph, in the order in which they compute. tensors: by their names. said: the metadata."""

    nodes: Sequence[Any]
    tensors: dict[str, Tensor]
    said: dict[str, str]


def to_onnx(
    net: nn.Module, inputs: Mapping[str, Tensor], free: Sequence[Any], outputs: Sequence[str], **said: object
) -> Any:
    """An onnx.ModelProto. inputs: examples by name, in the order that the network takes them. free: for each input,
    {axis: torch.export.Dim} of those that may have any size. outputs: names. said: kept in the file's metadata."""
    with needed_for("The network is trained; writing it as ONNX"):
        import onnx
        import onnxscript  # noqa: F401  (torch's exporter needs it, and says so in many lines)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of torch's exporter, about torch's own code
        program = torch.onnx.export(
            net.eval(),
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
    return model


def half_as_large(model: Any) -> Any:
    """An onnx.ModelProto whose matrices are kept in half precision; it computes with them in float32 as before."""
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
    return model


def stored_in(path: Path) -> Stored:
    """What a network's ONNX file holds; float32 where `half_as_large` kept less. InputError when it cannot be read."""
    with needed_for("Reading weights out of an ONNX file"):
        import onnx
        from onnx import numpy_helper

    with reading(path, "a network"):
        model = onnx.load(str(path), load_external_data=False)
        tensors = {
            each.name: torch.from_numpy(numpy_helper.to_array(each).copy())
            for each in model.graph.initializer
        }
        for node in model.graph.node:
            if node.op_type == "Cast" and node.input[0] in tensors:
                tensors[node.output[0]] = tensors[node.input[0]].float()
        return Stored(
            tuple(model.graph.node), tensors, {each.key: each.value for each in model.metadata_props}
        )
