"""Outcomes of movements: a knee bend that takes up a landing is no squat, and what cannot be seen is not absent."""

import re
from itertools import pairwise
from types import MappingProxyType

import numpy as np
import pytest

from pcnet3d.models.gait.events import Stance, Step
from pcnet3d.models.gait.gait import Gait
from pcnet3d.models.place.airborne import Airborne
from pcnet3d.pipeline.core.measures import CANNOT_BE_TOLD, NONE, SEEN, Measure, Remark, nested
from pcnet3d.pipeline.core.notices import notice
from pcnet3d.pipeline.signals.doubtful_flights import Hop
from pcnet3d.pipeline.signals.flights import Flight
from pcnet3d.stages.measures.columns import Columns
from pcnet3d.stages.measures.jumps import (
    _contacts,
    _Errors,
    cut_jumps,
    goes_on,
    jumping,
    jumps,
    unsure_hops,
    without_leaps,
    without_slips,
)
from pcnet3d.stages.measures.movements import knee_bends
from pcnet3d.stages.measures.outcomes import BRIEFEST_S, doubts_of, with_outcome
from pcnet3d.stages.measures.stage import Measures

TIMES = np.arange(0, 6, 1 / 30)


@pytest.mark.parametrize(
    ("lowest_s", "count"), [((2.3,), 0), ((1.2,), 1), ((3.2,), 1), ((1.2, 2.3, 4.0), 2)], ids=str
)
def test_landing_is_no_squat(lowest_s, count):
    jump = Flight(off_s=1.6, apex_s=1.85, land_s=2.1, fall=5.8, rise=0.18, off_feet=2, land_feet=2)
    bends, _ = bent(dips(*lowest_s), [jump])
    assert (bends["count"], bends.get("squats", 0)) == (count, count)


def bent(knee_deg, jumps=(), ankle=None, sd_deg=None, against=MappingProxyType({})):
    """(figures, landings) of both knees that bend alike, of feet that stand."""
    columns = {f"{side}_knee_flexion_deg": knee_deg for side in "rl"}
    if sd_deg is not None:
        columns |= {f"{side}_knee_flexion_sd_deg": np.full(len(TIMES), sd_deg) for side in "rl"}
    of, gait = Columns(columns, TIMES, (), judged=True), Gait({"r": [], "l": []}, [])
    rows, landings = knee_bends(of, gait, [*jumps], ankle, np.zeros(len(TIMES)), True, against)
    return nested(rows), landings


def dips(*lowest_s: float, deg: float = 90) -> np.ndarray:
    """(T,) the angle of a knee that bends at these times."""
    return sum(deg * np.exp(-(((TIMES - low_s) / 0.25) ** 2)) for low_s in lowest_s)


def hopped(statures: float) -> np.ndarray:
    """(T,) the lower ankle of somebody who is off the floor from 1.7 to 2.1 s."""
    return 0.04 + statures * np.clip(1 - ((TIMES - 1.9) / 0.2) ** 2, 0, None)


def test_a_dip_too_small_to_count_leaves_no_doubt_about_others():
    """A dip of 25 degrees behind a hop made "squatted at least once" of one squat."""
    bends, _ = bent(dips(2.3, deg=25) + dips(4.0), ankle=hopped(0.08), sd_deg=6.0)
    assert bends["count"] == 1
    assert "count_reason" not in bends


@pytest.mark.parametrize(
    ("lowest_s", "statures", "count", "doubt"),
    [
        ((2.3,), 0.08, 0, {"reason"}),
        ((2.3, 4.0), 0.08, 1, {"count_reason"}),
        ((2.3,), 0.045, 1, set()),
        ((2.9,), 0.08, 1, set()),
    ],
)
def test_a_bend_that_may_be_a_landing_is_not_counted_and_not_denied(lowest_s, statures, count, doubt):
    """Jumping jacks were "squatted twice", also behind a hop that was not found. 0.045: feet that come off their
    toes."""
    ankle = np.where((TIMES > 1.2) & (TIMES < 1.3), np.nan, hopped(statures))
    bends, landings = bent(dips(*lowest_s), ankle=ankle)
    assert bends["count"] == count
    assert {"reason", "count_reason"} & bends.keys() == doubt
    jumped = nested(with_outcome("jumps", jumps(Airborne(), [], [], [], None, landings), 6.0))
    assert jumped["outcome"] == (CANNOT_BE_TOLD if doubt else NONE)


