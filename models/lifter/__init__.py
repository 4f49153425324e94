"""Lifters: the built-in one, and other people's networks in ONNX files."""
