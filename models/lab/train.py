"""pcnet3d lab train CONFIG.toml -o DIR: trains what the config file describes; needs the extra "train"."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import torch
import typer

from ...pipeline.core.errors import InputError
from ...pipeline.plugins.removed import refuse_removed
from ...pipeline.running.recipe import load_toml
from .common.config import checked
from .training import Device, lifter, rectifier

_TRAINERS = {"lifter": lifter, "pcnet": rectifier}


def train(
    config: Annotated[
        Path,
        typer.Argument(help="Config file, such as models/lab/training/lifter.toml."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for weights, checkpoint and log.")],
    device: Annotated[Device, typer.Option(help="auto: a GPU if there is one.")] = "auto",
    threads: Annotated[int, typer.Option(min=1, help="Number of CPU threads.")] = 1,
) -> None:
    """Train a network of this package from a config file, or continue a stopped training."""
    trainer, checked_config = read_config(config)
    torch.set_num_threads(threads)
    trainer.train(checked_config, output, device)


def read_config(path: Path) -> tuple[Any, Any]:
    """The module that trains what a config file describes, and its TrainConfig. InputError for keys and values that it
    cannot have."""
    content = load_toml(path, "a training config")
    for key, value in content.items():
        inner = value if isinstance(value, dict) else ()
        refuse_removed("training", key, *(f"{key}.{name}" for name in inner))
    kind = str(content.get("kind", "lifter"))
    if kind not in _TRAINERS:
        raise InputError("bad-value", f"{path}: expected a kind of {', '.join(_TRAINERS)}; got '{kind}'.")
    return _TRAINERS[kind], checked(content, _TRAINERS[kind].TrainConfig, str(path))