@pytest.mark.parametrize(("begins_s", "count"), [(3.75, 0), (3.2, 1)])
@pytest.mark.parametrize("cut", [False, True])
def test_a_bend_with_which_a_clip_begins_may_be_a_landing(begins_s, count, cut):
    """Of a captured jump, cut at its touchdown, the landing was "squatted once"."""
    first = int(np.searchsorted(TIMES, begins_s))
    columns = {f"{side}_knee_flexion_deg": dips(1.5, 4.0)[0 if cut else first :] for side in "rl"}
    of = Columns(columns, TIMES[0 if cut else first :], (first,) if cut else (), judged=True)
    none, still = Gait({"r": [], "l": []}, []), np.zeros(len(of.times))
    bends = nested(knee_bends(of, none, [], None, still, True, {})[0])
    assert bends["count"] == count + cut
    assert bool({"reason", "count_reason"} & bends.keys()) != count


def test_a_flight_of_legs_off_their_keypoints_is_not_counted_and_not_denied():
    """A policeman "jumped at least once": a detector had laid his legs on the car behind him for five frames."""
    flight = Flight(off_s=1.6, apex_s=1.85, land_s=2.1, fall=5.8, rise=0.18, off_feet=2, land_feet=2)
    for limb, count in (("l_leg", 0), ("l_arm", 1)):
        airborne = without_slips(Airborne((flight,)), {limb: [(1.8, 1.9)]})
        gait = Gait({"r": [], "l": []}, [])
        assert len(jumping(airborne, gait)) == count
        assert len(unsure_hops(airborne, gait)) == 1 - count


@pytest.mark.parametrize(("hop", "contacts"), [((), 1), (((2.2, 2.3),), 0), (((5.0, 5.1),), 1)])
def test_between_jumps_with_an_uncertain_hop_there_is_no_time_on_the_floor(hop, contacts):
    """Of four hops in jumping jacks three were told, and a second on the floor in which there was the fourth."""
    found = [
        Flight(off_s=at, apex_s=at + 0.15, land_s=at + 0.3, fall=5.8, rise=0.06, off_feet=2, land_feet=2)
        for at in (1.6, 2.6)
    ]
    assert len([*_contacts(found, [_Errors(0.03, 0.02)] * 2, hop)]) == contacts


def test_a_bend_of_one_frame_is_not_counted_and_not_denied():
    """Of a man in ten frames a second the arm was "raised once to 123 degrees (± 12)" in one frame, in which the
    detector had gone astray."""
    knee = dips(4.0)
    knee[60:63] = 30, 90, 30
    bends, _ = bent(knee)
    assert (bends["count"], "count_reason" in bends) == (1, True)
    bends, _ = bent(np.where(TIMES < 3, knee, 0.0))
    assert (bends["count"], "reason" in bends) == (0, True)


@pytest.mark.parametrize(("unstated_deg", "doubt"), [(0.0, False), (8.0, True)])
def test_a_near_miss_beside_another_is_told_of_unknown_errors_alone(unstated_deg, doubt):
    """A boxer's knees, lifted from one image each, "bent once"; they bent six times."""
    columns = {f"{side}_knee_flexion_deg": dips(2.3, deg=32) + dips(4.0, deg=40) for side in "rl"}
    of = Columns(columns, TIMES, (), False, unstated_deg)
    none = Gait({"r": [], "l": []}, [])
    bends = nested(knee_bends(of, none, [], None, np.zeros(len(TIMES)), True, {})[0])
    assert (bends["count"], "count_reason" in bends) == (1, doubt)


@pytest.mark.parametrize(("sd_deg", "count", "doubt"), [(1.0, 2, False), (15.0, 1, True)])
def test_a_bend_that_is_deep_enough_but_not_beyond_its_noise_is_not_denied_beside_another(
    sd_deg, count, doubt
):
    """Two jumping jacks at half speed: of two equal bends, by 51 and 44 degrees, "bent the knees once"."""
    columns = {f"{side}_knee_flexion_deg": dips(2.3, deg=60) + dips(4.0, deg=40) for side in "rl"}
    columns |= {f"{side}_knee_flexion_sd_deg": np.full(len(TIMES), sd_deg) for side in "rl"}
    of = Columns(columns, TIMES, (), judged=True)
    bends = nested(knee_bends(of, Gait({"r": [], "l": []}, []), [], None, np.zeros(len(TIMES)), True, {})[0])
    assert (bends["count"], "count_reason" in bends) == (count, doubt)


@pytest.mark.parametrize(
    ("lowest_s", "count", "doubt"), [((2.3,), 0, {"reason"}), ((2.3, 4.0), 1, {"count_reason"})]
)
def test_a_bend_of_a_leg_off_its_keypoints_is_not_counted_and_not_denied(lowest_s, count, doubt):
    bends, landings = bent(dips(*lowest_s), against={"l_leg": [(2.2, 2.4)], "r_arm": [(3.9, 4.1)]})
    assert (bends["count"], landings) == (count, [])
    assert {"reason", "count_reason"} & bends.keys() == doubt


