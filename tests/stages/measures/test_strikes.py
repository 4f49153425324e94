"""Punches and kicks, holds, and where a repetition begins: known answers of made-up limbs and signals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from golden.measures import rows_of
from pcnet3d.pipeline import CAMERA, PoseSequence, Take
from pcnet3d.pipeline.core.answer import answer
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.measures import CANNOT_BE_TOLD, NONE, SEEN, grouped, nested, within
from pcnet3d.stages.measures.columns import Columns
from pcnet3d.stages.measures.cycles import repetitions
from pcnet3d.stages.measures.figures import moments
from pcnet3d.stages.measures.movements import BEND, arm_raises
from pcnet3d.stages.measures.outcomes import with_outcome
from pcnet3d.stages.measures.repeats import repeats
from pcnet3d.stages.measures.strikes import HIDES_PUNCHES, _kicks, _Limb, _once, _punches, _trimmed, strikes
from pcnet3d.stages.report.measures import happened

# A person who stands: hips, knees, ankles, arms that hang.
BODY = np.zeros((17, 3))
for side, across in (("r", 0.2), ("l", -0.2)):
    heights = {"hip": 0.0, "knee": -0.45, "ankle": -0.9, "shoulder": 0.5, "elbow": 0.2, "wrist": -0.05}
    for part, height in heights.items():
        BODY[H36M17.index(f"{side}_{part}")] = across, 0.0, height
BODY[H36M17.index("thorax"), 2] = 0.5

TIMES = np.arange(0, 12, 1 / 30)


def bump(at_s, width_s, high):
    return high * np.exp(-(((TIMES - at_s) / width_s) ** 2))


LEVELLED = SimpleNamespace(level_ok=True, level_reason="")


def swung(by_deg, width_s=0.3):
    """The right leg, straight, swings forward by so many degrees at 6 s, and back."""
    turn = np.radians(bump(6, width_s, by_deg))
    joints = np.repeat(BODY[None], len(TIMES), axis=0)
    for part, below in (("knee", 0.45), ("ankle", 0.9)):
        joints[:, H36M17.index(f"r_{part}"), 1] = -below * np.sin(turn)
        joints[:, H36M17.index(f"r_{part}"), 2] = -below * np.cos(turn)
    return PoseSequence(joints, H36M17, CAMERA, time_s=TIMES)


def test_what_moves_before_a_rise_is_no_part_of_it():
    """Arms that swing to 40 degrees at 2 to 5 s, and rise to 140 at 8 s: the rise begins after 5 s."""
    x = 10 + sum(bump(at, 0.3, 40) for at in (2, 3, 4, 5)) + bump(8, 0.8, 130)
    (one,) = repetitions(x, TIMES, 70)
    assert 6 < one.start_s < 7.5
    assert one.rise == pytest.approx(130, rel=0.05)


@pytest.fixture
def held():
    """Figures of an angle that is held from 3 to 8 s."""
    x = 10 + 100 * np.clip(np.minimum(TIMES - 2, 9 - TIMES), 0, 1)
    columns = Columns({"x_deg": x}, TIMES, (), False)
    return repeats(columns, "knee_flexion", x, np.full(len(TIMES), np.nan), BEND, [])


def test_a_hold_is_no_repetition(held):
    found = nested(held)
    assert found["count"] == 0
    holds = found["holds"]
    assert holds["count"] == 1
    assert holds["longest_s"] == pytest.approx(5.4, abs=0.2)
    # "From 8.10 to 14.43 s, the longest 3.2 s": the first was of the way up as well.
    assert holds["stop_s"][0] - holds["start_s"][0] == pytest.approx(holds["longest_s"])


def raised(columns, against):
    """The groups of both arms, whose elevations are given (T,)."""
    nothing = np.full(len(TIMES), np.nan)
    names = [f"{side}_{part}" for side in "rl" for part in ("shoulder_flexion", "elbow_flexion")]
    columns = {f"{name}_deg": nothing for name in names} | columns
    return nested(arm_raises(Columns(columns, TIMES, (), True), grouped([]), None, against))


def test_a_raise_of_an_arm_off_its_keypoints_is_not_counted_and_not_denied():
    """A detector had given a woman the raised arm of the man beside her."""
    told = raised(
        {f"{side}_shoulder_elevation_deg": bump(3, 0.5, 90) for side in "rl"}, {"l_arm": [(2.8, 3.1)]}
    )
    assert (told["right"]["count"], "reason" in told["right"]) == (1, False)
    assert (told["left"]["count"], "reason" in told["left"]) == (0, True)


@pytest.mark.parametrize(("unsure", "count"), [((2.8, 3.2), 1), ((2.0, 3.6), 0)])
def test_a_raise_counts_by_what_is_seen_while_the_elbow_is_sure(unsure, count):
    """The plainest raise of a dancer was left out, because the detector was unsure of the elbow at the top."""
    arms = {f"{side}_shoulder_elevation_deg": 10 + bump(3, 0.7, 130) for side in "rl"}
    told = raised(arms, {"l_elbow": [unsure]})
    assert (told["right"]["count"], len(told["right"]["peak_deg"])) == (1, 1)
    assert (told["left"]["count"], "reason" in told["left"]) == (count, not count)
    assert not {"peak_deg", "mean_rise_deg", "count_reason"} & set(
        told["left"]
    )  # of a height that is not sure


@pytest.mark.parametrize(("deg", "sd_deg", "held"), [(130, 6.0, 1), (95, 6.0, 0), (95, 1.0, 1), (60, 1.0, 0)])
def test_an_arm_that_is_up_all_the_time_is_not_said_not_to_be_raised(deg, sd_deg, held):
    """Of a photograph of somebody with both arms overhead: "No arm raises"."""
    both = {f"{side}_shoulder_elevation_deg": np.full(len(TIMES), float(deg)) for side in "rl"}
    both |= {f"{side}_shoulder_elevation_sd_deg": np.full(len(TIMES), sd_deg) for side in "rl"}
    told = raised(both, {"l_elbow": [(0, 12)]})
    assert (told["right"]["count"], "reason" in told["right"], "holds" in told["left"]) == (0, False, False)
    assert told["right"].get("holds", {}).get("count", 0) == held
    raises = {
        "r_shoulder_elevation_deg": 100 + bump(3, 0.7, 70),
        "l_shoulder_elevation_deg": np.zeros(len(TIMES)),
    }
    assert "holds" not in raised(raises, {})["right"]  # it is raised once
    if held:
        assert "longest_reason" in told["right"]["holds"]
        assert told["right"]["holds"]["longest_s"] == pytest.approx(np.ptp(TIMES))


@pytest.mark.parametrize(("unsure", "count"), [((3.3, 12.0), 1), ((0.0, 2.7), 1), ((2.0, 12.0), 0)])
def test_a_raise_counts_at_least_whose_return_the_detector_is_unsure_of_to_the_end(unsure, count):
    """An arm rose from 20 to 153 degrees; then the detector was unsure of the elbow until the take's end: beside the
    range of 23 to 150 degrees stood that whether it was raised cannot be told."""
    arms = {f"{side}_shoulder_elevation_deg": 10 + bump(3, 0.7, 130) for side in "rl"}
    told = raised(arms, {"l_elbow": [unsure]})["left"]
    assert (told["count"], ["reason", "count_reason"][count] in told) == (count, True)


def test_a_raise_counts_whatever_the_largest_is():
    """Of a dancer's arm that rose to the horizontal beside raises over the head the page said that it was uncertain
    whether it rises by 50 degrees."""
    arms = {f"{side}_shoulder_elevation_deg": 10 + bump(3, 0.6, 150) + bump(8, 0.6, 68) for side in "rl"}
    sds = {f"{side}_shoulder_elevation_sd_deg": np.full(len(TIMES), 6.0) for side in "rl"}
    told = raised(arms | sds, {})["right"]
    assert (told["count"], "count_reason" in told) == (2, False)


def test_an_arm_that_punches_is_not_raised_too():
    """A boxer's arms were told twice. The right one is raised at 3 s, and punches at 8 s; the left one only punches."""
    punch = bump(8, 0.2, 80)
    arms = {"r_shoulder_elevation_deg": bump(3, 0.5, 90) + punch, "l_shoulder_elevation_deg": punch}
    none = dict.fromkeys(
        f"{side}_{part}_deg" for side in "rl" for part in ("shoulder_flexion", "elbow_flexion")
    )
    columns = Columns(arms | {name: np.full(len(TIMES), np.nan) for name in none}, TIMES, (), False)
    punches = [
        row
        for side in ("right", "left")
        for row in within(side, [moments("start", [7.8]), moments("stop", [8.2])])
    ]
    told = nested(arm_raises(columns, grouped(punches), None, {}))
    assert told["right"]["count"] == 1
    assert told["right"]["peak_at_s"] == [pytest.approx(3)]
    assert (told["left"]["count"], told["left"].get("reason")) == (0, None)


