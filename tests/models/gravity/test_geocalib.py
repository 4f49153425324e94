"""GeoCalib's fields: cameras out of rendered fields, noisy and with outliers, and a toy network from end to end."""

import cv2
import numpy as np
import pytest
from onnx import helper

from golden.networks import save_graph
from pcnet3d.models.common.download import GEOCALIB
from pcnet3d.models.common.onnx import open_onnx
from pcnet3d.models.gravity import geocalib
from pcnet3d.models.gravity.geocalib import Fields, network_input, up_from_fields, up_from_network
from pcnet3d.models.gravity.lines import tangent
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.camera import pitch_roll_deg
from pcnet3d.pipeline.core.rotations import angle_deg, unit
from pcnet3d.pipeline.core.take import Told
from pcnet3d.pipeline.plugins import registry
from pcnet3d.stages.calibrate import Calibrate
from refusals import refused

SIZE = (1280, 720)


def up_of(pitch_deg: float, roll_deg: float) -> np.ndarray:
    """Of a camera that looks down by the pitch and whose image is turned counter-clockwise by the roll."""
    pitch, roll = np.radians([pitch_deg, roll_deg])
    return np.array([-np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch), -np.sin(pitch)])


def rendered(up: np.ndarray, focal_px: float, pixels: np.ndarray, size=SIZE) -> tuple[np.ndarray, np.ndarray]:
    """The up field (..., 2), by moving a point of each ray up a little, and the latitude (...,) at pixels (..., 2)."""
    uv = (pixels - np.array(size) / 2) / focal_px
    q = np.concatenate([uv, np.ones_like(uv[..., :1])], axis=-1)
    higher = q + 1e-6 * up
    field = unit(higher[..., :2] / higher[..., 2:] - uv)
    return field, np.pi / 2 - np.arccos(np.clip(unit(q) @ up, -1, 1))


def fields(up, focal_px, noise_deg=0.0, outliers=0.0, seed=0, size=SIZE) -> Fields:
    """As fine as GeoCalib's, 2.25 pixels of the image apart. outliers: share of large patches that are quite wrong."""
    rng = np.random.default_rng(seed)
    pixels = np.stack(np.meshgrid(np.arange(1, size[0], 2.25), np.arange(1, size[1], 2.25)), axis=-1)
    field, latitude = rendered(up, focal_px, pixels, size)
    shape = latitude.shape
    wrong = cv2.resize(rng.random((6, 9)), shape[::-1], interpolation=cv2.INTER_NEAREST) < outliers
    turn = np.radians(noise_deg) * rng.normal(size=shape) + wrong * rng.uniform(-0.6, 0.6, shape)
    c, s = np.cos(turn), np.sin(turn)
    field = np.stack([c * field[..., 0] - s * field[..., 1], s * field[..., 0] + c * field[..., 1]], axis=-1)
    latitude = (
        latitude + np.radians(noise_deg) * rng.normal(size=shape) + wrong * rng.uniform(-0.6, 0.6, shape)
    )
    return Fields(field, np.ones(shape), latitude, np.ones(shape), pixels, size)


CAMERAS = [
    (pitch, roll, focal)
    for pitch, roll, focal in zip(
        np.random.default_rng(2).uniform(-40, 60, 12),
        [*np.random.default_rng(3).uniform(-30, 30, 9), 90.0, -90.0, 180.0],
        np.random.default_rng(4).uniform(700, 1800, 12),
        strict=True,
    )
]


def test_clean_fields_give_the_camera():
    for pitch, roll, focal in CAMERAS:
        up = up_of(pitch, roll)
        found = up_from_fields(fields(up, focal), focal, 0)
        assert angle_deg(found.up, up) < 1e-3
        assert found.focal_px == pytest.approx(focal)
        assert found.focal_sd_px == 0
        np.testing.assert_allclose(pitch_roll_deg(found.up)[0], pitch, atol=1e-3)


def test_noise_and_outliers_leave_up_within_a_third_of_a_degree():
    for pitch, roll, focal in CAMERAS:
        for told in [True, False]:
            up = up_of(pitch, roll)
            given = fields(up, focal, noise_deg=2, outliers=0.15, seed=int(focal))
            found = up_from_fields(given, focal if told else None)
            assert angle_deg(found.up, up) < 0.3
            assert abs(np.log(found.focal_px / focal)) < (0.01 if told else 0.04)
            assert found.focal_sd_px / focal < (0.021 if told else 0.15)


def test_confidence_decides_what_counts():
    """Half of the image shows another camera, but the network doubts it."""
    up = up_of(10, 5)
    given, other = fields(up, 1000), fields(up_of(-20, -25), 1000)
    left = given.pixels[..., 0] < SIZE[0] * 0.55
    mixed = Fields(
        np.where(left[..., None], other.up, given.up),
        np.where(left, 0.0, 0.8),
        np.where(left, other.latitude, given.latitude),
        np.where(left, 0.0, 0.8),
        given.pixels,
        SIZE,
    )
    assert angle_deg(up_from_fields(mixed, 1000).up, up) < 0.01
    sure = Fields(mixed.up, np.ones(left.shape), mixed.latitude, np.ones(left.shape), given.pixels, SIZE)
    assert angle_deg(up_from_fields(sure, 1000).up, up) > 5


