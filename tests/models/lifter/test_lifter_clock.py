"""Frame rates and holes that the lifter's network was not trained on."""

from functools import cache

import numpy as np
import pytest

from golden.lifts import lift
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.metrics import joint_error
from pcnet3d.models.lab.common.metrics import scaled
from pcnet3d.models.lifter.clock import clock_of
from pcnet3d.models.lifter.live import LiveLifter
from pcnet3d.pipeline import H36M17, IMAGE, PoseSequence
from pcnet3d.pipeline.core.rotations import is_finite
from refusals import refused

SECONDS = 6.0


@cache
def seen(fps):
    """The walker's keypoints with a pixel or two of error that changes within 0.2 s, the camera, and the truth."""
    walk = walker(fps=fps, seconds=SECONDS)
    camera = side_camera(walk)
    exact = camera.project(walk.world)
    moments = np.arange(0, SECONDS + 0.2, 0.2)
    error = np.random.default_rng(0).normal(0, 1.5, (len(moments), 17 * 2))
    error = np.stack([np.interp(walk.time_s, moments, each) for each in error.T], axis=-1).reshape(
        exact.shape
    )
    frames = np.arange(len(walk.time_s))
    score = np.full(exact.shape[:2], 0.9)
    keypoints = PoseSequence(
        exact + error, H36M17, IMAGE, confidence=score, time_s=walk.time_s, frame_index=frames
    )
    return keypoints, camera, camera_poses(walk, camera).joints.astype(np.float64)


def size(camera):
    return camera.width, camera.height


def mpjpe(keypoints, camera, truth):
    """mm, one scale for the take; and of the motion from frame to frame, mm a second."""
    lifted = lift(keypoints, size(camera), camera.focal_px).joints.astype(np.float64)
    off = scaled(lifted, truth, "take") - truth
    speed = np.linalg.norm(np.diff(off, axis=0), axis=-1).mean() * keypoints.fps
    return 1000 * joint_error(off, 0 * off).mean(), 1000 * speed


def some(keypoints, rows):
    return PoseSequence(
        keypoints.joints[rows],
        H36M17,
        IMAGE,
        confidence=keypoints.confidence[rows],
        time_s=keypoints.time_s[rows],
        frame_index=keypoints.frame_index[rows],
    )


@pytest.fixture(scope="module")
def usual() -> tuple[float, float]:
    """Both at thirty frames a second."""
    return mpjpe(*seen(30))


@pytest.mark.parametrize("fps", [2, 10, 24, 50, 60, 240])
def test_any_frame_rate_is_lifted_about_as_well_as_thirty(fps, usual):
    error, speed = mpjpe(*seen(fps))
    assert error < 1.3 * usual[0]
    assert speed < 1.6 * usual[1]


def test_an_odd_row_among_every_third_changes_nothing_much():
    keypoints, camera, truth = seen(60)
    every = np.arange(0, len(keypoints), 3)
    odd = np.append(every, every[-1] + 1)
    regular, _ = mpjpe(some(keypoints, every), camera, truth[every])
    with_odd, _ = mpjpe(some(keypoints, odd), camera, truth[odd])
    assert with_odd < 1.1 * regular


@pytest.mark.parametrize("what", ["joints", "rows"])
def test_what_is_missing_here_and_there_costs_hardly_anything(what, usual):
    keypoints, camera, truth = seen(30)
    lost = np.random.default_rng(3).uniform(size=keypoints.joints.shape[: 2 if what == "joints" else 1]) < 0.3
    pixels = keypoints.joints.copy()
    pixels[lost] = np.nan
    error, speed = mpjpe(keypoints.with_(joints=pixels), camera, truth)
    assert error < 1.05 * usual[0]
    assert speed < 1.15 * usual[1]


def test_joints_on_a_line_are_counted_and_longer_gaps_are_left_to_the_network():
    keypoints, camera, _ = seen(30)
    pixels = keypoints.joints.copy()
    pixels[10:14, 3] = np.nan
    pixels[20:50, 5] = np.nan
    pixels[:4, 6] = np.nan  # before it was first seen
    said = lift(keypoints.with_(joints=pixels), size(camera)).history[-1].options
    assert said["joints_on_a_line"] == 4


def test_a_line_goes_from_sighting_to_sighting():
    pixels = np.full((9, 2, 2), np.nan)
    pixels[[0, 4, 8], 0] = [[0, 0], [4, 40], [8, 0]]
    pixels[3, 1] = 7.0
    score = np.where(is_finite(pixels), 0.5, 0.0)
    score[0, 0] = 0.3
    filled, confidence = clock_of(30.0).rows(pixels, score)
    np.testing.assert_allclose(filled[:, 0, 0], np.arange(9))
    np.testing.assert_allclose(filled[:, 0, 1], [0, 10, 20, 30, 40, 30, 20, 10, 0])
    np.testing.assert_allclose(confidence[:, 0], [0.3, 0.3, 0.3, 0.3, 0.5, 0.5, 0.5, 0.5, 0.5])
    np.testing.assert_array_equal(np.isfinite(filled[:, 1, 0]), np.arange(9) == 3)