@pytest.mark.parametrize(("steps_told", "outcome"), [(True, NONE), (False, CANNOT_BE_TOLD)])
def test_a_bend_with_feet_that_seem_to_move_is_none_only_where_steps_are_seen(steps_told, outcome):
    """Somebody faces the camera, so that how far the feet are apart is depth, as in steps that cannot be counted."""
    columns = {f"{side}_knee_flexion_deg": 60 * np.exp(-(((TIMES - 3) / 0.4) ** 2)) for side in "rl"}
    apart = np.where(TIMES < 3, 0.0, 1.0)
    of, gait = Columns(columns, TIMES, (), False), Gait({"r": [], "l": []}, [])
    bends, _ = knee_bends(of, gait, [], None, apart, steps_told, {})
    assert nested(with_outcome("knee_bends", bends, 6.0))["outcome"] == outcome


@pytest.mark.parametrize("movement", ["walking", "knee_bends", "arm_raises", "jumps"])
def test_what_a_take_is_too_short_for_is_not_said_to_be_absent(movement):
    for lasts_s, outcome in [(0.2, CANNOT_BE_TOLD), (3.0, NONE)]:
        assert nested(with_outcome(movement, [Measure("count", 0)], lasts_s))["outcome"] == outcome
        assert nested(with_outcome(movement, [Measure("count", 1)], lasts_s))["outcome"] == SEEN


@pytest.mark.parametrize("looked", [True, False])
def test_a_single_frame_is_reason_enough(looked):
    """Beside it stood that the place in the room is not known and that the take is not levelled."""
    rows = [Measure("count", 0), Remark("reason", "the take is not levelled")]
    said = nested(with_outcome("jumps", rows, 0.0, looked))
    assert said["outcome"] == CANNOT_BE_TOLD
    assert said["reason"] == nested(with_outcome("walking", [], 0.0))["reason"]


@pytest.mark.parametrize("frames", [6, 45])
def test_a_take_that_is_too_short_is_not_said_to_last_another_time_than_the_page_says(frames):
    """Of 6 frames, 0.2 s on the page, 0.167 s were said to be too short; and of 45 frames 1.5 s, which is the length
    that a walk takes at least."""
    said = nested(with_outcome("walking", [Measure("steps", 0)], (frames - 1) / 30))
    assert said["outcome"] == CANNOT_BE_TOLD
    assert not re.search(r"\d", said["reason"])


@pytest.mark.parametrize("code", ["nobody-upright", "picture-upside-down", "upside-down", "on-its-side"])
@pytest.mark.parametrize(("weight", "none_is"), [("suspicious", CANNOT_BE_TOLD), ("warning", NONE)])
def test_in_an_image_that_may_be_turned_nothing_is_said_to_be_absent(take, code, weight, none_is):
    """A woman walked in a video on its side, and the page said that there was no walking."""
    said = notice(code, weight=weight, off_deg=60, share_percent=100)
    before, after = (nested(Measures()(one).measures) for one in (take, take.saying(said)))
    groups = [name for name in BRIEFEST_S if name in before]
    codes = {before[name]["outcome"] for name in groups}
    assert {SEEN, NONE} <= codes
    for name in groups:
        outcome = before[name]["outcome"]
        assert after[name]["outcome"] == (SEEN if outcome == SEEN else none_is)


@pytest.mark.parametrize("code", ["slow-motion-stated", "rate-against-movement", "fps-contradicts"])
def test_at_a_frame_rate_that_may_be_wrong_nothing_that_takes_its_time_is_said_to_be_absent(take, code):
    """Jumping jacks in slow motion fall at a quarter of gravity, and the page said that there were no jumps."""
    values = {f"{name}_fps": 30 for name in ("captured", "shown", "used")}
    said = notice(code, **values, fps=30, movement="", times=2, fits=60, way="slowly", source="file")
    before, after = (nested(Measures()(one).measures) for one in (take, take.saying(said)))
    doubted = code != "fps-contradicts"  # the user has said it
    for name in filter(before.get, BRIEFEST_S):
        outcome, by_time = before[name]["outcome"], name not in ("knee_bends", "arm_raises")
        hides = doubted and by_time and outcome == NONE
        assert after[name]["outcome"] == (CANNOT_BE_TOLD if hides else outcome)