@pytest.mark.parametrize(
    ("width_s", "lifted", "count", "doubt"),
    [(0.2, True, 0, True), (0.2, False, 1, False), (1.0, True, 1, False)],
)
def test_a_lifted_raise_that_may_be_a_punch_is_not_counted_and_not_denied(width_s, lifted, count, doubt):
    """Of a boxer without keypoints, whose punches were not looked for, the arms were "raised 5 times to 90 degrees".
    The right hand goes from the guard straight forward and back."""
    joints = np.repeat(BODY[None], len(TIMES), axis=0)
    elbow, wrist = H36M17.indices(("r_elbow", "r_wrist"))
    ahead = bump(8, width_s, 1.0)
    rises = np.pi / 2 * ahead
    joints[:, elbow, 1:] = np.c_[-0.3 * np.sin(rises), 0.5 - 0.3 * np.cos(rises)]
    joints[:, wrist, 1:] = np.c_[-0.2 - 0.35 * ahead, 0.4 + 0.1 * ahead]
    level = PoseSequence(joints, H36M17, CAMERA, time_s=TIMES)
    nothing = np.full(len(TIMES), np.nan)
    columns = {
        f"{side}_{name}_deg": nothing for side in "rl" for name in ("shoulder_flexion", "elbow_flexion")
    }
    columns |= {"r_shoulder_elevation_deg": 90 * ahead, "l_shoulder_elevation_deg": 0 * ahead}
    take = Columns(columns, TIMES, (), False)
    told = nested(arm_raises(take, grouped([]), level if lifted else None, {}))["right"]
    assert told["count"] == count
    assert ("reason" in told) == doubt


