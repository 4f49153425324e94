"""Lifters that look at the image: where they look, and what becomes of their landmarks."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from golden.crops import lifted_by
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_files
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_lifter
from pcnet3d.models.lifter.blazepose import crops_around
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, PoseSequence, remap
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, COCO17, FEET
from pcnet3d.pipeline.core.rotations import geodesic_deg, kabsch
from pcnet3d.pipeline.reading.load import read_video
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from refusals import refused

RNG = np.random.default_rng(0)
WORLD = RNG.normal(size=(33, 3)).round(2)


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    walk = walker(seconds=1)
    files = write_files(tmp_path_factory.mktemp("walk"), walk, side_camera(walk))
    return open_take(RunOptions(video=files.video, keypoints=files.keypoints))


@pytest.fixture
def upright():
    """(2, 17, 2) pixels: a person whose trunk is vertical, hips at (300, 200), reaching 100 pixels down."""
    pixels = np.full((2, 17, 2), (300.0, 180.0))
    for name, place in {
        "pelvis": (300, 200), "l_hip": (310, 200), "r_hip": (290, 200), "l_shoulder": (320, 140),
        "r_shoulder": (280, 140), "l_ankle": (300, 300), "head": (300, 20),
    }.items():  # fmt: skip
        pixels[:, H36M17.index(name)] = place
    return pixels


def test_the_crop_is_around_the_hips_and_holds_the_body(upright):
    crops = crops_around(upright, np.full((2, 17), np.nan), np.arange(2))
    assert_allclose(crops.centre, [[300, 200]] * 2)
    assert_allclose(crops.size, 250)  # 2 x 1.25 x 100; the head does not count
    assert_allclose(crops.R_image_from_crop, [np.eye(2)] * 2, atol=1e-12)


def test_doubtful_keypoints_do_not_widen_the_crop(upright):
    confidence = np.full((2, 17), 0.9)
    confidence[0, H36M17.index("l_ankle")] = 0.1
    sides = crops_around(upright, confidence, np.arange(2)).size[:, 0]
    assert sides[0] < 200
    assert sides[1] == 250


def test_a_turned_image_gives_the_same_crop(upright):
    """The person lies with the head to the right: a quarter turn clockwise of image and keypoints."""
    image = RNG.integers(0, 255, (400, 600, 3), dtype=np.uint8)
    turned = np.ascontiguousarray(np.rot90(image, -1))
    lying = np.stack([399 - upright[..., 1], upright[..., 0]], axis=-1)
    nothing = np.full((2, 17), np.nan)
    standing, lying = (crops_around(pixels, nothing, np.arange(2)) for pixels in (upright, lying))
    assert_allclose(lying.R_image_from_crop[0], [[0, -1], [1, 0]], atol=1e-12)
    a, b = (crops.cut(0, seen, (250, 250)) for crops, seen in ((standing, image), (lying, turned)))
    assert_allclose(b[2:-2, 2:-2], a[2:-2, 2:-2], atol=5)


def test_landmarks_become_the_17_joints_about_the_pelvis(landmarks, take):
    lifted = lifted_by(landmarks(WORLD), take.keypoints, (640, 360), video=take.video)
    expected = remap(PoseSequence(WORLD[None], BLAZEPOSE33, CAMERA)).joints[0]
    nose = H36M17.index("nose")
    others = np.delete(np.arange(17), [nose])
    # The walker's trunk leans a little, so his crop is turned a little; depth and lengths do not change.
    assert_allclose(lifted.joints[:, others, 2] - (expected - expected[0])[others, 2], 0, atol=1e-4)
    lengths = np.linalg.norm((expected - expected[0])[others], axis=-1)
    assert_allclose(np.linalg.norm(lifted.joints[:, others], axis=-1), np.tile(lengths, (30, 1)), atol=1e-4)
    assert np.ptp(lifted.joints[:, nose, 2]) > 1e-3  # it looks at every image
    heel = WORLD[BLAZEPOSE33.index("l_heel")] - expected[0]
    assert_allclose(
        np.linalg.norm(lifted.feet[:, FEET.index("l_heel")], axis=-1), np.linalg.norm(heel), atol=1e-4
    )
    assert_allclose(lifted.confidence, 1 / (1 + np.exp(-2)), atol=1e-5)
    assert (lifted.frame.name, lifted.frame.unit) == ("CAMERA", "m")
    np.testing.assert_array_equal(lifted.frame_index, take.keypoints.frame_index)


def test_where_nobody_is_seen_the_pose_is_missing_and_counted(landmarks, take):
    lifted = lifted_by(landmarks(WORLD, person=0.2), take.keypoints, (640, 360), video=take.video)
    assert np.isnan(lifted.joints).all()
    assert lifted.history[-1].options["frames_without_person"] == len(lifted)


def test_flip_averages_with_the_mirrored_landmarks(landmarks, take):
    lifter = load_lifter(landmarks(WORLD))
    lifted = lifted_by(lifter, take.keypoints, (640, 360), flip=True, video=take.video)
    width = np.linalg.norm(lifted.joint("l_hip") - lifted.joint("r_hip"), axis=-1)
    hips = WORLD[BLAZEPOSE33.indices(("l_hip", "r_hip")), 0]
    assert_allclose(width, abs(hips[0] - hips[1]), atol=1e-4)  # their heights and depths became the same


def test_without_a_video_it_is_refused(landmarks, take):
    with refused("needs-input"):
        lifted_by(landmarks(WORLD), take.keypoints, (640, 360))


@pytest.mark.data
@pytest.mark.parametrize(
    ("clip", "file", "mm", "deg"),
    [("walk_crop", "walk_crop.mp4", 40, 4.5), ("demo_man", "sports2d_demo.mp4", 40, 4.5)],
)
def test_the_real_network_agrees_with_its_stored_answers(data, clip, file, mm, deg):
    """Stored are answers to crops that were not turned with the trunk: near, not the same."""
    with np.load(data / "lifter" / f"{clip}.npz", allow_pickle=False) as stored:
        found, world, size = (stored[key] for key in ("movenet_kp2d", "blazepose_world", "image_size"))
    rows = np.arange(0, len(found), 12)
    confidence = np.clip(found[rows, :, 2], 0, 1)
    keypoints = PoseSequence(found[rows, :, :2], COCO17, IMAGE, confidence=confidence, frame_index=rows)
    lifter = load_lifter(str(data / "models" / "pose_landmark_lite.onnx"))
    ours = lifted_by(lifter, keypoints, tuple(map(int, size)), video=read_video(data / "video" / file)).joints
    theirs = remap(PoseSequence(world[rows], BLAZEPOSE33, CAMERA)).joints
    theirs = theirs - theirs[:, :1]
    assert 1000 * np.median(np.linalg.norm(ours - theirs, axis=-1)) < mm
    assert np.median(geodesic_deg(kabsch(ours, theirs), np.eye(3))) < deg
