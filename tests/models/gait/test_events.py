"""Contacts of the walker, and stances, steps and walks out of probabilities and separations whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest

from golden.motions import motion_with
from golden.walks import GEOMETRIC, measured, seen_from
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.take_angles import smoothed
from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.models.common.motion import motion_of
from pcnet3d.models.gait.gait import (
    ON_FLOOR,
    Gait,
    Stance,
    Step,
    along_sight,
    contact_times,
    contacts,
    faded_steps,
    gait_of,
    leg_lengths,
    separation,
    stances,
    strides,
    swings_of,
    walks,
    walks_of,
    windows,
)
from pcnet3d.models.lab.evaluation.gait import true_contact
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.frames import CAMERA, Z_UP
from pcnet3d.pipeline.core.rotations import rotate, transpose

FPS = 30
TIME = np.arange(8 * FPS) / FPS
WALK = walker(seconds=10, turn_deg=0)


def walked(lands_s, stays_s, sides=None):
    """Stances and separation of feet that land at these times, in turn or of these sides, and stay so long."""
    lands_s, stays_s = np.array(lands_s), np.broadcast_to(stays_s, len(lands_s))
    landings = list(zip(sides or "rl" * len(lands_s), lands_s.tolist(), stays_s.tolist(), strict=False))
    feet = {of: [Stance(side, at, at + stay) for side, at, stay in landings if side == of] for of in "rl"}
    apart = np.interp(TIME, lands_s, (-1.0) ** np.arange(len(lands_s)))
    return feet, np.column_stack([apart, np.zeros_like(apart)])


def limping(right_s=0.7, left_s=0.5, share=0.6, start_s=0.4):
    """The right foot lands right_s after the left one, the left one left_s after."""
    stride = right_s + left_s
    lands_s = np.add.outer(start_s + stride * np.arange(5), [0, right_s]).ravel()
    feet, apart = walked(lands_s, share * stride, "lr" * 5)
    return feet, -apart


def test_stances_begin_and_end_between_rows():
    probability = np.clip(0.6 + 3 * np.sin(2 * np.pi * (TIME - 0.51)), 0, 1)
    (found,) = stances({"r": probability}, TIME).values()
    assert len(found) == 9
    assert np.isnan([found[0].start_s, found[-1].stop_s]).all()
    np.testing.assert_allclose([s.start_s % 1 for s in found[1:]], 0.51, atol=0.01)
    np.testing.assert_allclose([s.stop_s % 1 for s in found[:-1]], 0.01, atol=0.01)


def test_a_flicker_is_no_event_and_a_gap_hides_them():
    probability = np.where((TIME > 2) & (TIME < 4), 0.9, 0.1)
    flicker = probability.copy()
    flicker[90] = 0.1
    assert stances({"r": flicker}, TIME) == stances({"r": probability}, TIME)
    probability[70:80] = np.nan
    (before, after) = stances({"r": probability}, TIME)["r"]
    assert np.isnan(before.stop_s)
    assert np.isnan(after.start_s)


def test_steps_and_strides_of_a_limping_walk():
    feet, between = limping()
    (walk,) = walks(feet, between, TIME, 0.25)
    assert [step.side for step in walk[:4]] == ["r", "l", "r", "l"]
    for step in walk:
        assert step.stop_s - step.start_s == pytest.approx(0.7 if step.side == "r" else 0.5)
    own = strides([walk], feet)
    assert len(own) == len(walk) - 1
    for stride in own:
        assert stride.stop_s - stride.start_s == pytest.approx(1.2)
        assert stride.off_s - stride.start_s == pytest.approx(0.72)
        double = 0.02 if stride.side == "l" else 0.22  # 0.72 s of stance less the other foot's step
        assert stride.off_s - stride.other_start_s == pytest.approx(double)
    both = contact_times([walk], "r") + contact_times([walk], "l")
    np.testing.assert_allclose(np.sort(both), [walk[0].start_s, *(step.stop_s for step in walk)])


def test_feet_apart_sideways_and_feet_that_do_not_pass_take_no_steps():
    """Jumping jacks were counted as steps: ankles 0.8 legs apart sideways, whose depths were off by 0.2."""
    feet, between = limping()
    assert walks(feet, between * 0.2 + (0.0, 0.8), TIME, 0.25) == []
    assert walks(feet, between * 0.1, TIME, 0.25) == []
    assert walks(feet, np.abs(between), TIME, 0.25) == []


def test_walks_end_at_gaps_long_pauses_and_turns():
    feet, between = limping()
    gap = between.copy()
    gap[round(3.2 * FPS)] = np.nan
    assert sum(map(len, walks(feet, gap, TIME, 0.25))) < sum(map(len, walks(feet, between, TIME, 0.25)))
    assert walks(*limping(1.6, 1.6), TIME, 0.25) == []
    turning = np.where(TIME < 3.4, 170.0, -170.0)  # by 20 degrees, across the half turn
    assert len(walks(feet, between, TIME, 0.25, facing_deg=turning)) == 1
    turning = np.where(TIME < 3.4, 0.0, 90.0)
    first, second = walks(feet, between, TIME, 0.25, facing_deg=turning)
    assert first[-1].stop_s < 3.4 < second[0].stop_s


@pytest.mark.parametrize("swing_deg", [0.0, 20.0, -28.0])
def test_a_pelvis_that_swings_with_every_step_does_not_turn(swing_deg):
    """Who swings it by 15 degrees to either side did not walk: each step turned by 30."""
    feet, between = limping(0.6, 0.6)
    swing = swing_deg * np.cos(np.pi * (TIME - 0.4) / 0.6)
    (walk,) = walks(feet, between, TIME, 0.25, facing_deg=swing)
    assert walk == walks(feet, between, TIME, 0.25)[0]
    turning = swing + np.where(TIME < 3.1, 0.0, 60.0)
    first, second = walks(feet, between, TIME, 0.25, facing_deg=turning)
    assert first[-1].stop_s < 3.1 < second[0].stop_s
    turning = swing + np.interp(TIME, [2.8, 4.0], [0, 90])  # from one landing to the next but one
    first, second = walks(feet, between, TIME, 0.25, facing_deg=turning)
    assert first[-1].stop_s < 2.9 < 3.9 < second[0].stop_s
    assert (len(first), len(second)) == (4, 3)


def there_and_back(steps, swing_deg):
    """Stances, separation and facing of so many steps forwards and, from the foot in front on, as many backwards, for
    which the film runs back: the feet land behind, and the pelvis swings the other way."""
    lands = 0.4 + 0.5 * np.arange(2 * steps + 2)
    sides = ["rl"[i % 2] for i in range(steps + 1)]
    sides += sides[::-1]
    foot = np.array([1 if side == "r" else -1 for side in sides]) * np.repeat([1, -1], steps + 1)
    return *walked(lands, 0.6, sides), np.interp(TIME, lands, swing_deg * foot)


@pytest.mark.parametrize("steps", [3, 4, 5, 6])
@pytest.mark.parametrize("swing_deg", [-28.0, 10.0, 20.0, 28.0])
def test_who_walks_back_swings_the_other_way_and_loses_no_step(steps, swing_deg):
    """One swing for the whole take was wrong for half of it, whose steps were turns."""
    feet, between, facing = there_and_back(steps, swing_deg)
    there, back = walks(feet, between, TIME, 0.25, facing_deg=facing)
    assert (len(there), len(back)) == (steps, steps)
    turns_s = 0.4 + 0.5 * (steps + 1) + 1.25  # between two landings of the way back
    for walk in walks(feet, between, TIME, 0.25, facing_deg=facing + np.where(turns_s > TIME, 0.0, 90.0)):
        assert not any(step.start_s < turns_s < step.stop_s for step in walk)


def test_each_walk_of_a_take_has_its_own_swing():
    """Three steps with the pelvis to one side, and after a rest many with it to the other."""
    lands_s = np.r_[1.0:2.6:0.5, 4.5:7.6:0.5]
    swings = (-1.0) ** np.arange(len(lands_s))
    facing = np.interp(TIME, lands_s, swings * np.where(lands_s < 3, 25, -25))
    assert [len(walk) for walk in walks(*walked(lands_s, 0.6), TIME, 0.25, facing_deg=facing)] == [3, 6]


def test_a_turn_ends_a_walk_though_a_landing_faces_nobody_knows_where():
    feet, between = limping(0.6, 0.6)
    facing = np.where(TIME < 3.1, 0.0, 60.0)
    facing[np.abs(TIME - 1.0) < 0.1] = np.nan
    for walk in walks(feet, between, TIME, 0.25, facing_deg=facing):
        assert not any(step.start_s < 3.1 < step.stop_s for step in walk)


@pytest.mark.parametrize("turn_deg", [35.0, 45.0, 65.0, 90.0])
def test_a_turn_in_a_short_walk_is_no_swing(turn_deg):
    """Half of a turn in the middle of four or five landings was taken for what the pelvis swings."""
    for landings in [4, 5, 6, 7]:
        feet, between = limping(0.6, 0.6)
        end_s = 0.4 + 0.6 * (landings - 1) + 0.1
        feet = {side: [stance for stance in all_ if stance.start_s < end_s] for side, all_ in feet.items()}
        turns_s = 0.4 + 0.6 * (landings // 2) - 0.3
        for walk in walks(feet, between, TIME, 0.25, facing_deg=np.where(turns_s > TIME, 0.0, turn_deg)):
            assert not any(step.start_s < turns_s < step.stop_s for step in walk)


def pausing(pause_s, at=5, both_feet=True, count=11, step_s=0.55):
    """Stances and separation of a walk that pauses before a landing, on both feet or on the one that landed last."""
    lands = 0.3 + step_s * np.arange(count) + pause_s * (np.arange(count) >= at)
    stays = np.diff(lands, append=lands[-1] + step_s) + 0.1
    if not both_feet:
        stays[at - 2] -= pause_s
    return walked(lands, stays)


def step_times(walks):
    return [step.stop_s - step.start_s for walk in walks for step in walk]


@pytest.mark.parametrize("pause_s", [0.7, 0.9])
@pytest.mark.parametrize("both_feet", [True, False])
def test_a_pause_ends_a_walk_and_is_in_no_step(pause_s, both_feet):
    """A pause of less than 0.95 s, with which a step takes less than 1.5, was a step of the walk."""
    first, second = walks(*pausing(pause_s, both_feet=both_feet), TIME, 0.25)
    np.testing.assert_allclose(step_times([first, second]), 0.55)
    assert (len(first), len(second)) == (3, 5)  # without the step before the pause, and the one it is in


@pytest.mark.parametrize(("at", "steps"), [(1, 9), (10, 8)])
def test_a_pause_in_the_first_or_the_last_step_leaves_one_walk(at, steps):
    (walk,) = walks(*pausing(0.9, at), TIME, 0.25)
    assert len(walk) == steps
    np.testing.assert_allclose(step_times([walk]), 0.55)


def test_a_slow_walk_a_limp_and_a_walk_out_of_a_run_have_no_pause():
    for feet, between in (limping(0.6, 1.2, 0.75), limping(0.9, 0.9, 0.8), limping(1.0, 0.5, 0.9)):
        (walk,) = walks(feet, between, TIME, 0.25)
        landings = [stance.start_s for of in feet.values() for stance in of if stance.start_s < TIME[-1]]
        assert len(walk) == len(landings) - 1
    lands = 0.3 + np.cumsum([0, 0.35, 0.34, 0.34, 0.33, 0.49, 0.59, 0.62, 0.6])  # of a validation subject
    stays = [0.22, 0.26, 0.27, 0.39, 0.69, 0.74, 0.82, 0.76, 0.8]
    (walk,) = walks(*walked(lands, stays), TIME, 0.25)
    assert len(walk) == 8


def test_a_walk_out_of_the_image_ends_there_however_long_the_take_goes_on():
    """Nobody knows how long the foot stays that is last seen on the floor."""
    feet, between = limping(0.5, 0.5)
    out_s = 2.8  # 0.4 s behind the fifth landing
    seen = {
        side: [
            Stance(side, s.start_s, s.stop_s if s.stop_s < out_s else np.nan) for s in of if s.start_s < out_s
        ]
        for side, of in feet.items()
    }
    gone = np.where((out_s <= TIME)[:, None], np.nan, between)
    (alone,) = walks(seen, gone[out_s > TIME], TIME[out_s > TIME], 0.25)
    again = np.where((TIME > 7)[:, None], between, gone)  # the person comes back
    (longer,) = walks(seen, again, TIME, 0.25)
    assert len(alone) == 4
    assert longer == alone


def test_two_steps_with_flights_are_a_run():
    """A run of a second may show no more than three landings; in these every foot leaves before the other lands."""
    feet, between = limping()
    two = {"l": feet["l"][:2], "r": feet["r"][:1]}
    flying = {side: [Stance(side, s.start_s, s.start_s + 0.3) for s in found] for side, found in two.items()}
    (run,) = walks(flying, between, TIME, 0.25)
    assert [step.side for step in run] == ["r", "l"]
    standing = {**flying, "r": two["r"]}  # one foot waits for the other
    assert walks(standing, between, TIME, 0.25) == []
    hidden = {**flying, "r": [Stance("r", two["r"][0].start_s, np.nan)]}
    assert walks(hidden, between, TIME, 0.25) == []


@pytest.mark.parametrize(
    ("step_s", "lasts", "kind"),
    [
        (0.35, 0.5, "running"),
        (1.1, 0.5, "none"),  # a skeleton whose bones changed by 17 % "ran 3 steps in 3.5 s"
        (1.1, 1.2, "walking"),
    ],
)
def test_nobody_runs_at_fifty_steps_a_minute(step_s, lasts, kind, monkeypatch):
    body = np.zeros((240, 17, 3))
    ankles = H36M17.indices(("r_ankle", "l_ankle"))
    body[:, ankles, 2] = -1.0
    body[:, H36M17.indices(("r_knee", "l_knee")), 2] = -0.5
    swing = 0.4 * np.sin(np.pi * (TIME - 0.5) / step_s + np.pi / 2)
    body[:, ankles[0], 0], body[:, ankles[1], 0] = -swing, swing
    feet, _ = walked(0.5 + step_s * np.arange(6), lasts * step_s)
    monkeypatch.setattr("pcnet3d.models.gait.gait.stances", lambda *_: feet)
    assert gait_of(replace(motion_with({}, TIME), body=body)).kind == kind


def body_of(walk):
    """Low-passed, in BODY's axes."""
    smooth = smoothed(walk.world - walk.root[:, None], walk.time_s)
    return rotate(transpose(R_world_from_body(smooth)), smooth)


