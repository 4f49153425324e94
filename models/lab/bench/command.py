"""`pcnet3d lab bench`: how fast rectifiers, whole runs of files and of a video, and studies are on this machine."""

from __future__ import annotations

import typer

from .batch import batch
from .files import files
from .pipeline import pipeline
from .rectify import rectify

bench = typer.Typer(help="Measure speed and memory on this machine.", no_args_is_help=True)
for _command in (rectify, files, pipeline, batch):
    bench.command()(_command)
