"""Pictures of the video: that they are the right images, and that none is there when none is wanted."""

import re
import threading

import av
import cv2
import numpy as np
import pytest

from golden import numbered
from pcnet3d.adapters.video import read
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, InputError, PoseSequence, Take
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.files.video_frames import OnePass, _Film, images_ahead, images_at, images_from
from pcnet3d.stages.report.player import jpeg, sure_keypoints, windows
from pcnet3d.stages.report.stage import report


def test_damage_is_where_the_last_image_came_from_whichever_is_wanted(film):
    """Of a wanted frame behind the damage it was said that nothing can be decoded beyond that very frame."""
    video = film()
    with av.open(video.path) as container:
        places = [packet.pos for packet in container.demux(video=0) if packet.size]
    content = bytearray(video.path.read_bytes())
    start, stop = places[30], places[-1]
    content[start:stop] = bytes(stop - start)
    video.path.write_bytes(content)
    with pytest.raises(InputError, match="cannot be decoded beyond frame") as through:
        list(images_from(video))
    with pytest.raises(InputError) as wanted:
        images_at(video, [3, 55])
    assert str(wanted.value) == str(through.value)
    images = OnePass(video)
    for look in [images.ask([number], lambda _, image: image) for number in (55, 3)]:
        with pytest.raises(
            InputError, match="cannot be decoded beyond frame"
        ):  # who asks second is told, too
            look()
    assert 20 <= int(re.search(r"frame (\d+)", str(wanted.value))[1]) < 40


def test_who_asks_in_time_looks_in_one_pass(film, monkeypatch):
    passes, decoded = [], _Film._decoded
    monkeypatch.setattr(_Film, "_decoded", lambda *asked: passes.append(asked) or decoded(*asked))
    video = film(frames=30)
    images = OnePass(video)
    some = images.ask([3, 20, 3], lambda number, image: (number, image.shape))
    grey = images.ask([20, 29, 30], lambda _, image: image.shape, grey_side=80)
    width, height = video.size
    assert some() == {number: (number, (height, width, 3)) for number in (3, 20)}
    assert grey() == dict.fromkeys((20, 29), (round(80 * height / width), 80))
    assert len(passes) == 1
    assert np.array_equal(images.ask([20], lambda _, image: image)()[20], images_at(video, [20])[20])
    assert some().keys() == {3, 20}
    assert OnePass(None).ask([1], lambda _, image: image)() == {}


def test_images_decoded_ahead_are_the_same(film):
    video = film(frames=30)
    for span in ((0,), (13,), (3, 11), (29,), (30,)):
        ahead, plain = (list(images(video, *span)) for images in (images_ahead, images_from))
        assert [number for number, _ in ahead] == [number for number, _ in plain]
        assert all(np.array_equal(a, b) for (_, a), (_, b) in zip(ahead, plain, strict=True))


def test_images_decoded_ahead_stop_with_whoever_asks(film):
    threads = threading.active_count()
    images = images_ahead(film(frames=30))
    assert next(images)[0] == 0
    assert threading.active_count() > threads
    images.close()
    assert threading.active_count() == threads


@pytest.mark.parametrize(
    ("ending", "codec", "options"),
    [
        ("mp4", "libx264", {"bf": "2", "g": "999"}),
        ("ts", "libx264", {}),
        ("ts", "libx264", {"bf": "2"}),
        ("ts", "libx264", {"bf": "2", "g": "12"}),
        ("ts", "mpeg2video", {"bf": "2", "g": "12"}),
        ("vob", "mpeg2video", {"bf": "2", "g": "12"}),
        ("flv", "libx264", {"bf": "2", "g": "12"}),
        ("avi", "mpeg4", {"bf": "2", "g": "12"}),
    ],
)
def test_a_frame_is_found_wherever_seeking_lands(tmp_path, ending, codec, options):
    """In MPEG-TS behind the frame that is looked for, as every search for the first one with B-frames does; MPEG-PS
    gives wrong stamps behind it, and FLV and AVI find nothing before their first frame."""
    (video,) = read(numbered.numbered_film(tmp_path / f"film.{ending}", codec, **options))
    for first in (0, 1, 5, 13, 37, 59):
        shown = dict(images_from(video, first))
        assert list(shown) == list(range(first, numbered.FRAMES))
        for number, image in shown.items():
            assert image[:40, :40].mean() == pytest.approx(8 + numbered.STEP * number, abs=1.9)
    found = images_at(video, [0, 20, 58])
    assert sorted(found) == [0, 20, 58]
    for number, image in found.items():
        assert image[:40, :40].mean() == pytest.approx(8 + numbered.STEP * number, abs=1.9)