@pytest.mark.parametrize("fps", [25, 30, 60, 120])
def test_initial_contacts_of_the_walker(fps):
    walk = walker(seconds=10, fps=fps, turn_deg=0)
    found = stances(contacts(body_of(walk), walk.time_s), walk.time_s)
    for side, strikes in walk.heel_strikes_s.items():
        starts = np.array([stance.start_s for stance in found[side]])
        assert np.nanmin(np.abs(starts[:, None] - strikes[1:]), axis=0).max() < 0.035


def test_who_stands_is_on_the_floor():
    still = np.repeat(body_of(WALK)[-1:], 60, axis=0)
    for probability in contacts(still, np.arange(60) / 30).values():
        assert (probability > 0.8).all()


def test_units_do_not_matter_and_a_mirror_exchanges_the_feet():
    body = body_of(WALK)
    found = contacts(body, WALK.time_s)
    np.testing.assert_allclose(contacts(body * 700, WALK.time_s)["r"], found["r"], atol=1e-6)
    mirrored = (body * (1, -1, 1))[:, mirror()]
    np.testing.assert_allclose(contacts(mirrored, WALK.time_s)["l"], found["r"], atol=1e-9)


def test_a_unit_that_grows_as_the_person_comes_nearer_changes_no_contact():
    body = body_of(WALK)
    found = contacts(body, WALK.time_s)
    near = contacts(body * (1 + 0.15 * WALK.time_s)[:, None, None], WALK.time_s)
    off = [np.abs((near[side] > ON_FLOOR).astype(int) - (found[side] > ON_FLOOR)) for side in "rl"]
    assert np.mean(off) < 0.02


