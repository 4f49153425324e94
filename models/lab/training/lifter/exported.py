"""A lifter's network as an ONNX file: written for the run time, and read back as weights to go on from."""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor

from .....pipeline.core.errors import InputError
from .....pipeline.files.atomic import whole_file
from ....lifter.features import CHANNELS
from ...common.onnx_file import half_as_large, stored_in, to_onnx
from ...common.training import read_weights, reading
from .net import Block, LifterNet


def export(net: LifterNet, path: Path, **properties: object) -> None:
    """Write the network as ONNX: "features" (B, T, CHANNELS) -> "joints" (B, T, 17, 3), "sd" (B, T, 17, 2) and
    "velocity" (B, T, 17, 3), any B and T. Matrices are kept in half precision. properties: kept in the file's metadata;
    the run time needs `reach`."""
    batch, frames = torch.export.Dim("batch"), torch.export.Dim("frames")
    features = {"features": torch.zeros(2, 90, CHANNELS)}
    model = to_onnx(net, features, ({0: batch, 1: frames},), ("joints", "sd", "velocity"), **properties)
    model = half_as_large(model)
    with whole_file(path) as partial:
        partial.write_bytes(model.SerializeToString())


def weights_of(path: Path, net: LifterNet) -> dict[str, Tensor]:
    """The weights of a run's best.pt, or of a network that `export` wrote, such as the shipped lifter.onnx, by their
    names in LifterNet. InputError when it is neither, or says another reach than net's: dilations are in no weight. Of
    a best.pt nobody knows them."""
    if path.suffix.lower() != ".onnx":
        return read_weights(path)
    stored = stored_in(path)
    with reading(path, "a network"):
        weights = {
            name: value for name, value in stored.tensors.items() if name.endswith((".weight", ".bias"))
        }
        # The exporter turns the matrix of a linear layer and forgets its name, but adds the bias to its product.
        product = {node.output[0]: node.input[1] for node in stored.nodes if node.op_type == "MatMul"}
        for node in stored.nodes:
            matrices = [
                stored.tensors[product[name]] for name in node.input if product.get(name) in stored.tensors
            ]
            biases = [name for name in node.input if name in weights]
            if node.op_type == "Add" and matrices and biases:
                weights[biases[0].removesuffix("bias") + "weight"] = matrices[0].T.contiguous()
        reach = sum(block.dilation for block in net.blocks if isinstance(block, Block))
        if int(stored.said.get("reach", reach)) != reach:
            raise InputError(
                "wrong-network",
                f"Expected a network with the config's dilations, but {path} reaches {stored.said['reach']} frames, "
                f"not {reach}.",
            )
        return weights
