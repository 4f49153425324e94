"""Random numbers of the virtual beds: torch's on the device that trains, numpy's where published figures rest on
them."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor


class Draw:
    """The same seed and step give the same numbers on the same kind of device, whatever came before. rng: numpy's."""

    dtype = torch.float32

    def __init__(self, seed: int, step: int, device: torch.device | str = "cpu") -> None:
        self.device = torch.device(device)
        self.rng = np.random.default_rng([seed, step])
        self._generator = torch.Generator(self.device)
        self._generator.manual_seed((seed * 1_000_003 + step) % 2**63)

    def rand(self, *shape: int) -> Tensor:
        """Numbers between 0 and 1."""
        return torch.rand(*shape, generator=self._generator, device=self.device)

    def randn(self, *shape: int) -> Tensor:
        """Standard normal numbers."""
        return torch.randn(*shape, generator=self._generator, device=self.device)

    def integers(self, below: int, *shape: int) -> Tensor:
        return torch.randint(below, shape, generator=self._generator, device=self.device)

    def choice(self, weights: Tensor, count: int) -> Tensor:
        """(count,) places among the weights, as often as they weigh."""
        return torch.multinomial(weights, count, replacement=True, generator=self._generator)

    def runs(self, rate: Tensor, mean_length: float) -> Tensor:
        """Booleans of rate's shape (..., T): runs that start with that probability a frame and last geometrically
        long."""
        start = self.share(rate, *rate.shape)
        stays = min(max(1 - 1 / mean_length, 1e-6), 1 - 1e-6)
        length = (self.uniform((1e-7, 1.0), *rate.shape).log() / np.log(stays)).ceil()
        return _lasting(start, length)

    def ar1(self, coefficient: float, *shape: int) -> Tensor:
        """Stationary AR(1) noise of unit variance along the time axis of (B, T, J, 2)."""
        white = self.randn(*shape)
        frame = torch.arange(shape[1], device=self.device)
        lag = frame[:, None] - frame
        weights = torch.where(lag >= 0, coefficient ** lag.clamp_min(0).float(), 0.0)
        weights[:, 1:] *= (1 - coefficient**2) ** 0.5
        return torch.einsum("ts,bsjk->btjk", weights, white)

    def uniform(self, between: tuple[float, float], *shape: int) -> Tensor:
        low, high = between
        return low + (high - low) * self.rand(*shape)

    def log_uniform(self, between: tuple[float, float], *shape: int) -> Tensor:
        low, high = between
        return low * (high / low) ** self.rand(*shape)

    def normal(self, *shape: int, most: float | None = None) -> Tensor:
        """Standard normal numbers; those beyond `most` become it."""
        values = self.randn(*shape)
        return values if most is None else values.clamp(-most, most)

    def share(self, probability: float | Tensor, *shape: int) -> Tensor:
        """Booleans, True with that probability."""
        return self.rand(*shape) < probability


class NumpyDraw(Draw):
    """The same of a numpy generator, in double precision on the CPU: for test beds."""

    dtype = torch.float64

    def __init__(self, rng: np.random.Generator) -> None:
        self.device, self.rng = torch.device("cpu"), rng

    def rand(self, *shape: int) -> Tensor:
        return torch.from_numpy(self.rng.random(shape))

    def randn(self, *shape: int) -> Tensor:
        return torch.from_numpy(self.rng.standard_normal(shape))

    def integers(self, below: int, *shape: int) -> Tensor:
        return torch.from_numpy(self.rng.integers(below, size=shape))

    def runs(self, rate: Tensor, mean_length: float) -> Tensor:
        start = self.share(rate, *rate.shape)
        return _lasting(start, torch.from_numpy(self.rng.geometric(1 / mean_length, rate.shape)))

    def ar1(self, coefficient: float, *shape: int) -> Tensor:
        from scipy.signal import lfilter

        white = self.rng.standard_normal(shape, dtype=np.float32)
        white[:, 1:] *= np.sqrt(1 - coefficient**2)
        return torch.from_numpy(np.asarray(lfilter([1.0], [1.0, -coefficient], white, axis=1)))


def _lasting(start: Tensor, length: Tensor) -> Tensor:
    """(..., T) True from every start on for so many frames."""
    frame = torch.arange(start.shape[-1], device=start.device)
    return torch.where(start, frame + length, 0).cummax(dim=-1).values > frame