def test_a_hidden_knee_hides_no_step():
    body = body_of(WALK)
    whole = separation(body, WALK.time_s)
    body[40:50, H36M17.index("r_knee")] = np.nan
    np.testing.assert_allclose(separation(body, WALK.time_s), whole, rtol=0.01, atol=1e-3)


def mirror():
    swap = {"r_": "l_", "l_": "r_"}
    return [H36M17.index(swap.get(name[:2], name[:2]) + name[2:]) for name in H36M17.joints]


def test_missing_legs_are_missing_contacts_and_nothing_crosses_a_seam():
    body = body_of(WALK)
    body[40:50, H36M17.index("r_ankle")] = np.nan
    found = contacts(body, WALK.time_s)
    assert np.isnan(found["r"][40:50]).all()
    assert np.isfinite(found["r"][50:]).all()

    def first_clip(body):
        return next(features for _, features in windows(body, WALK.time_s[60:], "r", (30,)))[:30]

    other = body[60:].copy()
    other[30:, H36M17.index("l_knee")] += 0.2  # legs have other lengths in the other clip
    np.testing.assert_allclose(
        first_clip(other) * leg_lengths(other, WALK.time_s[60:], (30,))[0],
        first_clip(body[60:]) * leg_lengths(body[60:], WALK.time_s[60:], (30,))[0],
    )


