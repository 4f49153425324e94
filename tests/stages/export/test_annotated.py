"""annotated.mp4, decoded again: its clock, what is drawn where, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from golden.bodies import facing_camera
from golden.films import film
from pcnet3d.adapters import video as adapter
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, InputError, PoseSequence, Take
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.files.video_frames import images_from
from pcnet3d.stages.drawing.palette import LEFT, RIGHT
from pcnet3d.stages.export.annotated import write_annotated
from pcnet3d.stages.rectify import Rectify
from refusals import refused

STAMPS_MS = (0, 30, 70, 100, 180, 210, 250, 290, 390, 420, 450, 500)
ROWS = np.array([2, 3, 4, 6, 7, 8, 9])  # frame 5 has no pose
SIZE = (64, 48)
WIDTH, HEIGHT = 128, 96  # so small an image is enlarged
PANEL = 96  # pixels wide


@pytest.fixture(scope="module")
def take(tmp_path_factory) -> Take:
    """An upright person before a level camera; the detector sees the wrists alone, the left one hardly."""
    (video,) = adapter.read(film(tmp_path_factory.mktemp("film") / "film.mp4", STAMPS_MS))
    clock = {"time_s": video.time_s[ROWS], "frame_index": ROWS}
    poses = PoseSequence(np.tile(facing_camera(), (len(ROWS), 1, 1)), H36M17, CAMERA, **clock)
    pixels = np.full((len(ROWS), len(COCO17), 2), np.nan)
    sure = np.full(pixels.shape[:2], np.nan)
    for joint, at, confidence in (("r_wrist", (15, 40), 1.0), ("l_wrist", (45, 40), 0.05)):
        pixels[:, COCO17.index(joint)], sure[:, COCO17.index(joint)] = at, confidence
    keypoints = PoseSequence(pixels, COCO17, IMAGE, confidence=sure, **clock)
    camera = Camera(SIZE, 60.0, 3.0, "told")
    found = Rectify("geometric")(Take("t", video=video, poses=poses, keypoints=keypoints, camera=camera))
    return found.with_(
        rectified=replace(found.rectified, level_ok=True)
    )  # seven frames are too few to level a take


def shown(take, folder) -> tuple[np.ndarray, list[np.ndarray]]:
    """Time stamps and images of the file."""
    write_annotated(take, folder / "annotated.mp4")
    (video,) = adapter.read(folder / "annotated.mp4")
    assert video.codec == "h264"
    return video.time_s, [image.astype(int) for _, image in images_from(video)]


@pytest.fixture(scope="module")
def stamps_and_images(take, tmp_path_factory):
    """Of the take as it is."""
    return shown(take, tmp_path_factory.mktemp("annotated"))


@pytest.fixture
def images(stamps_and_images) -> list[np.ndarray]:
    return stamps_and_images[1]


def near(image: np.ndarray, colour, off: int = 60) -> np.ndarray:
    """(N, 2) x and y of the pixels of about that colour."""
    return np.argwhere(np.abs(image - np.array(colour)).max(axis=-1) < off)[:, ::-1]


def test_frames_keep_their_time_stamps(stamps_and_images):
    time_s, images = stamps_and_images
    np.testing.assert_allclose(time_s, (np.array(STAMPS_MS[2:10]) - STAMPS_MS[2]) / 1000, atol=1e-4)
    assert {image.shape for image in images} == {(HEIGHT, WIDTH + PANEL, 3)}


def test_keypoints_that_were_seen_are_where_they_are(images):
    image = images[0][:, :WIDTH]
    right, left = near(image, RIGHT), near(image, LEFT)
    assert len(right) >= 4
    np.testing.assert_allclose(right.mean(axis=0), (30.5, 80.5), atol=1.5)
    assert not len(left)


def test_no_bone_goes_to_a_point_that_was_not_seen(take, tmp_path):
    """Legs that the image cuts off were drawn up to the hands."""
    keypoints = take.keypoints
    pixels, sure = keypoints.joints.copy(), keypoints.confidence.copy()
    pixels[:, COCO17.index("l_elbow")], sure[:, COCO17.index("l_elbow")] = (45, 10), 0.9
    for score, drawn in ((0.05, False), (0.9, True)):
        sure[:, COCO17.index("l_wrist")] = score
        told = take.with_(keypoints=keypoints.with_(joints=pixels, confidence=sure))
        left = near(shown(told, tmp_path)[1][0][:, :WIDTH], LEFT)
        between = (left[:, 1] > 36) & (left[:, 1] < 64) & (np.abs(left[:, 0] - 90) < 8)
        assert between.any() == drawn


def test_the_horizon_of_a_level_camera_is_in_the_middle(images):
    columns = images[0][:, 60:120].sum(axis=-1)
    assert np.abs(columns[:68].argmax(axis=0) - 48).max() <= 2  # keypoints lie below


@pytest.mark.parametrize(
    "change", [{"camera": None}, {"rectified": {"level_ok": False}}], ids=["no focal length", "not levelled"]
)
def test_no_horizon_that_is_not_known(take, tmp_path, change):
    if "rectified" in change:
        change = {"rectified": replace(take.rectified, **change["rectified"])}
    image = shown(take.with_(**change), tmp_path)[1][0]
    assert np.ptp(image[36:64, 60:120]) < 40


def test_the_skeleton_stands_beside_it_with_its_right_on_the_left(images):
    image = images[0][:, WIDTH : WIDTH + PANEL // 2]
    right, left = near(image, RIGHT, 90), near(image, LEFT, 90)
    assert len(right) > 3
    assert right[:, 0].mean() < left[:, 0].mean() - 1


def test_a_frame_without_a_pose_has_no_skeleton(images):
    coloured = [np.ptp(image[:, WIDTH + 4 :], axis=-1).max() > 100 for image in images]
    assert coloured == [number in ROWS for number in range(2, 10)]


def test_where_it_begins_is_told(take, tmp_path):
    (event,) = write_annotated(take, tmp_path / "annotated.mp4")
    assert event.text == "annotated.mp4 begins at 0.070 s of the take."


def test_without_a_video_or_frames_of_it_it_is_refused(take, tmp_path):
    with refused("needs-input"):
        write_annotated(take.with_(video=None), tmp_path / "annotated.mp4")
    level = take.rectified.level.with_(frame_index=ROWS + 100)
    with pytest.raises(InputError, match="from frame 102 on"):
        write_annotated(
            take.with_(rectified=replace(take.rectified, level=level)), tmp_path / "annotated.mp4"
        )
    assert not list(tmp_path.iterdir())
