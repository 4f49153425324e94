"""Tiny ONNX networks with the shapes of public lifters, whose answers are known."""

from pathlib import Path

import numpy as np
import pytest

from golden.bodies import feet_of
from golden.lifters import MARKER_COLOURS
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_files
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lifter import images
from pcnet3d.pipeline import H36M17, IMAGE, PoseSequence
from pcnet3d.pipeline.core.anthropometry import implied_stature
from pcnet3d.pipeline.core.layouts import COCO17, COCO23, FEET, MHR70
from pcnet3d.pipeline.reading.load import read_video

onnx = pytest.importorskip("onnx")
from onnx import TensorProto, helper  # noqa: E402

from golden.networks import save_graph  # noqa: E402

SIZE = (1920, 1080)
JOINTS = 17
WHOLE_BODY = 133
RTMW3D_NAMES = ("output", "1554", "1556")  # as the published file calls x, y and z
RTMW3D_BINS = (576, 768, 576)


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
def landmarks(tmp_path):
    """landmarks(world (33, 3), person, visibility) -> file like BlazePose's: the same answer to any image, but the
    nose's z is the mean of the image."""

    def make(world, person=0.9, visibility=2.0, name="landmarks.onnx"):
        points = np.zeros((39, 5), np.float32)
        points[:, 3] = visibility
        full = np.zeros((39, 3), np.float32)
        full[:33] = world
        nose_z = np.zeros((1, 117), np.float32)
        nose_z[0, 2] = 1
        nodes = [
            helper.make_node("ReduceMean", ["image"], ["mean"], axes=[1, 2, 3], keepdims=0),
            helper.make_node("Mul", ["mean", "nose_z"], ["shift"]),
            helper.make_node("Add", ["world", "shift"], ["Identity_4"]),
            helper.make_node("Identity", ["points"], ["Identity"]),
            helper.make_node("Identity", ["person"], ["Identity_1"]),
        ]
        weights = {
            "nose_z": nose_z, "world": full.reshape(1, -1), "points": points.reshape(1, -1),
            "person": np.array([[person]], np.float32),
        }  # fmt: skip
        outputs = {"Identity": [1, 195], "Identity_1": [1, 1], "Identity_4": [1, 117]}
        return save(tmp_path / name, nodes, {"image": [1, 64, 64, 3]}, outputs, weights)

    return make


@pytest.fixture
def rtmw3d(tmp_path):
    """rtmw3d(points (23, 3), score, joints) -> file of RTMW3D's input and outputs: the same answer to any image.
    points: x and y in shares of the crop's width and height, metres of depth."""

    def make(points, score=0.9, joints=WHOLE_BODY, bins=RTMW3D_BINS, name="rtmw3d.onnx"):
        shares = np.array(points, dtype=float)
        shares[:, 2] = (shares[:, 2] / 2.1744869 + 1) / 2
        weights, nodes = {}, []
        for axis, (output, count) in enumerate(zip(RTMW3D_NAMES, bins, strict=True)):
            rows = np.zeros((1, joints, count), np.float32)
            here = np.arange(min(len(shares), joints))
            rows[0, here, np.round(shares[here, axis] * count).astype(int)] = score
            weights[f"rows_{axis}"] = rows
            nodes.append(helper.make_node("Identity", [f"rows_{axis}"], [output]))
        outputs = {output: [1, joints, count] for output, count in zip(RTMW3D_NAMES, bins, strict=True)}
        return save(tmp_path / name, nodes, {"input": ["batch", 3, 384, 288]}, outputs, weights)

    return make


@pytest.fixture
def markers(tmp_path):
    """markers(depth (23,)) -> file of RTMW3D's input and outputs that finds COCO23's joints by the MARKER_COLOURS of
    their discs, and gives them these metres of depth. A disc that is not there has no score."""

    def make(depth, name="markers.onnx"):
        colours, others = MARKER_COLOURS.astype(float), WHOLE_BODY - len(MARKER_COLOURS)
        z = np.zeros((1, WHOLE_BODY, 576), np.float32)
        z[0, np.arange(len(depth)), np.round((np.asarray(depth) / 2.1744869 + 1) / 2 * 576).astype(int)] = 1
        node = helper.make_node
        nodes = [
            node("Mul", ["input", "deviation"], ["scaled"]),
            node("Add", ["scaled", "mean"], ["rgb"]),
            node("Mul", ["rgb", "rgb"], ["squares"]),
            node("ReduceSum", ["squares", "channel"], ["square"], keepdims=1),
            node("Conv", ["rgb", "colours"], ["minus_twice"]),
            node("Add", ["square", "minus_twice"], ["partly"]),
            node("Add", ["partly", "own_squares"], ["off"]),
            node("Mul", ["off", "width"], ["exponent"]),
            node("Exp", ["exponent"], ["likeness"]),
            node("ReduceSum", ["likeness", "rows"], ["columns_sum"], keepdims=0),
            node("ReduceSum", ["likeness", "columns"], ["rows_sum"], keepdims=0),
            node("Identity", ["z"], [RTMW3D_NAMES[2]]),
        ]
        for here, output in zip(("columns_sum", "rows_sum"), RTMW3D_NAMES, strict=False):
            nodes += [
                node("Sub", [here, "threshold"], [f"{here}_1"]),
                node("Resize", [f"{here}_1", "", "twice"], [f"{here}_2"], mode="nearest",
                     coordinate_transformation_mode="asymmetric", nearest_mode="floor"),
                node("Concat", [f"{here}_2", f"{here}_others"], [output], axis=1),
            ]  # fmt: skip
        weights = {
            "mean": np.array([123.675, 116.28, 103.53], np.float32).reshape(1, 3, 1, 1),
            "deviation": np.array([58.395, 57.12, 57.375], np.float32).reshape(1, 3, 1, 1),
            "colours": -2 * colours.astype(np.float32).reshape(-1, 3, 1, 1),
            "own_squares": (colours**2).sum(axis=1).astype(np.float32).reshape(1, -1, 1, 1),
            "width": np.float32(-1 / 40**2), "threshold": np.float32(1.5), "z": z,
            "twice": np.array([1, 1, 2], np.float32),
            "columns_sum_others": np.full((1, others, 576), -1, np.float32),
            "rows_sum_others": np.full((1, others, 768), -1, np.float32),
            "channel": np.array([1]), "rows": np.array([2]), "columns": np.array([3]),
        }  # fmt: skip
        outputs = {
            output: [1, WHOLE_BODY, count] for output, count in zip(RTMW3D_NAMES, RTMW3D_BINS, strict=True)
        }
        return save(tmp_path / name, nodes, {"input": [1, 3, 384, 288]}, outputs, weights)

    return make