def test_a_take_with_only_a_hold_says_so(held):
    bends = with_outcome("knee_bends", held, 12.0)
    assert nested(bends)["outcome"] == SEEN
    poses = PoseSequence(np.zeros((31, 17, 3)), H36M17, CAMERA, time_s=np.arange(31) / 10)
    said = answer(Take("take", poses=poses, measures=tuple(within("knee_bends", bends))))
    assert said == ["Held the knees bent once, for 5.3 s."]
    page = happened(within("knee_bends", bends), "m")
    assert "holds" in page.lower()
    assert "not found" not in page


def test_without_a_punch_lifted_poses_do_not_say_that_there_was_none():
    """The lifter shows one labelled punch in seven, and nearly every kick."""
    level = PoseSequence(
        np.random.default_rng(0).normal(size=(60, 17, 3)) * 0.001 + BODY, H36M17, CAMERA, time_s=TIMES[:60]
    )
    for lifted, punches in ((True, CANNOT_BE_TOLD), (False, NONE)):
        found = strikes(level, LEVELLED, lifted)
        assert nested(with_outcome("punches", found["punches"], 2.0))["outcome"] == punches
        assert nested(with_outcome("kicks", found["kicks"], 2.0))["outcome"] == NONE
    unsure = strikes(level, LEVELLED, True, {f"{side}_arm": np.full(60, np.nan) for side in "rl"})["punches"]
    assert nested(unsure)["right"]["reason"] == HIDES_PUNCHES  # there was an image


