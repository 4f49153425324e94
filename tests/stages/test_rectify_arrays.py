"""Arrays, takes made by hand and live frames are looked at as files are."""

import re
import warnings

import numpy as np
import pytest
import torch

from golden.detections import AS_COCO
from pcnet3d.adapters import read
from pcnet3d.models import LiveRectifier
from pcnet3d.pipeline import CAMERA, H36M17, InputError, Pipeline, PoseSequence, Take, Told
from pcnet3d.pipeline.core.layouts import LAYOUTS
from pcnet3d.stages import rectify
from pcnet3d.stages.rectify import Rectify
from refusals import refused

FPS = 30
MIRRORED, INVERTED = np.array([-1.0, 1, 1]), np.array([1.0, -1, -1])
GEOMETRIC = Pipeline((Rectify("geometric"),))


@pytest.fixture
def joints(facing_camera) -> np.ndarray:
    """(120, 17, 3) in CAMERA, who sways, bent at the knees."""
    sway = 0.02 * np.sin(np.arange(120) / 5)[:, None, None] * np.linspace(0, 1, 17)[:, None]
    return (
        facing_camera + sway * [1, 0.3, 1] + np.random.default_rng(0).normal(scale=0.001, size=(120, 17, 3))
    )


def by_hand(joints, **told) -> Take:
    frame = CAMERA.with_(unit="arbitrary")
    poses = PoseSequence(joints, H36M17, frame, time_s=np.arange(len(joints)) / FPS)
    return Take("by hand", poses=poses, told=Told(**told))


def one_by_one(joints, check="refuse") -> LiveRectifier:
    live = LiveRectifier("geometric", check=check)
    for row, pose in enumerate(joints):
        live.update(pose, row / FPS)
    return live


DOORS = {
    "an array": lambda joints, check: rectify(joints, "geometric", fps=FPS, check=check),
    "poses": lambda joints, check: rectify(by_hand(joints).poses, "geometric", check=check),
    "a take": lambda joints, check: GEOMETRIC(by_hand(joints, check=check)),
    "live": one_by_one,
}


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize(("change", "code"), [(MIRRORED, "sides-swapped"), (INVERTED, "wrong-axes")])
def test_a_mirrored_or_inverted_body_is_refused_as_of_a_file(save, joints, door, change, code):
    with pytest.raises(InputError) as of_a_file:
        read(save((change * joints).astype(np.float32)), "motionbert")
    with pytest.raises(InputError) as raised:
        DOORS[door](change * joints, "refuse")
    assert raised.value.code == of_a_file.value.code == code
    said, expected = (
        re.sub(r"\d+", "N", str(error.value)).partition(": ")[2] for error in (raised, of_a_file)
    )
    assert said == expected
    DOORS[door](change * joints, "off")
    DOORS[door](joints, "refuse")


def test_what_was_read_as_asked_is_not_refused_later(save, joints):
    mirrored = save((MIRRORED * joints).astype(np.float32))
    rectify(read(mirrored, "motionbert", handedness="ignore"), "geometric")
    rectify(read(mirrored, "motionbert", handedness="mirror"), "geometric")


@pytest.mark.parametrize(
    ("axes", "given"),
    [
        ("camera", lambda x, y, z: (x, y, z)),
        ("camera-y-up", lambda x, y, z: (x, -y, -z)),
        ("z-up", lambda x, y, z: (z, -x, -y)),
        ("y-up", lambda x, y, z: (-x, -y, z)),
    ],
)
def test_axes_by_name(joints, axes, given):
    turned = np.stack(given(*np.moveaxis(joints, -1, 0)), axis=-1)
    body = rectify(turned, "geometric", axes=axes).body
    np.testing.assert_allclose(body.joint("l_hip")[:, 1], -0.1, atol=0.02)
    assert (body.joint("head")[:, 2] > 0.7).all()