def test_true_stances_of_the_walker_are_those_of_a_gait_laboratory():
    found = true_contact(WALK.world, WALK.time_s)
    lifted = true_contact(WALK.world + np.array([3.0, -2.0, 7.0]), WALK.time_s)
    for side, strikes in WALK.heel_strikes_s.items():
        start, stop = found[side].T
        np.testing.assert_allclose(lifted[side], found[side], atol=1e-6)
        assert np.nanmin(np.abs(start[:, None] - strikes[1:]), axis=0).max() < 0.03
        share = np.nanmedian(stop - start) / np.median(np.diff(strikes))
        assert 0.6 < share < 0.67  # 0.62 in truth (Perry & Burnfield 2010)


# --- steps beside a walk that only the knees show

FADING_S = np.arange(0, 6, 1 / 30)
LANDS = np.arange(0.8, 5.4, 0.5)  # left and right in turn; each knee swings 0.2 s before its foot lands
KNEES = {
    side: 10 + 50 * sum(np.exp(-(((FADING_S - at_s + 0.2) / 0.08) ** 2)) for at_s in LANDS[first::2])
    for first, side in enumerate("lr")
}
FADED = [Step("rl"[i % 2], at_s, at_s + 0.5) for i, at_s in enumerate(LANDS[:-1])]
EVERYWHERE = np.ones(len(FADING_S), dtype=bool)