@pytest.fixture
def instanthmr(tmp_path):
    """instanthmr(joints (70, 3), place (3,)) -> file of InstantHMR's inputs and outputs: the same answer to any image,
    but the nose's z is greater by the mean of the image; without a place that is `cliff_cond`. left_out: an output.
    fails_from: the first number of `cliff_cond` from which it fails."""

    def make(joints, place=None, left_out="", metadata=(), fails_from=None, name="instanthmr.onnx"):
        shapes = {
            "mhr_params": (204,), "shape_params": (45,), "cam_trans": (3,), "joints_2d": (70, 2), "joints_3d": (70, 3),
        }  # fmt: skip
        nose_z = np.zeros((1, len(MHR70), 3), np.float32)
        nose_z[0, MHR70.index("nose"), 2] = 1
        weights = {f"{name}_0": np.zeros((1, *shape), np.float32) for name, shape in shapes.items()}
        weights |= {"joints_3d_0": np.asarray(joints, np.float32)[None], "nose_z": nose_z}
        weights |= {"first": np.array([0]), "row": np.array([1])}
        weights["limit"] = np.float32(10 if fails_from is None else fails_from)
        if place is not None:
            weights["cam_trans_0"] = np.asarray(place, np.float32)[None]
        node = helper.make_node
        nodes = [
            node("ReduceMean", ["image"], ["mean"], axes=[1, 2, 3], keepdims=0),
            node("Mul", ["mean", "nose_z"], ["shift"]),
            node("Add", ["joints_3d_0", "shift"], ["joints_3d"]),
            node("Identity", ["cliff_cond" if place is None else "cam_trans_0"], ["where"]),
            node("Gather", ["cliff_cond", "first"], ["across"], axis=1),
            node("GreaterOrEqual", ["across", "limit"], ["is_beyond"]),
            node("Cast", ["is_beyond"], ["beyond"], to=TensorProto.INT64),
            node("Reshape", ["beyond", "row"], ["row_of_one"]),
            node("Gather", ["where", "row_of_one"], ["cam_trans"], axis=0),  # there is no second row
            *(
                node("Identity", [f"{name}_0"], [name])
                for name in ("mhr_params", "shape_params", "joints_2d")
            ),
        ]
        outputs = {name: ["batch", *shape] for name, shape in shapes.items() if name != left_out}
        inputs = {"image": ["batch", 3, 224, 224], "cliff_cond": ["batch", 3]}
        nodes = [each for each in nodes if left_out not in each.output]
        return save(tmp_path / name, nodes, inputs, outputs, weights, metadata)

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


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    """Any video; the tests show other images."""
    walk = walker(seconds=1)
    return read_video(write_files(tmp_path_factory.mktemp("walk"), walk, side_camera(walk)).video)


@pytest.fixture
def body(facing_camera):
    """(23, 3) COCO23 in CAMERA of a person 1.7 m tall, about the middle of the hips."""
    own = dict(zip(H36M17.joints, facing_camera, strict=True))
    own |= dict(zip(FEET.joints, feet_of(facing_camera[None])[0], strict=True))
    face = {"eye": (0.03, -0.03, 0.01), "ear": (0.07, 0.0, 0.09)}
    for part, (x, y, z) in face.items():
        own |= {f"{side}_{part}": own["nose"] + (sign * x, y, z) for side, sign in (("l", 1), ("r", -1))}
    joints = np.array([own[name] for name in COCO23.joints])
    joints -= joints[COCO23.indices(("l_hip", "r_hip"))].mean(axis=0)
    return joints * 1.7 / implied_stature(facing_camera[None])


@pytest.fixture
def showing(monkeypatch):
    """showing(images): from now on the lifter is shown these, frame by frame."""

    def show(frames):
        def given(video, first, last):
            yield from ((i, frames[i]) for i in range(first, last + 1))

        monkeypatch.setattr(images, "images_ahead", given)

    return show
