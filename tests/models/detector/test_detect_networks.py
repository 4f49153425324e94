"""Networks that find joints: known answers of toy networks, what is refused, the real ones on real video, several looks
at one person; and downloads, once and with their licence."""

import hashlib
import http.server
import socket
import threading
import zipfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import commands
from pcnet3d.adapters.video import read
from pcnet3d.models.common import download as networks
from pcnet3d.models.common.download import MOVENET, Network
from pcnet3d.models.detector.load import load_detector
from pcnet3d.models.detector.networks import Follower, MoveNet, looked_twice
from pcnet3d.models.detector.protocols import Crop, Found
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.layouts import COCO17, COCO23, HALPE26
from pcnet3d.pipeline.files.video_frames import images_from
from pcnet3d.stages.detect import Detect
from refusals import refused


@pytest.mark.parametrize("kind", ["uint8", "int32", "float"])
@pytest.mark.parametrize("side", [192, 256])
def test_movenet_finds_the_joints_where_they_are(toys, tmp_path, kind, side):
    detector = load_detector(toys.save_toy(tmp_path / "toy.onnx", kind, side))
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


WIDTH, HEIGHT = 320, 240
CROP = Crop(60, 20, 200, 200)
R_WRIST, L_WRIST = COCO17.indices(("r_wrist", "l_wrist"))
JOINTS = np.random.default_rng(0).uniform((80, 40), (240, 200), (17, 2)).astype(np.float32)


class Fake:
    """A network that sees JOINTS where they are, by an image whose left column is bright unless it is mirrored; off[i]
    is added to its look number i, in the image's own directions."""

    layout, aspect, room, method = COCO17, 1.0, 1.25, "fake"

    def __init__(self, off=(), sure=0.9, score=(0.8,)):
        self.off, self.sure, self.score, self.crops = list(off), sure, score, []

    def look(self, image, crop):
        mirrored = image[0, 0, 0] == 0
        number = len(self.crops)
        self.crops.append((crop, mirrored))
        xy = JOINTS + (self.off[number] if number < len(self.off) else 0)
        if mirrored:
            xy = np.column_stack([WIDTH - xy[:, 0], xy[:, 1]])[COCO17.mirror]
        return Found(
            xy,
            np.full(17, self.score[min(number, len(self.score) - 1)]),
            np.array([80, 40, 240, 200]),
            self.sure,
        )

    def next_crop(self, found):
        return CROP


@pytest.fixture
def image():
    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    picture[:, 0] = 255
    return picture


def test_looks_that_agree_change_nothing(image):
    fake = Fake()
    found = looked_twice(fake, image, CROP)
    np.testing.assert_allclose(found.xy, JOINTS, atol=1e-3)
    np.testing.assert_allclose(found.score, 0.8, atol=1e-6)
    assert found.sure == pytest.approx(0.9)
    assert [(crop.width, mirrored) for crop, mirrored in fake.crops] == [(200, False), (176, True)]
    for crop, mirrored in fake.crops:  # both about the same middle
        middle = crop.left + crop.width / 2
        assert (WIDTH - middle if mirrored else middle) == pytest.approx(160, abs=1)
        assert crop.top + crop.height / 2 == pytest.approx(120, abs=1)


def test_small_errors_are_averaged(image):
    found = looked_twice(Fake([np.array([4.0, 0]), np.array([-2.0, 2.0])]), image, CROP)
    np.testing.assert_allclose(found.xy - JOINTS, np.tile([1.0, 1.0], (17, 1)), atol=1e-3)


def test_of_two_that_contradict_each_other_one_is_taken_never_the_middle(image):
    far = np.zeros((17, 2))
    far[R_WRIST] = (60, 0)
    for scores, expected in (((0.8, 0.7), JOINTS + far), ((0.7, 0.8), JOINTS), ((0.8, 0.8), JOINTS + far)):
        found = looked_twice(Fake([far], score=scores), image, CROP)
        np.testing.assert_allclose(found.xy, expected, atol=1e-3)  # the surer one, of equals the first
        assert found.score[R_WRIST] == pytest.approx(max(scores))


def test_where_nobody_is_one_look_is_enough(image):
    fake = Fake(sure=0.1)
    assert looked_twice(fake, image, CROP).sure == pytest.approx(0.1)
    assert len(fake.crops) == 1


