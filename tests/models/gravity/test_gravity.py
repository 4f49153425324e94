"""Pooling votes on up, who else is heard, and who is believed when sources contradict each other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from golden.ups import stated_deg, take_up, up_of
from pcnet3d.models.gravity.evidence import (
    IMAGE,
    RAYLEIGH_90,
    Evidence,
    about,
    direction,
    fuse,
    fused_up,
    radius_90,
)
from pcnet3d.models.gravity.images import tangent
from pcnet3d.models.gravity.votes import (
    LEAN_DEG,
    RAISED_LEAN_DEG,
    STATED_LEAN_DEG,
    TILT_SHARE,
    UNKNOWN_DEG,
    USUAL_SPREAD,
    PersonFrames,
    bodies_covariance,
    effective_number,
    of_frames,
    of_votes,
    pitch_roll_error_deg,
    pool,
)
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.camera import Look, pitch_roll_deg, view_rotation
from pcnet3d.pipeline.core.rotations import angle_deg, unit
from refusals import refused

UP = np.array([0.0, -1.0, 0.0])  # of a camera that stands straight
ERROR_DEG = 2.0  # that the frames state; less than a lifter's lean, which is then all that they share
seeds = st.integers(0, 2**32 - 1)


def constant(value, count) -> np.ndarray:
    return np.full(count, float(value))


def votes_about(up, scatter_deg, count, rng) -> np.ndarray:
    """(count, 3) unit vectors, root mean square angle scatter_deg about up, Gaussian in two dimensions."""
    across = rng.normal(scale=np.radians(scatter_deg) / np.sqrt(2), size=(count, 3))
    angles = across - (across @ up)[:, None] * up
    return Rotation.from_rotvec(np.cross(up, angles)).apply(up)


def seldom(count) -> np.ndarray:
    return np.arange(count, dtype=float)  # a vote a second is independent of the one before


def own_error_deg(votes) -> float:
    """What is left of the votes' error once that which they share is taken away."""
    return np.sqrt(votes.error_deg**2 - LEAN_DEG**2)


def bodies_say(up, error_deg) -> Evidence:
    """Of who may face anywhere."""
    return about("frames", up, bodies_covariance(up, error_deg))


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_votes_that_are_turned_turn_their_mean_and_nothing_else(seed):
    rng = np.random.default_rng(seed)
    votes, errors = votes_about(UP, 12, 40, rng), rng.uniform(2, 20, 40)
    Q = Rotation.random(random_state=seed % 2**31).as_matrix()
    straight, turned = (pool(ups, errors, np.arange(40) / 30) for ups in (votes, votes @ Q.T))
    np.testing.assert_allclose(turned.up, Q @ straight.up, atol=1e-5)
    # Effective numbers are not exactly the same: no two directions across a sphere's point are everywhere the same.
    assert turned.error_deg == pytest.approx(straight.error_deg, rel=1e-4)


@pytest.mark.parametrize("error_deg", [1.0, 8.0, np.nan])
def test_copies_of_a_frame_are_one_vote(error_deg):
    one = pool(UP[None], constant(error_deg, 1), np.zeros(1))
    many = pool(np.tile(UP, (300, 1)), constant(error_deg, 300), np.arange(300) / 30)
    np.testing.assert_allclose(many.up, UP, atol=1e-12)
    assert many.error_deg == pytest.approx(one.error_deg)


def test_what_a_lone_frame_states_is_what_its_rectifier_expects_but_no_less_than_the_lean():
    errors = [pool(UP[None], constant(stated, 1), np.zeros(1)).error_deg for stated in (1, 8, np.nan)]
    np.testing.assert_allclose(errors, [LEAN_DEG, TILT_SHARE * 8, TILT_SHARE * UNKNOWN_DEG])


def test_frames_that_state_no_error_at_all_count_as_very_sure_ones():
    """A rectifier that knows the truth states 0."""
    votes = votes_about(UP, 3, 20, np.random.default_rng(0))
    sure, exact = (pool(votes, constant(stated, 20), seldom(20)) for stated in (0.1, 0.0))
    np.testing.assert_array_equal(exact.up, sure.up)
    assert exact.error_deg == sure.error_deg > 0
    mixed = pool(votes, np.where(np.arange(20) < 1, 0.0, 8.0), seldom(20))
    assert np.isfinite([*mixed.up, mixed.error_deg]).all()


