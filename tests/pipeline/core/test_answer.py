"""What was seen, in plain words: of walks, squats, raised arms, jumps, and of takes in which nothing was recognised."""

import numpy as np
import pytest

from golden.measures import rows_of
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, Take
from pcnet3d.pipeline.core.answer import _JOINTS, answer
from pcnet3d.pipeline.core.measures import CANNOT_BE_TOLD, NONE, NOT_LOOKED_FOR

KNEE = {"p05_deg": 8.0, "p95_deg": 68.0, "p05_error_deg": 7.3, "p95_error_deg": 7.3}
RANGES = {
    "r_knee_flexion": KNEE,
    "l_knee_flexion": {"p05_deg": 10.0, "p95_deg": 80.0, "p05_error_deg": 4.0, "p95_error_deg": 4.0},
}
WALK = {
    "gait": "walking", "walks": 1, "steps": 4, "cadence_spm": 98.0, "cadence_error_spm": 1.8, "walking_speed": 1.15,
    "walking_speed_error": 0.05, "right": {"landings_s": [1.2, 2.4]}, "left": {"landings_s": [0.6, 1.8, 3.0]},
}  # fmt: skip


def take(unit: str = "m", **measures) -> Take:
    poses = PoseSequence(np.zeros((31, 17, 3)), H36M17, CAMERA.with_(unit=unit), time_s=np.arange(31) / 10)
    return Take("take", poses=poses, measures=rows_of({"range_of_motion": RANGES, **measures}))


def test_a_walk_with_its_cadence_speed_and_knees():
    assert answer(take(walking=WALK)) == [
        "Walked 4 steps in 2.4 s, 98 ± 3 a minute, at 1.15 ± 0.082 m/s.",
        "In nine of ten frames, in degrees (± for each end): knees 8 to 68 (right) and 10 to 80 (left) ± 12.",
    ]


def test_of_an_arm_that_cannot_be_judged_it_is_said_beside_the_other():
    """A left arm that the detector guessed: the page named the right one alone, as if only that had been raised."""
    arms = {
        "right": {"count": 1, "peak_deg": [80.0]},
        "left": {"count": 0, "reason": "the elbow is not sure"},
    }
    assert answer(take(arm_raises=arms))[0] == (
        "Raised the right arm once to 80 degrees; whether the left arm was raised cannot be told."
    )


def test_of_an_arm_that_cannot_be_judged_it_is_said_beside_a_hold_too():
    """Both arms were up alike: "Held the right arm up once", and no word of the left one."""
    held = {"count": 0, "holds": {"count": 1, "longest_s": 4.0}}
    arms = {"right": held, "left": {"count": 0, "reason": "it is uncertain"}}
    assert "whether the left arm was raised cannot be told" in answer(take(arm_raises=arms))[0]
    assert (
        "cannot be told"
        not in answer(take(arm_raises={"right": held, "left": {**held, "reason": "a gap"}}))[0]
    )


def test_without_a_scale_there_is_no_speed_and_a_run_is_called_one():
    said = answer(take("arbitrary", walking={**WALK, "gait": "running"}))[0]
    assert said == "Ran 4 steps in 2.4 s, 98 ± 3 a minute."


def test_of_a_walk_that_is_cut_the_steps_are_the_least():
    """Three steps were told of a video that shows four, in which the walk goes on."""
    said = answer(take(walking={**WALK, "count_reason": "how it ends was not seen"}))[0]
    assert said.startswith("Walked at least 4 steps in 2.4 s (how it ends was not seen), 98")


@pytest.mark.parametrize(
    ("back", "words"), [(4, " backwards in 2.4 s,"), (1, ", 1 of them backwards in 2.4 s,")]
)
def test_steps_backwards_are_told(back, words):
    said = answer(take(walking={**WALK, "backward_steps": back}))[0]
    assert said.startswith(f"Walked 4 steps{words} 98")


def test_knee_bends_are_squats_only_if_all_are():
    deep = {"count": 1, "squats": 1, "peak_deg": [102.4], "peak_error_deg": [6.9]}
    assert answer(take(knee_bends=deep))[0] == "Squatted once, the less bent knee to 102 degrees (± 11)."
    several = {"count": 3, "squats": 1, "peak_deg": [55.0, 90.0, 60.0]}
    said = answer(take(knee_bends=several))[0]
    assert (
        said == "Bent the knees 3 times, the less bent knee to between 55 and 90 degrees, 1 squat among them."
    )


def test_a_peak_that_is_not_known_is_none_of_those_told():
    some = {"count": 3, "peak_deg": [140.0, None, 150.0]}
    whole = {"count": 3, "peak_deg": [140.0, 145.0, 150.0]}
    one, both = (
        answer(take(arm_raises={"right": some}))[0],
        answer(take(arm_raises={"right": some, "left": some}))[0],
    )
    assert (one.count("2 of them"), both.count("2 of them")) == (1, 2)
    assert "of them" not in answer(take(arm_raises={"right": whole}))[0]


