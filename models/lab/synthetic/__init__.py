"""Cameras, bodies and keypoint noise: synthetic views of motion capture, made in torch."""

from ....pipeline.core.errors import needed_for

with needed_for("Seeing motion capture with virtual cameras"):
    import torch  # noqa: F401
