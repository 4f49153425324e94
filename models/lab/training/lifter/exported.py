"""A lifter's network as an ONNX file: written for the run time, and read back as weights to go on from."""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor

from .....pipeline.core.errors import InputError
from .....pipeline.files.atomic import whole_file
from ....common.onnx import without_traces
from ....lifter.features import CHANNELS
from ...common.extras import needed_for
from ...common.training import read_weights, reading
from .net import Block, LifterNet


def export(net: LifterNet, path: Path, **properties: object) -> None:
    """Write the network as ONNX: "features" (B, T, CHANNELS) -> "joints" (B, T, 17, 3), "sd" (B, T, 17, 2) and
    "velocity" (B, T, 17, 3), any B and T. properties: kept in the file's metadata; the run time needs `reach`."""
    with needed_for("The network is trained; writing it as ONNX"):
        import onnx
        import onnxscript  # noqa: F401  (torch's exporter needs it, and says so in many lines)

    batch, frames = torch.export.Dim("batch"), torch.export.Dim("frames")
    program = torch.onnx.export(
        net.eval(),
        (torch.zeros(2, 90, CHANNELS),),
        input_names=["features"],
        output_names=["joints", "sd", "velocity"],
        dynamic_shapes=({0: batch, 1: frames},),
        dynamo=True,
        external_data=False,
        verbose=False,
    )
    assert program is not None
    model = without_traces(program.model_proto)
    onnx.helper.set_model_props(model, {key: str(value) for key, value in properties.items()})
    with whole_file(path) as partial:
        onnx.save(model, str(partial))


def weights_of(path: Path, net: LifterNet) -> dict[str, Tensor]:
    """The weights of a run's best.pt, or of a network that `export` wrote, such as the shipped lifter.onnx, by their
    names in LifterNet. InputError when it is neither, or says another reach than net's first as many blocks have:
    dilations are in no weight. Of a best.pt nobody knows them."""
    if path.suffix.lower() != ".onnx":
        return read_weights(path)
    with needed_for("Reading weights out of an ONNX file"):
        import onnx
        from onnx import numpy_helper

    with reading(path):
        model = onnx.load(str(path), load_external_data=False)
        graph = model.graph
        stored = {
            each.name: torch.from_numpy(numpy_helper.to_array(each).copy()) for each in graph.initializer
        }
        weights = {name: value for name, value in stored.items() if name.endswith((".weight", ".bias"))}
        # The exporter turns the matrix of a linear layer and forgets its name, but adds the bias to its product.
        product = {node.output[0]: node.input[1] for node in graph.node if node.op_type == "MatMul"}
        for node in graph.node:
            matrices = [stored[product[name]] for name in node.input if product.get(name) in stored]
            biases = [name for name in node.input if name in weights]
            if node.op_type == "Add" and matrices and biases:
                weights[biases[0].removesuffix("bias") + "weight"] = matrices[0].T.contiguous()
        said = {prop.key: prop.value for prop in model.metadata_props}
        count = len({name.split(".")[1] for name in weights if name.startswith("blocks.")})
        dilations = [block.dilation for block in net.blocks if isinstance(block, Block)][:count]
        if "reach" in said and int(said["reach"]) != sum(dilations):
            raise InputError(
                "wrong-network",
                f"Expected a network whose first {count} blocks have the config's dilations "
                f"({', '.join(map(str, dilations))}), but {path} reaches {said['reach']} frames, not {sum(dilations)}.",
            )
        return weights
