"""A focal length that is wrong by a factor makes the way towards the camera as wrong, and the steps stay; in a zoom
feet that stand come nearer."""

from types import SimpleNamespace

import numpy as np
import pytest

from pcnet3d.examples.walker import walker
from pcnet3d.models.gait.focal import focal_by_steps, zoom_by_feet
from pcnet3d.models.gait.gait import find_gait
from pcnet3d.pipeline.core.canonical import R_world_from_body
from pcnet3d.pipeline.core.frames import CAMERA, LEVEL
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.pose import PoseSequence
from pcnet3d.pipeline.core.rotations import from_columns, rotate, transpose

USUAL = np.exp(0.16)  # of lifted walks before the right camera


def seen(depth=lambda depth, time_s: depth, along=True):
    """Arguments of both functions, of the built-in walk seen along its way or across it. depth: what it looks like, of
    (T,) what it is and the times."""
    world = walker().world.astype(np.float64)
    root, time_s = world[:, 0], np.arange(len(world)) / 30
    joints = world - root[:, None]
    way = (root[-1] - root[0]) * (1, 1, 0)
    way /= np.linalg.norm(way)
    away = way if along else np.cross((0, 0, 1), way)
    R_source_from_level = transpose(from_columns(np.cross(away, (0, 0, 1)), np.array([0.0, 0, -1]), away))
    looks = root + (depth(root @ away, time_s) - root @ away)[:, None] * away
    filtered = PoseSequence(joints, H36M17, LEVEL, time_s=time_s, root=looks)
    gait = find_gait(rotate(transpose(R_world_from_body(world)), joints), time_s)
    assert gait.kind == "walking"
    return filtered, SimpleNamespace(source=CAMERA, R_source_from_level=R_source_from_level), gait


def by_steps(factor, along=True):
    return focal_by_steps(*seen(lambda depth, _: factor * depth, along))


def test_a_usual_walk_fits_its_focal_length():
    assert by_steps(USUAL) is None


@pytest.mark.parametrize("factor", [1.8, 2.5])
def test_too_long_a_focal_length_is_told(factor):
    assert by_steps(factor * USUAL) == pytest.approx(factor ** (1 / 0.75), rel=0.2)


@pytest.mark.parametrize(("factor", "along"), [(0.2, True), (2.5, False)])
def test_on_a_belt_and_across_the_view_steps_do_not_tell(factor, along):
    assert by_steps(factor, along) is None


@pytest.mark.parametrize("along", [True, False])
def test_a_zoom_is_told_by_feet_that_stand(along):
    def zoomed(depth, time_s):
        return (depth + 8) * np.exp(-0.4 * time_s)

    assert 0.25 < zoom_by_feet(*seen(zoomed, along)) < 0.45  # the walker goes too


@pytest.mark.parametrize("along", [True, False])
def test_who_walks_and_stands_or_is_on_a_belt_before_a_still_camera_shows_no_zoom(along):
    """The walker comes as near as half a metre. On a belt the feet go and the body stays; by a focal length that is
    three times too long the body goes three times as far as the feet step."""
    shows = (
        lambda depth, _: depth - depth.min() + 0.5,
        lambda depth, _: 4 + 0 * depth,
        lambda depth, _: 3 * (depth - depth.min()) + 0.5,
    )
    for shown in shows:
        assert zoom_by_feet(*seen(shown, along)) is None
