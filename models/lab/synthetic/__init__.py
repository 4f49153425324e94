"""Cameras, bodies and keypoint noise: synthetic views of motion capture."""
