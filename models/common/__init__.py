"""What networks share: ONNX files, error measures, training, configuration files."""
