"""Muon with one product for all matrices of a shape: a step of a small network is hundreds of them otherwise."""

# pyright: reportPrivateImportUsage=false
from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

_COEFFICIENTS = (3.4445, -4.775, 2.0315)  # Jordan et al. 2024


class BatchedMuon(torch.optim.Muon):
    """torch.optim.Muon with adjust_lr_fn="match_rms_adamw": the same steps up to rounding, the same state."""

    @torch.no_grad()
    def step(self, closure: Callable[[], Any] | None = None) -> None:
        """One step of all matrices that have a gradient. closure: not used, for losses are taken elsewhere."""
        for group in self.param_groups:
            by_shape: dict[torch.Size, list[Tensor]] = defaultdict(list)
            for parameter in group["params"]:
                if parameter.grad is not None:
                    by_shape[parameter.shape].append(parameter)
            for shape, parameters in by_shape.items():
                gradients = [p.grad for p in parameters if p.grad is not None]
                for parameter in parameters:
                    self.state[parameter].setdefault("momentum_buffer", torch.zeros_like(parameter))
                buffers = [self.state[p]["momentum_buffer"] for p in parameters]
                torch._foreach_lerp_(buffers, gradients, 1 - group["momentum"])
                ahead = torch._foreach_lerp(gradients, buffers, group["momentum"])
                update = orthogonal(torch.stack(list(ahead)), group["ns_steps"]).to(parameters[0].dtype)
                rate = group["lr"] * 0.2 * math.sqrt(max(shape))
                torch._foreach_mul_(parameters, 1 - group["lr"] * group["weight_decay"])
                torch._foreach_add_(parameters, list(update.unbind()), alpha=-rate)


def orthogonal(matrices: Tensor, steps: int) -> Tensor:
    """(N, rows, columns) bfloat16, nearly orthogonal matrices by Newton and Schulz's iteration, as many steps."""
    a, b, c = _COEFFICIENTS
    X = matrices.bfloat16()
    tall = X.shape[1] > X.shape[2]
    X = X.mT if tall else X
    X = X / X.flatten(1).norm(dim=1).clamp_min(1e-7)[:, None, None]
    for _ in range(steps):
        gram = X @ X.mT
        X = torch.baddbmm(X, torch.baddbmm(gram, gram, gram, beta=b, alpha=c), X, beta=a)
    return X.mT if tall else X
