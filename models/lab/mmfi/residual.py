"""Judges the pose that 3DPCNet's residual head corrects, which the exported network does not tell."""

from __future__ import annotations

import numpy as np
import torch

from ....pipeline.core.rotations import rotate, transpose
from ..evaluation.rectifiers import Judged, Take, compare, together
from ..training.rectifier import net as pcnet
from ..training.rectifier.export import Deployed

_CHUNK = 1024


@torch.no_grad()
def judge_net(net: pcnet.PCNet, take: Take, symmetric: bool) -> Judged:
    """Like rectifiers.judge, but of what the residual head made of the pose as well: the corrected pose, in the
    camera's axes, is canonicalised with the deployed rotation."""
    deployed, parts = Deployed(net, symmetric), []
    for start in range(0, len(take.R), _CHUNK):
        part = take.some(slice(start, start + _CHUNK))
        joints = torch.from_numpy(part.joints.astype(np.float32))
        valid = torch.ones(joints.shape[:2])
        R, error_deg = (x.double().numpy() for x in deployed(joints, valid))
        answer = net(joints, valid)
        pose = pcnet.rotate(answer.R, answer.canonical).double().numpy()
        parts.append(compare(part, R, error_deg, rotate(transpose(R), pose)))
    return together(parts)