def test_a_lifted_arm_that_never_reaches_out_does_not_punch():
    """Every page of a walk said that punches cannot be told."""
    level = PoseSequence(np.repeat(BODY[None], 60, axis=0), H36M17, CAMERA, time_s=TIMES[:60])
    image = {f"{side}_arm": np.ones(60) for side in "rl"}
    moved = level.joints.copy()
    moved[20:40, H36M17.indices(["r_wrist"])[0]] += np.sin(np.linspace(0, np.pi, 20))[:, None] * [
        0,
        -0.3,
        0.3,
    ]
    for poses, hides in ((level, False), (level.with_(joints=moved), True)):
        found = nested(strikes(poses, LEVELLED, True, image)["punches"])
        assert ["reason" in found[side] for side in ("right", "left")] == [hides, False]


def test_a_guard_that_rises_slowly_is_no_part_of_the_punch():
    """The arm opens a little from 2 s on and shoots out at 6 s: the punch lasts under a second."""
    reach = 0.4 + 0.05 * np.clip((TIMES - 2) / 3, 0, 1) + bump(6, 0.12, 0.5)
    (one,) = repetitions(reach, TIMES, 0.25)
    limb = _Limb(reach, *(np.zeros_like(TIMES) for _ in range(4)), driver=reach)
    punch = _trimmed(limb, TIMES, one)
    assert 5.6 < punch.start_s < 6 < punch.stop_s < 6.4


def test_keypoints_that_tremble_before_a_lifted_punch_are_no_part_of_it():
    """It began 0.6 s early, at the fastest frame of all."""
    reach = 0.5 + 0.45 * np.exp(-((TIMES - 2) ** 2) / 0.01)
    image = reach + np.where(np.abs(TIMES - 1.3) < 0.02, 0.3, 0.0)
    (one,) = repetitions(reach, TIMES, 0.3)
    limb = _Limb(reach, *([np.zeros_like(reach)] * 4), driver=reach, image=image)
    punch = _trimmed(limb, TIMES, replace(one, start_s=1.0, stop_s=2.9))
    assert (punch.start_s, punch.stop_s) == pytest.approx((1.8, 2.2), abs=0.07)


def test_punches_and_kicks_are_told_by_side():
    right, left = {"count": 5, "count_reason": "lifted poses hide some"}, {"count": 1}
    measures = rows_of(
        {"punches": {"right": right, "left": left}, "kicks": {"right": {"count": 2}, "left": {"count": 0}}}
    )
    poses = PoseSequence(np.zeros((31, 17, 3)), H36M17, CAMERA, time_s=np.arange(31) / 10)
    assert answer(Take("take", poses=poses, measures=measures))[0] == (
        "Punched at least 5 times with the right arm (lifted poses hide some) and once with the left arm; "
        "kicked twice with the right leg."
    )


def test_a_slow_or_swung_arm_is_no_punch_and_a_slow_leg_no_kick():
    reach = 0.4 + bump(6, 0.12, 0.5)
    (one,) = repetitions(reach, TIMES, 0.25)
    zeros = np.zeros(len(TIMES))
    for away, across, counts in ((1.0, 0.0, False), (6.0, 1.0, True), (6.0, 9.0, False)):
        limb = _Limb(reach, zeros, zeros + away, zeros + away, zeros + across, reach)
        assert _punches(limb, TIMES, one) is counts


