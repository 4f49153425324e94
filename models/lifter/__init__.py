"""Lifters: the built-in one, and other people's networks in ONNX files."""

from pathlib import Path

SHIPPED = Path(__file__).parent / "lifter.onnx"  # the built-in lifter's weights
