"""A video of numbered images, and a detector that knows where the walker is in each of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.core.layouts import COCO17, HALPE26

FRAMES, FPS, STEP = 60, 30, 4  # STEP: grey levels from image to image in the upper left corner
WIDTH, HEIGHT, PADDED = 640, 360, 400  # PADDED: what the network sees, whose sides go in steps


def joints_px() -> np.ndarray:
    """(60, 17, 2) the walker's COCO joints in the video."""
    walk = walker(fps=FPS, seconds=FRAMES / FPS)
    return side_camera(walk).project(halpe26(walk))[:, HALPE26.indices(COCO17.joints)].astype(np.float32)


def numbered_film(path: Path, codec: str = "libx264", **options: str) -> Path:
    """60 images of a floor, whose upper left corner tells their number by its brightness; H.264 without B-frames unless
    the options of the codec say otherwise. MPEG-TS can be read from a pipe."""
    import av

    rows, columns = np.indices((HEIGHT, WIDTH))
    floor = (120 + 60 * np.sin(columns / 40) * np.sin(rows / 30)).astype(np.uint8)
    with av.open(str(path), "w") as container:
        fine = {"crf": "12", "bf": "0"} if codec == "libx264" else {"b": "8M"}
        stream = container.add_stream(codec, rate=FPS, options=fine | options)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for number in range(FRAMES):
            image = np.repeat(floor[..., None], 3, axis=-1)
            image[:48, :48] = 8 + STEP * number
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, "rgb24")))
        container.mux(stream.encode())
    return path


def toy_detector(path: Path, joints: np.ndarray | None = None, score: float = 0.9) -> Path:
    """MoveNet's multi-person inputs and outputs; looks the answer up by the corner's brightness.

    joints: (60, 17, 2) those that it finds, in pixels of the video, or (60, P, 17, 2) those of up to six people;
    without them `joints_px`. score: of each of them.
    """
    onnx = pytest.importorskip("onnx")
    from golden.networks import save_graph

    helper, kinds = onnx.helper, onnx.TensorProto
    people = (joints_px() if joints is None else joints).reshape(FRAMES, -1, 17, 2)
    count = people.shape[1]
    answers = np.zeros((FRAMES, 1, 6, 56), np.float32)
    scores = np.full((FRAMES, count, 17, 1), score)
    of_image = np.concatenate([people[..., ::-1] / (PADDED, WIDTH), scores], axis=-1)
    answers[:, 0, :count, :51] = of_image.reshape(FRAMES, count, 51)
    answers[:, 0, :count, 55] = score
    constants = {
        "answers": answers,
        "first": np.array([0, 4, 4, 0]),
        "last": np.array([1, 14, 14, 3]),
        "black": np.array(8, np.float32),
        "step": np.array(STEP, np.float32),
    }
    nodes = [
        helper.make_node("Cast", ["image"], ["pixels"], to=kinds.FLOAT),
        helper.make_node("Slice", ["pixels", "first", "last"], ["corner"]),
        helper.make_node("ReduceMean", ["corner"], ["grey"], keepdims=0),
        helper.make_node("Sub", ["grey", "black"], ["above"]),
        helper.make_node("Div", ["above", "step"], ["number"]),
        helper.make_node("Round", ["number"], ["rounded"]),
        helper.make_node("Cast", ["rounded"], ["row"], to=kinds.INT64),
        helper.make_node("Gather", ["answers", "row"], ["people"], axis=0),
    ]
    inputs = {"image": (kinds.UINT8, [1, None, None, 3])}
    return save_graph(path, nodes, inputs, {"people": [1, 6, 56]}, constants)
