"""The stage that reads a camera from a video's images, and `inspect`, which shows it."""

import json

import cv2
import numpy as np
import pytest

from commands import pcnet3d, succeeded
from golden.detections import detected, scored
from golden.films import film_of
from pcnet3d.adapters import video as videos
from pcnet3d.models.gravity.view import _boxes, camera_of, static_camera
from pcnet3d.pipeline import H36M17, PoseSequence, Take, Told, Video
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.files.digest import sha256
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.stages.calibrate import Calibrate, _notices
from pcnet3d.stages.lift import Lift
from refusals import refused
from rooms import no_lines, street


@pytest.fixture(scope="module")
def shown():
    return street(4)


@pytest.fixture(scope="module")
def video(shown, tmp_path_factory):
    path = tmp_path_factory.mktemp("street") / "street.mp4"
    film_of(path, [shown.image] * 25, range(0, 1000, 40), crf=16, g=5, preset="ultrafast")
    (found,) = videos.read(path)
    return found


@pytest.mark.parametrize(
    ("own", "first_frame", "compared"), [(True, None, False), (False, None, True), (True, 0, True)]
)
def test_keypoints_that_were_detected_in_the_video_are_not_compared_with_it(
    video, tmp_path, own, first_frame, compared
):
    """A man's own keypoints agreed with his video by 0.38 and were called those of another recording. Here none moves
    as the video, which is one image. Rows that the user numbers are compared."""
    frames = np.arange(25)
    points = 100 + 40 * np.sin(frames[:, None, None] / 3 + np.arange(34).reshape(17, 2))
    source = f"{sha256(video.path) if own else 64 * '0'} 1.0.0"
    detected(frames, scored(points), 0 * frames, source=source).save(tmp_path / "keypoints.npz")
    options = RunOptions(video=video.path, keypoints=tmp_path / "keypoints.npz", first_frame=first_frame)
    codes = [each.code for each in Calibrate()(open_take(options)).notices]
    assert ("keypoints-not-of-video" in codes) == compared


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_lines_contradict_a_wrong_focal_length(factor):
    shown = street(9)
    true_px = shown.camera.focal_px
    found = static_camera({0: shown.image}, {0: shown.boxes}, factor * true_px)
    assert found.focal_px == factor * true_px
    codes = [each.code for each in _notices(found)]
    assert ("focal-contradicted" in codes) == (factor != 1)
    assert factor == 1 or found.focal_against_px == pytest.approx(true_px, rel=0.05)


def test_a_moving_camera_is_looked_at_every_tenth_frame(video):
    found = camera_of(video, camera="moving")
    assert [look.frame for look in found.looks] == [0, 10, 20]


def test_people_are_left_out_along_their_limbs():
    joints = np.random.default_rng(0).uniform(100, 300, (5, 17, 2))
    joints[2] = np.nan
    people = PoseSequence(joints, H36M17, IMAGE, frame_index=np.arange(5))
    boxes = _boxes([people], [1, 2])
    assert len(boxes[1]) > 17
    assert len(boxes[2]) > 17  # of a frame beside it
    inside = (boxes[1][:, :2] <= joints[1, 3]).all(axis=1) & (boxes[1][:, 2:] >= joints[1, 3]).all(axis=1)
    assert inside.any()
    assert _boxes([], [3])[3].shape == (0, 4)


def test_inspect_says_what_a_run_would_find(video, shown, tmp_path):
    """Of a video, and of an image of the same place."""
    image = tmp_path / "one.png"
    cv2.imwrite(str(image), shown.image[:, :, ::-1])
    for file, size in ((video.path, (video.width, video.height)), (image, shown.image.shape[1::-1])):
        as_json, as_text = (succeeded(pcnet3d("inspect", file, *words)) for words in (["--json"], []))
        said = json.loads(as_json.stdout)
        assert (said["width"], said["height"]) == size
        assert abs(said["pitch_deg"] - shown.pitch_deg) < 2.5
        assert abs(said["roll_deg"] - shown.roll_deg) < 2.5
        assert said["up_error_deg"] > 0.3
        assert said["focal_source"] in ("lines", "prior")
        assert f"pitch {said['pitch_deg']:.1f} and roll {said['roll_deg']:.1f}" in as_text.stdout
        assert f"focal length {said['focal_px']:.0f} pixels" in as_text.stdout


def test_inspect_says_why_an_image_shows_no_up(tmp_path):
    cv2.imwrite(str(tmp_path / "grass.png"), no_lines("grass", 0)[:, :, ::-1])
    said = json.loads(succeeded(pcnet3d("inspect", tmp_path / "grass.png", "--json")).stdout)
    assert (said["pitch_deg"], said["roll_deg"], said["up_error_deg"]) == (None, None, None)
    assert "line" in said["reason"]


CALIBRATION = """
[cam01]
name = "cam01"
size = [{width}, {height}]
matrix = [[{focal}, 0.0, {x}], [0.0, {focal}, {y}], [0.0, 0.0, 1.0]]
distortions = [0.1, 0.0, 0.0, 0.0]
rotation = [0.0, 0.0, 0.0]
translation = [0.0, 0.0, 0.0]
fisheye = false
"""


def test_a_calibrated_camera_has_the_files_focal_length_and_no_distortion_left(video, tmp_path):
    width, height = video.width, video.height
    text = CALIBRATION.format(
        width=width, height=height, focal=0.9 * max(width, height), x=width / 2, y=height / 2
    )
    calibration = tmp_path / "Calib.toml"
    calibration.write_text(text)
    take = Calibrate(camera_file=calibration, camera_name="cam01")(Take("street", video=video))
    assert take.camera.focal_source == "told"
    assert take.camera.focal_px == pytest.approx(0.9 * max(video.width, video.height), rel=0.05)
    assert take.camera.intrinsics.name == "cam01"
    with refused("option-conflict"):
        Calibrate(camera_file=calibration)(Take("street", video=video, told=Told(focal_px=1000.0)))


def test_a_guessed_focal_length_is_not_called_known(tmp_path):
    video = Video(tmp_path / "none.mp4", 640, 480, np.arange(30) / 30, "h264")
    joints = np.random.default_rng(0).uniform(150, 300, (1, 17, 2)) + np.arange(30)[:, None, None]
    keypoints = PoseSequence(joints, H36M17, IMAGE, time_s=np.arange(30) / 30, frame_index=np.arange(30))
    for source, known in (("prior", False), ("lines", True)):
        camera = Camera((640, 480), 512.0, 100.0, source)
        take = Lift()(Take("t", video=video, keypoints=keypoints, camera=camera).telling(handedness="ignore"))
        said = next(step.options for step in take.poses.history if step.name == "lift")
        assert (said["focal_known"], said["focal_px"]) == (known, 512.0)
        assert any(event.code == "focal-guessed" for event in take.notices) == (not known)
