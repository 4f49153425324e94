"""What was seen, in plain words: of walks, squats, raised arms, jumps, and of takes in which nothing was recognised."""

import numpy as np
import pytest

from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, Take
from pcnet3d.pipeline.core.measures import read_measures
from pcnet3d.pipeline.running.sentences import _JOINTS, answer, headlines

KNEE = {"p05_deg": 8.0, "p95_deg": 68.0, "p05_error_deg": 7.3, "p95_error_deg": 7.3}
RANGES = {
    "r_knee_flexion": KNEE,
    "l_knee_flexion": {"p05_deg": 10.0, "p95_deg": 80.0, "p05_error_deg": 4.0, "p95_error_deg": 4.0},
}
WALK = {
    "gait": "walking", "walks": 1, "steps": 4, "walked_s": 2.4, "cadence_spm": 98.0, "cadence_error_spm": 1.8,
    "walking_speed": 1.15, "walking_speed_error": 0.05,
    "right": {"landings_s": [1.2, 2.4]}, "left": {"landings_s": [0.6, 1.8, 3.0]},
}  # fmt: skip
UNSEEN = {"count_at_least": True}
JUMPS = {"count": 2, "height_by_flight_time_cm": [13.2, 12.9]}


def take(unit: str = "m", **measures) -> Take:
    poses = PoseSequence(np.zeros((31, 17, 3)), H36M17, CAMERA.with_(unit=unit), time_s=np.arange(31) / 10)
    return Take("take", poses=poses, measures=read_measures({"range_of_motion": RANGES, **measures}))


def walking(**changes) -> dict:
    return {"walking": {**WALK, **changes}}


def arms(right: dict, left: dict) -> dict:
    return {"arm_raises": {"right": right, "left": left}}


def raised(start_s: float, peak_at_s: float, stop_s: float, peak_deg: float = 97.0) -> dict:
    times = {"start_s": [start_s], "peak_at_s": [peak_at_s], "stop_s": [stop_s]}
    return {"count": 1, "peak_deg": [peak_deg], **times}


def test_a_walk_with_its_cadence_speed_and_knees():
    assert answer(take(**walking())) == [
        "Walked 4 steps in 2.4 s. Cadence 98 ± 3 steps/min, speed 1.15 ± 0.08 m/s."
    ]


@pytest.mark.parametrize(
    ("measures", "words"),
    [
        ({"unit": "arbitrary", **walking(gait="running")}, "Ran 4 steps in 2.4 s. Cadence 98 ± 3 steps/min."),
        # Three steps were told of a video that shows four, in which the walk goes on.
        (
            walking(steps_at_least=True, not_visible="end"),
            "Walked at least 4 steps in 2.4 s (end not visible). Cadence 98",
        ),
        (
            {"knee_bends": {"count": 1, "squats": 1, "peak_deg": [102.4], "peak_error_deg": [6.9]}},
            "1 squat, peak of both knees 102 ± 11°.",
        ),
        (
            {"knee_bends": {"count": 3, "squats": 1, "peak_deg": [55.0, 90.0, 60.0]}},
            "3 knee bends (1 squat), peak of both knees 55 to 90° (errors not known).",
        ),
        (
            {"knee_bends": {"count": 3, "squats": 3, "peak_deg": [102.0, 95.0, 98.0], **UNSEEN}},
            "At least 3 squats, peak of both knees 95 to 102° (errors not known).",
        ),
        (arms({"count": 1, "peak_deg": [80.0]}, {}), "1 raise of the right arm, peak 80° (error not known)."),
        (
            arms(*[{"count": 2, "peak_deg": [150.0, 160.0]}] * 2),
            "2 raises of both arms, peak 150 to 160° (errors not known).",
        ),
        (arms(*[{"count": 3, **UNSEEN}] * 2), "At least 3 raises of both arms."),
        (
            {"jumps": {"count": 1, "height_by_flight_time_cm": [32.0], "height_by_flight_time_error_cm": [3.1]}},
            "1 jump, height by flight time 32 ± 5 cm.",
        ),
        ({"jumps": JUMPS}, "2 jumps, height by flight time 13 cm (errors not known)."),
        ({"jumps": {**JUMPS, "height_by_flight_time_cm": [13.2, 15.0]}}, "13 to 15 cm"),
    ],
)  # fmt: skip
def test_what_was_done_is_told_with_its_count_and_what_hides_some(measures, words):
    assert words in " ".join(answer(take(**measures)))


def test_a_figure_without_an_error_has_two_digits_and_says_so():
    known = {name: value for name, value in WALK.items() if "error" not in name}
    said = answer(take(walking={**known, "walking_speed": 0.794488}))[0]
    assert said.endswith("Cadence 98 steps/min, speed 0.79 m/s (errors not known).")


def test_a_peak_that_is_not_known_is_none_of_those_told():
    some = {"count": 3, "peak_deg": [140.0, None, 150.0]}
    whole = {"count": 3, "peak_deg": [140.0, 145.0, 150.0]}
    told = [" ".join(answer(take(**arms(*sides)))) for sides in ((some, {}), (some, some), (whole, {}))]
    assert [("2 of them" in each, "4 of them" in each) for each in told] == [
        (True, False),
        (False, True),
        (False, False),
    ]


