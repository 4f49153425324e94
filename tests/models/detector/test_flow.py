import numpy as np
import pytest

from pcnet3d.models.detector.flow import Way, flow_notice, flow_of, pairs_of
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.pose import PoseSequence

FRAMES, SIDE = 60, 240


@pytest.fixture(scope="module")
def film():
    """{frame: image} of blobs that swing about, and where they are (T, 17, 2)."""
    rng = np.random.default_rng(0)
    t = np.arange(FRAMES)[:, None]
    home = np.stack(np.meshgrid(np.linspace(40, 200, 5), np.linspace(40, 200, 4)), -1).reshape(-1, 2)[:17]
    phase, rate = rng.uniform(0, 6, (2, 17)), rng.uniform(0.25, 0.45, (2, 17))
    moved = np.stack([12 * np.sin(rate[i] * t + phase[i]) for i in range(2)], axis=-1)
    at = home + moved
    y, x = np.mgrid[:SIDE, :SIDE]
    texture = rng.uniform(0, 120, (17, 9, 9))
    images = {}
    for frame in range(FRAMES):
        image = np.full((SIDE, SIDE), 90.0)
        for joint in range(17):
            far = np.hypot(x - at[frame, joint, 0], y - at[frame, joint, 1])
            image += (130 + texture[joint, 0, 0]) * np.exp(-((far / 7) ** 2)) * (1 if joint % 2 else -0.6)
        images[frame] = np.clip(image, 0, 255).astype(np.uint8)
    return images, at


def made_at(rate):
    """Keypoints of the same seconds at a rate so many times the video's."""
    return lambda at: np.stack(
        [
            np.interp(np.arange(FRAMES * rate - 1) / rate, np.arange(FRAMES), of)
            for of in at.reshape(FRAMES, -1).T
        ],
        -1,
    ).reshape(-1, 17, 2)


def said(film, points):
    images, _ = film
    keypoints = PoseSequence(points, COCO17, IMAGE, frame_index=np.arange(len(points)))
    return flow_notice(flow_of(images, pairs_of(0, FRAMES - 1, 30.0), keypoints, SIDE))


def test_of_keypoints_that_move_as_the_video_and_of_who_stands_still_nothing_is_said(film):
    assert said(film, film[1]) is None
    assert said(film, np.repeat(film[1][:1], FRAMES, axis=0)) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda at: at[::-1],
        lambda at: np.stack([SIDE - 1 - at[..., 0], at[..., 1]], -1),
        lambda at: np.roll(at, 3, axis=0),
        lambda at: at[np.arange(FRAMES) // 2],
        made_at(25 / 30),
    ],
)
def test_those_of_another_are_told(film, change):
    assert said(film, change(film[1])).code == "keypoints-not-of-video"


def test_where_there_are_key_frames_only_frames_behind_them_are_looked_at():
    pairs = pairs_of(0, 299, 30.0, range(0, 300, 50))
    assert {start // 50 for start, _ in pairs} == set(range(6))
    assert max(end % 50 for _, end in pairs) < 10
    assert len(pairs) >= len(pairs_of(0, 299, 30.0))


def left_out(*rows):
    return lambda at: np.delete(at, rows, axis=0)


@pytest.mark.parametrize(
    ("change", "way"),
    [
        (made_at(25 / 30), Way(0, 25 / 30)),
        (made_at(24 / 30), Way(0, 24 / 30)),
        (left_out(*range(9, FRAMES, 10)), Way(0, 0.9)),
        (left_out(*range(30, 35)), Way(-5, 1.0, 30)),
    ],
)
def test_a_lag_that_grows_or_begins_is_told_with_what_fits(film, change, way):
    """Keypoints of 25 frames a second beside the video of 30: a cadence of 115 for 97, and no word."""
    images, at = film
    keypoints = PoseSequence(change(at), COCO17, IMAGE)
    flow = flow_of(images, pairs_of(0, len(keypoints) - 1, 30.0), keypoints, SIDE)
    assert flow_notice(flow).code == "keypoints-not-of-video"
    assert flow.way.lag == pytest.approx(way.lag, abs=1)
    assert flow.way.rate == pytest.approx(way.rate, abs=0.03)
    assert (flow.way.since is None) == (way.since is None)


def test_a_part_that_is_numbered_from_0_is_told_with_the_shift_that_fits(film):
    images, at = film
    part = PoseSequence(at[25:50], COCO17, IMAGE)
    pairs = pairs_of(0, FRAMES - 1, 30.0)
    flow = flow_of(images, pairs, part, SIDE, range(-FRAMES, len(part)))
    assert flow.way.lag == -25
    assert "25 frames earlier" in flow.how
    other = PoseSequence(at[25:50][::-1] + np.random.default_rng(1).normal(0, 3, (25, 17, 2)), COCO17, IMAGE)
    assert not getattr(flow_of(images, pairs, other, SIDE, range(-FRAMES, 25)), "how", "")