@pytest.mark.parametrize(
    ("speed", "height", "reach", "out", "counts"),
    [
        (6.0, 1.1, 0.95, 0.9, True),
        (1.0, 1.1, 0.95, 0.9, False),  # slow
        (4.3, 0.59, 0.8, 0.28, False),  # a skater's foot that flicked up behind was a kick
        (5.7, 0.56, 0.8, 0.67, False),  # and so was the leading leg of a leap
        (6.0, 1.1, 0.5, 0.4, False),  # a knee that is lifted
    ],
)
def test_a_kick_is_fast_high_stretched_and_away_from_the_body(speed, height, reach, out, counts):
    rises = bump(6, 0.3, height)
    (one,) = repetitions(rises, TIMES, 0.5)
    zeros = np.zeros(len(TIMES))
    limb = _Limb(zeros + reach, rises, zeros + speed, zeros, zeros, rises, out=zeros + out)
    assert _kicks(limb, TIMES, one) is counts


@pytest.mark.parametrize(("apart_sd", "code"), [(0.0, NONE), (0.02, NONE), (0.12, CANNOT_BE_TOLD)])
def test_a_foot_that_misses_a_kick_by_less_than_its_error_is_not_denied(apart_sd, code):
    """A straight leg swings forward, and its foot rises by 0.7 leg lengths."""
    found = strikes(swung(73), LEVELLED, True, apart_sd=apart_sd)
    assert nested(with_outcome("kicks", found["kicks"], 12.0))["outcome"] == code


def test_a_foot_that_is_fast_but_low_is_not_denied_as_a_kick():
    """A foot that kicks a ball at 12 m/s and rises by 0.6 leg lengths: "No kicks". A slower one steps."""
    for width_s, code in ((0.06, CANNOT_BE_TOLD), (0.4, NONE)):
        found = strikes(swung(66, width_s), LEVELLED, False)
        assert nested(with_outcome("kicks", found["kicks"], 12.0))["outcome"] == code


@pytest.mark.parametrize(("width_s", "code"), [(0.1, SEEN), (0.3, CANNOT_BE_TOLD), (0.8, NONE)])
def test_a_punch_that_is_only_slow_is_not_denied(width_s, code):
    """Nine straight punches at up to 2.8 m/s: "No punches"."""
    joints = np.repeat(BODY[None], len(TIMES), axis=0)
    shoulder, reach = BODY[H36M17.index("r_shoulder")], 0.2 + bump(6, width_s, 0.38)
    for part, share in (("elbow", 0.5), ("wrist", 1.0)):
        below = np.sqrt(0.09 - reach**2 / 4) * (part == "elbow")
        joints[:, H36M17.index(f"r_{part}")] = shoulder - np.stack([0 * reach, share * reach, below], axis=-1)
    found = strikes(PoseSequence(joints, H36M17, CAMERA, time_s=TIMES), LEVELLED, False)
    assert nested(with_outcome("punches", found["punches"], 12.0))["outcome"] == code


def test_a_leg_that_rises_in_a_handstand_does_not_kick():
    joints = swung(95).joints.copy()
    joints[:, H36M17.index("thorax"), 2] *= -1
    level = PoseSequence(joints, H36M17, CAMERA, time_s=TIMES)
    told = nested(strikes(level, LEVELLED, False)["kicks"])["right"]
    assert (told["count"], "reason" in told) == (0, True)


def test_a_leg_that_swings_in_a_run_or_a_leap_does_not_kick():
    """A straight leg swings forward to the height of the hip and back, at 6 s."""
    level = swung(95)

    def kicks(**moves):
        return nested(strikes(level, LEVELLED, False, **moves)["kicks"])["right"]["count"]

    assert kicks() == kicks(runs=[(2, 3)]) == kicks(flies=[(2, 2.5)]) == 1
    assert kicks(runs=[(5.7, 6.2)]) == kicks(flies=[(5.9, 6.3)]) == 0
    leaping = level.joints.copy()  # where a lifter loses the leg for a frame
    leaping[int(np.searchsorted(TIMES, 6)), H36M17.index("r_ankle")] += [0, 0.9, 0]
    assert kicks(unfiltered=level) == 1
    assert kicks(unfiltered=level.with_(joints=leaping)) == 0


