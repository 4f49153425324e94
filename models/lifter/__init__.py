"""Lifters: the built-in one, and other people's networks in ONNX files."""

from pathlib import Path

SHIPPED = Path(__file__).parent / "lifter.onnx"  # the built-in lifter's weights
CHANGES = Path(__file__).parent / "changes.onnx"  # the network of changes.py