def test_independent_votes_average_out_down_to_what_they_share():
    rng = np.random.default_rng(0)
    stated, true = [], []
    for count in (25, 100, 400):
        pools = [
            pool(votes_about(UP, 8, count, rng), constant(ERROR_DEG, count), seldom(count)) for _ in range(60)
        ]
        stated.append(np.mean([own_error_deg(votes) for votes in pools]))
        true.append(np.sqrt(np.mean([angle_deg(votes.up, UP) ** 2 for votes in pools])))
    np.testing.assert_allclose(np.array(stated) * [5, 10, 20], 8, rtol=0.25)
    np.testing.assert_allclose(true, stated, rtol=0.3)
    assert pools[0].error_deg == pytest.approx(LEAN_DEG, abs=0.1)


@settings(max_examples=25, deadline=None)
@given(seeds, st.floats(20, 170), st.floats(0, 0.3), st.booleans())
def test_up_to_three_in_ten_outliers_do_not_move_it(seed, away_deg, share, together):
    """Where they are all on one side as well as where they are everywhere."""
    rng = np.random.default_rng(seed)
    votes = votes_about(UP, 3, 100, rng)
    clean = pool(votes, constant(np.nan, 100), seldom(100))
    bad = rng.permutation(100)[: round(share * 100)]
    axes = rng.normal(size=(1 if together else 100, 3)) * [1, 0, 1]
    votes[bad] = Rotation.from_rotvec(np.radians(away_deg) * unit(axes)).apply(UP)[: len(bad)]
    assert angle_deg(pool(votes, constant(np.nan, 100), seldom(100)).up, clean.up) < 1.5


def test_frames_that_expect_a_larger_error_count_less():
    left, right = (Rotation.from_euler("z", sign * 2, degrees=True).apply(UP) for sign in (1, -1))
    votes = np.repeat([left, right], 50, axis=0)
    trusted = pool(votes, np.repeat([4.0, 12.0], 50), seldom(100)).up
    assert angle_deg(trusted, left) < 0.5
    assert angle_deg(pool(votes, constant(4, 100), seldom(100)).up, UP) < 0.01


def test_a_frame_without_a_vote_changes_nothing():
    votes = votes_about(UP, 5, 30, np.random.default_rng(0))
    gaps = np.insert(votes, [0, 7, 7, 30], np.nan, axis=0)
    there = np.isfinite(gaps[:, 0])
    errors, time_s = constant(4, 34), np.arange(34) / 30
    pooled, clean = pool(gaps, errors, time_s), pool(votes, errors[there], time_s[there])
    np.testing.assert_array_equal(pooled.up, clean.up)
    assert pooled.error_deg == clean.error_deg


@pytest.mark.parametrize("how", ["in turn", "one after the other", "now and then"])
def test_votes_that_split_into_two_state_that_either_may_be_right(how):
    """Two ups 50 degrees apart. Whichever is taken, the other half may be right; a tenth moves the error less."""
    rng = np.random.default_rng(0)
    other = Rotation.from_euler("x", 50, degrees=True).apply(UP)
    second = {
        "in turn": np.arange(300) % 2 == 1,
        "one after the other": np.arange(300) >= 150,
        "now and then": np.arange(300) % 10 == 0,
    }[how]
    votes = np.where(second[:, None], votes_about(other, 3, 300, rng), votes_about(UP, 3, 300, rng))
    pooled = pool(votes, constant(ERROR_DEG, 300), np.arange(300) / 30)
    if how == "now and then":
        assert angle_deg(pooled.up, UP) < 2
        assert LEAN_DEG < pooled.error_deg < 8
    else:
        true = np.sqrt(
            np.mean(angle_deg(pooled.up, np.array([UP, other])) ** 2)
        )  # as likely the one as the other
        assert pooled.error_deg > 0.6 * true
        assert RAYLEIGH_90 * pooled.error_deg > 30


@pytest.mark.parametrize("correlation", [0.8, 0.9, 0.97])
def test_the_effective_number_of_correlated_votes_is_that_of_theory(correlation):
    """An AR(1) series of n has n (1 - r) / (1 + r) independent values (Geyer 1992)."""
    rng = np.random.default_rng(0)
    count, step = 6000, np.sqrt(1 - correlation**2)
    series = rng.normal(size=(count, 2))
    for row in range(1, count):
        series[row] = correlation * series[row - 1] + step * series[row]
    time_s = seldom(count)  # so slow that the ceiling of one vote every 0.3 s is not met
    found = effective_number(series, time_s, np.ones(count))
    assert found == pytest.approx(count * (1 - correlation) / (1 + correlation), rel=0.4)


