"""RTMW3D and InstantHMR: what they are shown, what becomes of their answers, and how a lift is taken up again."""

import weakref

import numpy as np
import pytest
from numpy.testing import assert_allclose

from golden.crops import FOCAL, SIZE, keypoints_of, lifted_by, placed, projected, shown
from golden.films import noting, pressing_ctrl_c
from pcnet3d.models import load_lifter
from pcnet3d.models.lifter import images
from pcnet3d.models.lifter.answers import load_answers
from pcnet3d.models.lifter.images import Crops, upright_crops
from pcnet3d.pipeline import CAMERA, H36M17, InputError, PoseSequence, remap
from pcnet3d.pipeline.core.anthropometry import implied_stature
from pcnet3d.pipeline.core.device import computing_on
from pcnet3d.pipeline.core.intrinsics import Intrinsics
from pcnet3d.pipeline.core.layouts import COCO23, FEET
from pcnet3d.pipeline.core.lifted import ToLift

RNG = np.random.default_rng(4)


@pytest.mark.parametrize("size", [(288, 384), (224, 224)])
def test_from_the_image_to_the_crop_and_back_is_within_a_pixel(size):
    import cv2

    dots = RNG.uniform((420, 220), (760, 600), (20, 2))
    centre, aspect = np.array([[600.0, 400.0]] * 20), size[0] / size[1]
    crops = Crops(centre, np.tile([[600 * aspect, 600]], (20, 1)), np.tile(np.eye(2), (20, 1, 1)))
    found = []
    for row, dot in enumerate(dots):
        image = np.zeros((800, 1000, 3), np.uint8)
        cv2.circle(image, (round(16 * dot[0]), round(16 * dot[1])), 16 * 6, (255, 255, 255), -1, shift=4)
        y, x = np.nonzero(crops.cut(row, image, size)[..., 0] > 100)
        found.append(2 * np.array([x.mean(), y.mean()]) / size - 1)
    assert np.abs(crops.pixels(np.array(found)[:, None])[:, 0] - dots).max() < 1


def test_what_lies_beyond_the_image_is_black():
    crops = Crops(np.zeros((1, 2)), np.full((1, 2), 100.0), np.eye(2)[None])
    part = crops.cut(0, np.full((200, 200, 3), 200, np.uint8), (50, 50))
    assert (part[:24, :24] == 0).all()
    assert (part[26:, 26:] == 200).all()


def test_upright_crops_hold_the_body_at_the_network_s_aspect():
    pixels = RNG.uniform((300, 200), (400, 600), (3, 17, 2))
    pixels[0, 0], pixels[0, 1] = (300, 200), (400, 600)
    confidence = np.full((3, 17), 0.9)
    pixels[1, 2], confidence[1, 2] = (2000, 2000), 0.1  # a guess
    crops = upright_crops(pixels, confidence, np.arange(3), 1.5, 0.75)
    assert_allclose(crops.centre[0], (350, 400))
    assert_allclose(crops.size[0], (450, 600))
    assert crops.size[1].max() <= 601
    wide = upright_crops(pixels[..., ::-1], confidence, np.arange(3), 1.5, 0.75)
    assert_allclose(wide.size[0], (600, 800))


@pytest.mark.parametrize("hidden", [(), ("l_wrist", "r_big_toe")])
def test_rtmw3d_s_joints_are_where_they_are_in_the_image(markers, body, hidden):
    """To a pixel, left ones at the left ones' discs; the network's input is what it was trained on."""
    network = load_lifter(markers(body[:, 2])).network
    pixels = projected(placed(body, 0.6, -0.1, 3.5))
    crops = network.crops(remap(keypoints_of(pixels[None])).joints, np.full((1, 17), np.nan), np.arange(1))
    seen = network.look(crops.cut(0, shown(pixels, hidden), network.size), np.zeros(0))
    found = crops.pixels(seen.points[None, :, :2])[0]
    missing = np.isin(COCO23.joints, hidden)
    assert np.isnan(found[missing]).all()
    scale = crops.size[0, 0] / network.size[0]  # image pixels to one of the crop
    assert np.linalg.norm(found - pixels, axis=-1)[~missing].max() < scale
    depth = seen.points[~missing, 2]
    assert_allclose(depth, body[~missing, 2], atol=2.1744869 / 288)


