"""Checkpoints of a training, as its folder holds them."""

from pathlib import Path
from typing import Any

import torch


def read_checkpoint(folder: Path) -> dict[str, Any]:
    """What was saved: config, learns_from, step, best, and the state of net, average and optimisers."""
    return torch.load(folder / "checkpoint.pt", weights_only=True)


def same(one: Any, other: Any) -> bool:
    """Bit for bit, all the way down."""
    if isinstance(one, torch.Tensor):
        return torch.equal(one, other)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other