def run(*later: float) -> Gait:
    lands = [1.0, 1.4, 1.8, 2.15, *(later or (2.95, 3.35, 3.75))]
    feet = {side: [Stance(side, at, at + 0.25) for at in lands[first::2]] for first, side in enumerate("rl")}
    steps = [Step("lr"[i % 2], start, stop) for i, (start, stop) in enumerate(pairwise(lands))]
    return Gait(feet, [steps])


def test_a_leap_is_no_step_of_the_run_that_it_ends():
    """A leap over a hurdle made the fourth step of a run, and its flight of 0.5 s the run's mean."""
    leap = Flight(off_s=2.4, apex_s=2.65, land_s=2.9, fall=5.8, rise=0.18, off_feet=1, land_feet=1)
    assert run().kind == "running"
    assert [len(walk) for walk in without_leaps(run(), [leap]).walks] == [3, 2]
    assert without_leaps(run(), []).walks == run().walks


@pytest.mark.parametrize(
    ("begin_s", "end_s", "jump_s", "cut"),
    [
        (-0.5, 5.5, None, False),
        (0.5, 5.5, None, True),
        (-0.5, 4.2, None, True),
        (-0.5, 5.5, (4.1, 4.6), True),
        (-0.5, 5.5, (0.2, 0.7), True),
        (-0.5, 5.5, (4.9, 5.2), False),
    ],
)
def test_steps_are_the_least_where_a_walk_is_not_seen_to_begin_and_end(begin_s, end_s, jump_s, cut):
    """Three steps were told of a video that shows four, and three of a run that goes on into a leap."""
    time_s = np.arange(begin_s, end_s, 1 / 30)
    jumped = [Flight(jump_s[0], 0.0, jump_s[1], 5.8, 0.18, 1, 1)] if jump_s else []
    assert bool(goes_on(run(), [slice(0, len(time_s))], time_s, jumped)) == cut


@pytest.mark.parametrize(("clear", "count"), [(0.1, 0), (0.24, 1)])
def test_a_hop_among_the_steps_of_a_run_is_a_jump_by_how_high_the_feet_get(clear, count):
    """Who hopped in a run, the ankle 0.4 m up, did not jump: a flight of 0.28 s was a stride."""
    flight = Flight(1.8, 1.92, 2.05, 5.8, 0.06, 1, 1, clear)
    assert len(jumping(Airborne((flight,)), run())) == count
    assert len(unsure_hops(Airborne(uncertain=(Hop(1.8, 2.05, clear),)), run())) == count


def test_no_foot_lands_in_the_air():
    """A foot reached ahead in a leap, and was the fourth step of a run. Where it stood at 0.9 m told the floor."""
    leap = Flight(off_s=2.35, apex_s=2.6, land_s=2.85, fall=5.8, rise=0.18, off_feet=1, land_feet=1)
    grounded = without_leaps(run(2.5), [leap])
    assert [len(walk) for walk in grounded.walks] == [3]
    stood = [stance.start_s for of in grounded.feet.values() for stance in of]
    assert sorted(stood) == [1.0, 1.4, 1.8, 2.15]


def test_a_run_that_the_take_begins_in_is_no_jump():
    cut = ((0.85, 0.98), (9.0, 9.1))
    assert cut_jumps(Airborne(cut=cut), run()) == [(9.0, 9.1)]
    assert cut_jumps(Airborne(cut=cut), Gait({"r": [], "l": []}, [])) == list(cut)


@pytest.mark.parametrize(("share", "hides"), [(0.4, set()), (0.6, {"arm_raises"})])
def test_of_a_limb_that_is_guessed_in_most_frames_nothing_is_said_to_be_absent(share, hides):
    """At night the detector was unsure of the legs in 97 % of the frames, and the page said "No walking"."""
    joints = [f"{side}_{joint}" for side in "rl" for joint in ("knee", "ankle", "elbow", "wrist")]
    guessed = np.arange(10) < 10 * share
    one, all_of = (
        doubts_of([], {joint: guessed & (joint[0] in sides) for joint in joints}) for sides in ("r", "rl")
    )
    for doubt, hidden in ((one, hides), (all_of, set(BRIEFEST_S) if hides else set())):
        for movement in BRIEFEST_S:
            none, some = (
                nested(with_outcome(movement, [Measure("count", n)], 3.0, doubt=doubt)) for n in (0, 1)
            )
            assert none["outcome"] == (CANNOT_BE_TOLD if movement in hidden else NONE)
            assert some["outcome"] == SEEN


def test_in_a_picture_nobody_moves_or_holds_still():
    doubt = doubts_of([notice("image-still")], {})
    for count in (0, 1):
        said = nested(with_outcome("arm_raises", [Measure("count", count)], 4.0, doubt=doubt))
        assert said["outcome"] == CANNOT_BE_TOLD
