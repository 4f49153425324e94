"""Several processes that train one network, as torchrun starts them; one process otherwise."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
from torch import Tensor, distributed

from ..pipeline.errors import InputError


@dataclass(frozen=True)
class Ranks:
    """Which of how many processes this is, and where it computes. Rank 0 writes and speaks for all."""

    rank: int
    size: int
    device: torch.device

    def part(self, count: int) -> slice:
        """This process's rows of a batch. InputError when there are fewer rows than processes."""
        if count < self.size:
            raise InputError(
                f"Expected a batch of at least one pose for each of {self.size} processes, got {count}."
            )
        return slice(count * self.rank // self.size, count * (self.rank + 1) // self.size)

    def total(self, value: Tensor) -> float:
        """The sum of a number over all processes."""
        value = value.detach().clone()
        if self.size > 1:
            distributed.all_reduce(value)
        return value.item()

    def add_gradients(self, parameters: Iterable[torch.nn.Parameter]) -> None:
        """Every process gets the sum of all gradients."""
        if self.size == 1:
            return
        gradients = [p.grad for p in parameters if p.grad is not None]
        flat = torch.cat([gradient.flatten() for gradient in gradients])
        distributed.all_reduce(flat)
        for gradient, part in zip(gradients, flat.split([g.numel() for g in gradients]), strict=True):
            gradient.copy_(part.view_as(gradient))


@contextmanager
def ranks() -> Iterator[Ranks]:
    """The processes of this run by torchrun's environment variables: a GPU each where there are GPUs (NCCL), else
    the CPU (Gloo). InputError when there are more processes than GPUs."""
    size, local = (int(os.environ.get(name, other)) for name, other in (("WORLD_SIZE", 1), ("LOCAL_RANK", 0)))
    if torch.cuda.is_available():
        if local >= torch.cuda.device_count():
            raise InputError(
                f"Expected at most {torch.cuda.device_count()} processes here, one for each GPU, got {local + 1}."
            )
        device = torch.device("cuda", local)
        torch.cuda.set_device(device)
    else:
        device = torch.device("cpu")
    if size == 1:
        yield Ranks(0, 1, device)
        return
    distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    try:
        yield Ranks(distributed.get_rank(), size, device)
    finally:
        distributed.destroy_process_group()
