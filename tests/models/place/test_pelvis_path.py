"""The pelvis's path before a camera: known answers on the walker, whose path and camera are known exactly."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.models.place.path import covariances, pelvis_path, smoothed
from pcnet3d.pipeline import H36M17, IMAGE, InputError, PoseSequence
from pcnet3d.pipeline.core.camera import Background, Camera
from pcnet3d.pipeline.core.frames import GL_CAMERA
from pcnet3d.pipeline.core.intrinsics import Intrinsics
from pcnet3d.pipeline.core.rotations import is_finite

SIZE = (1280, 720)
FOCAL = 900.0
LENS = Camera(SIZE, FOCAL, 0.0, "told")


@pytest.fixture(scope="module")
def body(walk):
    return camera_poses(walk, camera_of(walk))


@pytest.fixture(scope="module")
def points(walk):
    """(T, 17, 3) metres from the camera."""
    return camera_of(walk).points(walk.world)


def camera_of(walk):
    return aimed(walk.root.mean(axis=0), 6, heading_deg=60, pitch_deg=10, roll_deg=3)


def seen(body, points, noise_px=0.0) -> PoseSequence:
    pixels = FOCAL * points[..., :2] / points[..., 2:] + np.array(SIZE) / 2
    pixels = pixels + np.random.default_rng(0).normal(0, 1, pixels.shape) * noise_px
    return PoseSequence(pixels, H36M17, IMAGE, time_s=body.time_s, frame_index=body.frame_index)


@pytest.fixture(scope="module")
def noisy(body, points):
    """Keypoints with 2 pixels of noise, and their path."""
    keypoints = seen(body, points, 2.0)
    return keypoints, pelvis_path(body, keypoints, LENS)


def off(path, points) -> np.ndarray:
    return np.linalg.norm(path.root - points[:, 0], axis=1)


def test_exact_keypoints_and_an_exact_body_give_the_exact_path(body, points):
    path = pelvis_path(body, seen(body, points), LENS)
    assert off(path, points).max() < 0.01
    assert (path.growth == 1).all()


def test_a_body_in_another_unit_gives_the_path_in_that_unit(body, noisy):
    keypoints, path = noisy
    halved = body.with_(joints=body.joints / 2, frame=body.frame.with_(unit="arbitrary"))
    half = pelvis_path(halved, keypoints, LENS)
    np.testing.assert_allclose(half.root, path.root / 2, rtol=1e-4)
    np.testing.assert_allclose(half.covariance, path.covariance / 4, rtol=1e-3)


def test_a_camera_that_shakes_makes_each_frame_less_certain_across_the_view(body, points):
    """A hand's tremble of two degrees cost the place and all jumps."""
    shake = np.random.default_rng(4).uniform(-15, 15, (len(points), 1, 2))
    shaken = seen(body, points)
    shaken = shaken.with_(joints=shaken.joints + shake)
    reach = float(np.hypot(*np.ptp(shake, axis=0)[0])) / SIZE[0]
    calm = pelvis_path(body, shaken, LENS)
    path = pelvis_path(body, shaken, replace(LENS, background=Background("hand-held", 0.1, reach)))
    sd, calm_sd = (np.sqrt(np.diagonal(each.own, axis1=1, axis2=2)) for each in (path, calm))
    np.testing.assert_allclose(sd[:, 2], calm_sd[:, 2])
    held = np.abs(path.root - points[:, 0])[:, :2] < 1.645 * sd[:, :2]
    assert held.mean() > 0.9 > (np.abs(calm.root - points[:, 0])[:, :2] < 1.645 * calm_sd[:, :2]).mean()


def test_hidden_joints_and_outliers_hardly_move_it(body, points, noisy):
    (given, whole), rng = noisy, np.random.default_rng(1)
    joints = given.joints.copy()
    joints[rng.uniform(size=joints.shape[:2]) < 0.3] = np.nan
    wild = rng.uniform(size=joints.shape[:2]) < 0.05
    joints[wild] += rng.choice([-1, 1], (wild.sum(), 2)) * 150
    keypoints = seen(body, points).with_(joints=joints)
    assert np.median(off(pelvis_path(body, keypoints, LENS), points)) < 0.05
    # Legs out of the image for the whole take: the trunk and the arms tell as well, with a larger error.
    legs = H36M17.indices([f"{side}_{part}" for side in "rl" for part in ("knee", "ankle")])
    joints = given.joints.copy()
    joints[:, legs] = np.nan
    cut = pelvis_path(body, given.with_(joints=joints), LENS)
    assert np.median(off(cut, points)) < 0.1
    assert np.median(np.trace(cut.own, axis1=1, axis2=2)) > np.median(np.trace(whole.own, axis1=1, axis2=2))


def test_frames_of_somebody_else_do_not_pull_it(body, points):
    keypoints = seen(body, points, 2.0)
    others = points.copy()
    others[60:65] += [1.5, 0, 2.0]
    path = pelvis_path(body, keypoints.with_(joints=seen(body, others, 2.0).joints), LENS)
    assert off(path, points)[55:70].max() < 0.25  # of 2.5 m