def faded(seen: slice, knees=KNEES, hidden=EVERYWHERE):
    swings = {side: swings_of(x, FADING_S) for side, x in knees.items()}
    return faded_steps(FADED[seen], knees, swings, FADING_S, hidden)


@pytest.mark.parametrize("seen", [slice(3, 6), slice(0, 3), slice(6, 9)])
def test_the_steps_before_and_behind_a_walk_keep_its_rhythm(seen):
    """A man walked towards the camera for 4.8 s in 7 even steps: "walked 3 steps in 1.8 s"."""
    before, behind = faded(seen)
    for found, true in ((before, FADED[: seen.start]), (behind, FADED[seen.stop :])):
        assert [step.side for step in found] == [step.side for step in true]
        times = [[at_s for step in steps for at_s in (step.start_s, step.stop_s)] for steps in (found, true)]
        np.testing.assert_allclose(*times, atol=0.05)


def test_where_steps_can_be_seen_the_knees_tell_none():
    assert faded(slice(3, 6), hidden=FADING_S < 0) == ([], [])
    before, behind = faded(slice(3, 6), hidden=FADING_S > 3)
    assert (before, len(behind)) == ([], 3)


@pytest.mark.parametrize("stops_s", [3.75, 4.25])
def test_a_walk_ends_where_the_knees_rest_or_bend_together(stops_s):
    rests = {side: np.where(stops_s < FADING_S, 10, x) for side, x in KNEES.items()}
    crouches = {side: np.where(stops_s < FADING_S, KNEES["l"] + KNEES["r"], x) for side, x in KNEES.items()}
    for knees in (rests, crouches):
        _, behind = faded(slice(2, 5), knees)
        assert all(step.stop_s < stops_s + 0.3 for step in behind)


@pytest.mark.parametrize(("turn_deg", "hidden"), [(0, True), (25, True), (60, False), (180, True)])
def test_who_comes_towards_the_camera_or_goes_away_walks_along_its_sight(turn_deg, hidden):
    a, ahead = np.radians(turn_deg), CAMERA.basis[2]
    towards = -ahead * np.cos(a) + CAMERA.basis[0] * np.sin(a)
    R = np.eye(3)[None].copy()
    R[0, :, 0] = -towards
    assert along_sight(R, CAMERA).tolist() == [hidden]
    assert along_sight(R, Z_UP).tolist() == [False]


def test_steps_that_are_depth_are_counted_and_are_in_no_mean():
    """Of a walk towards the camera only the middle was found."""
    motion = motion_of(measured(seen_from(walker(seconds=12, turn_deg=0), 0.0), GEOMETRIC[:3]))
    gait = gait_of(motion)
    (whole,) = walks_of(motion, gait)
    (part,) = walks_of(motion, replace(gait, walks=[list(whole.steps[2:5])]))
    assert part.every.index(part.steps[0]) >= 2
    assert part.every[-1] != part.steps[-1]
    assert abs(len(part.every) - len(whole.every)) <= 1
    assert walks_of(motion, Gait(gait.feet, [])) == []
