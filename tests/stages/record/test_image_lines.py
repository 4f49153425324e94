"""The frame whose lines tell up: in the report, with the lines and the horizon, where images are wanted."""

from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from pcnet3d.pipeline.core.camera import Camera, Look, view_rotation
from pcnet3d.stages.drawing.facts import Source, facts_of
from pcnet3d.stages.drawing.image_lines import horizon
from pcnet3d.stages.report.stage import report

SIZE = (64, 48)


def looking(pitch_deg=10.0, roll_deg=0.0, focal_px=50.0):
    up = view_rotation(np.array(0.0), np.array(pitch_deg), np.array(roll_deg))[:, 2]
    ends = np.array([[[10.0, 5.0], [10.0, 30.0]], [[5.0, 20.0], [40.0, 21.0]], [[1.0, 1.0], [9.0, 7.0]]])
    look = Look(3, up, np.radians(0.6) ** 2 * np.eye(3), 0.004, ends, np.array([0, 1, -1]))
    return Camera(SIZE, focal_px, 2.0, "lines", (look,))


def test_the_horizon_is_where_level_rays_meet_the_image():
    for pitch, roll in ((0.0, 0.0), (15.0, 0.0), (-10.0, 20.0), (5.0, -40.0)):
        camera = looking(pitch, roll)
        edge = horizon(camera, camera.looks[0].up)
        rays = np.concatenate([(edge - np.array(SIZE) / 2) / camera.focal_px, np.ones((2, 1))], axis=1)
        np.testing.assert_allclose(rays @ camera.looks[0].up, 0, atol=1e-9)
        assert ((edge >= -1e-9) & (edge <= np.array(SIZE) + 1e-9)).all()
    assert horizon(looking(60.0), looking(60.0).looks[0].up) is None


def test_the_report_has_the_lines_and_what_each_source_says(make_take, film):
    take = make_take().with_(video=film(), camera=looking())
    up = take.camera.looks[0].up
    take = take.with_(
        rectified=replace(
            take.rectified, up_own={"image": (up, 0.8), "frames": (up, 6.0)}, up_pulls={"image": 2.0}
        )
    )
    rows = facts_of(take).sources
    assert rows["image"].pitch_deg == pytest.approx(10.0)
    assert rows["feet"] == Source(share=0.25)
    page = report(take)
    assert "The image's lines, frame 3" in unescape(page)
    assert "frame 3" not in report(take.telling(images=False)).replace("frame 3,", "")