def test_quick_frames_are_never_independent():
    noise = np.random.default_rng(0).normal(size=(360, 2))
    assert effective_number(noise, np.arange(360) / 120, np.ones(360)) == pytest.approx(1 + 3 / 0.3, rel=0.05)
    assert effective_number(noise, np.arange(360) * 60.0, np.ones(360)) > 200


def test_what_the_user_knows_wins_by_its_weight():
    """In pitch, in which both are apart here, and in roll."""
    told_up = Rotation.from_euler("x", 10, degrees=True).apply(UP)
    votes = votes_about(UP, 6, 100, np.random.default_rng(0))
    errors, time_s = constant(ERROR_DEG, 100), seldom(100)
    alone = take_up(votes, errors, time_s)
    both = take_up(votes, errors, time_s, [direction("told", told_up, 1.0)])
    sd = stated_deg(alone.up, pool(votes, errors, time_s).error_deg)
    assert alone.error_deg == pytest.approx(np.hypot(*sd))
    frames = sd**-2 / (sd**-2 + 2.0)  # one degree is half a square degree in each of two directions
    assert both.shares == pytest.approx({"told": 1 - frames.mean(), "frames": frames.mean()}, rel=0.02)
    assert sum(both.shares.values()) == pytest.approx(1)
    left, apart = (pitch_roll_deg(told_up)[0] - pitch_roll_deg(each.up)[0] for each in (both, alone))
    assert left / apart == pytest.approx(frames[0], rel=0.02)
    assert both.error_deg == pytest.approx(np.sqrt(np.sum(1 / (sd**-2 + 2.0))), rel=0.02)


@pytest.mark.parametrize("share", [0.0, 0.13, 0.5, 0.9, 1.0])
def test_a_bound_holds_nine_in_ten_of_an_error_that_is_larger_along_one_direction(share):
    turn = Rotation.random(random_state=2).as_matrix()
    radius = radius_90(turn @ np.diag([4.0, (2 * share) ** 2, 0.0]) @ turn.T)
    draws = np.random.default_rng(0).normal(size=(400_000, 2)) * [2.0, 2 * share]
    assert np.mean(np.hypot(*draws.T) < radius * np.hypot(2.0, 2 * share)) == pytest.approx(0.9, abs=0.003)
    if share == 1:
        assert radius == pytest.approx(RAYLEIGH_90, rel=1e-4)


# --- bodies show a camera's roll better than its pitch


@pytest.mark.parametrize("pitch", [0.0, 25.0, -50.0, 85.0])
def test_bodies_state_their_pitch_wider_than_their_roll(pitch):
    for roll in [0.0, 30.0, -120.0]:
        up = up_of(pitch, roll)
        pitch_sd, roll_sd = stated_deg(up, 6.0)
        assert pitch_sd > 1.5 * roll_sd > 0
        found = fuse([bodies_say(up, 6.0)])
        np.testing.assert_allclose(found.up, up, atol=1e-12)
        assert found.error_deg == pytest.approx(np.hypot(pitch_sd, roll_sd))
        # Against somebody who is equally sure of both, they give way in pitch and hold in roll.
        for other, sd in ((up_of(pitch + 1, roll), pitch_sd), (up_of(pitch, roll + 1), roll_sd)):
            told = direction("told", other, 3.0 * np.sqrt(2))
            way = angle_deg(fuse([bodies_say(up, 6.0), told]).up, up) / angle_deg(other, up)
            assert way == pytest.approx(sd**2 / (sd**2 + 9.0), abs=0.01)


def test_their_error_grows_with_the_pitch_and_not_with_the_roll():
    stated = np.array([pitch_roll_error_deg(up_of(pitch), 6.0) for pitch in (0, 10, 20, 35, 50, 70, 90)])
    assert (np.diff(stated, axis=0) > 0).all()
    for pitch in (10, 20, 35, 50, 70):
        level = pitch_roll_error_deg(up_of(pitch), 6.0)
        np.testing.assert_allclose(pitch_roll_error_deg(up_of(-pitch), 6.0), level)
        for roll in (20, 90, 180):
            np.testing.assert_allclose(pitch_roll_error_deg(up_of(pitch, roll), 6.0), level, rtol=1e-9)
    whole = [take_up(up_of(pitch)[None], np.array([8.0]), np.zeros(1)).error_deg for pitch in (0, 25, 50)]
    assert whole[0] < whole[1] < whole[2]


