"""Tiny ONNX networks with the shapes of public lifters, whose answers are known."""

from pathlib import Path

import numpy as np
import pytest

from pcnet3d.pipeline import H36M17, IMAGE, PoseSequence
from pcnet3d.pipeline.core.layouts import COCO17

onnx = pytest.importorskip("onnx")
from onnx import helper  # noqa: E402

from golden.networks import save_graph  # noqa: E402

JOINTS = 17


def save(path: Path, *graph) -> str:
    """The file of such a graph, as a user names it."""
    return str(save_graph(path, *graph))


@pytest.fixture
def per_frame(tmp_path):
    """per_frame(matrix (C, 3), bias (17, 3), frames) -> file: each joint times the matrix, plus the bias."""

    def make(matrix, bias=None, frames=None, name="toy.onnx"):
        matrix = np.asarray(matrix, np.float32)
        bias = np.zeros((JOINTS, 3), np.float32) if bias is None else np.asarray(bias, np.float32)
        nodes = [
            helper.make_node("MatMul", ["x", "matrix"], ["turned"]),
            helper.make_node("Add", ["turned", "bias"], ["joints"]),
        ]
        length = frames or "frames"
        return save(
            tmp_path / name, nodes, {"x": [1, length, JOINTS, len(matrix)]}, {"joints": [1, length, JOINTS, 3]},
            {"matrix": matrix, "bias": bias},
        )  # fmt: skip

    return make


@pytest.fixture
def convolution(tmp_path):
    """convolution(field, frames) -> file: (1, T, 17, 2) -> (1, T - field + 1, 17, 3) with weights kernel
    (51, 34, field), also returned."""

    def make(field, frames=None, name="conv.onnx"):
        kernel = np.random.default_rng(field).normal(size=(3 * JOINTS, 2 * JOINTS, field)).astype(np.float32)
        kernel /= field
        nodes = [
            helper.make_node("Reshape", ["x", "flat"], ["rows"]),
            helper.make_node("Transpose", ["rows"], ["columns"], perm=[0, 2, 1]),
            helper.make_node("Conv", ["columns", "kernel"], ["answers"]),
            helper.make_node("Transpose", ["answers"], ["back"], perm=[0, 2, 1]),
            helper.make_node("Reshape", ["back", "points"], ["joints"]),
        ]
        weights = {
            "kernel": kernel,
            "flat": np.array([1, -1, 2 * JOINTS]),
            "points": np.array([1, -1, JOINTS, 3]),
        }
        answered = frames - field + 1 if frames else "answered"
        shapes = {"x": [1, frames or "frames", JOINTS, 2]}, {"joints": [1, answered, JOINTS, 3]}
        return save(tmp_path / name, nodes, *shapes, weights), kernel

    return make


@pytest.fixture
def swaying():
    """swaying(frames, layout) -> keypoints of someone who sways, right of the image's middle."""

    def make(frames=60, layout=H36M17, **changes):
        rng = np.random.default_rng(3)
        flat = rng.uniform((900, 200), (1500, 900), (len(layout), 2))
        sway = np.sin(np.arange(frames)[:, None, None] / 9 + rng.uniform(0, 6, (len(layout), 2))) * 30
        pixels = changes.pop("pixels", flat + sway)
        return PoseSequence(pixels, layout, IMAGE, frame_index=np.arange(len(pixels)), **changes)

    return make


@pytest.fixture
def coco(swaying):
    return swaying(40, COCO17)
