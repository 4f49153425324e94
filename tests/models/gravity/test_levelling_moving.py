"""A moving camera followed from frame to frame, and one that nods or looks straight down."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from golden.levelled import Filmed, noise_about, seen_of
from pcnet3d.models.gravity.levelling import camera_frame, level_moving, level_static, why_not
from pcnet3d.models.gravity.moving import sliding_up
from pcnet3d.pipeline.core.camera import view_rotation
from pcnet3d.pipeline.core.rotations import angle_deg, geodesic_deg, unit


@pytest.mark.parametrize(
    ("yaw", "pitch", "roll"),
    [
        (lambda t: 100 + 15 * t, 10.0, 0.0),
        (lambda t: 120 + 25 * np.sin(t), 15.0, -5.0),
        (120.0, lambda t: 1.5 * t, lambda t: 5 - t),
        (lambda t: 140 - 10 * t, lambda t: 5 * np.sin(2 * np.pi * t / 16), 3.0),
    ],
    ids=["pans", "pans to and fro", "tilts and rolls", "pans and tilts"],
)
@pytest.mark.parametrize("rectifier", ["truth with jitter", "pcnet"])
def test_a_camera_that_pans_and_tilts_slowly_is_followed_without_steps(yaw, pitch, roll, rectifier):
    moves = Filmed(yaw, pitch, roll)
    R = noise_about(moves.R, 4) if rectifier == "truth with jitter" else moves.by(rectifier)[0]
    levelled = moves.moving(R)
    tilt = angle_deg(levelled.R_camera_from_level[:, :, 2], moves.up)
    assert tilt.mean() < 3
    assert tilt.max() < 5
    steps, true = (
        geodesic_deg(rotations[1:], rotations[:-1]).max()
        for rotations in (levelled.R_camera_from_level, moves.R_level)
    )
    assert steps < true + 0.1
    assert levelled.heading == "camera"


@pytest.mark.parametrize("seconds", [1, 3, 20])
def test_a_camera_that_pitches_evenly_is_followed_without_lag_up_to_the_ends(seconds):
    """4 degrees a second, over which a mean of the neighbours lags by 6 degrees at the ends."""
    pitches = Filmed(pitch=lambda t: -10 + 4 * t, seconds=seconds)
    tilt = angle_deg(pitches.moving().R_camera_from_level[:, :, 2], pitches.up)
    assert tilt.max() < 0.1


@pytest.mark.parametrize("scatter_deg", [2, 8])
def test_noise_at_the_ends_of_a_line_does_not_blow_up_and_is_stated(scatter_deg):
    """At the ends a line is surer of nothing: its error there is larger, is said to be, and is no more than said. With
    8 degrees about each axis a slope of 4 degrees a second is only half believed, so some of the mean's lag is back."""
    pitches = Filmed(pitch=lambda t: -10 + 4 * t)
    ends, stated = [], []
    for seed in range(30):
        found = sliding_up(pitches.seen(noise_about(pitches.R, scatter_deg, seed)))
        up, error_deg = found.up, found.error_deg
        tilt, middle = angle_deg(up, pitches.up), len(up) // 2
        ends.append(tilt[[0, -1]])
        stated.append(error_deg[[0, -1]])
        assert tilt[middle] < 0.4 * scatter_deg
        assert error_deg[[0, -1]].min() > error_deg[middle]
    rms = np.sqrt(np.mean(np.square(ends)))
    assert rms < 0.7 * scatter_deg
    assert rms < np.sqrt(np.mean(np.square(stated)))


def test_a_line_through_a_few_votes_that_scatter_is_hardly_steeper_than_their_mean(seen):
    """Half a second of independent votes, 8 degrees apart: a plain line is twice as far off at its ends as the mean."""
    part = slice(0, 15)
    off = []
    for seed in range(60):
        few = seen_of(noise_about(seen.R[part], 8, seed), seen.error_deg[part], seen.time_s[part])
        up, middle = sliding_up(few).up, unit(few.votes.mean(axis=0))
        off.append([angle_deg(up[[0, -1]], seen.up[0]), angle_deg(middle, seen.up[0])])
    line, mean = (np.sqrt(np.mean(np.square([np.mean(o[i]) for o in off]))) for i in (0, 1))
    assert line < 1.5 * mean