def test_rtmw3d_gives_the_body_back(markers, body, showing, video):
    """Coming nearer, on the axis of a camera of known focal length; the size stays."""
    places = np.stack([np.zeros(60), np.full(60, -0.05), np.linspace(6, 3, 60)], axis=-1)
    truth = body + places[:, None]
    showing([shown(pixels) for pixels in projected(truth)])
    keypoints = keypoints_of(projected(truth))
    lifted = lifted_by(markers(body[:, 2]), keypoints, SIZE, FOCAL, video=video)
    expected = remap(PoseSequence(truth, COCO23, CAMERA))
    expected = expected.joints - expected.joint("pelvis")[:, None]
    assert np.linalg.norm(lifted.joints - expected, axis=-1).max() < 0.06  # a crop's pixel is up to 1.5 cm
    assert np.median(np.linalg.norm(lifted.joints - expected, axis=-1)) < 0.015
    sizes = [implied_stature(part) for part in (lifted.joints[:20], lifted.joints[-20:])]
    assert_allclose(sizes, 1.7, rtol=0.02)
    assert (lifted.frame.name, lifted.frame.unit, lifted.root) == ("CAMERA", "arbitrary", None)
    assert (
        lifted.joint("l_wrist")[:, 0].min() > 0 > lifted.joint("r_wrist")[:, 0].max()
    )  # who faces the camera
    heels = lifted.feet[:, FEET.indices(("l_heel", "r_heel"))]
    assert_allclose(
        np.ptp(heels[..., 0], axis=1), np.ptp(body[COCO23.indices(("l_heel", "r_heel")), 0]), atol=0.04
    )


@pytest.mark.parametrize("place", [(1.0, -0.3, 4.0), (-1.2, -0.2, 3.5), (0.3, -0.1, 3.0)])
def test_rtmw3d_s_body_projects_onto_its_joints(markers, body, showing, video, place):
    """Wherever it stands: some place before the camera puts all of its joints on their pixels."""
    pixels = projected(placed(body, *place))
    showing([shown(pixels)])
    lifted = lifted_by(markers(body[:, 2]), keypoints_of(pixels[None]), SIZE, FOCAL, video=video)
    assert lifted.history[-1].options["focal_known"]
    names = [name for name in COCO23.joints if name in H36M17]
    joints = lifted.joints[0, H36M17.indices(names)].astype(float)
    rays = (pixels[COCO23.indices(names)] - np.array(SIZE) / 2) / FOCAL
    # x - u z = 0 of every joint, linear in the place: x0 - u z0 = u z - x.
    axes = np.array([[1, 0], [0, 1]])
    rows = np.concatenate([np.column_stack([np.tile(axes[i], (len(rays), 1)), -rays[:, i]]) for i in (0, 1)])
    rest = np.concatenate([rays[:, i] * joints[:, 2] - joints[:, i] for i in (0, 1)])
    where = np.linalg.lstsq(rows, rest, rcond=None)[0]
    again = (joints + where)[:, :2] / (joints + where)[:, 2:] * FOCAL
    scale = 1.25**2 * np.ptp(pixels[:, 1]) / 384  # about the image pixels to one of the crop
    assert np.linalg.norm(again - rays * FOCAL, axis=-1).max() < scale


def test_without_a_focal_length_the_bearing_is_told(markers, body, showing, video):
    pixels = projected(placed(body, 1.2, 0.0, 4.0))
    showing([shown(pixels)])
    lifted = lifted_by(markers(body[:, 2]), keypoints_of(pixels[None]), SIZE, video=video)
    said = lifted.history[-1].options
    assert not said["focal_known"]
    assert said["bearing_deg"][0] == pytest.approx(np.degrees(np.arctan(0.3 * FOCAL / SIZE[0])), abs=1)