def test_the_stated_error_is_never_less_than_the_networks_own():
    found = up_from_fields(fields(up_of(15, 3), 1000), 1000)
    pitch, roll = np.degrees(np.sqrt(np.diag(found.covariance)))
    assert 1.5 <= pitch < 1.6
    assert 0.7 <= roll < 0.8
    assert found.error_deg == pytest.approx(np.hypot(pitch, roll))
    along_pitch = unit(up_of(16, 3) - found.up) @ tangent(found.up)
    np.testing.assert_allclose(along_pitch, [1, 0], atol=0.05)  # the plane's axes: pitch, then roll


def test_noisy_fields_state_larger_errors():
    def stated(noise_deg):
        return up_from_fields(fields(up_of(15, 3), 1000, noise_deg), 1000).error_deg

    assert stated(0) < stated(10) < stated(30)


def test_a_focal_length_that_no_camera_has():
    with pytest.raises(InputError, match="longer side of 1280; got 3"):
        up_from_fields(fields(up_of(0, 0), 1000), 3)


@pytest.mark.parametrize(
    ("size", "kept"),
    [
        ((1280, 720), (544, 320)),  # 568 x 320
        ((720, 1280), (320, 544)),
        ((1920, 1080), (544, 320)),
        ((640, 480), (416, 320)),  # 426 x 320
        ((100, 100), (320, 320)),
    ],
)
def test_the_networks_input(size, kept):
    """A ramp over the image says where each pixel of the input is from; up to rounding to whole grey levels."""
    width, height = size
    image = np.zeros((height, width, 3), np.uint8)
    image[..., 0] = np.linspace(0, 255, width)[None]
    image[..., 2] = np.linspace(0, 255, height)[:, None]
    value, pixels = network_input(image)
    assert value.shape == (1, 3, kept[1], kept[0])
    assert value.dtype == np.float32
    assert pixels.shape == (kept[1], kept[0], 2)
    # Their pixels are of borders, those of the ramp of centres: less than one pixel of the input apart.
    atol = 1.5 * max(height / 320 * 1 / min(size), 1 / min(size), 1 / 255)
    np.testing.assert_allclose(value[0, 0], pixels[..., 0] / (width - 1), atol=atol)
    np.testing.assert_allclose(value[0, 2], pixels[..., 1] / (height - 1), atol=atol)
    middle = (pixels[0, 0] + pixels[-1, -1]) / 2
    np.testing.assert_allclose(middle, np.array(size) / 2, atol=1.2 * max(1, min(size) / 320))


def toy(
    path, names=("up_field", "up_confidence", "latitude_field", "latitude_confidence"), side=None, wide=1
):
    """A network that reads the fields out of the image's colours: up in red and green, the latitude's sine in blue."""
    node, name = helper.make_node, dict(zip(("up", "sure", "latitude", "surer"), names, strict=True))
    ints = {"0": [0], "2": [2], "3": [3], "axis": [1]}
    held = {key: np.array(value, np.int64) for key, value in ints.items()}
    held |= {"two": np.float32(2), "one": np.float32(1), "nothing": np.float32(0), "most": np.float32(0.9999)}
    nodes = [
        node("Mul", ["image", "two"], ["doubled"]),
        node("Sub", ["doubled", "one"], ["signed"]),
        node("Slice", ["signed", "0", "2", "axis"], [name["up"]]),
        node("Slice", ["signed", "2", "3", "axis"], ["sine"]),
        node("Mul", ["sine", "most"], ["less"]),
        node("Asin", ["less"], [name["latitude"]]),
        node("Mul", ["sine", "nothing"], ["zero"]),
        node("Add", ["zero", "one"], ["ones"]),
        node("Squeeze", ["ones", "axis"], [name["sure"]]),
        node("Squeeze", ["ones", "axis"], [name["surer"]]),
    ]
    shape = (1, 3, side or "height", side or "width")
    outputs = {
        name["up"]: (1, 2 * wide, None, None), name["sure"]: (1, None, None),
        name["latitude"]: (1, 1, None, None), name["surer"]: (1, None, None),
    }  # fmt: skip
    return save_graph(path, nodes, {"image": shape}, outputs, held)


def coloured(up: np.ndarray, focal_px: float, size) -> np.ndarray:
    """An image in whose colours the toy reads the fields of that camera."""
    pixels = np.stack(np.meshgrid(np.arange(size[0]), np.arange(size[1])), axis=-1).astype(float)
    field, latitude = rendered(up, focal_px, pixels, size)
    values = np.concatenate([field, np.sin(latitude)[..., None]], axis=-1)
    return np.round((values + 1) / 2 * 255).astype(np.uint8)


