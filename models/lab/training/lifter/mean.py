"""One lifter of several runs from the same beginning, the mean of their weights:

    python -m pcnet3d.models.lab.training.lifter.mean CONFIG.toml OUT.onnx 0.5:RUN/best.pt 0.5:models/lifter/lifter.onnx

Runs that began with the same weights end near enough to each other for their mean to be a network, and often a better
one than each (Wortsman et al. 2022, model soups).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import torch
import typer

from .....pipeline.core.errors import InputError
from ...common.modules import run_command
from .exported import export
from .net import LifterNet
from .train import clips_of, read_config, started, trained_on
from .validation import judged, whole_takes


def mean(net: LifterNet, parts: list[tuple[float, Path]]) -> LifterNet:
    """net with the mean of these weights, by their shares. InputError for files that are not of this network
    (exported.weights_of), and for shares that do not sum to 1."""
    if abs(sum(share for share, _ in parts) - 1) > 1e-6:
        raise InputError(
            "bad-value", f"Expected shares that sum to 1, got {sum(share for share, _ in parts):g}."
        )
    total = {name: torch.zeros_like(value) for name, value in net.state_dict().items()}
    for share, path in parts:
        started(net, path)
        for name, value in net.state_dict().items():
            total[name] += share * value
    net.load_state_dict(total)
    return net.eval()


def part(text: str) -> tuple[float, Path]:
    """SHARE:PATH. InputError for anything else."""
    share, _, path = text.partition(":")
    try:
        return float(share), Path(path)
    except ValueError:
        raise InputError("bad-value", f"Expected a share and a file as in 0.5:best.pt, got {text}.") from None


def main(
    config: Annotated[Path, typer.Argument(help="The runs' config: network, whom to validate on.")],
    output: Annotated[Path, typer.Argument(help="The .onnx file to write.")],
    parts: Annotated[list[str], typer.Argument(help="SHARE:FILE, weights of a run or an exported network.")],
) -> None:
    """Write the mean of weights as a lifter whose stated deviations are as large as its errors on validation; print
    those."""
    asked = read_config(config)
    net = mean(LifterNet(asked.net), [part(text) for text in parts])
    takes = whole_takes([clip for part in clips_of(asked)[1].values() for clip in part])
    with torch.no_grad():
        net.leave_sd.bias.add_(math.log(judged(net, takes, torch.device("cpu"))["error_over_sd"]))
    for name, value in judged(net, takes, torch.device("cpu")).items():
        print(f"{name} {value:.2f}")
    export(net, output, reach=asked.net.reach, trained_on=trained_on(asked))


if __name__ == "__main__":
    run_command(main)
