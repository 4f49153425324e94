"""pcnet3d lab train CONFIG.toml -o DIR: trains what the config file describes; needs the extra "train"."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import torch
from typer import Argument, Option

from ...pipeline.core.errors import InputError
from ...pipeline.plugins.removed import refuse_removed
from ...pipeline.running.recipe import load_toml
from .training import lifter, rectifier
from .training.loop import Device, checked

_TRAINERS = {"lifter": lifter, "pcnet": rectifier}


def train(
    config: Annotated[Path, Argument(help="Config file, such as models/lab/training/lifter.toml.")],
    output: Annotated[Path, Option("-o", "--output", help="Folder for weights, checkpoint and log.")],
    device: Annotated[Device, Option(help="auto: a GPU if there is one.")] = "auto",
    threads: Annotated[int, Option(min=1, help="Number of CPU threads.")] = 1,
) -> None:
    """Train a network of this package from a config file, or continue a stopped training."""
    content = load_toml(config, "a training config")
    for key, value in content.items():
        inner = value if isinstance(value, dict) else ()
        refuse_removed("training", key, *(f"{key}.{name}" for name in inner))
    kind = str(content.get("kind", "lifter"))
    if kind not in _TRAINERS:
        raise InputError("bad-value", f"{config}: expected a kind of {', '.join(_TRAINERS)}; got '{kind}'.")
    trainer = _TRAINERS[kind]
    told = checked(content, trainer.TrainConfig, str(config))
    torch.set_num_threads(threads)
    trainer.train(told, output, device)  # type: ignore[arg-type]