@pytest.mark.parametrize("size", [(1280, 720), (720, 1280), (500, 410), (320, 240)])
def test_a_network_from_end_to_end(size, tmp_path):
    """Scaling and cropping are undone: the focal length is in pixels of the image that came."""
    up, focal = up_of(12, -8), 0.9 * max(size)
    images = [coloured(up, focal, size)] * 2
    found = up_from_network(images, toy(tmp_path / "toy.onnx"))
    assert angle_deg(found.up, up) < 0.3
    assert found.focal_px == pytest.approx(focal, rel=0.02)
    assert angle_deg(up_from_network(images[:1], tmp_path / "toy.onnx", focal, 0).up, up) < 0.3
    one = up_from_network(images[:1], tmp_path / "toy.onnx")
    np.testing.assert_allclose(one.covariance, found.covariance)  # two frames know no more than one


def test_other_networks_are_refused(tmp_path):
    image = [coloured(up_of(0, 0), 600, (640, 480))]
    others = ("up_field", "up_confidence", "latitude_field", "depth")
    with pytest.raises(InputError, match=r"is not GeoCalib's network: .* got inputs image .*depth"):
        up_from_network(image, toy(tmp_path / "names.onnx", names=others))
    with pytest.raises(InputError, match="any height and width"):
        up_from_network(image, toy(tmp_path / "side.onnx", side=320))
    (tmp_path / "broken.onnx").write_bytes(b"none")
    with pytest.raises(InputError, match="Expected GeoCalib's network"):
        up_from_network(image, tmp_path / "broken.onnx")


@pytest.mark.parametrize(
    ("name", "answer", "words"),
    [
        (
            "up_field",
            np.zeros((1, 3, 320, 416)),
            r"shape \(1, 2, 320, 416\) from 'up_field', got shape \(1, 3",
        ),
        ("latitude_field", np.zeros((1, 1, 10, 13)), r"\(1, 1, 320, 416\) from 'latitude_field', got shape"),
        (
            "up_confidence",
            np.full((1, 320, 416), np.nan),
            "finite numbers .* from 'up_confidence', got others",
        ),
    ],
)
def test_answers_of_other_shapes_are_refused(name, answer, words, tmp_path):
    good = {
        "up_field": np.ones((1, 2, 320, 416)), "up_confidence": np.ones((1, 320, 416)),
        "latitude_field": np.zeros((1, 1, 320, 416)), "latitude_confidence": np.ones((1, 320, 416)),
    }  # fmt: skip
    answers = {key: value.astype(np.float32) for key, value in (good | {name: answer}).items()}
    held = {f"{key}_0": value for key, value in answers.items()}
    nodes = [helper.make_node("Identity", [f"{key}_0"], [key]) for key in answers]
    outputs = {key: value.shape for key, value in answers.items()}
    path = save_graph(tmp_path / "toy.onnx", nodes, {"image": (1, 3, "h", "w")}, outputs, held)
    with pytest.raises(InputError, match=words):
        up_from_network([np.zeros((480, 640, 3), np.uint8)], path)


@pytest.mark.parametrize(
    "images",
    [
        [],
        [np.zeros((48, 64), np.uint8)],
        [np.zeros((48, 64, 3), np.float32)],
        [np.zeros((48, 64, 3), np.uint8), np.zeros((64, 48, 3), np.uint8)],
    ],
)
def test_images_of_other_types_are_refused(images, tmp_path):
    with refused("wrong-content"):
        up_from_network(images, toy(tmp_path / "toy.onnx"))


def test_the_network_is_known_by_name(tmp_path, monkeypatch):
    assert registry.load("gravity_networks", "geocalib") is GEOCALIB
    monkeypatch.setattr(type(GEOCALIB), "open", lambda self: tmp_path / f"{self.name}.onnx")
    assert registry.open_model("gravity_networks", "geocalib") == tmp_path / "geocalib.onnx"


def test_a_run_opens_the_network_once(tmp_path, monkeypatch):
    """And refuses one of another kind before it looks at the video."""
    path, opened = toy(tmp_path / "toy.onnx"), list[object]()

    def counted(*asked):
        opened.append(asked)
        return open_onnx(*asked)

    monkeypatch.setattr(geocalib, "open_onnx", counted)
    for _ in range(2):  # before the run, and at the stage
        Calibrate(gravity_network=str(path)).check_told(Told())
    up_from_network([np.zeros((96, 128, 3), np.uint8)], path)
    assert len(opened) == 1
    other = save_graph(
        tmp_path / "other.onnx", [helper.make_node("Relu", ["x"], ["y"])], {"x": (1, 3)}, {"y": (1, 3)}
    )
    with refused("wrong-network"):
        Calibrate(gravity_network=str(other)).check_told(Told())
