"""One lifter out of two runs, the second begun with the first one's weights: the mean of their weights, which does
better on validation than either of them.

    python -m pcnet3d.models.lifter.training.average FIRST SECOND --share 0.7 -o lifter.onnx

Both are folders of `pcnet3d train`. Prints the validation of both and of the mean.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import torch
import typer

from ...common.training import load_weights
from .net import LifterNet, NetConfig
from .train import check, check_batches, clips_of, export, read_config


def mean_of(first: LifterNet, second: LifterNet, config: NetConfig, share: float) -> LifterNet:
    """A network of their form whose every weight is 1 - share of the first's and share of the second's."""
    mean = LifterNet(config)
    weights = zip(first.state_dict().items(), second.state_dict().values(), strict=True)
    mean.load_state_dict({name: torch.lerp(a, b, share) for (name, a), b in weights})
    return mean


def main(
    first: Annotated[Path, typer.Argument(help="The folder of the first run.")],
    second: Annotated[Path, typer.Argument(help="The folder of the run that began with its weights.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The .onnx file to write.")],
    share: Annotated[float, typer.Option(min=0, max=1, help="Of the second's weights.")] = 0.5,
) -> None:
    """Average two lifters."""
    config = read_config(second / "lifter.toml")
    runs = [load_weights(LifterNet(config.net), folder / "best.pt") for folder in (first, second)]
    mean = mean_of(runs[0], runs[1], config.net, share)
    checks = check_batches(clips_of(config)[1], torch.device("cpu"))
    for name, net in (("first", runs[0]), ("second", runs[1]), ("mean", mean)):
        found = ", ".join(f"{key} {value:.2f}" for key, value in check(net.eval(), checks).items())
        print(f"{name}: {found}")
    export(mean, output, reach=config.net.reach, trained_on=config.subjects)


if __name__ == "__main__":
    typer.run(main)
