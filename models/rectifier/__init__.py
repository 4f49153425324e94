"""Rectifiers: the geometric one, and networks in ONNX files."""
