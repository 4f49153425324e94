"""From torch to the ONNX file that is shipped, and a check that both answer alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from .....pipeline.core.errors import InputError
from .....pipeline.core.layouts import H36M17
from .....pipeline.files.atomic import whole_file
from ....common.onnx import session_of, without_traces
from ...common.extras import needed_for
from .net import JOINTS, PCNet, gram_schmidt

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
    with needed_for("The network is trained; writing it as ONNX"):
        import onnx
        import onnxscript  # noqa: F401  (torch's exporter needs it, and says so in many lines)

    batch = torch.export.Dim("batch")
    program = torch.onnx.export(
        deployed.cpu().eval(),
        (torch.randn(2, JOINTS, 3), torch.ones(2, JOINTS)),
        input_names=["joints", "valid"],
        output_names=["R", "error_deg"],
        dynamic_shapes=({0: batch}, {0: batch}),
        dynamo=True,
        external_data=False,
        verbose=False,
    )
    assert program is not None
    model = without_traces(program.model_proto)
    stated = {"pcnet3d": "rectifier", **properties}
    onnx.helper.set_model_props(model, {key: str(value) for key, value in stated.items()})
    with whole_file(path) as partial:
        onnx.save(model, str(partial))
        apart = parity(deployed, partial)
        if not apart < _TOLERANCE:
            raise InputError(
                "wrong-network",
                f"The exported network answers otherwise than torch, by {apart:.1e}; it was not written.",
            )


def parity(deployed: Deployed, path: Path, count: int = 100) -> float:
    """Largest difference between torch and onnxruntime over random poses with missing joints; of the expected error,
    that of its logarithm."""
    rng = np.random.default_rng(0)
    valid = (rng.uniform(size=(count, JOINTS)) < 0.9).astype(np.float32)
    joints = rng.normal(0, 0.4, (count, JOINTS, 3)).astype(np.float32)
    session = session_of(path.read_bytes())
    R, error_deg = (
        np.asarray(x) for x in session.run(["R", "error_deg"], {"joints": joints, "valid": valid})
    )
    with torch.no_grad():
        expected = [x.numpy() for x in deployed(torch.from_numpy(joints), torch.from_numpy(valid))]
    return float(max(np.abs(R - expected[0]).max(), np.abs(np.log(error_deg / expected[1])).max()))