def test_distorted_images_are_straightened(markers, body, showing, video):
    """The crop is where the person is in the filmed image, the body as a pinhole camera has it."""
    import cv2

    lens = Intrinsics((FOCAL, FOCAL), (660.0, 470.0), (-0.25, 0.08, 0.0, 0.0), image_size=SIZE)
    truth = placed(body, 0.9, 0.1, 3.2)
    matrix = np.array([[FOCAL, 0, 660], [0, FOCAL, 470], [0, 0, 1.0]])
    filmed = cv2.projectPoints(truth, np.zeros(3), np.zeros(3), matrix, np.array(lens.distortion))[0][:, 0]
    lifter = load_lifter(markers(body[:, 2]))
    showing([shown(filmed)])
    found = lifted_by(lifter, keypoints_of(filmed[None]), SIZE, FOCAL, video=video, intrinsics=lens)
    showing([shown(projected(truth))])
    ideal = lifted_by(lifter, keypoints_of(projected(truth)[None]), SIZE, FOCAL, video=video)
    assert np.linalg.norm(found.joints - ideal.joints, axis=-1).max() < 0.04


def test_nobody_in_the_image_is_a_counted_gap(markers, body, showing, video):
    pixels = np.tile(projected(placed(body, 0, 0, 4)), (6, 1, 1))
    images = [shown(pixels[0])] * 6
    images[2] = np.zeros_like(images[0])
    images[4] = shown(pixels[0], ("r_elbow",))
    showing(images)
    lifted = lifted_by(markers(body[:, 2]), keypoints_of(pixels), SIZE, FOCAL, video=video)
    missing = np.isnan(lifted.joints).any(axis=-1)
    assert missing[2].all()
    assert missing[4].tolist() == [joint == "r_elbow" for joint in H36M17.joints]
    assert not np.delete(missing, (2, 4), axis=0).any()
    said = lifted.history[-1].options
    assert (said["frames_without_person"], said["frames_without_numbers"]) == (1, 0)


def test_frames_without_keypoints_are_not_looked_at(markers, body, showing, video):
    pixels = np.tile(projected(placed(body, 0, 0, 4)), (40, 1, 1))
    showing([shown(pixels[0])] * 40)
    pixels[10:30] = np.nan
    lifted = lifted_by(markers(body[:, 2]), keypoints_of(pixels), SIZE, FOCAL, video=video)
    assert np.flatnonzero(np.isnan(lifted.joints).all(axis=(1, 2))).tolist() == list(range(10, 30))
    assert lifted.history[-1].options["frames_without_joints"] == 20


def test_a_body_that_is_deeper_than_long_has_no_scale(rtmw3d, body, showing, video):
    points = np.column_stack([np.full((23, 2), 0.5), 10 * body[:, 2]])
    pixels = projected(placed(body, 0, 0, 4))
    showing([shown(pixels)])
    lifted = lifted_by(rtmw3d(points), keypoints_of(pixels[None]), SIZE, FOCAL, video=video)
    assert np.isnan(lifted.joints).all()
    assert lifted.history[-1].options["frames_without_scale"] == 1


@pytest.mark.parametrize(
    ("network", "words"),
    [
        (lambda make: make["rtmw3d"](np.full((17, 3), 0.5), joints=17), "not a lifter: expected keypoints"),
        (lambda make: make["instanthmr"](np.zeros((70, 3)), left_out="joints_3d"), "but no joints_3d"),
        (lambda make: make["instanthmr"](np.zeros((70, 3)), left_out="cam_trans"), "not a lifter: expected keypoints"),
    ],
)  # fmt: skip
def test_networks_of_other_shapes_are_refused(rtmw3d, instanthmr, network, words):
    with pytest.raises(InputError, match=words) as refused:
        load_lifter(network({"rtmw3d": rtmw3d, "instanthmr": instanthmr}))
    assert "\n" not in str(refused.value)


def test_kinds_are_told_and_contradicted(rtmw3d, instanthmr):
    path = rtmw3d(np.full((23, 3), 0.5))
    assert load_lifter(path, "rtmw3d").network.kind == "rtmw3d"
    with pytest.raises(InputError, match="of the kind rtmw3d, not instanthmr"):
        load_lifter(path, "instanthmr")
    with pytest.raises(InputError, match="of the kind instanthmr, not motionbert"):
        load_lifter(instanthmr(np.zeros((70, 3))), "motionbert")


def test_the_device_is_asked_for(rtmw3d):
    with computing_on("cpu") as placement:
        load_lifter(rtmw3d(np.full((23, 3), 0.5)))
    assert placement.used == {"rtmw3d.onnx": "cpu"}