def test_a_short_gap_is_bridged_with_a_growing_error_and_a_long_one_is_left(body, noisy):
    keypoints, whole = noisy

    def gapped(rows):
        joints = keypoints.joints.copy()
        joints[rows] = np.nan
        return pelvis_path(body, keypoints.with_(joints=joints), LENS)

    short = gapped(slice(60, 75))
    assert is_finite(short.root).all()
    size = np.trace(short.own, axis1=1, axis2=2) / np.trace(whole.own, axis1=1, axis2=2)
    assert size[67] > 2 * size[20]
    assert size[67] > size[61]
    long = gapped(slice(30, 150))
    assert np.isnan(long.root[90]).all()
    assert np.isnan(long.covariance[90]).all()
    assert is_finite(long.root[[10, 170]]).all()


def test_a_wrong_focal_length_stretches_the_depth_as_stated(body, points):
    path = pelvis_path(body, seen(body, points), Camera(SIZE, 1.1 * FOCAL, 0.1 * FOCAL, "prior"))
    np.testing.assert_allclose(path.root[:, 2], 1.1 * points[:, 0, 2], rtol=0.03)
    assert np.abs(path.root[:, :2] - points[:, 0, :2]).max() < 0.1
    assert (np.abs(path.root - points[:, 0])[:, 2] < 2 * np.sqrt(path.covariance[:, 2, 2])).all()


def test_a_wide_lens_hides_nobody_at_the_border_of_its_image(body, points):
    """Without its distortion a point near the border lies far outside a picture of the same size."""
    lens = Intrinsics((FOCAL, FOCAL), (640.0, 360.0), (-0.27, 0.04, 0.0, 0.0), image_size=SIZE)
    aside = points.copy()
    aside[..., 0] += 0.74 * points[:, :1, 2] - points[:, :1, 0]
    pixels, _ = cv2.projectPoints(
        aside.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), lens.matrix, np.array(lens.distortion)
    )
    filmed = pixels.reshape(*points.shape[:2], 2)
    there = (filmed[..., 0] < SIZE[0] - 3).all(axis=1)
    assert there.mean() > 0.5
    assert (FOCAL * aside[there][..., 0] / aside[there][..., 2] + 640 > SIZE[0]).mean() > 0.3
    path = pelvis_path(
        body, seen(body, points).with_(joints=filmed), Camera(SIZE, FOCAL, 0.0, "told", intrinsics=lens)
    )
    assert np.median(off(path, aside)[there]) < 0.03


def test_a_body_that_follows_its_image_is_brought_to_one_size(body, points):
    near = np.median(points[:, 0, 2]) / points[:, 0, 2]
    assert np.ptp(near) > 0.15
    path = pelvis_path(body.with_(joints=body.joints * near[:, None, None]), seen(body, points), LENS)
    np.testing.assert_allclose(path.growth, near, atol=0.03)
    assert np.median(off(path, points)) < 0.1


def test_rows_belong_together_by_their_frames(body, points):
    keypoints = seen(body, points)
    rows = np.arange(30, 150)
    part = keypoints.with_(
        joints=keypoints.joints[rows], confidence=None, time_s=keypoints.times[rows], frame_index=rows
    )
    path = pelvis_path(body, part, LENS)
    assert off(path, points)[rows].max() < 0.01


def test_nobody_is_nowhere(body, points):
    nothing = seen(body, points).with_(joints=np.full((len(body), 17, 2), np.nan))
    assert pelvis_path(body, nothing, LENS) is None
    with pytest.raises(InputError, match="CAMERA"):
        pelvis_path(body.with_(frame=GL_CAMERA), nothing, LENS)


def test_a_smoothed_path_is_as_wrong_as_it_says():
    """Drawn from the smoother's own model: white acceleration, noise of a known covariance."""
    rng = np.random.default_rng(2)
    jolt, frames, step = 0.5, 4000, 1 / 30
    velocity = np.cumsum(rng.normal(0, np.sqrt(jolt * step), (frames, 3)), axis=0)
    truth = np.cumsum(velocity * step, axis=0)
    root = rng.normal(size=(frames, 3, 3)) * [0.02, 0.02, 0.2]
    noise = np.einsum("tij,tkj->tik", root, root) + 1e-4 * np.eye(3)
    drawn = truth + np.einsum("tij,tj->ti", np.linalg.cholesky(noise), rng.normal(size=(frames, 3)))
    information = np.linalg.inv(noise)
    information[1000:1030] = 0
    path, factor = smoothed(drawn, information, np.arange(frames) * step, jolt)
    sd = np.sqrt(np.diagonal(covariances(factor), axis1=1, axis2=2))
    inside = np.abs(path - truth) < 1.645 * sd
    assert 0.86 < inside.mean() < 0.94
    assert (np.abs(path - truth)[1000:1030] < 4 * sd[1000:1030]).all()
    assert sd[1015].min() > 3 * np.median(sd)


@pytest.mark.parametrize("seen", [[0, 1], [0, -1], [9000, 9001, 9002]])
def test_gaps_of_any_length_are_solved(seen):
    frames = 20_000
    places, information = np.full((frames, 3), np.nan), np.zeros((frames, 3, 3))
    places[seen], information[seen] = [1.0, 2.0, 5.0], 100 * np.eye(3)
    path, factor = smoothed(places, information, np.arange(frames) / 240, 0.2)
    np.testing.assert_allclose(path[seen], places[seen], atol=0.01)
    sd = np.sqrt(np.diagonal(covariances(factor), axis1=1, axis2=2))
    assert sd[seen].max() < 0.11
    assert sd[4000].min() > 1