def test_who_leans_leans_to_the_front_or_the_back_and_more_under_raised_arms():
    """Before the camera that is its pitch, from the side its roll."""
    standing = np.zeros((30, 17, 3))
    raised = standing.copy()
    raised[:, H36M17.indices(["r_wrist", "l_wrist"])] = UP
    error_deg = constant(ERROR_DEG, 30)
    for facing, way in ((0.0, 2), (180.0, 2), (90.0, 0)):
        turned = Rotation.from_euler("z", facing, degrees=True).as_matrix()
        R = view_rotation(np.array(0.0), np.array(0.0), np.array(0.0)) @ turned
        (usual,), (wider,) = (
            of_frames(PersonFrames(joints, np.tile(R, (30, 1, 1)), error_deg, seldom(30)))
            for joints in (standing, raised)
        )
        more = np.diag(np.linalg.inv(wider.information) - np.linalg.inv(usual.information))
        assert np.degrees(np.sqrt(more[way])) == pytest.approx(RAISED_LEAN_DEG)
        assert more[2 - way] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("pitch", [90.0, -90.0])
def test_straight_down_or_up_no_direction_is_pitch_and_both_together_are_stated(pitch):
    up = np.array([0.0, 0.0, -np.sign(pitch)])
    straight, nearly = (fuse([bodies_say(each, 6.0)]) for each in (up, up_of(0.9999 * pitch)))
    np.testing.assert_allclose(straight.up, up, atol=1e-12)
    assert straight.error_deg == pytest.approx(nearly.error_deg, rel=1e-3)


def test_a_take_whose_lifter_is_unsure_states_a_larger_error():
    votes, times = np.tile(UP, (300, 1)), np.arange(300) / 30
    usual, unsure, silent = (
        pool(votes, constant(9, 300), times, spread).error_deg
        for spread in (constant(USUAL_SPREAD, 300), constant(2 * USUAL_SPREAD, 300), constant(np.nan, 300))
    )
    assert usual == pytest.approx(STATED_LEAN_DEG)
    assert unsure == pytest.approx(2**1.5 * usual)
    assert silent == pytest.approx(TILT_SHARE * 9)
    some = np.where(np.arange(300) < 100, np.nan, 2 * USUAL_SPREAD)  # filled frames state nothing
    assert pool(votes, constant(9, 300), times, some).error_deg == pytest.approx(unsure)


TIMES = np.arange(120) / 30


def look(pitch, roll=0.0, sd_deg=0.6, failure=0.004):
    up = up_of(pitch, roll)
    plane = tangent(up)
    return Look(0, up, plane @ (np.radians(sd_deg) ** 2 * np.eye(2)) @ plane.T, failure)


def votes(pitch, roll=0.0, scatter_deg=3.0):
    turns = np.random.default_rng(0).normal(scale=np.radians(scatter_deg), size=(len(TIMES), 3))
    return Rotation.from_rotvec(turns).apply(up_of(pitch, roll))


def fused(bodies, image=None, told=()):
    """The up, and what is said about contradictions."""
    found = fused_up(of_votes(pool(bodies, np.full(len(TIMES), 7.0), TIMES)), told, image)
    return found, found.notices


def test_beside_an_exact_image_bodies_are_told_and_have_no_say():
    """A lift that was told that up leans by it: what its bodies say is the image's word once more."""
    image = look(12)
    found, warnings = fused(votes(16), image)
    assert not warnings
    assert angle_deg(found.up, up_of(12)) < 1e-6
    assert found.shares == {IMAGE: 1.0}
    assert found.error_deg == pytest.approx(image.error_deg)
    assert angle_deg(found.own["frames"][0], up_of(16)) < 1.0
    # The same of what the user tells, and of both.
    told = direction("gravity vector", up_of(13), 1.0)
    assert fused(votes(16), None, [told])[0].shares == {"gravity vector": 1.0}
    assert fused(votes(16), image, [told])[0].shares.keys() == {IMAGE, "gravity vector"}


@pytest.mark.parametrize(("error_deg", "heard"), [(2.9, False), (3.1, True)])
def test_bodies_are_heard_beside_what_a_lifter_is_not_told(error_deg, heard):
    for image, told in (
        (look(12, sd_deg=error_deg / np.sqrt(2)), ()),
        (None, [direction("t", up_of(12), error_deg)]),
    ):
        found, _ = fused(votes(13), image, told)
        assert ("frames" in found.shares) is heard
        assert "frames" in found.own