def test_arms_and_jumps():
    both = {side: {"count": 2, "peak_deg": [150.0, 160.0]} for side in ("right", "left")}
    one = {"right": {"count": 0}, "left": {"count": 1, "peak_deg": [150.0]}}
    jumps = {"count": 1, "height_by_flight_time_cm": [32.0], "height_by_flight_time_error_cm": [3.1]}
    assert answer(take(arm_raises=both))[0] == (
        "Raised both arms twice to between 150 and 160 (right) and between 150 and 160 (left) degrees."
    )
    said = answer(take(arm_raises=one, jumps=jumps))[0]
    assert (
        said
        == "Raised the left arm once to 150 degrees; jumped once, 32 cm high by the time in the air (± 5)."
    )


def test_jumps_of_one_height_are_told_by_one_figure():
    jumps = {"count": 2, "height_by_flight_time_cm": [13.2, 12.9]}
    assert "each 13 cm" in answer(take(jumps=jumps))[0]
    assert "13 and 15 cm" in answer(take(jumps={**jumps, "height_by_flight_time_cm": [13.2, 15.0]}))[0]


def test_what_may_have_been_while_nobody_saw_is_not_said_to_be_absent():
    unseen = {"count_reason": "not seen from 3.60 to 4.50 s"}
    squats = {"count": 3, "squats": 3, "peak_deg": [102.0, 95.0, 98.0], **unseen}
    (said, *_) = answer(take(knee_bends=squats))
    assert said.startswith(
        "Squatted at least 3 times (not seen from 3.60 to 4.50 s), the less bent knee to between 95"
    )
    arms = {"right": {"count": 3}, "left": {"count": 3, **unseen}}
    assert answer(take(arm_raises=arms))[0] == (
        "Raised the right arm 3 times; raised the left arm at least 3 times (not seen from 3.60 to 4.50 s)."
    )
    both = {side: {"count": 3, **unseen} for side in ("right", "left")}
    assert (
        answer(take(arm_raises=both))[0]
        == "Raised both arms at least 3 times (not seen from 3.60 to 4.50 s)."
    )


def test_where_nothing_is_recognised_the_main_joints_are_told_and_what_cannot_be():
    beyond = {
        "r_elbow_flexion": {**KNEE, "beyond_anatomy_frames": 3},
        "trunk_lean_sagittal": {"p05_deg": -1.0, "p95_deg": 9.0},
    }
    groups = {
        "walking": {"outcome": CANNOT_BE_TOLD, "reason": "from behind"},
        "knee_bends": {"outcome": NONE, "count": 0},
        "jumps": {"outcome": NOT_LOOKED_FOR, "reason": "the camera moves"},
    }
    none, untold, not_looked_for, joints = answer(take(range_of_motion=RANGES | beyond, **groups))
    assert none == "No bends of both knees in 3.1 s."
    assert untold == "Cannot be told: walking."
    assert not_looked_for == "Not looked for: jumps (why: in the report, under What happened)."
    assert joints.startswith("In nine of ten frames, in degrees (± for each end): knees 8 to 68")
    assert joints.endswith("; trunk leaned 1 back to 9 forward.")
    assert "elbow" not in joints  # beyond what joints reach


def ranging(low: float, high: float, error: float | None = 4.0) -> dict:
    ends = {"p05_deg": low, "p95_deg": high, "p05_p95_deg": high - low}
    return ends | ({f"{end}_error_deg": error for end in ("p05", "p95", "p05_p95")} if error else {})


def test_the_joints_that_range_furthest_for_their_error_are_told():
    """Of a man who sways, the lean to the side; of a cyclist who held his arms up, the one knee that bends."""
    swaying = {
        "r_knee_flexion": ranging(2.0, 14.0), "l_knee_flexion": ranging(2.0, 12.0),
        "r_elbow_flexion": ranging(10.0, 60.0, 20.0), "r_shoulder_elevation": ranging(5.0, 12.0),
        "r_thigh_trunk_flexion": ranging(0.0, 9.0), "trunk_lean_sagittal": ranging(0.0, 5.0),
        "trunk_lean_frontal": ranging(-20.0, 20.0),
    }  # fmt: skip
    said = answer(take(range_of_motion=swaying))[-1].split(": ")[1].split("; ")
    assert [words.split()[0] for words in said] == ["trunk", "knees", "elbows", "thighs"]
    cycling = {
        "r_knee_flexion": ranging(2.0, 34.0, None), "l_knee_flexion": ranging(15.0, 77.0, None),
        "r_shoulder_elevation": ranging(22.0, 159.0, None), "r_elbow_flexion": ranging(-1.0, 43.0, None),
    }  # fmt: skip
    held = {"right": {"count": 0, "holds": {"count": 1, "longest_s": 3.2}}, "left": {"count": 0}}
    said = answer(take(arm_raises=held, range_of_motion=cycling))[1]
    assert "knees 2 to 34 (right) and 15 to 77 (left)" in said


