"""What networks share: ONNX files, downloads, error measures."""
