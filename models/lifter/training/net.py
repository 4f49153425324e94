"""The lifter's network: dilated temporal convolutions with residual blocks, for any number of frames."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from ....pipeline.errors import InputError
from ....pipeline.layouts import H36M17
from ..features import CHANNELS

_PELVIS = H36M17.index("pelvis")
_JOINTS = len(H36M17)
_LOG_SD = (-7.0, 1.0)  # of metres: 1 mm to 2.7 m


@dataclass(frozen=True)
class NetConfig:
    """width: channels of the hidden layers. dilations: one residual block each, in frames."""

    width: int = 320
    dilations: tuple[int, ...] = (1, 3, 9, 27, 1, 3)

    def __post_init__(self) -> None:
        sizes = {"width": self.width, "dilations": min(self.dilations, default=1)}
        if small := [name for name, size in sizes.items() if size < 1]:
            raise InputError(f"expected {' and '.join(small)} of at least 1")

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
        with torch.no_grad():
            # Starts as a network for single frames; what frames before and after add is learned.
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
    """(B, T, CHANNELS) features -> joints (B, T, 17, 3) relative to the pelvis in the ray frame, metres of a standard
    body; sd (B, T, 17, 2), their standard deviation in metres across the ray (of one axis) and along it; and velocity
    (B, T, 17, 3), metres a frame."""

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.enter = nn.Linear(CHANNELS, config.width)
        self.blocks = nn.ModuleList(Block(config.width, dilation) for dilation in config.dilations)
        self.norm = nn.LayerNorm(config.width)
        self.leave = nn.Linear(config.width, 3 * _JOINTS)
        self.leave_sd = nn.Linear(config.width, 2 * _JOINTS)
        self.leave_velocity = nn.Linear(config.width, 3 * _JOINTS)
        nn.init.zeros_(self.leave_sd.weight)
        nn.init.constant_(self.leave_sd.bias, -3.0)  # 5 cm

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        return self.answer(self.hidden(features))

    def hidden(self, features: Tensor) -> Tensor:
        """(B, T, width): everything but the last layers, which bfloat16 would round to millimetres."""
        x = self.enter(features)
        for block in self.blocks:
            x = block(x)
        return x

    def answer(self, hidden: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """joints, sd and velocity of what `hidden` gives."""
        x = self.norm(hidden.float())
        joints, velocity = (
            (values - values[:, :, [_PELVIS]])
            for values in (self._points(self.leave(x), 3), self._points(self.leave_velocity(x), 3))
        )
        return joints, self._points(self.leave_sd(x), 2).clamp(*_LOG_SD).exp(), velocity

    def _points(self, values: Tensor, numbers: int) -> Tensor:
        return values.reshape(values.shape[0], values.shape[1], _JOINTS, numbers)
