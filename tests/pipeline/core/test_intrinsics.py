"""Calibrated cameras: every program's file gives the same one, and rays through known lenses come back."""

import json

import cv2
import numpy as np
import pytest

from golden.cameras import DISTORTION, MATRIX, SIZE, WRITERS
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.intrinsics import Intrinsics, read_camera, undistorted, undistorted_image
from refusals import refused

LENSES = {
    "none": Intrinsics((900.0, 950.0), (600.0, 380.0), (), image_size=SIZE),
    "barrel": Intrinsics((800.0, 810.0), (630.0, 365.0), (-0.3, 0.1, 0.001, -0.002, 0.01), image_size=SIZE),
    "pincushion": Intrinsics((1100.0, 1100.0), (640.0, 350.0), (0.25, 0.05, 0, 0), image_size=SIZE),
    "rational": Intrinsics((700, 700), (640, 360), (5.0, 2.0, 0, 0, 0.1, 5.2, 3.5, 0.4), image_size=SIZE),
    "thin prism": Intrinsics(
        (900, 900), (640, 360), (-0.1, 0.02, 1e-3, 1e-3, 0, 0, 0, 0, 1e-3, 2e-3, -1e-3, 3e-3), image_size=SIZE
    ),
    "fisheye": Intrinsics((500, 505), (645, 355), (-0.02, 0.01, -0.003, 0.001), True, SIZE),
}


def filmed(rays: np.ndarray, lens: Intrinsics) -> np.ndarray:
    """(N, 2) pixels of rays x / z, y / z by OpenCV's own projections."""
    points, still = np.column_stack([rays, np.ones(len(rays))])[:, None], np.zeros(3)
    coefficients = np.array(lens.distortion or (0.0,) * 4)
    project = cv2.fisheye.projectPoints if lens.fisheye else cv2.projectPoints
    return project(points, still, still, lens.matrix, coefficients)[0][:, 0]


@pytest.mark.parametrize("name", LENSES)
def test_known_rays_come_back(name):
    lens = LENSES[name]
    reach = 2.5 if lens.fisheye else 0.7
    rays = np.random.default_rng(0).uniform(-reach, reach, (500, 2)) * (1, 0.6)
    expected = rays * lens.pinhole_focal_px + np.array(SIZE) / 2
    np.testing.assert_allclose(undistorted(filmed(rays, lens), lens), expected, atol=0.01)


def test_missing_points_stay_missing_and_shapes_stay():
    points = np.full((3, 2, 17, 2), 300.0)
    points[1, 0, 5, 0] = np.nan
    points[2, 1, 3] = np.nan
    found = undistorted(points, LENSES["barrel"])
    assert found.shape == points.shape
    np.testing.assert_array_equal(np.isnan(found).any(axis=-1), np.isnan(points).any(axis=-1))
    assert undistorted(np.empty((0, 2)), LENSES["barrel"]).shape == (0, 2)


def test_points_that_the_lens_cannot_have_drawn_go_missing():
    """With k1 alone, x (1 - 0.3 x^2) never exceeds 0.703; a fisheye of 500 px shows 90 degrees at 785 px."""
    lens = Intrinsics((1000, 1000), (640, 360), (-0.3, 0, 0, 0), image_size=SIZE)
    x = 640 + 1000 * np.array([0.65, 0.69, 0.72, 0.9])
    found = undistorted(np.column_stack([x, np.full(4, 360.0)]), lens)
    np.testing.assert_array_equal(np.isnan(found[:, 0]), [False, False, True, True])
    fisheye = Intrinsics((500, 500), (640, 360), (0, 0, 0, 0), True, SIZE)
    far = undistorted([[640 + 750, 360], [640 + 800, 360]], fisheye)
    np.testing.assert_allclose(far[0], [640 + 500 * np.tan(1.5), 360], rtol=1e-4)
    assert np.isnan(far[1]).all()


def test_coefficients_that_are_whole_numbers_are_those_of_the_same_floats():
    """OpenCV took them for floats, and read what stood behind them in memory."""
    rays = np.random.default_rng(0).uniform(-2, 2, (500, 2))
    for _ in range(50):
        whole, same = (
            Intrinsics((500, 500), (640, 360), zeros, True, SIZE) for zeros in ((0,) * 4, (0.0,) * 4)
        )
        np.testing.assert_array_equal(
            undistorted(filmed(rays, same), whole), undistorted(filmed(rays, same), same)
        )


@pytest.mark.parametrize("name", LENSES)
def test_the_image_goes_where_its_points_go(name):
    lens = LENSES[name]
    image = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    point = np.array([[500.0, 250.0]])
    cv2.circle(image, (500, 250), 6, (255, 255, 255), -1, cv2.LINE_AA)
    seen = undistorted_image(image, lens)
    assert seen.shape == image.shape
    rows, columns = np.nonzero(seen[..., 0] > 128)
    np.testing.assert_allclose([[columns.mean(), rows.mean()]], undistorted(point, lens), atol=0.6)


def test_without_a_size_nothing_is_undone():
    with pytest.raises(InputError, match=r"c\.toml: expected an image size of camera 'left', got none"):
        undistorted(np.zeros((1, 2)), Intrinsics((900, 900), (640, 360), name="left", source="c.toml"))


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