def test_one_body_in_all_kinds_of_numbers(joints):
    expected = rectify(joints, "geometric").level.joints
    for given in (
        joints.astype(np.float16),
        joints.tolist(),
        torch.tensor(joints, requires_grad=True),
        torch.tensor(joints, dtype=torch.bfloat16),
        joints[None],
        joints[:, None],
    ):
        np.testing.assert_allclose(rectify(given, "geometric").level.joints, expected, atol=0.02)
    millimetres = rectify((1000 * joints).astype(np.int32), "geometric", unit="mm").level
    assert millimetres.frame.unit == "m"
    np.testing.assert_allclose(millimetres.joints, expected, atol=0.02)
    assert len(rectify(joints[0], "geometric").level) == 1


@pytest.mark.parametrize("layout", ["COCO17", "HALPE26", "MPI3DHP17"])
def test_joints_of_another_layout(joints, layout):
    order = LAYOUTS[layout]
    known = {joint: joints[:, i] for i, joint in enumerate(H36M17.joints)}
    given = np.stack([known.get(joint, known["nose"]) for joint in order.joints], axis=1)
    for named in (layout, order):
        level = rectify(given, "geometric", joints=named, check="off").level
        assert level.layout.joints[: len(H36M17)] == H36M17.joints  # and feet, where it has them
        lengths = np.linalg.norm(level.joint("l_knee") - level.joint("l_hip"), axis=-1)
        np.testing.assert_allclose(
            lengths, np.linalg.norm(known["l_knee"] - known["l_hip"], axis=-1), atol=1e-5
        )


def _frozen(joints):
    joints[20:80] = joints[20]
    return joints


@pytest.mark.parametrize(
    ("change", "said", "options"),
    [
        (_frozen, "duplicates", {}),
        (lambda joints: joints, "stature", {"unit": "cm"}),
        (lambda joints: joints * [1, 1, 0], "flat", {}),
        (
            lambda joints: joints + np.linspace(0, 1, 120)[:, None, None] * [1, 0, 0],
            "on-its-side",
            {"axes": "z-up"},
        ),
        (lambda joints: joints[..., [0, 2, 1]] * [1, 1, -1], "nobody-upright", {}),
    ],
)
def test_what_else_is_wrong_is_told(joints, change, said, options):
    with pytest.warns(UserWarning, match=r"\.$") as warned:
        rectified = rectify(change(joints), fps=FPS, **options)
    found = {each.code: each.text for each in rectified.level.notices}
    assert found[said] in [str(each.message) for each in warned]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rectify(change(joints), fps=FPS, check="off", **options)


def test_sound_poses_bring_no_warning(joints):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert rectify(joints, fps=FPS).level.notices == ()
    assert one_by_one(joints).notices == ()


def test_live_tells_what_its_first_seconds_show(joints):
    joints[5:] = joints[5]
    assert "duplicates" in [each.code for each in one_by_one(joints).notices]


@pytest.mark.parametrize(
    ("values", "options", "code"),
    [
        (np.zeros((4, 16, 3)), {}, "wrong-content"),
        (np.zeros((4, 33, 3)), {}, "wrong-content"),
        (np.zeros((17, 2)), {}, "wrong-content"),
        (np.zeros((0, 17, 3)), {}, "wrong-content"),
        (np.zeros(17), {}, "wrong-content"),
        (np.array(["a"]), {}, "wrong-content"),
        ([[1, 2], [3]], {}, "wrong-content"),
        (None, {}, "wrong-content"),
        (np.full((4, 17, 3), np.inf), {}, "wrong-content"),
        (np.full((4, 17, 3), np.nan), {}, "nothing-usable"),
        (np.zeros((4, 17, 3)), {}, "nothing-usable"),
        (np.ones((4, 17, 3)), {"axes": "up"}, "bad-value"),
        (np.ones((4, 17, 3)), {"unit": "ell"}, "bad-value"),
        (np.ones((4, 17, 3)), {"check": "no"}, "bad-value"),
        (np.ones((4, 17, 3)), {"joints": "H36"}, "name-unknown"),
    ],
)
def test_what_cannot_be_read_is_refused(values, options, code):
    with refused(code):
        rectify(values, "geometric", **options)


def test_joints_in_another_order_are_refused(joints):
    with refused("wrong-content", 'joints="COCO17"'):
        rectify(joints[:, AS_COCO])


def test_poses_say_their_own_axes(joints):
    with refused("option-conflict", "axes"):
        rectify(by_hand(joints).poses, axes="z-up")