def test_a_static_take_called_moving_agrees_with_the_static_answer(seen):
    R, error_deg = seen.by("pcnet")
    static, moving = level_static(seen.seen(R, error_deg)), level_moving(seen.seen(R, error_deg))
    apart = angle_deg(moving.R_camera_from_level[:, :, 2], static.R_camera_from_level[:, 2])
    assert apart.max() < 2
    assert geodesic_deg(moving.R_camera_from_body, static.R_camera_from_body).max() < 2
    np.testing.assert_allclose(moving.up_error_deg, static.up_error_deg, rtol=0.3)


def test_votes_far_from_their_neighbours_do_not_pull_a_moving_camera(seen):
    bad = seen.R.copy()
    bad[50:56] = bad[50:56] @ Rotation.from_euler("x", 80, degrees=True).as_matrix()
    levelled = seen.moving(bad)
    assert angle_deg(levelled.R_camera_from_level[:, :, 2], seen.up).max() < 2
    assert levelled.up_error_deg[53] > levelled.up_error_deg[-1]


def test_a_gap_has_a_level_and_no_body(seen):
    R = seen.R.copy()
    R[100:120] = np.nan
    levelled = seen.moving(R)
    assert np.isnan(levelled.R_camera_from_body).any(axis=(1, 2)).nonzero()[0].tolist() == list(
        range(100, 120)
    )
    assert geodesic_deg(levelled.R_camera_from_level, seen.R_level).max() < 0.1


def test_when_a_take_was_changes_nothing(seen):
    """Stamps may count from 1970, in files of arrays and of cameras that are synchronised."""
    own = sliding_up(seen.seen(noise_about(seen.R, 6)))
    late = sliding_up(replace(seen.seen(noise_about(seen.R, 6)), time_s=seen.time_s + 1.7e9))
    assert angle_deg(late.up, own.up).max() < 1e-3
    np.testing.assert_allclose(late.error_deg, own.error_deg, rtol=1e-3)


@pytest.mark.parametrize(
    "gone", [slice(0, 180), slice(780, 960), slice(330, 630)], ids=["start", "end", "middle"]
)
def test_how_well_up_is_known_while_nobody_is_there_is_no_reason_against_a_take(gone):
    """Lifted skeletons lean one way and then another; the line through that goes far where there are none."""
    time_s = np.arange(960) / 30
    lean = gaussian_filter1d(np.random.default_rng(2).normal(size=(960, 3)), 15, axis=0)
    R = Rotation.from_rotvec(np.radians(8) * lean / lean.std()).as_matrix()
    R = Rotation.from_euler("x", 90, degrees=True).as_matrix() @ R  # the camera stands straight
    R[gone] = np.nan
    levelled = level_moving(seen_of(R, np.full(960, 8.0), time_s))
    assert why_not(levelled) == ""


@pytest.mark.parametrize("roll", [0.0, 20.0, 90.0, 180.0])
def test_a_camera_that_nods_keeps_its_heading(roll):
    """From looking nearly straight up to nearly straight down, one degree at a time, level, leaning or turned over."""
    pitch = np.arange(-88.0, 88.5)
    R_camera_from_world = view_rotation(np.zeros(len(pitch)), pitch, np.full(len(pitch), roll))
    R_world_from_level = np.swapaxes(R_camera_from_world, 1, 2) @ camera_frame(R_camera_from_world[:, :, 2])
    np.testing.assert_allclose(R_world_from_level, R_world_from_level[[88] * len(pitch)], atol=1e-9)


def test_a_camera_that_looks_straight_down_or_up_goes_on_as_it_nodded():
    for pitch in (-90.0, 90.0):
        nearly, straight = (
            camera_frame(view_rotation(np.array(0.0), np.array(angle), np.array(0.0))[:, 2])
            for angle in (0.8 * pitch, pitch)
        )
        assert geodesic_deg(nearly, straight) == pytest.approx(18, abs=0.1)
