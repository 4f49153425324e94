"""A take's rotations from a rectifier's frames: headings smoothed, drift reported, moving cameras followed."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from golden.levelled import Filmed, Z, headed, heading_deg, noise_about, seen_of, smoothed
from golden.ups import stated_deg
from pcnet3d.models.gravity.evidence import TakeUp, direction
from pcnet3d.models.gravity.levelling import (
    HEADING_S,
    camera_frame,
    level,
    level_moving,
    level_people,
    level_static,
    sliding_up,
    upright,
    why_not,
)
from pcnet3d.models.gravity.votes import STATED_LEAN_DEG, USUAL_SPREAD, PersonFrames
from pcnet3d.pipeline import rotate
from pcnet3d.pipeline.core.camera import Look, pitch_roll_deg, view_rotation
from pcnet3d.pipeline.core.rotations import angle_deg, geodesic_deg, unit

seeds = st.integers(0, 2**32 - 1)


def test_the_bound_of_bodies_reaches_an_up_by_which_they_are_above_their_feet(standing):
    """Before a camera rolled by 30 degrees the network was 24 off, and stated 8: people leaned to one side.
    Who bends now and then, or stands, changes nothing."""
    time_s, error_deg = np.arange(90) / 30, np.full(90, 9.0)
    R = np.tile(view_rotation(np.array(180.0), np.array(0.0), np.array(0.0)), (90, 1, 1))
    up = R[0, :, 2]
    bounds = {}
    for roll_deg in (0.0, 30.0):
        turn = Rotation.from_euler("z", roll_deg, degrees=True).as_matrix()
        found = level_static(PersonFrames(standing @ turn.T, R, error_deg, time_s)).up
        np.testing.assert_allclose(found.up, up, atol=1e-4)  # as by a network that takes it for level
        bounds[roll_deg] = float(found.bound_deg)
    assert bounds[0.0] < 15 < 30 < bounds[30.0]


def test_a_turned_camera_turns_the_answer_and_nothing_else(seen):
    """About its view: any other turn changes its pitch, and with that the error."""
    R = noise_about(seen.R, 6)
    Q = Rotation.from_euler("z", 140, degrees=True).as_matrix()
    straight = seen.static(R)
    turned = level_static(seen.seen(Q @ R, joints=rotate(Q, seen.joints)))
    np.testing.assert_allclose(turned.R_camera_from_level, Q @ straight.R_camera_from_level, atol=1e-4)
    np.testing.assert_allclose(turned.R_camera_from_body, Q @ straight.R_camera_from_body, atol=1e-4)
    np.testing.assert_allclose(turned.error_deg, straight.error_deg, rtol=1e-3)
    np.testing.assert_allclose(turned.up_error_deg, straight.up_error_deg, rtol=1e-3)


# --- headings


@given(st.floats(-180, 180), st.floats(-180, 180), seeds)
@settings(max_examples=25, deadline=None)
def test_a_constant_heading_is_kept_exactly(heading, tilt_deg, seed):
    rng = np.random.default_rng(seed)
    time_s = np.cumsum(rng.uniform(0.01, 0.1, 40))
    tilt = Rotation.from_rotvec(np.radians(tilt_deg) * np.array([0.6, 0.8, 0])).as_matrix()
    R = tilt @ headed(np.full(40, heading))
    out = upright(seen_of(R, rng.uniform(1, 20, 40), time_s), np.broadcast_to(tilt @ Z, (40, 3)))
    assert geodesic_deg(out, R).max() < 1e-5


def test_headings_pass_through_180_degrees_without_a_jump():
    heading = np.linspace(150, 210, 60)  # 170, 180, -170, ...
    out = heading_deg(smoothed(heading))
    assert np.abs((np.diff(out) + 180) % 360 - 180).max() < 1.1
    middle = slice(15, -15)
    np.testing.assert_allclose(out[middle] % 360, heading[middle], atol=0.01)


def test_noise_in_the_heading_is_smoothed_by_the_stated_gaussian():
    """White noise through a Gaussian of standard deviation s frames keeps 1 / (2 sqrt(pi) s) of its variance."""
    noise = np.random.default_rng(0).normal(scale=5, size=3000)
    left = heading_deg(smoothed(noise)).std() / noise.std()
    assert left == pytest.approx((2 * np.sqrt(np.pi) * HEADING_S * 30) ** -0.5, rel=0.1)


def test_no_smoothing_crosses_a_clip_boundary():
    heading = np.repeat([0.0, 90.0], 30)
    np.testing.assert_allclose(heading_deg(smoothed(heading, seams=(30,))), heading, atol=1e-9)
    assert np.abs(heading_deg(smoothed(heading)) - heading).max() > 20


def test_nan_stays_nan_and_does_not_spread():
    heading = np.full(40, 25.0)
    heading[[0, 11, 12, 39]] = np.nan
    out = smoothed(heading)
    assert np.array_equal(np.isnan(out).all(axis=(1, 2)), np.isnan(heading))
    np.testing.assert_allclose(heading_deg(out)[~np.isnan(heading)], 25)


def test_a_frame_that_expects_a_large_error_follows_its_neighbours():
    heading, error_deg = np.zeros(31), np.full(31, 4.0)
    heading[15] = 60
    trusting = np.abs(heading_deg(smoothed(heading, error_deg=error_deg))).max()
    error_deg[15] = 40
    assert np.abs(heading_deg(smoothed(heading, error_deg=error_deg))).max() < 0.05 * trusting


# --- a camera that stands still


def test_the_truth_stays_the_truth(seen):
    """Apart from the heading, which turns, and is smoothed with neighbours on one side at the ends."""
    levelled = seen.static()
    np.testing.assert_allclose(levelled.R_camera_from_body[:, :, 2], seen.up, atol=1e-9)
    errors = geodesic_deg(levelled.R_camera_from_body, seen.R)
    assert errors.max() < 1.5
    assert errors[10:].max() < 0.3
    assert angle_deg(levelled.R_camera_from_level[:, 2], seen.up[0]) < 1e-6


@pytest.mark.parametrize("levelling", [level_static, level_moving])
def test_a_camera_turned_in_any_way_turns_the_answer_and_its_error_is_that_of_its_pitch(seen, levelling):
    R = noise_about(seen.R, 6)
    Q = Rotation.from_euler("zx", [60, 35], degrees=True).as_matrix()
    straight = levelling(seen.seen(R))
    turned = levelling(seen.seen(Q @ R, joints=rotate(Q, seen.joints)))
    # The feet's word on the roll counts for more where the bodies' own counts for less.
    atol = 0.01 if levelling is level_static else 1e-4
    np.testing.assert_allclose(turned.R_camera_from_body, Q @ straight.R_camera_from_body, atol=atol)
    pitches = [
        np.abs(np.median(pitch_roll_deg(each.R_camera_from_body[:, :, 2])[:, 0]))
        for each in (straight, turned)
    ]
    assert pitches[1] > pitches[0] + 15
    assert (turned.up_error_deg > straight.up_error_deg + 1).all()
    assert (turned.error_deg > straight.error_deg).all()


def test_a_rectifier_without_an_expected_error_gives_none(seen):
    levelled = level_static(seen.seen(error_deg=np.full(len(seen.R), np.nan)))
    assert np.isnan(levelled.error_deg).all()
    assert np.isfinite(levelled.up_error_deg).all()


def test_a_take_without_a_vote_is_nan_and_not_levelled(seen):
    nothing = np.full_like(seen.R, np.nan)
    for levelled in (seen.static(nothing), seen.moving(nothing)):
        assert np.isnan(levelled.R_camera_from_body).all()
        assert np.isnan(levelled.R_camera_from_level).all()
        assert np.isnan(levelled.up_error_deg).all()
        assert "torso" in why_not(levelled)


def test_a_person_who_lies_is_levelled_by_a_rectifier_that_knows_up(seen):
    """How a trunk lies says nothing; how sure the rectifier is does."""
    across = np.cross(seen.up[0], [0.0, 0.0, 1.0])
    R_down = Rotation.from_rotvec(np.radians(75) * unit(across)).as_matrix()
    lying = seen.seen(joints=rotate(R_down, seen.joints))
    assert why_not(level_static(lying)) == ""
    unsure = replace(lying, error_deg=np.full(len(seen.R), 60.0))
    assert "known only to within" in why_not(level_static(unsure))
    told = level_static(unsure, [direction("told", seen.up[0], 1.0)])
    assert why_not(told) == ""


# --- a camera that moves


def test_up_that_is_badly_known_levels_no_take_whoever_told_it(seen):
    ups = np.tile(seen.up[0], (len(seen.up), 1))
    unsure = TakeUp(ups, np.where(seen.time_s < 2, 25.0, 3.0), {"image": 0.9, "frames": 0.1})
    assert "known only to within 38" in why_not(level(seen.seen(), unsure))


@pytest.mark.parametrize("levelling", [level_static, level_moving])
def test_a_lifter_that_is_unsure_widens_what_is_stated(levelling):
    R_camera = view_rotation(np.array(0.0), np.array(15.0), np.array(5.0))
    R, time_s = R_camera @ headed(np.zeros(90)), np.arange(90) / 30
    usual, unsure = (
        levelling(replace(seen_of(R, np.full(90, 9.0), time_s), spread=np.full(90, times * USUAL_SPREAD)))
        for times in (1, 2)
    )
    for levelled, lean_deg in ((usual, STATED_LEAN_DEG), (unsure, 2**1.5 * STATED_LEAN_DEG)):
        stated = np.hypot(*stated_deg(R_camera[:, 2], lean_deg))
        np.testing.assert_allclose(levelled.up_error_deg, stated, rtol=1e-6)
    assert (unsure.error_deg > 1.5 * usual.error_deg).all()


# --- several people before one camera


def look_at(up, failure=0.004, error_deg=0.7) -> Look:
    """An image that says so to within 0.7 degrees."""
    return Look(0, up, np.radians(error_deg) ** 2 / 2 * (np.eye(3) - np.outer(up, up)), failure)


@pytest.fixture(scope="module")
def two(seen) -> list[PersonFrames]:
    return [replace(seen.seen(noise_about(seen.R, 3, seed)), name=f"person {seed}") for seed in (0, 1)]


def test_each_person_and_the_image_are_told_with_share_and_own_answer(seen, two):
    """Beside an image that a lifter is told they have no say, and stand there with their own answer."""
    up = level_people(two, (), look_at(seen.up[0], error_deg=4.0))[0].up
    everybody = {"person 0", "person 1", "image"}
    assert up.shares.keys() == up.own.keys() == everybody
    exact = level_people(two, (), look_at(seen.up[0]))[0].up
    assert exact.shares == {"image": 1.0}
    assert exact.own.keys() == everybody
    assert sum(up.shares.values()) == pytest.approx(1)
    for one in two:
        alone = level_static(one).up
        np.testing.assert_allclose(up.own[one.name][0], alone.up, atol=1e-9)
        assert up.own[one.name][1] == pytest.approx(alone.error_deg)


def test_an_image_that_several_people_outvote_is_still_told(seen, two):
    askew = Rotation.from_rotvec([0, 0, np.radians(40)]).apply(seen.up[0])
    up = level_people(two, (), look_at(askew, failure=0.15))[0].up
    assert "The body is believed" in up.notices[0].text
    assert up.shares.keys() == {"person 0", "person 1"}
    assert angle_deg(up.own["image"][0], askew) < 1e-6
    assert {"person 0", "person 1"} < up.own.keys()


def test_people_of_one_name_each_have_their_share(two):
    up = level_people([replace(one, name="person") for one in two])[0].up
    assert up.shares == pytest.approx({"person (1)": 0.5, "person (2)": 0.5}, abs=0.05)
    assert up.own.keys() == up.shares.keys()


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
