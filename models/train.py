"""pcnet3d train CONFIG.toml -o DIR: trains what the config file describes; needs the extra "train"."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated

import typer

from ..pipeline.errors import InputError


def train(
    config: Annotated[Path, typer.Argument(help="What to train and how, e.g. models/lifter.toml.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for weights and log.")],
) -> None:
    """Train a network of this package from a config file."""
    try:
        from .lifter_train import train_lifter
        from .pcnet_train import train_pcnet
    except ModuleNotFoundError as error:
        raise InputError(
            f"Training needs {error.name}, which is not installed: pip install 'pcnet3d[train]'."
        ) from None
    train = train_pcnet if _kind(config) == "pcnet" else train_lifter
    train(config, output)


def _kind(config: Path) -> str:
    """What the file says it trains; a file that cannot be read is left to the trainer's own words."""
    try:
        return str(tomllib.loads(config.read_text(encoding="utf-8")).get("kind", "lifter"))
    except (OSError, ValueError):
        return "lifter"
