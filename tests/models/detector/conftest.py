"""A toy network that takes any red rectangle for a person, films of such people, and a recipe that is quick."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from commands import pcnet3d, recipe_of
from golden.films import film_of
from golden.networks import save_graph
from pcnet3d.adapters.video import read
from pcnet3d.pipeline import Video
from pcnet3d.pipeline.core.layouts import COCO17

# Where the toy sees the joints: in half widths and half heights from the middle of the rectangle.
_BODY = {
    "nose": (0, -0.9), "eye": (0.1, -0.95), "ear": (0.2, -0.9), "shoulder": (0.6, -0.6), "elbow": (0.8, -0.3),
    "wrist": (0.9, 0.0), "hip": (0.4, 0.0), "knee": (0.4, 0.5), "ankle": (0.4, 0.95),
}  # fmt: skip
BODY = np.array(
    [
        np.multiply(_BODY[name.split("_")[-1]], (-1 if name.startswith("r_") else 1, 1))
        for name in COCO17.joints
    ]
)
Box = tuple[float, float, float, float]  # left, top, right, bottom


def joints_of(box: Box) -> np.ndarray:
    """(17, 2) pixels of the joints that the toy sees in a rectangle."""
    corners = np.reshape(box, (2, 2)).astype(float)
    return corners.mean(axis=0) + BODY * np.ptp(corners, axis=0) / 2


def constant_graph(path: Path, shape: Sequence[int], answers: dict[str, np.ndarray]) -> Path:
    """A network whose outputs are always the same, for a float input of that shape."""
    kinds = {"f": "float", "i": "int64"}
    outputs = [f"{kinds[answer.dtype.kind]}{[*answer.shape]} {name}" for name, answer in answers.items()]
    nodes = "".join(f"{name} = Identity ({name}_0)\n" for name in answers)
    graph = f"toy (float{[*shape]} input) => ({', '.join(outputs)}) {{ {nodes} }}"
    return save_graph(path, graph, {f"{name}_0": answer for name, answer in answers.items()})


def save_toy(path: Path, kind: str = "uint8", side: int = 192) -> Path:
    """Inputs and outputs of MoveNet; the joints are where `joints_of` has them, with score 0.9, for red in the image;
    without red the score is 0."""
    at = ((np.arange(side) + 0.5) / side).astype(np.float32)
    held = {
        "weights": np.array([1, -0.5, -0.5], np.float32).reshape(1, 1, 1, 3),
        "columns": at.reshape(1, 1, side),
        "rows": at.reshape(1, side, 1),
        "body_x": np.float32(np.sqrt(3)) * BODY[:, 0].astype(np.float32).reshape(1, 1, 17),
        "body_y": np.float32(np.sqrt(3)) * BODY[:, 1].astype(np.float32).reshape(1, 1, 17),
        "no_less": np.float32(1e-6), "threshold": np.float32(60), "enough": np.float32(1e-4),
        "most": np.full((1, 1, 17), 0.9, np.float32),
        "channel": np.array([3], np.int64), "whole": np.array([1, 2], np.int64),
        "last": np.array([3], np.int64),
    }  # fmt: skip
    places = "".join(
        f"""m_{of} = Mul (red, {grid})
        s_{of} = ReduceSum <keepdims=1> (m_{of}, whole)
        mean_{of} = Div (s_{of}, mass)
        off_{of} = Sub ({grid}, mean_{of})
        square_{of} = Mul (off_{of}, off_{of})
        held_{of} = Mul (square_{of}, red)
        spread_{of} = ReduceSum <keepdims=1> (held_{of}, whole)
        variance_{of} = Div (spread_{of}, mass)
        deviation_{of} = Sqrt (variance_{of})
        reach_{of} = Mul (deviation_{of}, body_{of})
        at_{of} = Add (reach_{of}, mean_{of})
        {of} = Unsqueeze (at_{of}, last)
        """
        for of, grid in (("x", "columns"), ("y", "rows"))
    )
    graph = f"""toy ({kind}[1, {side}, {side}, 3] input) => (float[1, 1, 17, 3] output) {{
        image = Cast <to=1> (input)
        weighted = Mul (image, weights)
        redness = ReduceSum <keepdims=0> (weighted, channel)
        is_red = Greater (redness, threshold)
        red = Cast <to=1> (is_red)
        sum = ReduceSum <keepdims=1> (red, whole)
        mass = Max (sum, no_less)
        {places}
        there = Greater (sum, enough)
        there_1 = Cast <to=1> (there)
        score = Mul (there_1, most)
        s = Unsqueeze (score, last)
        output = Concat <axis=3> (y, x, s)
    }}"""
    return save_graph(path, graph, held)


@pytest.fixture(scope="session")
def toys() -> SimpleNamespace:
    """The functions of this file, for the tests."""
    return SimpleNamespace(
        joints_of=joints_of,
        constant_graph=constant_graph,
        save_toy=save_toy,
        film_in=film_in,
        scene=scene,
        walking=walking,
    )


@pytest.fixture(scope="session")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A detector's file that sees red rectangles."""
    return save_toy(tmp_path_factory.mktemp("toy") / "toy.onnx")


def scene(box: Box | None, size: tuple[int, int] = (320, 240), seed: int = 0) -> np.ndarray:
    """(H, W, 3): grey blotches, others for another seed, and a red rectangle unless there is none."""
    import cv2

    small = np.random.default_rng(seed).integers(30, 200, (6, 8), dtype=np.uint8)
    image = cv2.cvtColor(cv2.resize(small, size, interpolation=cv2.INTER_CUBIC), cv2.COLOR_GRAY2RGB)
    if box is not None:
        left, top, right, bottom = (round(side) for side in box)
        image[max(top, 0) : bottom, max(left, 0) : right] = (250, 10, 10)
    return image


def walking(frames: int) -> list[Box]:
    """A rectangle that goes to the right and bobs."""
    return [(40 + 3 * i, 50 + 4 * np.sin(i), 80 + 3 * i, 200 + 4 * np.sin(i)) for i in range(frames)]


def film_in(folder: Path) -> Callable[..., Video]:
    """film(images, stamps_ms=None, name="film.mp4"): a video of these images, H.264 with B-frames."""

    def make(
        images: Sequence[np.ndarray], stamps_ms: Sequence[int] | None = None, name: str = "film.mp4"
    ) -> Video:
        stamps = stamps_ms or [round(1000 * i / 30) for i in range(len(images))]
        path = film_of(folder / name, images, stamps, crf=12, bf=2, g=12)
        return read(path)[0]

    return make


@pytest.fixture
def film(tmp_path: Path) -> Callable[..., Video]:
    """film_in the test's own folder."""
    return film_in(tmp_path)


@pytest.fixture(scope="session")
def walk_film(tmp_path_factory: pytest.TempPathFactory) -> Video:
    """40 frames of one person."""
    return film_in(tmp_path_factory.mktemp("walk"))([scene(box) for box in walking(40)])


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recipe without recording and report."""
    stages = ("detect", "lift", "clean", "scale", "rectify", "trajectories", "export")
    return recipe_of(tmp_path_factory.mktemp("recipe") / "quick.toml", *stages)


@pytest.fixture
def call():
    """call(WORDS): `pcnet3d run WORDS`."""
    return partial(pcnet3d, "run")