def test_what_was_done_most_comes_first():
    arms = {"right": {"count": 0}, "left": {"count": 3}}
    punches = {"right": {"count": 4}, "left": {"count": 1}}
    said = answer(take(knee_bends={"count": 1, "squats": 0}, arm_raises=arms, punches=punches))[0]
    assert said.index("unched") < said.index("left arm 3 times") < said.index("bent")


def test_a_figure_without_an_error_has_two_digits_and_says_so():
    unknown = {name: value for name, value in WALK.items() if "error" not in name} | {
        "walking_speed": 0.794488
    }
    assert answer(take(walking=unknown))[0].endswith("at about 0.79 m/s (error not known).")


def test_a_speed_that_is_smaller_than_its_error_is_no_figure():
    """Towards a camera of an unknown lens somebody walked "at 1.4 ± 1.5 m/s"."""
    said = answer(take(walking={**WALK, "walking_speed_error": 0.9}))[0]
    assert "1.1" not in said
    assert "cannot be told (± 1.5 m/s)" in said


def test_a_zero_has_no_sign():
    ranges = {"trunk_lean_sagittal": {"p05_deg": -0.4, "p95_deg": -0.2}}
    assert (
        answer(take(range_of_motion=ranges))[-1]
        == "In nine of ten frames, in degrees (errors not known): trunk leaned 0."
    )


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (-4.2, 6, "4 left to 6 right"),
        (-40, -6, "40 to 6 left"),
        (2, 6, "2 to 6 right"),
        (-9, 0.3, "9 to 0 left"),
    ],
)
def test_a_lean_names_its_sides(low, high, words):
    ranges = {"trunk_lean_frontal": {"p05_deg": low, "p95_deg": high}}
    assert (
        answer(take(range_of_motion=ranges))[-1]
        == f"In nine of ten frames, in degrees (errors not known): trunk leaned {words}."
    )


def test_a_range_of_few_frames_is_not_that_of_the_take():
    seen, hardly = ({"p05_deg": 3.0, "p95_deg": 80.0, "nan_share": share} for share in (0.1, 0.9))
    assert "3 to 80" in answer(take(range_of_motion={"r_knee_flexion": seen}))[-1]
    assert answer(take(range_of_motion={"r_knee_flexion": hardly})) == []


def test_where_no_range_is_wider_than_its_error_no_joint_moves_and_only_where_all_are_known():
    still = {"p05_deg": 10.0, "p95_deg": 14.0, "p05_p95_deg": 4.0}
    still |= {f"{name}_error_deg": 5.0 for name in ("p05", "p95", "p05_p95")}
    joints = [
        angle
        for name in _JOINTS
        for angle in ([name] if name.startswith(("trunk", "thorax")) else [f"l_{name}", f"r_{name}"])
    ]
    assert (
        answer(take(range_of_motion=dict.fromkeys(joints, still)))[-1]
        == "No joint moves by more than its error."
    )
    assert "10 to 14" in answer(take(range_of_motion=dict.fromkeys(joints[1:], still)))[-1]


def test_without_measures_nothing_is_said():
    assert answer(Take("take", poses=take().poses)) == []


def test_both_arms_are_raised_only_if_together():
    """A skater's left arm went up 4.6 s before the right one."""
    one = {"count": 1, "peak_deg": [97.0], "start_s": [0.2], "peak_at_s": [0.7], "stop_s": [1.2]}
    later = {"count": 1, "peak_deg": [122.0], "start_s": [4.9], "peak_at_s": [5.4], "stop_s": [5.9]}
    assert answer(take(arm_raises={"right": later, "left": one}))[0] == (
        "Raised the right arm once to 122 degrees; raised the left arm once to 97 degrees."
    )
    touching = {**later, "start_s": [1.0], "peak_at_s": [1.5], "stop_s": [1.9]}
    assert "both" not in answer(take(arm_raises={"right": touching, "left": one}))[0]
    swung = {**one, "start_s": [0.2], "peak_at_s": [0.8], "stop_s": [1.8]}
    other = {
        **one,
        "start_s": [0.2],
        "peak_at_s": [0.4],
        "stop_s": [1.2],
    }  # arms of a leap: one in front, one behind
    assert "both" not in answer(take(arm_raises={"right": swung, "left": other}))[0]
    beside = {**later, "start_s": [0.4], "peak_at_s": [0.9], "stop_s": [1.9]}
    assert answer(take(arm_raises={"right": beside, "left": one}))[0].startswith("Raised both arms once")


def test_one_reason_for_both_sides_is_told_once():
    side = {"count": 3, "count_reason": "lifted poses hide some"}
    assert answer(take(punches={"right": side, "left": side}))[0] == (
        "Punched at least 3 times with the right arm and at least 3 times with the left arm (lifted poses hide some)."
    )