@pytest.mark.parametrize("fps", [10, 40])
def test_live_is_the_last_of_a_lift_of_all_so_far_at_any_rate(fps):
    keypoints, camera, _ = seen(fps)
    live = LiveLifter(H36M17, size(camera))
    rows = min(len(keypoints), 90)
    answers = [
        live.update(keypoints.joints[i], keypoints.confidence[i], keypoints.time_s[i]) for i in range(rows)
    ]
    for last in (7, rows // 2, rows - 1):
        whole = lift(keypoints.rows(0, last + 1), size(camera)).joints[-1]
        np.testing.assert_allclose(answers[last], whole, atol=2e-5)


@pytest.mark.parametrize(("fps", "rows"), [(10, 6), (30, 16), (240, 121)])
def test_half_a_second_without_anybody_is_missing_at_any_rate(fps, rows):
    keypoints, camera, _ = seen(fps)
    for count, missing in ((rows, rows), (rows - 1, 0)):
        pixels = keypoints.joints.copy()
        pixels[8 : 8 + count] = np.nan
        lifted = lift(keypoints.with_(joints=pixels), size(camera)).joints
        assert np.isnan(lifted).all(axis=(1, 2)).sum() == missing


def test_who_crosses_the_image_at_two_frames_a_second_is_one_person():
    keypoints, camera, _ = seen(2)
    pixels = keypoints.joints.astype(np.float64)
    pixels += np.arange(len(pixels))[:, None, None] * [1.2 * np.ptp(pixels, axis=1).max(), 0.0]
    wide = int(pixels.max()) + 50, camera.height
    assert np.isfinite(lift(keypoints.with_(joints=pixels), wide).joints).all()
    with refused("people-mixed"):
        lift(keypoints.with_(joints=pixels, time_s=keypoints.time_s / 15), wide)


def paused(keypoints, at, pause_s):
    """The same frames by their numbers, with a pause before one that the time stamps alone tell."""
    return keypoints.with_(time_s=keypoints.time_s + pause_s * (np.arange(len(keypoints)) >= at))


@pytest.mark.parametrize("pause_s", [8.0, 100.0, 36000.0])
def test_what_lies_behind_a_hole_in_the_recording_has_no_say(pause_s):
    """A pause of 100 s made 30 frames a second 2, and all of them were lifted 14 times slower."""
    keypoints, camera, _ = seen(30)
    other = keypoints.with_(joints=np.concatenate([keypoints.joints[:60], keypoints.joints[:59:-1]]))
    one, two = (lift(paused(each, 60, pause_s), size(camera)).joints for each in (keypoints, other))
    np.testing.assert_allclose(one[:60], two[:60], atol=1e-6)
    alone = lift(keypoints.rows(60, 180), size(camera)).joints
    assert (
        np.abs(one[60:] - alone)[30:].mean() < 0.002
    )  # near its edge a take is lifted otherwise than near a hole


def test_images_that_were_dropped_are_missing_rows():
    keypoints, camera, _ = seen(30)
    there = np.delete(np.arange(len(keypoints)), np.arange(60, 68))
    numbered = lift(some(keypoints, there), size(camera))
    counted = some(keypoints, there).with_(
        frame_index=np.arange(len(there))
    )  # as a video's own stamps tell it
    np.testing.assert_allclose(lift(counted, size(camera)).joints, numbered.joints, atol=1e-6)


def test_half_a_second_without_anybody_is_half_a_second_beside_a_hole():
    keypoints, camera, _ = seen(30)
    pixels = keypoints.joints.copy()
    pixels[30:34] = np.nan
    lifted = lift(paused(keypoints.with_(joints=pixels), 90, 100.0), size(camera))
    assert lifted.history[-1].options["frames_without_joints"] == 0
    pixels[88:92] = np.nan  # on both sides of the pause: not to be bridged
    lifted = lift(paused(keypoints.with_(joints=pixels), 90, 100.0), size(camera))
    assert not is_finite(lifted.joints[88:92]).any()


@pytest.mark.parametrize("fps", [30, 120, 240, 1000])
def test_a_few_rows_of_any_rate_are_lifted(fps):
    """Three rows at 240 frames a second are of three takes; the fourth, without a row, ended in a traceback."""
    for rows in [1, 2, 3, 5]:
        keypoints, camera, _ = seen(30)
        short = keypoints.rows(0, rows).with_(time_s=np.arange(rows) / fps)
        assert is_finite(lift(short, size(camera)).joints).all()


def test_live_is_not_for_ever_misled_by_a_burst():
    """Two images a millisecond apart made every later one look like one behind a hole."""
    keypoints, camera, _ = seen(30)
    burst = LiveLifter(H36M17, size(camera))
    for i in range(120):
        late = keypoints.time_s[i] if i > 3 else keypoints.time_s[3] - 0.001 * (3 - i)
        answer = burst.update(keypoints.joints[i], keypoints.confidence[i], late)
    np.testing.assert_allclose(answer, lift(keypoints.rows(0, 120), size(camera)).joints[-1], atol=2e-5)


@pytest.mark.parametrize("pause_s", [1.0, 20.0, 600.0])
def test_live_sees_the_hole_too(pause_s):
    """The rows of a pause of more than 5 s lay so far apart that the stream went on at 7 or less than one a second."""
    keypoints, camera, _ = seen(30)
    live = LiveLifter(H36M17, size(camera))
    late = paused(keypoints, 20, pause_s)
    for i in range(30):
        answer = live.update(late.joints[i], late.confidence[i], late.time_s[i])
    np.testing.assert_allclose(answer, lift(late.rows(0, 30), size(camera)).joints[-1], atol=2e-5)
