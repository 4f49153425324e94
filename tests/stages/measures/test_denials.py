"""What is said to be absent, and what cannot be told or was not looked for."""

import numpy as np
import pytest

from golden.walks import STAGES, columns_with, measured
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.models.gait.events import Step
from pcnet3d.models.gait.gait import Gait
from pcnet3d.models.gait.of_take import body_joints, gait_of
from pcnet3d.pipeline.core.measures import CANNOT_BE_TOLD, NONE, nested
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.measures.columns import Columns
from pcnet3d.stages.measures.movements import arm_raises, knee_bends
from pcnet3d.stages.measures.walking import walking


@pytest.mark.parametrize("joint", ["l_ankle", "r_wrist"])
def test_what_legs_or_arms_that_are_missing_would_show_is_not_said_to_be_absent(joint, without):
    """Jumps of a walker without an ankle were a count of 0."""
    found = nested(measured(without(joint, slice(None))).measures)
    assert found["jumps"] == {
        "outcome": "cannot-be-told",
        "reason": "fewer than 10 frames have the trunk, both arms and both legs",
    }


def test_no_repetition_within_its_noise(walk, take):
    vague = columns_with(
        take, **{f"{side}_shoulder_elevation_sd_deg": np.full(len(walk), 60.0) for side in "rl"}
    )
    assert nested(STAGES[3](take.with_(kinematics=vague)).measures)["arm_raises"]["right"]["count"] == 0


def bending(walk, take, angle, deg, sd_deg=None):
    """The take with an angle of both sides that rises to so many degrees as the knee does in the squat."""
    bent = take.kinematics["r_knee_flexion_deg"] * walk.during("squat")
    columns = {f"{side}_{angle}_deg": deg * bent / bent.max() for side in "rl"}
    if sd_deg is not None:
        columns |= {f"{side}_{angle}_sd_deg": np.full(len(walk), sd_deg) for side in "rl"}
    return take.with_(kinematics=columns_with(take, **columns))


def outcome(take, movement):
    return nested(STAGES[3](take).measures)[movement]["outcome"]


@pytest.mark.parametrize(("sd_deg", "code"), [(np.nan, NONE), (1.0, NONE), (6.0, CANNOT_BE_TOLD)])
@pytest.mark.parametrize(
    ("movement", "angle", "rise_deg"),
    [("arm_raises", "shoulder_elevation", 44.0), ("knee_bends", "knee_flexion", 29.0)],
)
def test_what_misses_its_threshold_by_less_than_its_error_is_not_denied(
    walk, take, movement, angle, rise_deg, sd_deg, code
):
    """An arm that rises by 48 of the 50 degrees that count, give or take 20: "No raised arms"."""
    assert outcome(bending(walk, take, angle, rise_deg, sd_deg), movement) == code


@pytest.mark.parametrize(("kind", "code"), [("measured", NONE), ("estimated", CANNOT_BE_TOLD)])
def test_a_lifter_whose_errors_are_not_known_errs_as_others_do(walk, kind, code):
    poses = camera_poses(walk, side_camera(walk)).with_(made_by=MadeBy(kind, "another"))
    take = measured(poses)
    assert outcome(bending(walk, take, "shoulder_elevation", 44), "arm_raises") == code


@pytest.mark.parametrize(
    ("depth_deg", "sd_deg", "told"),
    [(64, 2.0, "squats"), (64, 8.0, "squats_reason"), (76, 2.0, "squats"), (76, 8.0, "squats_reason")],
)
def test_a_bend_within_its_error_of_a_squat_is_neither_said_to_be_one_nor_none(
    walk, take, depth_deg, sd_deg, told
):
    """Landings that bend the knees to 71 ± 22 degrees were told as squats."""
    bends = nested(STAGES[3](bending(walk, take, "knee_flexion", depth_deg, sd_deg)).measures)["knee_bends"]
    assert bends["count"] == 1
    assert {"squats", "squats_reason"} & set(bends) == {told}


TIMES = np.arange(0, 6, 1 / 30)
BUMP = np.exp(-(((TIMES - 3) / 0.5) ** 2))  # half of it from 2.6 to 3.4 s


def bends(deg, apart, steps=(), leans=None, **columns):
    """knee_bends of both knees that bend to so many degrees at 3 s."""
    columns |= {f"{side}_knee_flexion_deg": deg * BUMP for side in "rl"}
    take = Columns(columns, TIMES, (), judged=True)
    gait = Gait({"r": [], "l": []}, [[Step("r", *steps)]] if steps else [])
    return nested(knee_bends(take, gait, [], None, apart, True, {}, leans)[0])


@pytest.mark.parametrize(
    ("deg", "moves_s", "by", "steps", "count", "doubt"),
    [
        # people who step to a stool, sit down and stand up: "no bends of both knees"
        (110, 2.4, 1.0, (), 1, False),
        (110, 2.4, 1.0, (1.5, 2.2), 1, False),
        (110, 3.0, 1.0, (), 0, True),
        (110, 2.4, 1.0, (2.8, 3.3), 0, False),
        (50, 2.4, 1.0, (), 0, False),  # as in steps
        (50, 2.4, 0.6, (), 0, True),  # a boxer ducks
        (50, 0.5, 1.0, (), 1, False),
    ],
)
def test_a_deep_bend_is_told_by_the_feet_while_it_is_deep(deg, moves_s, by, steps, count, doubt):
    told = bends(deg, np.where(moves_s < TIMES, by, 0.0), steps)
    assert (told["count"], "reason" in told) == (count, doubt)


