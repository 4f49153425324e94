"""People placed as in real videos, and keypoints as good detectors find them."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from golden.bodies import facing_camera  # noqa: E402
from pcnet3d.models.lab.synthetic import keypoint_noise  # noqa: E402
from pcnet3d.models.lab.synthetic.cameras import TYPICAL, ViewRange  # noqa: E402
from pcnet3d.models.lab.synthetic.on_device import cameras as t_cameras  # noqa: E402
from pcnet3d.models.lab.synthetic.on_device.draw import Draw  # noqa: E402
from pcnet3d.models.lab.synthetic.on_device.keypoint_noise import Spoilt, detect  # noqa: E402
from pcnet3d.models.lab.synthetic.places import PLACE_SPREAD, PLACES, SIZE_SPREAD  # noqa: E402
from pcnet3d.models.lab.training.lifter.windows import Material  # noqa: E402
from pcnet3d.pipeline import H36M17  # noqa: E402
from pcnet3d.pipeline.core.layouts import LIMBS  # noqa: E402

ROWS = np.array(PLACES)
FAR = H36M17.indices(keypoint_noise.FAR_JOINTS)
NEAR = H36M17.indices([f"{side}_{part}" for side in "lr" for part in ("shoulder", "hip", "knee", "elbow")])


def people(count, frames=9, walks_m=0.0):
    """(count, frames, 17, 3) somebody upright, +Z up, who walks so far along x."""
    body = facing_camera()[:, [0, 2, 1]] * [1, 1, -1]
    path = np.linspace(0, walks_m, frames)[:, None, None] * np.array([1.0, 0, 0])
    return torch.from_numpy(np.tile(body + path, (count, 1, 1, 1)).astype(np.float32))


def placed(world, share=1.0, views=None, step=0):
    return t_cameras.place(world, Draw(2, step), TYPICAL, views or ViewRange(), 0.5, share)


def rows_of(cameras, world):
    """(B, 4) what PLACES would say of the images."""
    pixels = cameras.project(cameras.to_camera(world))
    longer = cameras.image_size.amax(-1)[:, None, None, None]
    points = (pixels - cameras.image_size[:, None, None] / 2) / longer
    place, size = t_cameras.place_and_size(points[:, :, H36M17.indices(LIMBS)])
    aspect = cameras.image_size[:, 0] / cameras.image_size[:, 1]
    return np.column_stack([place.numpy(), size.numpy(), aspect.numpy()])


def off(rows):
    """(B, rows, 3) of each from each row of PLACES, mirrored or not: x, y, logarithm of the size; infinite where the
    images differ in shape."""
    x = np.abs(np.abs(rows[:, None, 0]) - np.abs(ROWS[:, 0]))
    y, size = np.abs(rows[:, None, 1] - ROWS[:, 1]), np.abs(np.log(rows[:, None, 2] / ROWS[:, 2]))
    same = np.abs(rows[:, None, 3] - ROWS[:, 3]) < 1e-3
    return np.where(same[..., None], np.stack([x, y, size], axis=-1), np.inf)


def test_place_and_size_of_people_are_those_of_the_table(monkeypatch):
    monkeypatch.setattr(t_cameras, "PLACE_SPREAD", 0.0)
    monkeypatch.setattr(t_cameras, "SIZE_SPREAD", 0.0)
    world = people(600)
    rows = rows_of(placed(world), world)
    fits = (off(rows) < [0.001, 0.001, 0.01]).all(-1)
    assert fits.any(1).mean() > 0.98  # the others do not fit into the image there
    assert fits.any(0).all()  # every row is drawn
    assert abs(np.sign(rows[:, 0]).mean()) < 0.15


def test_people_are_spread_about_the_table():
    world = people(600)
    apart = off(rows_of(placed(world), world))
    near = (apart < [2 * PLACE_SPREAD + 0.001, 2 * PLACE_SPREAD + 0.001, 2 * SIZE_SPREAD + 0.01]).all(-1)
    assert near.any(1).mean() > 0.98
    assert np.median(apart.max(-1).min(1)) > 0.005


@pytest.mark.parametrize("walks_m", [0.0, 3.0, 15.0])
def test_everybody_is_inside_the_image_however_far_they_walk(walks_m):
    world = people(200, walks_m=walks_m)
    cameras = placed(world)
    inside = cameras.to_camera(world)
    pixels = cameras.project(inside)
    assert bool((inside[..., 2] > 0.9).all())
    assert bool(((pixels >= -0.1) & (pixels <= cameras.image_size[:, None, None] + 0.1)).all())


def test_a_share_of_the_windows_is_placed_and_none_of_these_pans(monkeypatch):
    monkeypatch.setattr(t_cameras, "PLACE_SPREAD", 0.0)
    monkeypatch.setattr(t_cameras, "SIZE_SPREAD", 0.0)
    world = people(500, walks_m=0.5)
    cameras = placed(world, 0.4, ViewRange(pans=1.0))
    turns = (cameras.R_camera_from_world[:, -1] - cameras.R_camera_from_world[:, 0]).abs().amax((1, 2)) > 1e-6
    assert float(turns.float().mean()) == pytest.approx(0.6, abs=0.06)
    rows = rows_of(cameras, world)
    matches = (off(rows) < [0.02, 0.02, 0.1]).all(-1).any(1)
    assert matches[~turns.numpy()].mean() > 0.95
    assert matches[turns.numpy()].mean() < 0.3


def test_nothing_is_placed_by_default():
    world = people(50)
    plain = t_cameras.place(world, Draw(2, 0), TYPICAL, ViewRange(), 0.5)
    assert torch.equal(plain.position, placed(world, 0.0).position)
    assert Material().placed == Material().good == Material().slow == 0.0


def errors(spoilt):
    """(B, T, 17) how far keypoints of a standing person are off, of the box's longer side."""
    joints = np.broadcast_to(facing_camera() + np.array([0, 0, 4.0]), (600, 30, 17, 3)).astype(np.float32)
    pixels = torch.from_numpy(joints[..., :2] / joints[..., 2:] * 1000 + 500)
    found, _ = detect(pixels, torch.from_numpy(joints), Draw(0, 0), spoilt, 30.0)
    return (found - pixels).norm(dim=-1).numpy() / np.ptp(pixels[0, 0].numpy(), axis=0).max()


def test_a_good_detector_errs_by_a_hundredth_and_a_half_at_wrists_and_ankles_as_elsewhere():
    usual, good = errors(Spoilt()), errors(Spoilt(good=1.0))
    assert np.nanmean(good[..., FAR]) == pytest.approx(0.015, rel=0.05)
    assert np.nanmean(good[..., NEAR]) == pytest.approx(0.015, rel=0.05)
    assert np.nanmean(usual[..., FAR]) > 0.025
    assert (good > 0.1).mean() < 0.6 * (usual > 0.1).mean()  # outliers
    assert np.isnan(good).mean() < 0.6 * np.isnan(usual).mean()  # gaps


def test_a_share_of_the_detectors_is_good():
    each = np.nanmean(errors(Spoilt(good=0.3))[..., FAR], axis=(1, 2))
    between = (0.015 + np.nanmean(errors(Spoilt())[..., FAR])) / 2
    assert (each < between).mean() == pytest.approx(0.3, abs=0.06)