def test_a_vague_image_and_bodies_are_fused_the_pitch_more_the_images_than_the_roll():
    bodies, image = pool(votes(16), np.full(len(TIMES), 7.0), TIMES), look(12, 4, sd_deg=3.0)
    found, warnings = fused(votes(16), image)
    assert not warnings
    sd = stated_deg(bodies.up, bodies.error_deg)
    way = (pitch_roll_deg(found.up) - pitch_roll_deg(bodies.up)) / ([12, 4] - pitch_roll_deg(bodies.up))
    np.testing.assert_allclose(way, sd**2 / (sd**2 + 9), atol=0.02)
    assert way[0] > 0.6 > 0.4 > way[1]
    assert found.shares[IMAGE] == pytest.approx(way.mean(), abs=0.02)
    assert angle_deg(found.own["frames"][0], up_of(16)) < 1.0


def test_an_image_with_many_lines_wins_over_leaning_bodies_and_both_are_named():
    found, (warning,) = fused(votes(50), look(20))
    assert angle_deg(found.up, up_of(20)) < 0.1
    assert found.shares == {IMAGE: 1.0}
    assert "pitch 20" in warning.text
    assert "The image is believed" in warning.text
    assert angle_deg(found.own["frames"][0], up_of(50)) < 1.5  # still there to be shown


@pytest.mark.parametrize("roll", [25, 30, 40])
def test_a_diagonal_pattern_is_vetoed_by_the_bodies_and_the_bound_reaches_it(roll):
    """Lines on one plane only are wrong in 15 of 100."""
    found, (warning,) = fused(votes(10), look(10, roll, failure=0.15))
    assert angle_deg(found.up, up_of(10)) < 1.0
    assert warning.values["believed"] == "body is"
    assert found.bound_deg >= warning.values["apart_deg"] - 1e-6


@pytest.mark.parametrize("pitch", [0, 15, 22, 30, 45])
@pytest.mark.parametrize("roll", [0, 15, 26, 45])
def test_good_lines_are_not_overruled_by_how_cameras_are_usually_held(pitch, roll):
    """Pitch 22, roll 26: lines were right within 2 degrees, the skeletons said 7 and 10 and were believed, and up was
    21 off. Bodies are drawn towards usual cameras."""
    image = look(pitch, roll, failure=0.01)
    found, said = fused(votes(0.5 * pitch + 4, 0.4 * roll), image)
    assert angle_deg(found.up, image.up) < 1.5
    assert all(each.values["believed"] == "image is" for each in said)


@pytest.mark.parametrize(
    ("failure", "believed", "close"),
    [
        (0.01, "image is", False),
        (0.06, "image is", True),
        (0.15, "body is", True),
        (0.6, "body is", False),
    ],
)
def test_the_bound_reaches_an_answer_that_is_hardly_less_likely(failure, believed, close):
    """Up was said to be known to within 12 degrees; the image's, 22 away, was hardly less likely, and right."""
    bodies, image = votes(1, -8), look(23, -13, failure=failure)
    found, (warning,) = fused(bodies, image)
    winner = fused(bodies)[0] if believed == "body is" else fused(np.full_like(bodies, np.nan), image)[0]
    apart_deg = warning.values["apart_deg"]
    assert warning.values["believed"] == believed
    assert angle_deg(found.up, winner.up) < 1e-3
    assert (found.bound_deg > apart_deg) == close
    assert (found.error_deg > winner.error_deg + 1) == close


def test_told_reaction_instead_of_gravity_is_refused_with_the_cause():
    bodies = of_votes(pool(votes(10), np.full(len(TIMES), 7.0), TIMES))
    for heard, image in ((bodies, None), ([], look(10)), (bodies, look(10))):
        with refused("wrong-axes"):
            fused_up(heard, [direction("gravity vector", -up_of(10), 1.0)], image)
    with refused("wrong-axes"):
        fused_up(bodies, [direction("gravity vector", up_of(10, 80), 1.0)])


def test_told_gravity_that_is_off_is_believed_and_said():
    found, warnings = fused(votes(10), look(10), [direction("gravity vector", up_of(40), 1.0)])
    assert any("the body" in each.text for each in warnings)
    assert any("the image" in each.text for each in warnings)
    assert angle_deg(found.up, up_of(40)) < 1e-3
    assert set(found.shares) == {"gravity vector"}
