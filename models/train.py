"""pcnet3d train CONFIG.toml -o DIR: trains what the config file describes; needs the extra "train".

On several GPUs: torchrun --nproc-per-node N -m pcnet3d.models.train CONFIG.toml -o DIR
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from ..pipeline.config import load_toml
from ..pipeline.errors import InputError
from .extras import needed_for


def train(
    config: Annotated[Path, typer.Argument(help="What to train and how, e.g. models/lifter.toml.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for weights and log.")],
) -> None:
    """Train a network of this package from a config file."""
    with needed_for("Training"):
        from .lifter_train import train_lifter
        from .pcnet_ablations import train_ablations
        from .pcnet_train import train_pcnet
    trainers = {"lifter": train_lifter, "pcnet": train_pcnet, "ablations": train_ablations}
    kind = _kind(config)
    if kind not in trainers:
        raise InputError(f"{config}: expected a kind of {', '.join(trainers)}; got '{kind}'.")
    if kind != "pcnet" and int(os.environ.get("WORLD_SIZE", 1)) > 1:
        raise InputError(
            f"{config}: only the kind 'pcnet' trains in several processes; start one for '{kind}'."
        )
    trainers[kind](config, output)


def _kind(config: Path) -> str:
    """What the file says it trains; a file that cannot be read is left to the trainer's own words."""
    try:
        return str(load_toml(config, "a training config").get("kind", "lifter"))
    except InputError:
        return "lifter"


if __name__ == "__main__":  # torchrun starts modules, not commands
    from ..pipeline.cli import main

    sys.argv.insert(1, "train")
    main()
