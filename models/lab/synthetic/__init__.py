"""Cameras, bodies and keypoint noise: synthetic views of motion capture, made in torch."""
