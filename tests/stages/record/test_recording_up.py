"""Which way is up, how well that is known and what it rests on: as curves and in words."""

from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.pipeline import CAMERA, Z_UP, Rectified, Take
from pcnet3d.pipeline.core.camera import Camera, view_rotation
from pcnet3d.pipeline.core.frames import GL_CAMERA, PC_CAMERA
from pcnet3d.pipeline.running.sentences import camera_words, up_rests_on, up_words
from pcnet3d.stages.drawing.image_lines import horizon
from pcnet3d.stages.export.stage import summary


def changed(take: Take, **changes) -> Take:
    """The take with these changes in its Rectified."""
    assert take.rectified is not None
    return take.with_(rectified=replace(take.rectified, **changes))


def moving(rectified: Rectified, pitch_deg: np.ndarray) -> Rectified:
    """The same with a camera that pitches."""
    zero = np.zeros_like(pitch_deg)
    levels = view_rotation(zero, pitch_deg, zero)
    return replace(rectified, R_source_from_level=levels, camera="moving", level_heading="camera")


@pytest.mark.parametrize("frame", [CAMERA, GL_CAMERA, PC_CAMERA], ids=lambda frame: frame.name)
def test_pitch_and_roll_do_not_depend_on_the_names_of_the_axes(make_take, frame):
    take = make_take()
    R = frame.basis @ view_rotation(*(np.array(angle) for angle in (40.0, 20.0, -8.0)))
    votes = np.tile(R[:, 2], (12, 1))
    take = take.with_(
        poses=take.poses.with_(frame=frame),
        rectified=replace(take.rectified, R_source_from_level=R, up_votes=votes),
    )
    assert "pitch 20 ± 5° (positive: it looks down)" in camera_words(take)


def words(take: Take) -> str:
    return " ".join([camera_words(take), up_words(take), up_rests_on(take.rectified)])


TILTED = {"R_source_from_level": view_rotation(*(np.array(angle) for angle in (30.0, -12.0, -8.0)))}


@pytest.mark.parametrize(
    ("changes", "said", "not_said"),
    [
        ({}, "is based on the body's posture (75 %), the feet's places (25 %)", "relative to the camera"),
        ({}, "pitch 0 ± 5° (positive: it looks down), roll 0 ± 5° (positive: its", "unless"),
        (TILTED, "pitch -12 ± 5° (positive: it looks down)", "pitch 12"),
        (TILTED, "roll -8 ± 5° (positive: its image is turned counter-clockwise)", "roll 8"),
        (
            {"level_ok": False, "level_reason": "the person lies"},
            "could not be levelled: the person lies",
            "nown to within",
        ),
        ({"source": Z_UP, "camera": None, "up_votes": None}, "The source knows its own up", "looks"),
    ],
)
def test_how_well_up_is_known_and_what_it_rests_on(make_take, changes, said, not_said):
    text = words(changed(make_take(), **changes))
    assert said in text
    assert not_said not in text


def test_up_of_a_moving_camera_and_of_who_does_not_stand_has_its_condition(make_take):
    take = make_take()
    moved = take.with_(rectified=moving(take.rectified, np.zeros(12)))
    text = words(changed(moved, up_bound_deg=np.linspace(5, 8, 12)))
    assert "within 5° to 8° (90 %)" in text
    level = take.rectified.level
    laid = changed(take, level=level.with_(joints=level.joints[..., [2, 1, 0]]))
    assert "Up is known to within 5° (90 %), unless the image is turned" in words(laid)


def test_the_bound_of_up_is_a_curve(taken):
    _, recording = taken()
    assert np.ravel(recording.over_time("rotation/bound", "Scalars:scalars")[2]).tolist() == [5] * 12


SIZE = (64, 48)


def looking(pitch_deg=10.0, roll_deg=0.0, focal_px=50.0) -> tuple[Camera, np.ndarray]:
    """A camera, and up in its axes."""
    up = view_rotation(np.array(0.0), np.array(pitch_deg), np.array(roll_deg))[:, 2]
    return Camera(SIZE, focal_px, 2.0, "lines"), up


def test_the_horizon_is_where_level_rays_meet_the_image():
    for pitch, roll in ((0.0, 0.0), (15.0, 0.0), (-10.0, 20.0), (5.0, -40.0)):
        camera, up = looking(pitch, roll)
        edge = horizon(camera, up)
        rays = np.concatenate([(edge - np.array(SIZE) / 2) / camera.focal_px, np.ones((2, 1))], axis=1)
        np.testing.assert_allclose(rays @ up, 0, atol=1e-9)
        assert ((edge >= -1e-9) & (edge <= np.array(SIZE) + 1e-9)).all()
    assert horizon(*looking(60.0)) is None


def test_the_summary_has_what_each_source_says(make_take):
    camera, up = looking()
    take = changed(make_take(), up_own={"image": (up, 0.8), "frames": (up, 6.0)}).with_(camera=camera)
    rows = summary(take)["rectification"]["up_by_source"]
    assert rows["image"]["pitch_deg"] == pytest.approx(10.0)
    assert rows["feet"] == {"share": 0.25}
