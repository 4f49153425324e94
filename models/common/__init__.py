"""What networks share: ONNX files, downloads, a take's motion."""
