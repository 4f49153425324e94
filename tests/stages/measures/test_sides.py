"""Right and left are compared where it is known which is which, and both are seen; on the filmed walker."""

import numpy as np
import pytest

from pcnet3d.pipeline import H36M17, Take
from pcnet3d.pipeline.core.measures import CANNOT_BE_TOLD, Measure, Remark
from pcnet3d.pipeline.core.notices import notice
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.signals.angles import ANGLES, MIDLINE
from pcnet3d.stages.measures.columns import Columns
from pcnet3d.stages.measures.sides import ranges_compared, sides_untold, steps_compared
from pcnet3d.stages.measures.stage import _range

TIME = np.arange(90) / 30


def swinging(seen=slice(None), deeper: float = 0.0) -> dict[str, np.ndarray]:
    """All angles from 0 to 50 degrees in each second, the right ones only in some frames; in the first half second to
    `deeper` more."""
    swing = 25 - 25 * np.cos(2 * np.pi * TIME) + np.where(TIME < 0.5, deeper * np.sin(2 * np.pi * TIME), 0)
    right = np.full(len(TIME), np.nan)
    right[seen] = swing[seen]
    return {f"{name}_deg": right if name.startswith("r_") else swing for name in ANGLES}


@pytest.mark.parametrize(
    ("deeper", "seen", "told"),
    [
        (0.0, slice(None), True),
        (80.0, slice(None), True),
        (0.0, slice(15, None), True),  # what was not seen is like the rest
        (80.0, slice(15, None), False),
        (0.0, slice(0, 0), False),
    ],
)
def test_sides_are_compared_where_both_were_seen(deeper, seen, told):
    """Of somebody who crouched and walked off the right knee was seen in the walk alone: "knee flexion -64 ± 17 %"."""
    columns = swinging(seen, deeper)
    ranges = []
    for side in "rl":
        values = columns[f"{side}_knee_flexion_deg"]
        known = values[np.isfinite(values)] if np.isfinite(values).any() else np.array([0.0, 50.0])
        found = float(np.ptp(np.percentile(known, [5, 95])))
        ranges.append(Measure("p05_p95", found, "deg", 2.0, group=(f"{side}_knee_flexion",)))
    rows = ranges_compared(Columns(columns, TIME, (), judged=False), ranges, ["r_knee_flexion"], 3.0, {})
    assert told == ("symmetry_index" in {row.name for row in rows})
    assert told != (Remark("symmetry_outcome", CANNOT_BE_TOLD, group=("knee_flexion",)) in rows)


def unsure(take: Take, joint: str, share: float, detector: str = "movenet@0") -> Take:
    """The detector is unsure of that joint in a share of the frames, in a row."""
    confidence = np.full(take.keypoints.joints.shape[:2], 0.8)
    confidence[: round(share * len(confidence)), H36M17.index(joint)] = 0.4
    made_by = MadeBy("estimated", detector)
    return take.with_(keypoints=take.keypoints.with_(confidence=confidence, made_by=made_by))


@pytest.mark.parametrize(
    ("joint", "parts"),
    [
        ("l_ankle", ["leg"]),
        ("r_knee", ["leg"]),
        ("r_elbow", ["upper arm", "forearm"]),
        ("l_wrist", ["forearm"]),
    ],
)
def test_a_limb_that_the_detector_is_unsure_of_is_not_compared(filmed, joint, parts):
    """A cyclist in profile, who pedals evenly: "Right and left differ in range of thigh forward -75 ± 35 %"."""
    assert list(sides_untold(unsure(filmed, joint, 0.4))) == parts
    for other in (unsure(filmed, joint, 0.1), unsure(filmed, joint, 0.4, "yolo@0"), filmed):
        assert sides_untold(other) == {}


def test_sides_that_are_doubtful_are_not_compared(filmed):
    """A report named differences of right and left, and said that these are doubtful in the whole take."""
    doubtful = filmed.saying(notice("left-and-right", evidence="bones"))
    assert set(sides_untold(doubtful)) == {"leg", "upper arm", "forearm"}


def test_only_what_is_untold_is_withheld():
    ranges = [Measure("p05_p95", 50.0, "deg", 2.0, group=(name,)) for name in ANGLES if name not in MIDLINE]
    take = Columns(swinging(), TIME, (), judged=False)
    for untold, kept in (
        ({}, "knee_flexion"),
        ({"leg": "why"}, "elbow_flexion"),
        ({"forearm": "why"}, "thigh_sagittal"),
    ):
        rows = ranges_compared(take, ranges, list(ANGLES), 3.0, untold)
        told = {row.group[-1] for row in rows if row.name == "symmetry_index"}
        withheld = {row.group[-1] for row in rows if row.name == "symmetry_outcome"}
        assert kept in told
        assert bool(withheld) == bool(untold)
        assert not told & withheld


def test_steps_of_unsure_legs_have_no_symmetry():
    rows = [Measure("steps", 4), Measure("step_time_symmetry_index", 30.0, "percent", 4.0)]
    assert steps_compared(rows, {"forearm": "why"}) == rows
    steps, outcome, reason = steps_compared(rows, {"leg": "why"})
    assert steps == rows[0]
    assert outcome == Remark("step_time_symmetry_outcome", CANNOT_BE_TOLD)
    assert (reason.name, reason.text) == ("step_time_symmetry_reason", "why")


@pytest.mark.parametrize(
    ("unsure", "deeper", "told"),
    [
        (slice(0, 0), 0.0, True),
        (slice(0, 12), 0.0, True),  # the other frames show the same
        (slice(0, 12), 60.0, False),  # a knee behind a car: "22 to 95" of one that bends to 30
        (slice(0, 50), 0.0, False),  # a banner over the legs
    ],
)
def test_a_range_is_of_frames_in_which_the_detector_is_sure(unsure, deeper, told):
    guessed = np.isin(np.arange(len(TIME)), np.arange(len(TIME))[unsure])
    take = Columns(swinging(deeper=deeper), TIME, (), judged=False, unstated_deg=8.0)
    rows = _range(take, "r_knee_flexion", True, {"r_ankle": guessed, "l_knee": ~guessed})
    found = {row.name: row for row in rows}
    assert ("p95" in found, "reason" in found) == (told, not told)
    assert found["frames"].value == (~guessed).sum()