def test_a_follower_searches_with_single_looks_and_then_looks_as_often_as_it_is_told(image):
    fake = Fake()
    follower = Follower(fake, twice=True)
    (found,) = follower.people(image)
    searched = len(fake.crops) - 2
    assert not any(mirrored for _, mirrored in fake.crops[:searched])
    assert [crop.width for crop, _ in fake.crops[searched:]] == [200, 176]
    np.testing.assert_allclose(found.xy, JOINTS, atol=1e-3)
    before = len(fake.crops)
    follower.people(image, [found])
    assert len(fake.crops) == before + 2


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize(("again", "people"), [(0.45, 0), (0.55, 1)])
def test_what_passes_for_a_person_in_one_look_alone_is_nobody(image, twice, again, people):
    """The stem of a tree did in one frame of a hundred, and was followed from there on."""

    class Once(Fake):
        def look(self, image, crop):
            found = super().look(image, crop)
            return replace(found, sure=0.55 if len(self.crops) <= searched else again)

    searched = 12  # three windows, each looked at four times
    assert len(Follower(Once(), twice).people(image)) == people


def test_how_many_looks_a_detector_takes(tmp_path, toys):
    one = toys.save_toy(tmp_path / "toy.onnx", "float")
    plain = load_detector(one).method
    assert load_detector(one, looks=None).method == f"{plain}, 2 looks"
    assert load_detector(one, looks=1).method == plain
    for looks in (0, 3):
        with pytest.raises(InputError, match="1 or 2 looks"):
            load_detector(one, looks=looks)
    assert Detect().looks is None


def test_a_detector_that_sees_everybody_at_once_looks_once():
    assert load_detector(lambda image: None, looks=None).method.startswith("<lambda>")
    with pytest.raises(InputError, match=r"looks at all people at once; leave --set detect.looks=2 out"):
        load_detector(lambda image: None, looks=2)


@pytest.fixture
def served(tmp_path, toy, monkeypatch):
    """An address that serves the toy as toy.onnx and in toy.zip, and the cache that downloads go to."""
    folder = tmp_path / "served"
    folder.mkdir()
    (folder / "toy.onnx").write_bytes(toy.read_bytes())
    with zipfile.ZipFile(folder / "toy.zip", "w") as archive:
        archive.write(toy, "20230605/rtmpose_onnx/end2end.onnx")
        archive.writestr("20230605/detail.json", "{}")
    monkeypatch.setattr("pooch.os_cache", lambda name: tmp_path / "cache" / name)
    handler = partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    handler.log_message = lambda *_: None
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def _network(url: str, toy: Path, **changes: str) -> Network:
    digest = hashlib.sha256(toy.read_bytes()).hexdigest()
    return Network(**{
        "name": "toy", "given": "--detector FILE.onnx", "about": "a toy", "url": url, "sha256": digest,
        "megabytes": 0.1, "licence": "MIT-0", **changes,
    })  # fmt: skip


@pytest.mark.parametrize("name", ["toy.onnx", "toy.zip"])
def test_a_network_is_downloaded_once_and_its_licence_shown(served, toy, capsys, name):
    network = _network(f"{served}/{name}", toy)
    assert network.open().read_bytes() == toy.read_bytes()
    assert "licence: MIT-0" in capsys.readouterr().err
    assert _network(f"{served}/gone", toy).open() == network.path
    assert capsys.readouterr().err == ""
    assert [path.name for path in network.path.parent.iterdir()] == ["toy.onnx"]


@pytest.mark.parametrize(
    ("name", "changes"), [("toy.onnx", {"sha256": "0" * 64}), ("gone.onnx", {}), ("gone.zip", {})]
)
def test_a_network_that_cannot_be_had(served, toy, name, changes):
    network = _network(f"{served}/{name}", toy, **changes)
    with refused("not-reached", network.url, network.sha256, network.path, "--detector FILE.onnx"):
        network.open()
    assert not network.path.exists()


def test_without_a_network_one_sentence_says_what_to_do(walk_film, tmp_path, call, monkeypatch):
    def refuse(*_, **__):
        raise OSError("no network")

    monkeypatch.setattr("pooch.os_cache", lambda name: tmp_path / "cache" / name)
    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(networks, "_download_onnx", refuse)
    path = tmp_path / "cache/pcnet3d/movenet.onnx"
    result = call(walk_film.path, "-o", tmp_path / "out")
    commands.refused(result, MOVENET.url, MOVENET.sha256, path, "--detector FILE.onnx")
    assert not (tmp_path / "out").exists()
