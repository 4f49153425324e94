"""Files of calibrated cameras: every program's gives the same one."""

import json

import numpy as np
import pytest

from golden.cameras import DISTORTION, MATRIX, SIZE, WRITERS
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.camera_file import read_camera
from refusals import refused

NAMES = {"Pose2Sim": "cam02", "Caliscope": "1"}


@pytest.fixture
def written(tmp_path):
    return lambda form: WRITERS[form](tmp_path)


@pytest.mark.parametrize("form", WRITERS)
def test_every_program_writes_the_same_camera(form, written):
    camera = read_camera(written(form), NAMES.get(form))
    np.testing.assert_allclose(camera.matrix, MATRIX, rtol=1e-9)
    coefficients = DISTORTION[: len(camera.distortion)]
    np.testing.assert_allclose(camera.distortion, coefficients)
    assert len(coefficients) == (4 if form == "Pose2Sim" else 5)
    assert camera.image_size == (None if form == "PyYAML" else SIZE)
    assert not camera.fisheye
    assert camera.source.endswith(written(form).name)


def test_a_fisheye_is_known_as_one(written, tmp_path):
    assert read_camera(written("Caliscope"), "2").fisheye
    text = WRITERS["ROS"](tmp_path).read_text()
    path = tmp_path / "fisheye.yaml"
    path.write_text(text.replace("plumb_bob", "equidistant").replace(", 0.010000]", "]"))
    assert read_camera(path).fisheye


@pytest.mark.parametrize(
    ("head", "distortion", "k", "tail"),
    [
        (
            "header:\n  seq: 5\n  frame_id: left\n",
            (-0.2, 0.1, 0, 0, 0),
            "K",
            "binning_x: 0\n---\nheight: 1\n",
        ),
        ("", (), "k", ""),  # as ROS 2 says that there is none
    ],
)
def test_the_message_of_ros_is_read_as_well(tmp_path, head, distortion, k, tail):
    path = tmp_path / "message.yaml"
    model = "plumb_bob" if distortion else "''"
    bent = f"{'d' if k == 'k' else 'D'}: {list(distortion)}\n{k}: {MATRIX.ravel().tolist()}\n"
    path.write_text(f"{head}height: 720\nwidth: 1280\ndistortion_model: {model}\n{bent}{tail}")
    camera = read_camera(path)
    assert camera.distortion == distortion
    np.testing.assert_allclose(camera.matrix, MATRIX)
    assert camera.image_size == SIZE


@pytest.mark.parametrize(
    ("form", "names"),
    [
        ("Pose2Sim", ["cam01", "cam02"]),
        ("Caliscope", ["1", "2"]),
    ],
)
def test_several_cameras_have_to_be_told_apart(form, names, written):
    with pytest.raises(InputError, match=f"holds {len(names)} cameras; name one: {', '.join(names)}"):
        read_camera(written(form))
    with pytest.raises(InputError, match="holds no camera 'cam1'"):
        read_camera(written(form), "cam1")


def test_two_cameras_of_one_name_are_refused(written, tmp_path):
    camera = json.loads(written("tutorial JSON").read_text()) | {"name": "left"}
    path = tmp_path / "two.json"
    path.write_text(json.dumps({"a": camera, "b": camera}))
    with pytest.raises(InputError, match="different names, got left, left"):
        read_camera(path)


def test_the_intrinsics_are_scaled_to_the_video(written):
    path = written("OpenCV YAML")
    half = read_camera(path, image_size=(640, 360))
    assert half.image_size == (640, 360)
    assert half.focal_px == (500, 505)
    assert half.principal_point_px == pytest.approx((314.75, 182.25))  # borders, not first pixels, coincide
    assert half.distortion == DISTORTION
    assert half.at_size(SIZE).principal_point_px == pytest.approx((630, 365))


def test_without_a_size_that_of_a_video_with_the_same_middle_is_believed(written):
    assert read_camera(written("PyYAML"), image_size=SIZE).image_size == SIZE
    cut = (1280, 800)  # a principal point may lie some per cent off
    assert read_camera(written("PyYAML"), image_size=cut).image_size == cut


@pytest.mark.parametrize(
    ("form", "sizes", "words"),
    [
        (
            "PyYAML",
            [(720, 1280), (1920, 1080), (3840, 2160), (640, 360), (960, 720), (1280, 960)],
            "(630, 365)",
        ),
        ("ROS", [(720, 1280), (640, 480), (1280, 700)], "1280 x 720"),
    ],
)
def test_a_video_of_another_aspect_or_without_a_size_another_middle_is_refused(form, sizes, words, written):
    for size in sizes:
        with refused(None, f"{size[0]} x {size[1]} pixels", words):
            read_camera(written(form), image_size=size)


