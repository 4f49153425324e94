"""The lifter's network: dilated temporal convolutions with residual blocks, for any number of frames."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from ..pipeline.layouts import H36M17
from .lifter_features import CHANNELS

_PELVIS = H36M17.index("pelvis")


@dataclass(frozen=True)
class NetConfig:
    """width: channels of the hidden layers. dilations: one residual block each, in frames."""

    width: int = 320
    dilations: tuple[int, ...] = (1, 3, 9, 27, 1, 3)

    @property
    def reach(self) -> int:
        """Frames on each side that a frame's answer depends on."""
        return sum(self.dilations)


class Block(nn.Module):
    """Pre-norm residual block: a convolution over three frames `dilation` apart, then one within the frame."""

    def __init__(self, width: int, dilation: int) -> None:
        super().__init__()
        self.dilation = dilation
        self.norm = nn.LayerNorm(width)
        self.mix = nn.Linear(3 * width, width)  # as a matrix product: faster on CPUs than a dilated Conv1d
        self.out = nn.Linear(width, width)
        with (
            torch.no_grad()
        ):  # starts as a network for single frames; what frames before and after add is learned
            self.mix.weight[:, :width] = 0
            self.mix.weight[:, 2 * width :] = 0

    def forward(self, x: Tensor) -> Tensor:
        frames, d = x.shape[1], self.dilation
        here = self.norm(x)
        if frames == 1 and not torch.compiler.is_exporting():  # the same numbers without the zeros around
            width = x.shape[-1]
            near = nn.functional.linear(here, self.mix.weight[:, width : 2 * width], self.mix.bias)
            return x + self.out(nn.functional.gelu(near))
        if frames <= d and not torch.compiler.is_exporting():  # the same numbers without a long padding
            before = after = torch.zeros_like(here)
        else:
            padded = nn.functional.pad(here, (0, 0, d, d))  # zeros before the first and after the last frame
            before, after = padded[:, :frames], padded[:, 2 * d :]
        near = torch.cat([before, here, after], dim=-1)  # (B, T, 3 width)
        return x + self.out(nn.functional.gelu(self.mix(near)))


class LifterNet(nn.Module):
    """(B, T, CHANNELS) features -> (B, T, 17, 3) joints relative to the pelvis in the ray frame, metres of a
    standard body."""

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.enter = nn.Linear(CHANNELS, config.width)
        self.blocks = nn.ModuleList(Block(config.width, dilation) for dilation in config.dilations)
        self.norm = nn.LayerNorm(config.width)
        self.leave = nn.Linear(config.width, 3 * len(H36M17))

    def forward(self, features: Tensor) -> Tensor:
        x = self.enter(features)
        for block in self.blocks:
            x = block(x)
        joints = self.leave(self.norm(x)).float()
        joints = joints.reshape(joints.shape[0], joints.shape[1], len(H36M17), 3)
        return joints - joints[:, :, [_PELVIS]]
