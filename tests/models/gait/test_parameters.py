"""Times and lengths of a walker whose footprints, speed and cadence are known: straight, in a bend, on a belt."""

from itertools import pairwise

import numpy as np
import pytest

from pcnet3d.models.gait.figures import (
    OF_SIDES,
    belt_drift,
    depth_of_steps,
    length_values,
    over_belt,
    path_error,
    shipped_errors,
    standing,
    times_too_far,
)
from pcnet3d.models.gait.gait import OF_STYLE, Gait, Stance, Step, walks
from pcnet3d.pipeline.core.pose import RootPath

FPS, SPEED, STEP_S, STANCE_S, WIDTH = 60, 1.2, 0.5, 0.62, 0.16
TIME = np.arange(6 * FPS) / FPS


def striding(bend_degps=0.0):
    """(root (T, 2), ankles by side (T, 2) relative to it, gait): feet that stand still, each beside the pelvis's way
    where the pelvis is 0.4 of a stance after the initial contact."""
    heading = np.radians(bend_degps) * TIME
    root = np.cumsum(SPEED / FPS * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    feet, paths = {"r": [], "l": []}, {}
    for side, first, aside in (("r", 0.3, -WIDTH / 2), ("l", 0.3 + STEP_S, WIDTH / 2)):
        starts = np.arange(first, TIME[-1] - 1, 2 * STEP_S)
        feet[side] = [Stance(side, float(s), float(s + STANCE_S)) for s in starts]
        at = starts + 0.4 * STANCE_S
        angle = np.radians(bend_degps) * at
        place = np.column_stack([np.interp(at, TIME, root[:, i]) for i in range(2)])
        place += aside * np.column_stack([-np.sin(angle), np.cos(angle)])
        index = np.clip(np.searchsorted(starts, TIME, side="right") - 1, 0, None)
        paths[side] = place[index] - root
    separation = np.interp(
        TIME,
        *np.array(sorted((s.start_s, 1.0 if s.side == "r" else -1.0) for x in feet.values() for s in x)).T,
    )
    found = walks(feet, np.column_stack([separation, 0 * separation]), TIME, 0.25)
    return root, paths, Gait(feet, found)


def mean(values, name):
    both = np.concatenate([values[name][side] for side in "rl"])
    assert len(both) >= 6
    return np.nanmean(both)


def test_times_of_a_gait_cycle():
    _, _, gait = striding()
    values = gait.times
    assert gait.kind == "walking"
    for name, known in {
        "step_time_s": STEP_S,
        "stride_time_s": 2 * STEP_S,
        "stance_time_s": STANCE_S,
        "swing_time_s": 2 * STEP_S - STANCE_S,
        "stance_percent": 62,
        "swing_percent": 38,
        "single_support_percent": 38,
        "double_support_percent": 24,
        "flight_time_s": -0.12,
    }.items():
        assert mean(values, name) == pytest.approx(known, abs=1e-6), name


def test_a_run_is_what_has_flights():
    _, _, gait = striding()
    short = {
        side: [Stance(side, s.start_s, s.start_s + 0.4) for s in feet] for side, feet in gait.feet.items()
    }
    run = Gait(short, gait.walks)
    assert run.kind == "running"
    assert mean(run.times, "flight_time_s") == pytest.approx(0.1)
    assert mean(run.times, "single_support_percent") == pytest.approx(40)


@pytest.mark.parametrize("bend_degps", [0.0, 25.0, -25.0])
def test_lengths_width_and_speed(bend_degps):
    root, ankles, gait = striding(bend_degps)
    values = length_values(gait, root, ankles, TIME)
    assert mean(values, "walking_speed") == pytest.approx(SPEED, rel=0.01)
    assert mean(values, "step_length") == pytest.approx(SPEED * STEP_S, rel=0.01)
    assert mean(values, "stride_length") == pytest.approx(2 * SPEED * STEP_S, rel=0.02)
    assert mean(values, "step_width") == pytest.approx(WIDTH, abs=0.01)
    for side in "rl":  # the foot on the inside of a bend takes no shorter steps
        assert np.nanmean(values["step_length"][side]) == pytest.approx(SPEED * STEP_S, rel=0.015)


def test_places_without_a_path_are_missing():
    root, ankles, gait = striding()
    root[:, 0] = np.nan
    assert np.isnan(np.concatenate([*length_values(gait, root, ankles, TIME)["step_length"].values()])).all()


@pytest.mark.parametrize("share", [0.5, 0.65, 0.8, 1.2])
def test_feet_that_drift_ahead_are_on_no_belt(share):
    """A woman on a lawn, whose legs BlazePose lifted too short, walked on a treadmill at 0.37 m/s."""
    root, ankles, gait = striding()
    short = {side: share * ankle for side, ankle in ankles.items()}
    assert over_belt(root, short, TIME, gait)[1] == 0


def test_who_gets_on_over_the_floor_is_on_no_belt():
    """A shuffler, whose path was 0.4 of what his feet told, was put on a treadmill at three times his speed."""
    root, ankles, gait = striding()
    assert over_belt(0.4 * root, ankles, TIME, gait)[1] == 0
    assert over_belt(0.1 * root, ankles, TIME, gait)[1] > 0


def test_who_walks_there_and_backwards_again_is_on_no_belt():
    """The feet went back under the body in one half and ahead in the other, together hardly at all: any drift was a
    belt's."""
    root, ankles, gait = striding()
    end_s, drift = (
        2 * TIME[-1],
        np.array([-0.1, 0.0]),
    )  # an error of the path; and legs are lifted shorter on the way back
    path = np.concatenate([root, root[-2::-1]])
    time_s = np.arange(len(path)) / FPS
    size = np.where(time_s > TIME[-1], 0.9, 1.0)[:, None]
    both = {side: size * np.concatenate([ankle, ankle[-2::-1]]) for side, ankle in ankles.items()}
    feet = {
        side: [*of, *(Stance(side, end_s - s.stop_s, end_s - s.start_s) for s in of)]
        for side, of in gait.feet.items()
    }
    assert not belt_drift(*standing(path + time_s[:, None] * drift, both, time_s, feet)).any()
    found = belt_drift(*standing(TIME[:, None] * drift, ankles, TIME, gait.feet))  # on a treadmill
    np.testing.assert_allclose(found, drift - [SPEED, 0], atol=1e-3)


def test_a_walk_in_depth_that_goes_farther_than_its_steps_is_too_long():
    """Speed and lengths of steps by a focal length that was told 2.2 times too long, and not a word."""
    root, ankles, gait = striding()
    for times, told in ((0.4, 1), (1.0, 1), (1.4, 1), (2.2, 2.2)):
        feet = standing(times * root, ankles, TIME, gait.feet)
        assert times_too_far(*feet, np.array([1.0, 0.2])) == pytest.approx(told, rel=0.05)
        assert times_too_far(*feet, np.array([0.2, 1.0])) == 1  # across the view
    assert times_too_far(*np.empty((2, 0, 2)), np.array([1.0, 0.0])) == 1


OF_PATH = {"walking_speed", "step_length", "stride_length", "step_width"}


@pytest.mark.parametrize("gait", ["walking", "running"])
@pytest.mark.parametrize("source", ["lifted", "measured"])
def test_errors_shrink_with_steps_and_grow_with_the_path_and_away_from_the_usual_gait(gait, source):
    errors, times = shipped_errors(gait, source), set(striding()[2].times)
    assert set(errors.figures) == (times | OF_PATH if source == "lifted" else times)
    few, more, many, thousand = (errors.mean("step_time_s", n) for n in (2, 3, 100, 1000))
    assert few > more > many == thousand  # than it was fitted on
    assert errors.mean("step_time_s", 1) > 0.004  # a single step's, between frames
    even, uneven = (errors.mean("step_time_s", 5, scatter=s) for s in (0.01, 0.1))
    assert uneven > 1.2 * even
    one, other = (errors.mean("step_length", 3, root_sd) for root_sd in (0.0, 0.1))
    assert other > one if source == "lifted" else np.isnan(one)
    assert set(errors.seen) == set(OF_STYLE)
    usual = {name: errors.seen[name]["usual"] for name in OF_STYLE}
    assert errors.beyond(usual) == errors.beyond({}) == {}
    most = errors.seen["stance_percent"]["most"]
    far = {**usual, "stance_percent": most + 8.0}
    assert set(errors.beyond(far)) == {"stance_percent"}
    assert errors.beyond({"step_time_s": 0.5 * errors.seen["step_time_s"]["least"]})["step_time_s"] > 0
    grown = errors.mean("stance_percent", 10, style=far)
    assert grown > 1.2 * errors.mean("stance_percent", 10, style=usual)
    if gait == "walking":
        within = errors.mean("stance_percent", 9, style={"stance_percent": most})
        assert within > errors.mean("stance_percent", 9)


@pytest.mark.parametrize("gait", ["walking", "running"])
def test_a_difference_of_the_sides_is_less_sure_than_a_mean_the_more_so_the_more_of_a_step_is_depth(gait):
    errors = shipped_errors(gait)
    assert set(errors.differences) == set(OF_SIDES)
    for figure in OF_SIDES:
        few, many = (errors.difference(figure, n, n, 0.5) for n in (2, 20))
        assert errors.side(figure, 0.5) < many / 2 + 1e-9 < few
    if gait == "walking":
        side, along = (errors.difference("step_length", 5, 5, depth) for depth in (0.0, 1.0))
        assert along > 2 * max(side, errors.mean("step_length", 10))
    assert np.isnan(shipped_errors(gait, "measured").difference("step_length", 5, 5, 0.0))


@pytest.mark.parametrize(("off_deg", "depth"), [(0, 1.0), (60, 0.5), (90, 0.0), (180, 1.0)])
def test_how_much_of_a_step_is_depth_is_by_where_the_person_faces(off_deg, depth):
    _, _, gait = striding()
    off = np.radians(off_deg)
    ahead, right = np.array([np.sin(off), 0, np.cos(off)]), np.array([-np.cos(off), 0, np.sin(off)])
    R_camera_from_body = np.stack([-ahead, right, [0, -1, 0]], axis=-1)  # CAMERA's y is down
    turning = np.tile(R_camera_from_body, (len(TIME), 1, 1))
    turning[::3] = np.nan
    assert depth_of_steps(turning, TIME, gait.walks) == pytest.approx(depth, abs=1e-9)
    assert np.isnan(depth_of_steps(np.nan * turning, TIME, gait.walks))


@pytest.mark.parametrize(("towards", "share"), [(1.0, 0.75), (0.0, 0.0)])
def test_speed_towards_the_camera_has_the_whole_error_of_the_focal_length(towards, share):
    time_s = np.linspace(0, 2, 61)
    axis, across = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    root = 5 * axis + np.outer(time_s, towards * axis + (1 - towards) * across)
    covariance = np.broadcast_to(np.eye(3), (61, 3, 3))
    walk = [[Step("right", 0.0, 1.0), Step("left", 1.0, 2.0)]]
    assert path_error(RootPath(root, covariance, (0.0, 0.75)), axis, time_s, walk)[1] == pytest.approx(
        share, abs=1e-9
    )


@pytest.mark.parametrize(("walked", "mixed"), [(0, False), (6, True)])
def test_a_run_that_becomes_a_walk_is_not_all_a_run(walked, mixed):
    """ "Ran at least 8 steps": three with flights, five with both feet on the floor."""
    lands = 0.35 * np.arange(14)
    on_s = np.where(np.arange(14) < 14 - walked, 0.25, 0.5)
    feet = {
        side: [Stance(side, at, at + on) for at, on in zip(lands[first::2], on_s[first::2], strict=True)]
        for first, side in enumerate("rl")
    }
    steps = [Step("lr"[i % 2], start, stop) for i, (start, stop) in enumerate(pairwise(lands))]
    gait = Gait(feet, [steps])
    assert (gait.kind, gait.mixed) == ("running", mixed)
