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
from pcnet3d.stages.report.pictures import jpeg, keypoints_at
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


def test_points_that_were_not_seen_are_not_drawn():
    poses = PoseSequence(np.zeros((2, 17, 3)), H36M17, CAMERA, time_s=np.arange(2) / 30)
    sure = np.full((2, 17), 0.8)
    sure[1, :3] = 0.1, 0.2, np.nan
    pixels = np.arange(2 * 17 * 2, dtype=np.float32).reshape(2, 17, 2)
    seen = PoseSequence(pixels, COCO17, IMAGE, confidence=sure, time_s=np.arange(2) / 30)
    points, layout = keypoints_at(Take("t", poses=poses, keypoints=seen), 1)
    assert layout is COCO17
    assert np.isnan(points[:2]).all()
    np.testing.assert_array_equal(points[2:], pixels[1, 2:])
    assert np.isnan(keypoints_at(Take("t", poses=poses, keypoints=seen), 7)[0]).all()


def picture(*asked) -> np.ndarray:
    """(H, W, 3) the picture that `jpeg` makes, in BGR."""
    return cv2.imdecode(np.frombuffer(jpeg(*asked), np.uint8), cv2.IMREAD_COLOR)


def test_keypoints_are_drawn_where_they_are():
    """A right leg along a diagonal of a grey shown: its colour is on the line, and nowhere far from it."""
    image = np.full((200, 300, 3), 128, np.uint8)
    keypoints = np.full((17, 2), np.nan)
    keypoints[H36M17.indices(("r_hip", "r_knee"))] = [[100, 40], [180, 120]]
    shown = picture(image, keypoints, H36M17, keypoints).astype(int)
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


@pytest.mark.parametrize(
    "points", [np.full((17, 2), np.nan), np.full((17, 2), -50.0), np.full((17, 2), 5000.0)]
)
def test_without_a_person_in_it_the_whole_image_is_shown(points):
    image = np.zeros((90, 160, 3), np.uint8)
    shown = picture(image, points, H36M17, points)
    assert shown.shape[1] == 280
    assert shown.shape[0] == pytest.approx(280 * 90 / 160, abs=1)


def test_no_frames_means_no_image(walk_take, film):
    take = walk_take.with_(video=film())
    assert "data:image/jpeg" in report(take)
    without = report(take.telling(images=False))
    assert "data:image/jpeg" not in without
    assert "data:image/png" not in without


def test_points_of_which_the_detector_is_unsure_are_not_drawn():
    """Legs were drawn over a banner that hid them."""
    poses = PoseSequence(np.zeros((30, 17, 3)), H36M17, CAMERA, time_s=np.arange(30) / 30)
    sure = np.full((30, 17), 0.8)
    sure[10:, COCO17.index("r_knee")] = 0.4
    pixels = np.ones((30, 17, 2), dtype=np.float32)
    seen = PoseSequence(pixels, COCO17, IMAGE, confidence=sure, time_s=np.arange(30) / 30)
    seen = seen.with_(made_by=MadeBy("estimated", "movenet@0"))
    for frame, drawn in ((2, True), (20, False)):
        points, _ = keypoints_at(Take("t", poses=poses, keypoints=seen), frame)
        assert np.isfinite(points).all() == drawn
        assert np.isfinite(np.delete(points, COCO17.index("r_knee"), axis=0)).all()


def test_a_picture_shows_the_whole_person_where_the_detector_is_unsure_of_the_limbs():
    """Of a man with his arms over his head it showed the trunk alone, for the other joints are not drawn."""
    every = np.array([(100, y) for y in np.linspace(20, 180, 17)])
    trunk = np.where(np.abs(every - (100, 100)).max(axis=1, keepdims=True) < 30, every, np.nan)
    image = np.zeros((200, 200, 3), np.uint8)
    image[20:24, 40:44] = 255  # beside the highest joint
    whole, part = (picture(image, trunk, COCO17, around) for around in (every, trunk))
    assert whole[:, :90].max() > 200
    assert part[:, :90].max() < 50