def test_numbers_that_no_camera_has(written, tmp_path):
    for change, words in [
        ({"cameraMatrix": [[12, 0, 640], [0, 12, 360], [0, 0, 1]]}, "256 to 25600 pixels .* 12 and 12"),
        ({"cameraMatrix": [[1000, 0, 640], [0, 400, 360], [0, 0, 1]]}, "nearly equal .* got 1000 and 400"),
        ({"cameraMatrix": [[1000, 0, -5], [0, 1000, 360], [0, 0, 1]]}, "principal point inside"),
        (
            {"cameraMatrix": [[1000, 90, 640], [0, 1000, 360], [0, 0, 1]]},
            "fx 0 cx, 0 fy cy, 0 0 1, got 1000 90",
        ),
        ({"cameraMatrix": [[1000, 0, 0], [0, 1000, 0], [640, 360, 1]]}, "fx 0 cx, 0 fy cy, 0 0 1"),
        ({"cameraMatrix": [[1000, 0, 640], [0, 1000, 360]]}, "9 finite numbers"),
        ({"cameraMatrix": [[1000, 0, None], [0, 1000, 360], [0, 0, 1]]}, "9 finite numbers"),
        ({"cameraMatrix": [[float("inf"), 0, 640], [0, 1000, 360], [0, 0, 1]]}, "9 finite numbers"),
        ({"distCoeffs": [0.1, 0.2, 0.3]}, "0, 4, 5, 8, 12 coefficients .* got 3"),
        ({"distCoeffs": "rather bent"}, "finite numbers, got"),
        ({"fisheye": "perhaps"}, "a fisheye mark, 0 or 1, .* got perhaps"),
        ({"fisheye": True}, "0, 4 coefficients .* got 5"),
        ({"image_size": [1280.5, 720]}, "whole pixels"),
        ({"distortion_model": "double_sphere"}, "got 'double_sphere'"),
    ]:
        content = json.loads(written("tutorial JSON").read_text()) | change
        path = tmp_path / "bad.json"
        path.write_text(json.dumps(content))
        with pytest.raises(InputError, match=words):
            read_camera(path)


@pytest.mark.parametrize("form", WRITERS)
def test_a_file_that_was_cut_short(form, written):
    path = written(form)
    text = path.read_text()
    path.write_text(text[: text.index("1010") + 2])
    with pytest.raises(InputError, match=str(path)):
        read_camera(path, NAMES.get(form))


def test_other_files_are_refused(tmp_path):
    for content, words in [
        (b"", "no camera matrix"),
        (b"\x89PNG\r\n\x1a\n\0\0", "not UTF-8 text"),
        (b"frame,x,y\n0,1,2\n", "not one, or is damaged"),
        (b'{"image_id": 1, "keypoints": [1, 2, 3]}', "no camera matrix"),
        (b'[{"image_id": 1}]', "no camera matrix"),
        (b"[tool]\nname = 'x'\n", "no camera matrix"),
        (b"<svg xmlns='http://www.w3.org/2000/svg'/>", "not one, or is damaged"),
        (b"1 PINHOLE 1280 720 1000 1000 640 360\n", "write one with K, dist and image_size"),
        (b"K: " + b"[" * 100_000, "nest"),
        (b"K: " + b"[" * 900, "not one, or is damaged"),
        (b"K:\n  " + b"- " * 100_000, "nest"),
        (b"K: [1000, 0, 640\n", "not one, or is damaged .*line 2"),
        (b"K: [1000, 0, 640]\nD\n", "not one, or is damaged .*line 3"),
        (b"K: [1000, 0, \x01]\n", "not one, or is damaged"),
        (b"a: &a [1, 1]\nb: &b [*a, *a]\nK: [*b, *b]\n", "an alias"),
        (b'{"a":' * 100_000, "too deeply"),
        (b"x" * (1 << 20) + b"x", "larger than"),
    ]:
        path = tmp_path / "file.txt"
        path.write_bytes(content)
        with pytest.raises(InputError, match=words):
            read_camera(path)
        with pytest.raises(InputError, match="No such file"):
            read_camera(tmp_path / "nothing.yml")


def test_nothing_in_a_file_is_run(tmp_path):
    """A tag of Python's is a tag like any other."""
    made = tmp_path / "made"
    (tmp_path / "tag.yml").write_text(f"K: !!python/object/apply:os.mkdir ['{made}']\n")
    with pytest.raises(InputError, match="9 finite numbers"):
        read_camera(tmp_path / "tag.yml")
    assert not made.exists()
