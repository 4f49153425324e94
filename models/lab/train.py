"""pcnet3d lab train CONFIG.toml -o DIR: trains what the config file describes; needs the extra "train".

Where the package is not installed, for example on a machine lent for minutes: python -m pcnet3d.models.lab.train ...
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...pipeline.core.errors import InputError
from ...pipeline.core.extras import needed_for
from ...pipeline.running.recipe import load_toml
from .common.modules import run_command


def train(
    config: Annotated[
        Path,
        typer.Argument(help="Config file, such as models/lab/training/lifter/lifter.toml."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for weights, checkpoint and log.")],
    device: Annotated[str, typer.Option(help="auto (a GPU if there is one), cpu or cuda.")] = "auto",
    threads: Annotated[int, typer.Option(min=1, help="Number of CPU threads.")] = 1,
    minutes: Annotated[
        float | None, typer.Option(min=0, help="Stop after this many minutes; the same command continues.")
    ] = None,
) -> None:
    """Train a network of this package from a config file, or continue a stopped training."""
    with needed_for("Training"):
        import torch

        from .training.lifter.train import train_lifter
        from .training.rectifier.train import train_pcnet
    torch.set_num_threads(threads)
    trainers = {"lifter": train_lifter, "pcnet": train_pcnet}
    kind = _kind(config)
    if kind not in trainers:
        raise InputError("bad-value", f"{config}: expected a kind of {', '.join(trainers)}; got '{kind}'.")
    trainers[kind](config, output, device, minutes)


def _kind(config: Path) -> str:
    """What the file says it trains; a file that cannot be read is left to the trainer's own words."""
    try:
        return str(load_toml(config, "a training config").get("kind", "lifter"))
    except InputError:
        return "lifter"


if __name__ == "__main__":
    run_command(train)
