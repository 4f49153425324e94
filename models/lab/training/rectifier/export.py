"""From torch to the ONNX file that is shipped, checked to answer alike, and back to weights to go on from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from .....pipeline.core.errors import InputError
from .....pipeline.core.layouts import H36M17
from .....pipeline.files.atomic import whole_file
from ....common.onnx import session_of
from ...common.onnx_file import stored_in, to_onnx
from ...common.training import read_weights, reading
from .net import JOINTS, PCNet, gram_schmidt, skeleton_adjacency

_TOLERANCE = 1e-4


class Deployed(nn.Module):
    """What the run time asks for: joints (B, 17, 3), valid (B, 17) -> R (B, 3, 3), error_deg (B,).

    symmetric: average with the answer to the mirrored body, so that left and right are treated alike; twice the work,
        in one pass over twice the batch, which takes less of a single pose's time than two passes.
    """

    def __init__(self, net: PCNet, symmetric: bool) -> None:
        super().__init__()
        self.net, self.symmetric = net, symmetric

    def forward(self, joints: Tensor, valid: Tensor) -> tuple[Tensor, Tensor]:
        if not self.symmetric:
            answer = self.net(joints, valid)
            return answer.R, answer.error_deg
        other_side = torch.from_numpy(H36M17.mirror).to(joints.device)
        across, body = joints.new_tensor([-1.0, 1, 1]), joints.new_tensor([1.0, -1, 1])
        both = self.net(
            torch.cat([joints, joints[:, other_side] * across]), torch.cat([valid, valid[:, other_side]])
        )
        R, mirrored_R = both.R.unflatten(0, (2, -1))
        R = R + mirrored_R * across[:, None] * body
        error_deg, mirrored_deg = both.error_deg.unflatten(0, (2, -1))
        return gram_schmidt(torch.cat([R[..., 0], R[..., 1]], dim=-1)), (error_deg * mirrored_deg).sqrt()


def export(deployed: Deployed, path: Path, **properties: object) -> None:
    """Write "joints" (B, 17, 3) and "valid" (B, 17) -> "R" (B, 3, 3) and "error_deg" (B,), any B.

    properties: kept in the file's metadata. InputError, and no file, when onnxruntime answers something else.
    """
    axes = {0: torch.export.Dim("batch")}
    inputs = {"joints": torch.randn(2, JOINTS, 3), "valid": torch.ones(2, JOINTS)}
    stated = {"pcnet3d": "rectifier", **properties}
    model = to_onnx(deployed.cpu(), inputs, (axes, axes), ("R", "error_deg"), **stated)
    with whole_file(path) as partial:
        partial.write_bytes(model.SerializeToString())
        apart = parity(deployed, partial)
        if not apart < _TOLERANCE:
            raise InputError(
                "wrong-network",
                f"The exported network answers otherwise than torch, by {apart:.1e}; it was not written.",
            )


def started(net: PCNet, path: Path) -> PCNet:
    """net with the weights of a run's best.pt, or of a network that `export` wrote, such as the shipped pcnet.onnx: the
    same answers. Such a file has no residual head; net's own is kept. InputError when it is neither, or does not fit.
    """
    weights = _folded(path) if path.suffix.lower() == ".onnx" else read_weights(path)
    own = {name: value for name, value in net.state_dict().items() if name.startswith("residual.")}
    with reading(path, "weights of the network that the config's [net] says"):
        net.load_state_dict({**own, **weights})
    return net


def _folded(path: Path) -> dict[str, Tensor]:
    """The weights by their names in PCNet. What no input changes the exporter works out ahead and forgets the names
    of: the joints' positions, the graph's adjacency, and the halves of a bias that keys and values share."""
    stored = stored_in(path)
    weights = {
        name.removeprefix("net."): each for name, each in stored.tensors.items() if name.startswith("net.")
    }
    whole = {node.output[0]: node.input[0] for node in stored.nodes if node.op_type == "Slice"}
    halves: dict[str, list[Tensor]] = {}
    for node in stored.nodes:
        named = whole.get(node.input[1], "") if node.op_type == "Gemm" else ""
        if named.endswith("key_value.weight"):
            bias = named.removeprefix("net.").removesuffix("weight") + "bias"
            halves.setdefault(bias, []).append(stored.tensors[node.input[2]])
    weights |= {name: torch.cat(parts) for name, parts in halves.items()}
    for tensor in stored.tensors.values():
        # Half is the skeleton's where alpha is 0.
        if tensor.is_floating_point() and tensor.shape == (JOINTS, JOINTS):
            weights["encoder.graph.learned"] = 2 * tensor - skeleton_adjacency()
            weights["encoder.graph.alpha"] = torch.zeros(())
        elif tensor.is_floating_point() and tensor.ndim == 3 and tensor.shape[:2] == (JOINTS, 1):
            weights["encoder.attention.position"] = tensor[:, 0]
    return weights


def parity(deployed: Deployed, path: Path) -> float:
    """Largest difference between torch and onnxruntime over a hundred random poses with missing joints; of the expected
    error, that of its logarithm."""
    rng = np.random.default_rng(0)
    valid = (rng.uniform(size=(100, JOINTS)) < 0.9).astype(np.float32)
    joints = rng.normal(0, 0.4, (100, JOINTS, 3)).astype(np.float32)
    session = session_of(path.read_bytes())
    R, error_deg = (
        np.asarray(x) for x in session.run(["R", "error_deg"], {"joints": joints, "valid": valid})
    )
    with torch.no_grad():
        expected = [x.numpy() for x in deployed(torch.from_numpy(joints), torch.from_numpy(valid))]
    return float(max(np.abs(R - expected[0]).max(), np.abs(np.log(error_deg / expected[1])).max()))
