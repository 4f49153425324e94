"""Networks that find joints: known answers of toy networks, what is refused, and the real ones on real video."""

import numpy as np
import pytest

from pcnet3d.adapters.video import read
from pcnet3d.models.detector.crops import Crop
from pcnet3d.models.detector.load import load_detector
from pcnet3d.models.detector.movenet import MoveNet
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.layouts import COCO17, COCO23, HALPE26
from pcnet3d.pipeline.files.video_frames import images_from


@pytest.mark.parametrize("kind", ["uint8", "int32", "float"])
@pytest.mark.parametrize("side", [192, 256])
def test_movenet_finds_the_joints_where_they_are(toys, tmp_path, kind, side):
    detector = load_detector(toys.save_toy(tmp_path / "toy.onnx", getattr(toys, kind), side))
    box = (120, 40, 180, 200)
    (found,) = detector.people(toys.scene(box))
    np.testing.assert_allclose(found.xy, toys.joints_of(box), atol=1.0)
    np.testing.assert_allclose(found.score, 0.9, atol=1e-6)
    assert detector.layout is COCO17
    assert detector.method.startswith("movenet@")


def test_a_small_person_in_a_wide_image_is_searched_for(toys, toy):
    """In all of the image it is but a speck; a crop that follows it sees it as exactly as a large one."""
    box = (1500, 300, 1516, 340)
    (found,) = load_detector(toy).people(toys.scene(box, size=(1920, 360)))
    np.testing.assert_allclose(found.xy, toys.joints_of(box), atol=0.5)


def test_the_person_is_followed_and_found_again_when_lost(toys, toy):
    detector = load_detector(toy)
    box, elsewhere = (40, 40, 80, 140), (250, 100, 280, 190)
    before = detector.people(toys.scene(box))
    (found,) = detector.people(toys.scene(elsewhere), before)
    np.testing.assert_allclose(found.xy, toys.joints_of(elsewhere), atol=1.0)
    assert detector.people(toys.scene(None), before) == ()


@pytest.mark.parametrize(("joints", "layout"), [(17, COCO17), (26, HALPE26), (133, COCO23)])
def test_simcc_peaks_become_pixels(toys, tmp_path, joints, layout):
    """Bins twice as fine as the input of 192 x 256; the whole image of 300 x 400 is the crop."""
    x, y = np.zeros((1, joints, 384), np.float32), np.zeros((1, joints, 512), np.float32)
    columns, rows = np.arange(joints) + 100, np.arange(joints) + 200
    x[0, np.arange(joints), columns], y[0, np.arange(joints), rows] = 0.9, 0.8
    path = toys.constant_graph(tmp_path / "simcc.onnx", (1, 3, 256, 192), {"simcc_x": x, "simcc_y": y})
    detector = load_detector(path)
    assert detector.layout is layout
    found = detector._network.look(np.zeros((400, 300, 3), np.uint8), Crop(0, 0, 300, 400))
    expected = np.stack([columns / 384 * 300, rows / 512 * 400], axis=1)[: len(layout)]
    np.testing.assert_allclose(found.xy, expected, rtol=1e-6)
    np.testing.assert_allclose(found.score, 0.8, rtol=1e-5)


def test_simcc_of_another_number_of_joints(toys, tmp_path):
    answers = {"simcc_x": np.zeros((1, 21, 384), np.float32), "simcc_y": np.zeros((1, 21, 512), np.float32)}
    path = toys.constant_graph(tmp_path / "hand.onnx", (1, 3, 256, 192), answers)
    with pytest.raises(InputError, match="17, 26, 133 joints of a person, got 21"):
        load_detector(path)


def _nms(boxes, scores, labels):
    dets = np.concatenate([boxes, np.reshape(scores, (-1, 1))], axis=1)[None]
    return {"dets": dets.astype(np.float32), "labels": np.array([labels], np.int64)}


def test_people_come_from_the_boxes_of_a_person_detector(toys, toy, tmp_path):
    """Two people at once, which the network of one person alone would mix; a dog and a doubtful box are left out. The
    person detector's input is square, so its pixels are half those of the image of 640 x 480."""
    boxes = np.array([[100, 50, 160, 230], [400, 100, 460, 280], [300, 10, 360, 40], [0, 0, 50, 50]]) / 2
    answers = _nms(boxes, [0.9, 0.8, 0.9, 0.1], [0, 0, 16, 0])
    path = toys.constant_graph(tmp_path / "people.onnx", (1, 3, 320, 320), answers)
    image = toys.scene((100, 50, 160, 230), size=(640, 480))
    image[100:280, 400:460] = (250, 10, 10)
    people = load_detector(toy, path).people(image)
    assert len(people) == 2
    for found, box in zip(people, boxes * 2, strict=False):
        np.testing.assert_allclose(found.xy, toys.joints_of(tuple(box)), atol=1.5)


@pytest.mark.parametrize(
    ("shape", "answers"),
    [
        ((1, 3, 224, 224), {"class": np.zeros((1, 1000), np.float32)}),
        ((1, 17, 3), {"rotation": np.zeros((1, 3, 3), np.float32)}),
        ((1, 192, 192, 3), {"output": np.zeros((1, 1, 21, 3), np.float32)}),
        ((1, 256, 256, 3), {"output": np.zeros((1, 6, 56), np.float32)}),  # MoveNet, of several people
    ],
)
def test_a_network_of_another_kind(toys, toy, tmp_path, shape, answers):
    path = toys.constant_graph(tmp_path / "other.onnx", shape, answers)
    with pytest.raises(
        InputError, match=r"other\.onnx is not a network that finds joints .*got inputs input \("
    ):
        load_detector(path)
    with pytest.raises(InputError, match=r"other\.onnx is not a network that finds people"):
        load_detector(toy, path)


@pytest.mark.parametrize("content", [b"", b"no network at all", None])
def test_a_file_that_is_no_network(tmp_path, content):
    path = tmp_path / "broken.onnx"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=r"Expected a network that finds joints .*broken\.onnx"):
        load_detector(path)


@pytest.mark.data("lifter", "models", "video")
def test_a_real_network_on_real_video_agrees_with_the_stored_keypoints(data):
    """Mean distance of sure joints over the body's height; the stored ones were made with other crops."""
    detector = load_detector(data / "models/movenet_lightning_int8.onnx")
    stored = np.load(data / "lifter/walk_crop.npz")["movenet_kp2d"]
    (video,) = read(data / "video/walk_crop.mp4")
    before, off = (), []
    for number, image in images_from(video):
        before = detector.people(image, before)
        (found,) = before
        sure = (found.score > 0.3) & (stored[number, :, 2] > 0.3)
        step = np.linalg.norm(found.xy - stored[number, :, :2], axis=1)[sure].mean()
        off.append(step / np.ptp(stored[number, :, 1]))
    assert len(off) == len(stored)
    assert np.median(off) < 0.03
    assert np.percentile(off, 90) < 0.06


def test_the_number_of_cores_changes_no_answer(toy, monkeypatch):
    """8-bit MoveNet answered otherwise in two threads than in one, and other people were found."""
    opened = []

    class Kept(MoveNet):
        def __init__(self, network):
            super().__init__(network)
            opened.append(network)

    monkeypatch.setattr("pcnet3d.models.detector.load.MoveNet", Kept)
    monkeypatch.setattr("pcnet3d.models.common.onnx.cores", lambda: 4)
    load_detector(toy)
    assert opened[-1].session.get_session_options().intra_op_num_threads == 1
