"""Random numbers of one training step, on the device that trains."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor


class Draw:
    """The same seed and step give the same numbers on the same kind of device, whatever came before. rng: numpy's."""

    def __init__(self, seed: int, step: int, device: torch.device | str = "cpu") -> None:
        self.device = torch.device(device)
        self.rng = np.random.default_rng([seed, step])
        self._generator = torch.Generator(self.device)
        self._generator.manual_seed((seed * 1_000_003 + step) % 2**63)

    def uniform(self, between: tuple[float, float], *shape: int) -> Tensor:
        low, high = between
        return low + (high - low) * torch.rand(*shape, generator=self._generator, device=self.device)

    def log_uniform(self, between: tuple[float, float], *shape: int) -> Tensor:
        return self.uniform((math.log(between[0]), math.log(between[1])), *shape).exp()

    def normal(self, *shape: int, most: float | None = None) -> Tensor:
        """Standard normal numbers; those beyond `most` become it."""
        values = torch.randn(*shape, generator=self._generator, device=self.device)
        return values if most is None else values.clamp(-most, most)

    def share(self, probability: float | Tensor, *shape: int) -> Tensor:
        """Booleans, True with that probability."""
        return torch.rand(*shape, generator=self._generator, device=self.device) < probability

    def integers(self, below: int, *shape: int) -> Tensor:
        return torch.randint(below, shape, generator=self._generator, device=self.device)

    def choice(self, weights: Tensor, count: int) -> Tensor:
        """(count,) places among the weights, as often as they weigh."""
        return torch.multinomial(weights, count, replacement=True, generator=self._generator)

    def runs(self, rate: Tensor, mean_length: float | Tensor) -> Tensor:
        """Booleans of rate's shape (..., T): runs that start with that probability a frame and last geometrically
        long."""
        start = self.share(rate, *rate.shape)
        frame = torch.arange(rate.shape[-1], device=self.device)
        stays = torch.as_tensor(1 - 1 / mean_length, device=self.device).clamp(1e-6, 1 - 1e-6)
        length = (self.uniform((1e-7, 1.0), *rate.shape).log() / stays.log()).ceil()
        ends = torch.where(start, frame + length, 0.0)
        return ends.cummax(dim=-1).values > frame
