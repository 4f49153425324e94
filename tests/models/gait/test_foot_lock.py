"""Foot lock on a walk whose path is known: what slides is held, and nothing is moved by more than its error."""

import numpy as np
import pytest

from pcnet3d.models.gait.events import Stance
from pcnet3d.models.gait.foot_lock import flat_rows, foot_locked
from pcnet3d.models.gait.parameters import flat_span

FPS, SPEED, STEP_S = 30.0, 1.2, 0.5
TIME_S = np.arange(int(6 * FPS)) / FPS


@pytest.fixture(scope="module")
def walk():
    """Root (T, 3), ankles by side relative to it, stances: each foot is on the floor for 60 % of a stride of 1 s and
    swings evenly to the next place for the rest."""
    root = np.stack([SPEED * TIME_S, np.zeros_like(TIME_S), np.full_like(TIME_S, 4.0)], axis=-1)
    ankles, feet = {}, {}
    for i, side in enumerate("rl"):
        starts = np.arange(-1, 8) * 2 * STEP_S + i * STEP_S
        times = np.stack([starts, starts + 1.2 * STEP_S], axis=-1)
        along = np.interp(TIME_S, times.ravel(), np.repeat(SPEED * (starts + 0.6 * STEP_S), 2))
        place = np.stack([along, np.full_like(along, 0.1 - 0.2 * i), np.full_like(along, 3.1)], axis=-1)
        ankles[side] = place - root
        feet[side] = [Stance(side, a, b) for a, b in times if a > 0 and b < TIME_S[-1]]
    return root, ankles, feet


def slides(root, ankles, feet):
    """(N,) greatest distance from the beginning of each flat part, in metres."""
    found = []
    for side, stances in feet.items():
        for stance in stances:
            rows = slice(*np.searchsorted(TIME_S, flat_span(stance, 0.0, TIME_S[-1])))
            places = (root + ankles[side])[rows]
            found.append(np.linalg.norm(places - places[0], axis=1).max())
    return np.array(found)


def stated(sd):
    return {side: np.tile(sd**2 * np.eye(3), (len(TIME_S), 1, 1)) for side in "rl"}


def off_by(sd):
    wave = [np.sin(2 * np.pi * TIME_S / period + period) for period in (0.9, 1.3, 2.1)]
    return sd * np.sqrt(2) * np.stack(wave, axis=-1)


def test_feet_of_a_noisy_path_stay_and_the_path_comes_nearer(walk):
    root, ankles, feet = walk
    noisy = root + off_by(0.03)
    locked = foot_locked(noisy, ankles, stated(0.03), feet, TIME_S)
    assert slides(noisy, ankles, feet).max() > 0.05
    assert slides(locked, ankles, feet).max() < 1e-9
    assert np.linalg.norm(locked - noisy, axis=1).max() < 2.5 * 0.03
    inside = slice(30, -30)
    velocity = [np.diff(path[inside], axis=0) * FPS - [SPEED, 0, 0] for path in (noisy, locked)]
    assert np.sqrt((velocity[1] ** 2).mean()) < np.sqrt((velocity[0] ** 2).mean())


def test_a_true_path_is_left_as_it_is(walk):
    root, ankles, feet = walk
    np.testing.assert_allclose(foot_locked(root, ankles, stated(0.03), feet, TIME_S), root, atol=1e-12)


def test_the_correction_goes_evenly_from_stance_to_stance(walk):
    root, ankles, feet = walk
    noisy = root + off_by(0.03)
    correction = foot_locked(noisy, ankles, stated(0.03), feet, TIME_S) - noisy
    assert (
        np.abs(np.diff(correction, axis=0)).max() < 0.03
    )  # noise changes by 0.03 from frame to frame at most


def test_a_foot_that_slides_by_more_than_its_error_is_left_alone(walk):
    root, ankles, feet = walk
    noisy = root + off_by(0.03)
    np.testing.assert_array_equal(foot_locked(noisy, ankles, stated(0.001), feet, TIME_S), noisy)
    unknown = {side: np.full((len(TIME_S), 3, 3), np.nan) for side in "rl"}
    np.testing.assert_array_equal(foot_locked(noisy, ankles, unknown, feet, TIME_S), noisy)


def test_on_a_belt_feet_are_carried_along(walk):
    root, ankles, feet = walk
    stays = np.zeros_like(root) + off_by(0.01)
    np.testing.assert_array_equal(foot_locked(stays, ankles, stated(1.0), feet, TIME_S), stays)


def test_nothing_is_spread_across_a_gap(walk):
    root, ankles, feet = walk
    noisy = root + off_by(0.03)
    noisy[80:90] = np.nan
    locked = foot_locked(noisy, ankles, stated(0.03), feet, TIME_S)
    np.testing.assert_array_equal(np.isnan(locked), np.isnan(noisy))
    first = {side: [stance for stance in stances if stance.stop_s < 2.6] for side, stances in feet.items()}
    np.testing.assert_array_equal(foot_locked(noisy, ankles, stated(0.03), first, TIME_S)[90:], noisy[90:])


def test_who_stands_all_along_stays_but_for_the_ends(walk):
    root, ankles, _ = walk
    noisy = root[[0]] + off_by(0.02)
    legs = {"r": np.broadcast_to(ankles["r"][0], root.shape)}
    feet = {"r": [Stance("r", np.nan, np.nan)]}
    places = foot_locked(noisy, legs, stated(0.03), feet, TIME_S) + legs["r"]
    inside = places[int(0.2 * FPS) : -int(0.4 * FPS)]
    np.testing.assert_allclose(inside, inside[[0]].repeat(len(inside), axis=0), atol=1e-12)


def test_a_foot_whose_leaving_a_gap_hides_stands_no_longer_than_it_is_seen(walk):
    """It stood to the end of the take, and no other foot stood meanwhile: a walk back from the camera was a zoom."""
    _, _, feet = walk
    gap_s, seen = 2.2, np.ones(len(TIME_S), dtype=bool)

    def cut(stance):
        if stance.start_s < gap_s < stance.stop_s:
            return Stance(stance.side, stance.start_s, np.nan, seen_s=(0.0, gap_s))
        return stance

    hidden = {side: [cut(stance) for stance in of] for side, of in feet.items()}
    assert hidden != feet
    whole, found = (list(flat_rows(each, seen, TIME_S, ())) for each in (feet, hidden))
    late = [(side, rows) for side, rows in whole if TIME_S[rows][0] > gap_s]
    assert found[-len(late) :] == late
    assert all(TIME_S[rows][-1] < gap_s or (side, rows) in late for side, rows in found)