@pytest.fixture
def long_take(markers, body):
    """A lifter, 30 images and the keypoints in them."""
    places = np.stack([np.linspace(-0.5, 0.5, 30), np.zeros(30), np.full(30, 4.0)], axis=-1)
    pixels = projected(body + places[:, None])
    return load_lifter(markers(body[:, 2])), [shown(each) for each in pixels], keypoints_of(pixels)


@pytest.mark.parametrize("stop", [0, 12, 28])
def test_interrupted_and_taken_up_again_is_bitwise_the_same(
    long_take, showing, video, monkeypatch, tmp_path, stop
):
    lifter, frames, keypoints = long_take
    showing(frames)
    whole = lifted_by(lifter, keypoints, SIZE, FOCAL, video=video)
    given, asked = images.images_ahead, []
    monkeypatch.setattr(images, "images_ahead", pressing_ctrl_c(given, stop))
    with pytest.raises(KeyboardInterrupt):
        lifter.lift(ToLift(keypoints, SIZE, FOCAL, video=video, checkpoint=tmp_path / "part.npz"))
    assert load_answers(tmp_path / "part.npz").looked == stop + 1
    monkeypatch.setattr(images, "images_ahead", noting(given, asked))
    resumed = lifted_by(lifter, keypoints, SIZE, FOCAL, video=video, resume=tmp_path / "part.npz")
    assert asked == list(range(stop + 1, 30))
    np.testing.assert_array_equal(resumed.joints, whole.joints)
    np.testing.assert_array_equal(resumed.confidence, whole.confidence)
    assert resumed.history == whole.history


def test_answers_of_another_lift_count_for_nothing(long_take, showing, video, tmp_path):
    lifter, frames, keypoints = long_take
    showing(frames)
    whole = lifted_by(lifter, keypoints, SIZE, FOCAL, video=video)
    part = tmp_path / "part.npz"
    lifter.lift(ToLift(keypoints, SIZE, FOCAL, flip=True, video=video, checkpoint=part))
    again = lifter.lift(ToLift(keypoints, SIZE, FOCAL, video=video, resume=part)).poses
    np.testing.assert_array_equal(again.joints, whole.joints)


def test_what_is_no_file_of_answers_is_refused(tmp_path):
    path = tmp_path / "part.npz"
    for content in (b"", b"PK\x03\x04"):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"part\.npz"):
            load_answers(path)
    np.savez(
        path, points=np.zeros((3, 2, 3)), confidence=np.zeros((2, 2)), sure=np.zeros(3), looked=1, source=""
    )
    with pytest.raises(InputError, match=r"do not belong together.*delete it"):
        load_answers(path)


def test_images_are_let_go_of(long_take, monkeypatch, video):
    """However long the video, no more than two are held."""
    lifter, frames, keypoints = long_take
    held: list[weakref.ref] = []
    most = []

    def given(video, first, last):
        for number in range(first, last + 1):
            image = frames[number].copy()
            held.append(weakref.ref(image))
            yield number, image
            most.append(sum(ref() is not None for ref in held))

    monkeypatch.setattr(images, "images_ahead", given)
    lifted_by(lifter, keypoints, SIZE, FOCAL, video=video)
    assert max(most) <= 2


def test_a_network_that_fails_half_way_keeps_what_it_has_answered(
    long_take, showing, video, monkeypatch, tmp_path
):
    lifter, frames, keypoints = long_take
    showing(frames)
    look = type(lifter.network).look

    def failing(network, crop, condition):
        if len(looked) == 7:
            raise RuntimeError("out of memory.\nmore words")
        looked.append(1)
        return look(network, crop, condition)

    looked: list[int] = []
    monkeypatch.setattr(type(lifter.network), "look", failing)
    with pytest.raises(
        InputError, match=r"markers.onnx@\w+ failed at video frame 7: out of memory; give"
    ) as error:
        lifter.lift(ToLift(keypoints, SIZE, FOCAL, video=video, checkpoint=tmp_path / "part.npz"))
    assert "\n" not in str(error.value)
    assert load_answers(tmp_path / "part.npz").looked == 7
