"""Lifters: the built-in one, and functions in its place."""

from pathlib import Path

SHIPPED = Path(__file__).parent / "lifter.onnx"  # the built-in lifter's weights