@pytest.mark.parametrize(("sd_deg", "doubt"), [(1.0, False), (6.0, True)])
def test_a_bend_between_steps_within_its_error_of_a_squat_is_not_denied(sd_deg, doubt):
    """Of somebody who walked to a box, bent the knees to 69 degrees, which were 72, and walked on: "No bends"."""
    sd = {f"{side}_knee_flexion_sd_deg": np.full(len(TIMES), sd_deg) for side in "rl"}
    told = bends(66, np.where(TIMES > 2.4, 1.0, 0.0), (1.5, 2.2), **sd)
    assert (told["count"], "reason" in told) == (0, doubt)


@pytest.mark.parametrize(
    ("pelvis", "foot", "count"),
    [(1.0, 1.0, 0), (1.0, 0.0, 1), (0.3, 0.3, 1), (0.0, 1.0, 0), (np.nan, 1.0, 1)],
)
def test_feet_that_travel_while_the_knees_are_bent_do_not_stay_in_place(pelvis, foot, count):
    """Side steps of 0.95 m, in which the ankles are never one before the other: "Squatted at least once".
    pelvis, foot: lengths of a leg of 0.8 m that they move to the side."""
    way, still = np.clip(TIMES - 2.5, 0, 1), np.zeros(len(TIMES))
    leg = 0.8 * np.cos(np.radians(80 * BUMP) / 2)
    aside = {f"{side}_ankle_y": 0.8 * (foot - np.nan_to_num(pelvis)) * way for side in "rl"}
    down = {f"{side}_ankle_z": -leg for side in "rl"} | {f"{side}_ankle_x": still for side in "rl"}
    root = {"root_x": still, "root_y": 0.8 * pelvis * way, "root_z": still}
    told = bends(80, still, **aside, **down, **root)
    assert (told["count"], "reason" in told) == (count, not count)


@pytest.mark.parametrize(
    ("before", "highest", "behind", "counts"),
    [
        (5, 77, 5, True),
        (85, 85, 85, False),
        (96, 41, 36, False),
        (14, 176, 20, False),
        (np.nan, np.nan, 5, True),
    ],
)
def test_who_is_not_upright_neither_squats_nor_raises_an_arm(before, highest, behind, counts):
    """People who crawled raised the left arm, a handstand raised both arms, and who got up from the floor squatted.
    Who lifts a box bends over it."""
    leans = np.select([TIMES < 2.6, TIMES < 3.4], [before, highest], behind)
    names = [f"r_{part}_deg" for part in ("shoulder_elevation", "shoulder_flexion", "elbow_flexion")]
    columns = Columns({name: 110 * BUMP for name in names}, TIMES, (), judged=True)
    arm = nested(arm_raises(columns, {}, leans))["right"]
    for told in (bends(110, np.zeros(len(TIMES)), leans=leans), arm):
        assert (told["count"], "reason" in told) == (counts, not counts)


def test_of_a_bend_whose_depth_was_not_seen_nobody_knows_whether_it_is_a_squat():
    """Of five squats the peak of one is missing: "5 times, 4 squats among them"."""
    deg = 110 * (BUMP + np.roll(BUMP, 60) + np.roll(BUMP, -60))
    deg[(TIMES > 2.8) & (TIMES < 3.1)] = np.nan
    columns = Columns({f"{side}_knee_flexion_deg": deg for side in "rl"}, TIMES, (), judged=True)
    rows, _ = knee_bends(columns, Gait({"r": [], "l": []}, []), [], None, np.zeros(len(TIMES)), True, {})
    told = nested(rows)
    assert (told["count"], told["squats"], "squats_reason" in told) == (3, 2, True)


@pytest.mark.parametrize(("travels_m", "code"), [(0.5, NONE), (3.0, CANNOT_BE_TOLD)])
def test_who_travels_without_a_counted_walk_is_not_said_not_to_walk(walk, travels_m, code):
    """Eleven steps to the side, over 5.8 m: "No walking"."""
    poses = camera_poses(walk, side_camera(walk)).with_(made_by=MadeBy("measured", "capture"))
    still = np.full(len(walk), np.flatnonzero(walk.during("squat"))[0])
    aside = np.linspace(0, travels_m, len(walk))[:, None] * (1, 0, 0)  # to the right in the image
    moves = poses.with_(joints=poses.joints[still], root=aside + np.array([0, 0, 5]))
    assert outcome(measured(moves), "walking") == code
    assert outcome(measured(moves.with_(root=None)), "walking") == NONE


def test_steps_beside_which_the_legs_go_on_passing_are_at_least_so_many(walk, take):
    """Of twelve steps of a shuffling walk three were counted, and "walked 3 steps" said nothing of the others."""
    body = body_joints(take.need("filtered"), take.need("rectified"))
    gait = gait_of(body, take.need("filtered"), take.need("rectified"), take.kinematics)
    few = Gait(gait.feet, [gait.walks[0][-3:]])
    rows = [
        walking(
            body, each, take.kinematics, lambda name, spans: None, take.need("filtered"), take.need("rectified"),
            take.poses,
        )
        for each in (gait, few)
    ]  # fmt: skip
    whole, part = (nested(of) for of in rows)
    assert part["steps"] == 3 < whole["steps"]
    assert "legs pass each other" in part["count_reason"]
    assert "legs pass each other" not in whole.get("count_reason", "")
