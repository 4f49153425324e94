"""Virtual cameras: the truth that they state is the truth; people placed as in real videos."""

import numpy as np
import pytest
import torch

from golden.bodies import facing_camera
from pcnet3d.models.lab.synthetic import cameras as module
from pcnet3d.models.lab.synthetic.cameras import TYPICAL, WILD, Cameras, ViewRange, place
from pcnet3d.models.lab.synthetic.draw import Draw, NumpyDraw
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.camera import view_rotation
from pcnet3d.pipeline.core.layouts import LIMBS

# Where people are in real videos, mirrored to one side: x, y, logarithm of the size, aspect.
ROWS = np.array([[abs(x), y, np.log(size), aspect] for x, y, size, aspect in module.PLACES])


@pytest.fixture
def draw(rng):
    return NumpyDraw(rng)


@pytest.fixture
def windows(rng):
    """(40, 25, 17, 3): people of scattered joints that wander over metres."""
    person = rng.uniform([-0.4, -0.4, 0], [0.4, 0.4, 1.8], (40, 1, 17, 3))
    return torch.from_numpy(person + np.cumsum(rng.normal(0, 0.05, (40, 25, 1, 3)), axis=1))


def test_people_stand_anywhere_inside_the_image(windows, draw):
    cameras = place(windows, draw)
    joints = cameras.to_camera(windows)
    pixels, size = cameras.project(joints), cameras.image_size[:, None, None]
    assert bool((joints[..., 2] > 0.9).all() and ((pixels >= 0) & (pixels <= size)).all())
    where = pixels.mean(dim=(1, 2)) / cameras.image_size
    assert bool((where.std(dim=0) > 0.1).all())


def test_ranges_are_kept(windows, draw):
    many = windows.repeat_interleave(10, 0)
    for views, (low, high), most in ((WILD, (-30, 45), 10.01), (TYPICAL, (-5, 25), 5.01)):
        cameras = place(many, draw, views)
        right, away = (cameras.R_camera_from_world[:, 0, row].numpy() for row in (0, 2))
        pitch = np.degrees(np.arcsin(-away[:, 2]))
        assert low <= pitch.min() < low + 5
        assert high - 5 < pitch.max() <= high
        assert np.abs(np.degrees(np.arcsin(right[:, 2] / np.cos(np.radians(pitch))))).max() <= most
        assert np.abs(np.exp(1j * np.arctan2(away[:, 1], away[:, 0])).mean()) < 0.15  # all around
        ratio = (cameras.focal_px / cameras.image_size.amax(-1)).numpy()
        assert views.focal[0] <= ratio.min() < ratio.max() <= views.focal[1]


def test_a_camera_one_metre_away_sees_half_a_metre_as_half_the_focal_length():
    R = view_rotation(np.array(90.0), np.array(0.0), np.array(0.0))[None, None]
    of = (R, np.zeros((1, 3)), np.array([1000.0]), np.array([[640.0, 480.0]]))
    camera = Cameras(*map(torch.from_numpy, of))
    # Looking along +y: +x of the world is to the right and +z of the world is up, so smaller in pixels.
    points = torch.tensor([[[[0.5, 1.0, 0.0], [0.0, 1.0, 0.5]]]], dtype=torch.float64)
    pixels = camera.project(camera.to_camera(points))
    np.testing.assert_allclose(pixels[0], [[[320 + 500, 240], [320, 240 - 500]]])


def test_people_are_placed_as_in_real_videos_and_a_share_is_before_typical_cameras(monkeypatch):
    for spread in ("PLACE_SPREAD", "SIZE_SPREAD"):
        monkeypatch.setattr(module, spread, 0.0)
    body = facing_camera()[:, [0, 2, 1]] * [1, 1, -1]
    world = torch.from_numpy(np.tile(body, (600, 9, 1, 1)).astype(np.float32))
    cameras = place(world, Draw(2, 0), placed=1.0)
    size = cameras.image_size[:, None, None]
    pixels = cameras.project(cameras.to_camera(world))[:, :, H36M17.indices(LIMBS)]
    spot, large = module.place_and_size((pixels - size / 2) / size.amax(-1, keepdim=True))
    aspect = cameras.image_size[:, 0] / cameras.image_size[:, 1]
    shown = torch.stack([spot[:, 0].abs(), spot[:, 1], large.log(), aspect], dim=-1).numpy()
    fits = (np.abs(shown[:, None] - ROWS) < [0.001, 0.001, 0.01, 0.001]).all(-1)
    assert fits.any(1).mean() > 0.95  # the others do not fit into the image there
    assert fits.any(0).all()  # every row is drawn
    level = ViewRange(pitch_deg=(0, 0), roll_deg=(0, 0))
    both = module.place_among(world, Draw(2, 0), level, WILD, 0.7, 0.0).R_camera_from_world[:, 0, 2, 2]
    assert float((both.abs() < 1e-4).float().mean()) == pytest.approx(0.7, abs=0.06)
