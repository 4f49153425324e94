"""Poses and keypoints of the same frames belong together; those of others are told, with the frames that would."""

import warnings

import numpy as np
import pytest

from pcnet3d.adapters import read
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.core.frames import CAMERA, IMAGE
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.pose import PoseSequence
from pcnet3d.pipeline.reading.together import together

WALK = walker(seconds=8.0)
FILMED = side_camera(WALK)
SIZE = (FILMED.width, FILMED.height)
INSIDE = FILMED.points(WALK.world)
BODY = INSIDE - INSIDE[:, :1]
PIXELS = FILMED.project(WALK.world) + np.random.default_rng(0).normal(0, 1.5, (len(WALK), 17, 2))


def poses(joints=BODY) -> PoseSequence:
    return PoseSequence(joints, H36M17, CAMERA.with_(origin="pelvis"), time_s=np.arange(len(joints)) / 30)


def keypoints(pixels=PIXELS, rows=None) -> PoseSequence:
    return PoseSequence(pixels, H36M17, IMAGE, np.full(pixels.shape[:2], 0.9), frame_index=rows)


@pytest.mark.parametrize("size", [SIZE, None])
@pytest.mark.parametrize("focal_px", [FILMED.focal_px, None])
def test_those_of_the_same_frames_belong_together(size, focal_px):
    assert together(poses(), keypoints(), size, focal_px) is None


@pytest.mark.parametrize("late", [-5, 3, 8])
def test_a_shift_is_told(late):
    said = together(
        poses().with_(frame_index=np.arange(20, 20 + len(BODY)), frames_known=True),
        keypoints(rows=np.arange(20, 20 + len(PIXELS)) + late),
        SIZE,
    )
    assert said.code == "keypoints-not-of-poses"
    assert f"; {abs(late)} frames {'later' if late > 0 else 'earlier'} they fit" in said.values["how"]


@pytest.mark.parametrize("rate", [25 / 30, 24 / 25, 60 / 50])
def test_another_rate_is_told_with_the_one_that_fits(rate):
    """Poses of the whole video, keypoints of the same seconds at so many times its rate."""
    rows = np.arange(0, len(PIXELS) - 1, 1 / rate)
    made = np.stack(
        [np.interp(rows, np.arange(len(PIXELS)), of) for of in PIXELS.reshape(len(PIXELS), -1).T], -1
    )
    said = together(poses(), keypoints(made.reshape(-1, 17, 2)), SIZE, FILMED.focal_px)
    assert f"; with numbers that grow {rate:.3g} times as fast they fit" in said.values["how"]


def test_another_persons_are_told():
    other = side_camera(WALK).project(walker(seconds=8.0, heading_deg=150).world)
    assert together(poses(), keypoints(other), SIZE).values["how"] == ""


def wandering(shape: tuple[int, ...], by: float, seed: int) -> np.ndarray:
    """Errors that last for some rows, as those of detectors and lifters."""
    noise = np.random.default_rng(seed).normal(0, by, shape)
    for row in range(1, len(noise)):
        noise[row] = 0.8 * noise[row - 1] + 0.6 * noise[row]
    return noise


def test_a_numbering_that_fits_some_of_a_short_take_by_chance_is_not_told():
    """Takes of a second, of kicks and squats, "fit with numbers that grow 0.96 times as fast"."""
    for seed in range(20):
        slowly = np.linspace(4 * seed, 4 * seed + 9, 36).round().astype(int)
        lifted = poses(BODY[slowly] + wandering(BODY[slowly].shape, 0.03, seed))
        seen = keypoints(PIXELS[slowly] + wandering(PIXELS[slowly].shape, 3.0, seed + 99))
        said = together(lifted, seen, SIZE)
        assert said is None or said.values["how"] == ""


def test_poses_that_are_off_but_move_with_their_keypoints_are_theirs():
    assert together(poses(BODY + wandering(BODY.shape, 0.15, 0)), keypoints(), SIZE) is None


def test_what_is_missing_is_no_fault():
    pixels = PIXELS.copy()
    pixels[:, H36M17.index("l_ankle")] = np.nan
    pixels[50:60] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert together(poses(), keypoints(pixels), SIZE, FILMED.focal_px) is None
        assert together(poses(), keypoints(np.full_like(PIXELS, np.nan)), SIZE) is None
        assert together(poses(BODY[:10]), keypoints(PIXELS[:10]), SIZE) is None
        apart = np.arange(1000, 1000 + len(PIXELS))
        assert together(poses(), keypoints(rows=apart), SIZE) is None


@pytest.mark.data("native")
def test_a_real_lift_belongs_to_the_keypoints_that_it_was_lifted_from(data):
    folder = data / "native" / "motionbert"
    track = read(folder / "boxing_alphapose-results.json")
    lifted = read(folder / "boxing_X3D.npy").with_(frame_index=track.frame_index, frames_known=True)
    assert together(lifted, track, None) is None
