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
WIDTH, HEIGHT = 640, 360
# Squares that MoveNet looks at: left, top and side of that around the image, and of that around who is in its middle.
WHOLE, PERSON = (0, -140, 640), (164, 24, 312)


def joints_px() -> np.ndarray:
    """(60, 17, 2) the walker's COCO joints in the video."""
    walk = walker(fps=FPS, seconds=FRAMES / FPS)
    return side_camera(walk).project(halpe26(walk))[:, HALPE26.indices(COCO17.joints)].astype(np.float32)


def in_the_middle() -> np.ndarray:
    """(60, 17, 2) the same of somebody who stays in the middle of the video and is so large in each image that the
    published crop of MoveNet, 1.9 times the torso's reach or 1.2 times the body's, is always PERSON."""
    joints = joints_px()
    off = joints - joints[:, COCO17.indices(("l_hip", "r_hip"))].mean(axis=1, keepdims=True)
    torso = np.abs(off[:, COCO17.indices(("l_shoulder", "r_shoulder", "l_hip", "r_hip"))])
    reach = np.maximum(1.9 * torso.max(axis=(1, 2)), 1.2 * np.abs(off).max(axis=(1, 2)))
    return (off * (PERSON[2] / 2 / reach)[:, None, None] + np.array([WIDTH, HEIGHT]) / 2).astype(np.float32)


def numbered_film(path: Path, codec: str = "libx264", **options: str) -> Path:
    """60 images of a floor, whose upper left corner tells their number by its brightness, and a patch beside the person
    too; H.264 without B-frames unless the options of the codec say otherwise. MPEG-TS can be read from a pipe."""
    import av

    left, top, _ = PERSON
    rows, columns = np.indices((HEIGHT, WIDTH))
    floor = (120 + 60 * np.sin(columns / 40) * np.sin(rows / 30)).astype(np.uint8)
    with av.open(str(path), "w") as container:
        fine = {"crf": "12", "bf": "0"} if codec == "libx264" else {"b": "8M"}
        stream = container.add_stream(codec, rate=FPS, options=fine | options)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for number in range(FRAMES):
            image = np.repeat(floor[..., None], 3, axis=-1)
            image[:48, :48] = image[top : top + 40, left : left + 40] = 8 + STEP * number
            image[top : top + 40, left + 40 : left + 80] = 235
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, "rgb24")))
        container.mux(stream.encode())
    return path


def toy_detector(path: Path, score: float = 0.9) -> Path:
    """MoveNet's inputs and outputs; finds the joints of `in_the_middle`, with that score, by the brightness of the
    patch in the crop that it looks at: that of all of the image, which is black above, or that of the person, which has
    a white patch; nobody in others."""
    pytest.importorskip("onnx")
    from golden.networks import save_graph

    answers = np.full(
        (3, FRAMES, 1, 1, 17, 3), -5.0, np.float32
    )  # in other crops, of the person, of all of the image
    answers[..., 2] = 0
    for rows, (left, top, side) in zip(answers[1:], (PERSON, WHOLE), strict=True):
        rows[:, 0, 0, :, :2] = ((in_the_middle() - [left, top]) / side)[..., ::-1]
        rows[..., 2] = score
    held = {
        "answers": answers.reshape(-1, 1, 1, 17, 3),
        "dark": np.float32(20), "white": np.float32(215), "black": np.float32(8), "step": np.float32(STEP),
        "frames": np.array(FRAMES), "two": np.array(2),
    }  # fmt: skip
    # Rows and columns of the input, whose side is 192.
    for name, (top, bottom, left, right) in {
        "above": (0, 30, 60, 130), "beside": (4, 18, 30, 44), "own": (4, 18, 4, 18), "whole": (45, 53, 3, 11),
    }.items():  # fmt: skip
        held |= {f"{name}_from": np.array([0, top, left, 0]), f"{name}_to": np.array([1, bottom, right, 3])}
    greys = "".join(
        f"{name}_part = Slice (pixels, {name}_from, {name}_to) {name}_grey = ReduceMean <keepdims=0> ({name}_part)\n"
        for name in ("above", "beside", "own", "whole")
    )
    graph = f"""toy (uint8[1, 192, 192, 3] image) => (float[1, 1, 17, 3] person) {{
        pixels = Cast <to=1> (image)
        {greys}
        is_whole = Less (above_grey, dark)
        is_person = Greater (beside_grey, white)
        grey = Where (is_whole, whole_grey, own_grey)
        lighter = Sub (grey, black)
        number = Div (lighter, step)
        rounded = Round (number)
        frame = Cast <to=7> (rounded)
        whole_once = Cast <to=7> (is_whole)
        whole_twice = Mul (whole_once, two)
        person_once = Cast <to=7> (is_person)
        crop = Max (whole_twice, person_once)
        first = Mul (crop, frames)
        row = Add (first, frame)
        person = Gather <axis=0> (answers, row)
    }}"""
    return save_graph(path, graph, held)