def test_a_lifted_punch_is_one_that_the_image_shows():
    """The lifter leaves 0.2 of the reach; the image has all of it, none of it, or is unknown."""
    reach = 0.55 + bump(6, 0.08, 0.25)
    (one,) = repetitions(reach, TIMES, 0.12)
    zeros = np.zeros(len(TIMES))
    for image, counts in ((0.4 + bump(6.05, 0.12, 0.6), True), (zeros + 0.6, False), (zeros + np.nan, False)):
        assert _punches(_Limb(reach, zeros, zeros, zeros, zeros, reach, image), TIMES, one) is counts


def test_a_lifted_arm_that_reaches_out_slowly_is_no_punch():
    """Backhands of a tennis player, at 1.1 to 1.5 arm lengths a second, were "punched at least 4 times"."""
    reach, zeros = 0.55 + bump(6, 0.15, 0.2), np.zeros(len(TIMES))
    (one,) = repetitions(reach, TIMES, 0.12)
    image = 0.4 + bump(6.05, 0.12, 0.6)
    assert not _punches(_Limb(reach, zeros, zeros, zeros, zeros, reach, image), TIMES, one)


@pytest.mark.parametrize(("runs", "count"), [((), 1), (((5.5, 6.5),), 0)])
def test_a_lifted_arm_that_swings_in_a_run_does_not_punch(runs, count):
    """A runner's arms "punched at least once". The right one goes straight ahead and back."""
    joints = np.repeat(BODY[None], len(TIMES), axis=0)
    ahead = bump(6, 0.1, 1.0)
    elbow, wrist = H36M17.indices(("r_elbow", "r_wrist"))
    joints[:, elbow, 1:] = np.c_[-0.3 * ahead, 0.2 + 0.3 * ahead]
    joints[:, wrist, 1:] = np.c_[-0.2 - 0.35 * ahead, 0.4 + 0.1 * ahead]
    level = PoseSequence(joints, H36M17, CAMERA, time_s=TIMES)
    image = {"r_arm": 0.4 + bump(6, 0.12, 0.6), "l_arm": np.zeros(len(TIMES))}
    elbows = dict.fromkeys("rl", np.zeros(len(TIMES)))
    told = nested(strikes(level, LEVELLED, True, image, runs, elbows=elbows)["punches"])["right"]
    assert (told["count"], "reason" in told) == (count, not count)


@pytest.mark.parametrize(("until_s", "counts"), [(5.8, True), (6.0, False)])
def test_a_punch_is_seen_on_its_way(until_s, counts):
    """The elbow of a dancer led her arm up; its angle was not known until the hand was at the height of the head, and
    she had "punched at least once"."""
    reach, image = 0.55 + bump(6, 0.08, 0.25), 0.4 + bump(6, 0.12, 0.6)
    (one,) = repetitions(reach, TIMES, 0.12)
    image[(TIMES > 5) & (until_s > TIMES)] = np.nan
    zeros = np.zeros(len(TIMES))
    image[np.searchsorted(TIMES, 5.7)] = 0.4  # a single frame
    assert _punches(_Limb(reach, zeros, zeros, zeros, zeros, reach, image), TIMES, one) is counts


def test_a_punch_that_the_image_shows_once_is_one():
    """Of a noisy lifter's five punches of a boxer two were counted twice, one of them 0.07 s long."""
    reach = 0.55 + bump(5.9, 0.05, 0.25) + bump(6.1, 0.05, 0.2)
    found = repetitions(reach, TIMES, 0.12)
    assert len(found) == 2
    twice = 0.4 + bump(5.9, 0.05, 0.6) + bump(6.1, 0.05, 0.6)
    assert _once(twice, TIMES, found) == found
    (punch,) = _once(0.4 + bump(6.1, 0.08, 0.6), TIMES, found)
    assert (punch.start_s, punch.stop_s, punch.peak) == (found[0].start_s, found[1].stop_s, found[0].peak)