def test_where_nothing_is_recognised_the_main_joints_are_told_and_nothing_is_denied():
    beyond = {
        "r_elbow_flexion": {**KNEE, "beyond_anatomy_frames": 3},
        "trunk_lean_sagittal": {"p05_deg": -1.0, "p95_deg": 9.0},
    }
    groups = {"walking": {"observable_percent": 12.0}, "jumps": {"observable_percent": 0.0}}
    (joints,) = answer(take(range_of_motion=RANGES | beyond, **groups))
    assert (
        joints
        == "In nine of ten frames that show it: knee flexion 8 to 68 ± 12° (right), 10 to 80 ± 7° (left)."
    )
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
    assert answer(take(range_of_motion=swaying)) == [
        "In nine of ten frames that show it: trunk lean to the side 20° left to 20° right ± 7°."
    ]
    shown = [label for label, _ in headlines(take(range_of_motion=swaying))]
    assert shown == [
        "trunk lean to the side", "knee flexion, right", "knee flexion, left", "elbow flexion, right",
        "hip flexion (thigh against trunk), right", "shoulder elevation, right",
    ]  # fmt: skip
    cycling = {
        "r_knee_flexion": ranging(2.0, 34.0, None), "l_knee_flexion": ranging(15.0, 77.0, None),
        "r_shoulder_elevation": ranging(22.0, 159.0, None), "r_elbow_flexion": ranging(-1.0, 43.0, None),
    }  # fmt: skip
    shown = dict(headlines(take(range_of_motion=cycling)))
    assert (shown["knee flexion, right"], shown["knee flexion, left"]) == ("2 to 34°", "15 to 77°")


def test_what_was_done_most_comes_first():
    bends = {"knee_bends": {"count": 1, "squats": 0}}
    assert answer(take(**bends, **arms({}, {"count": 3}))) == ["3 raises of the left arm.", "1 knee bend."]


@pytest.mark.parametrize(
    ("lean", "low", "high", "words"),
    [
        ("frontal", -4.2, 6, "4° left to 6° right"),
        ("frontal", -40, -6, "40° to 6° left"),
        ("frontal", 2, 6, "2° to 6° right"),
        ("frontal", -9, 0.3, "9° to 0° left"),
        ("sagittal", -0.4, -0.2, "0°"),  # which has no sign
    ],
)
def test_a_lean_names_its_sides(lean, low, high, words):
    ranges = {f"trunk_lean_{lean}": {"p05_deg": low, "p95_deg": high}}
    ((_, shown),) = headlines(take(range_of_motion=ranges))
    assert shown == words


def test_a_range_of_few_frames_is_not_that_of_the_take():
    seen, hardly = ({"p05_deg": 3.0, "p95_deg": 80.0, "nan_share": share} for share in (0.1, 0.9))
    # Of a woman whose knee was hidden in a fifth of the frames "in nine of ten frames" was untrue.
    assert "that show it: knee flexion 3 to 80" in answer(take(range_of_motion={"r_knee_flexion": seen}))[-1]
    assert answer(take(range_of_motion={"r_knee_flexion": hardly})) == []
    assert answer(Take("take", poses=take().poses)) == []  # nor is anything said without measures


def test_where_no_range_is_wider_than_its_error_no_joint_moves_and_only_where_all_are_known():
    still = ranging(10.0, 14.0, 5.0)
    joints = [
        angle
        for name in _JOINTS
        for angle in ([name] if name.startswith(("trunk", "thorax")) else [f"l_{name}", f"r_{name}"])
    ]
    assert answer(take(range_of_motion=dict.fromkeys(joints, still))) == []
    assert "10 to 14" in answer(take(range_of_motion=dict.fromkeys(joints[1:], still)))[-1]


@pytest.mark.parametrize(
    ("right", "together"),
    [
        (raised(4.9, 5.4, 5.9), False),  # a skater's left arm went up 4.6 s before the right one
        (raised(1.0, 1.5, 1.9), False),  # they touch
        (raised(0.4, 0.9, 1.9), True),
    ],
)
def test_both_arms_are_raised_only_if_together(right, together):
    said = answer(take(**arms(right, raised(0.2, 0.7, 1.2))))[0]
    assert said.startswith("1 raise of both arms") == together


def test_arms_of_a_leap_one_in_front_and_one_behind_are_not_raised_together():
    assert "both" not in answer(take(**arms(raised(0.2, 0.8, 1.8), raised(0.2, 0.4, 1.2))))[0]


def test_the_first_screen_has_40_words_and_six_figures_and_no_units():
    bends = {"knee_bends": {"count": 9, "squats": 4, "peak_deg": [90.0] * 9, "peak_error_deg": [5.0] * 9}}
    raises = arms({"count": 8, "peak_deg": [120.0] * 8}, {"count": 7, "peak_deg": [110.0] * 7})
    for unit in ("m", "arbitrary"):
        full = take(unit, **walking(not_visible="start and end", steps=10), **bends, **raises, jumps=JUMPS)
        said = answer(full, further=["Right and left differ in very many words " + "and more " * 20])
        assert len(" ".join(said).split()) <= 40
        assert all(
            any(name in sentence for sentence in said) for name in ("step", "knee bend", "raise", "jump")
        )
        shown = headlines(full)
        assert len(shown) <= 6
        assert any("m/s" in sentence for sentence in said) == (unit == "m")
        assert not any("units" in words for words in (*said, *(words for _, words in shown)))