@pytest.fixture
def unsure() -> Take:
    """30 frames in which the detector sees no eye or nose from frame 1, and is unsure of the right knee from 10 on."""
    poses = PoseSequence(np.zeros((30, 17, 3)), H36M17, CAMERA, time_s=np.arange(30) / 30)
    sure = np.full((30, 17), 0.8)
    sure[1:, :3] = 0.1, 0.2, np.nan
    sure[10:, COCO17.index("r_knee")] = 0.4
    pixels = np.arange(30 * 17 * 2, dtype=np.float32).reshape(30, 17, 2)
    seen = PoseSequence(pixels, COCO17, IMAGE, confidence=sure, time_s=np.arange(30) / 30)
    return Take("t", poses=poses, keypoints=seen.with_(made_by=MadeBy("estimated", "movenet@0")))


def test_points_that_were_not_seen_or_of_which_the_detector_is_unsure_are_not_drawn(unsure):
    """Legs were drawn over a banner that hid them."""
    shown, given = sure_keypoints(unsure), unsure.keypoints
    assert shown.layout is COCO17
    for frame, hidden in ((0, ()), (2, COCO17.joints[:2]), (20, (*COCO17.joints[:2], "r_knee"))):
        others = [joint not in hidden for joint in COCO17.joints]
        assert np.isnan(shown.joints[frame, COCO17.indices(hidden)]).all()
        np.testing.assert_array_equal(shown.joints[frame, others], given.joints[frame, others])


def seen_at(*points: tuple[float, float], layout=H36M17, **joints: tuple[float, float]) -> PoseSequence:
    """Keypoints of a single frame: of all joints, or of those that are named."""
    pixels = np.full((1, 17, 2), np.nan)
    pixels[0, layout.indices(tuple(joints) or layout.joints)] = [*joints.values()] or points
    return PoseSequence(pixels, layout, IMAGE, time_s=np.zeros(1))


def picture(image: np.ndarray, keypoints: PoseSequence | None) -> np.ndarray:
    """(H, W, 3) what the film shows of an image, in BGR."""
    window = windows(keypoints, image.shape[1::-1])
    content = jpeg(image, window(0), keypoints, 0)
    return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)


def test_keypoints_are_drawn_where_they_are():
    """A right leg along a diagonal of a grey image: its colour is on the line, and nowhere far from it."""
    image = np.full((200, 300, 3), 128, np.uint8)
    shown = picture(image, seen_at(r_hip=(100, 40), r_knee=(180, 120))).astype(int)
    assert shown.shape == (280, 280, 3)
    orange = np.argwhere(shown[..., 2] - shown[..., 0] > 90)
    # The square around the leg has its middle at the knee-hip middle and 1.35 times its side.
    side = int(1.35 * 80)
    ends = (np.array([[100, 40], [180, 120]]) - [140 - side / 2, 80 - side / 2]) * 280 / side
    off = np.abs((orange[:, 1] - ends[0, 0]) - (orange[:, 0] - ends[0, 1])) / np.sqrt(2)
    assert len(orange) > 200
    assert off.max() < 5
    assert orange[:, 1].min() == pytest.approx(ends[0, 0], abs=6)
    assert orange[:, 1].max() == pytest.approx(ends[1, 0], abs=6)


@pytest.mark.parametrize("at", [None, np.nan, -50.0, 5000.0])
def test_without_a_person_in_it_the_whole_image_is_shown(at):
    keypoints = None if at is None else seen_at(*[(at, at)] * 17)
    shown = picture(np.zeros((90, 160, 3), np.uint8), keypoints)
    assert shown.shape[1] == 280
    assert shown.shape[0] == pytest.approx(280 * 90 / 160, abs=1)


def test_the_window_follows_the_person_into_the_corner_of_the_image():
    frames = np.array([[(30, 30), (50, 90)], [(130, 30), (150, 90)], [(2, 1), (22, 61)]], dtype=float)
    pixels = np.full((3, 17, 2), np.nan)
    pixels[:, :2] = frames
    window = windows(PoseSequence(pixels, H36M17, IMAGE, time_s=np.arange(3) / 30), (160, 120))
    (first, side), (second, _), (third, _) = (window(frame) for frame in range(3))
    assert side == (81, 81)
    assert first.tolist() == [0, 20]
    assert second.tolist() == [79, 20]
    assert third.tolist() == [0, 0]


@pytest.mark.parametrize("size", [(72, 128), (128, 72)])
def test_who_fills_the_image_is_shown_whole(size):
    """Of somebody in an upright video it showed the trunk alone."""
    keypoints = seen_at(r_wrist=(4, 4), l_ankle=(size[0] - 4, size[1] - 4))
    corner, shown = windows(keypoints, size)(0)
    assert (corner.tolist(), shown) == ([0, 0], size)


def test_no_frames_means_no_image(walk_take, film):
    take = walk_take.with_(video=film())
    assert "data:image/jpeg" in report(take)
    without = report(take.telling(images=False))
    assert "data:image/jpeg" not in without
    assert "data:image/png" not in without
