"""How fast the parts of the lifter's training are on this machine:  pcnet3d bench training [CONFIG]"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from ....pipeline.core.extras import needed_for

_SHIPPED = Path(__file__).parents[1] / "training/lifter/lifter.toml"
_PARTS = ("material", "network", "optimiser")


def training(
    config: Annotated[Path, typer.Argument(help="A lifter's training config.")] = _SHIPPED,
    device: Annotated[str, typer.Option(help="auto (a GPU where there is one), cpu or cuda.")] = "auto",
    threads: Annotated[int, typer.Option(min=1, help="CPU threads.")] = 1,
    rounds: Annotated[int, typer.Option(min=1, help="How many steps of every length are measured.")] = 5,
) -> None:
    """Measure frames per second of a lifter's training: making its data, forward and backward pass, optimiser."""
    with needed_for("Measuring a training"):
        import torch
    torch.set_num_threads(threads)
    print(f"{'frames':>6} {'':>11}" + "".join(f"{part:>12}" for part in (*_PARTS, "together")))
    for length, seconds in measure(config, device, rounds).items():
        frames, *parts = seconds
        whole = [*parts, sum(parts)]
        print(
            f"{length:>6} {'frames/s':>11}" + "".join(f"{frames / part:>12,.0f}" for part in whole),
            flush=True,
        )


def measure(config: Path, device: str, rounds: int) -> dict[int, tuple[float, float, float, float]]:
    """{frames of a window: frames of a batch, and the seconds that its material, the network both ways and the
    optimiser take}, medians of rounds after one that is not counted. InputError as of train.run."""
    import torch

    from ..common.training import device_of, optimisers_of
    from ..synthetic.on_device.draw import Draw
    from ..training.lifter.net import LifterNet
    from ..training.lifter.train import clips_of, loss_of_batch, read_config
    from ..training.lifter.windows import Windows

    asked, on = read_config(config), device_of(device)
    windows = Windows(clips_of(asked)[0], asked.material, on)
    net = LifterNet(asked.net).to(on)
    optimisers = optimisers_of(net, asked.schedule, net.matrices())

    def timed(action: Callable[[], Any]) -> tuple[float, Any]:
        start = time.perf_counter()
        result = action()
        if on.type == "cuda":
            torch.cuda.synchronize()
        return time.perf_counter() - start, result

    table = {}
    for length in sorted({1, *asked.lengths}):
        count, seconds = max(asked.frames // length, 1), []
        for step in range(rounds + 1):
            material, batch = timed(partial(windows.batch, Draw(asked.seed, step, on), count, length))
            network, _ = timed(lambda batch=batch: loss_of_batch(net, batch, asked).backward())
            optimiser, _ = timed(lambda: [each.step() for each in optimisers])
            net.zero_grad(set_to_none=True)
            seconds.append((material, network, optimiser))
        middle = torch.tensor(seconds[1:]).median(dim=0).values.tolist()
        table[length] = (count * length, *middle)
    return table
