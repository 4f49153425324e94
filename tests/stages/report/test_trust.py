"""The gauge of trust is as low as the lowest of what it rests on, and says why."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.measures import read_measures
from pcnet3d.pipeline.core.notices import notice, own_notice
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.signals.angles import ANGLES
from pcnet3d.stages.report.trust import trust


def known(take, bound: float):
    rectified = replace(take.rectified, up_bound_deg=np.full(len(take.poses), bound))
    return erring(take.with_(rectified=rectified, findings=()), 5.0)


def erring(take, sd: float):
    stated = {f"{name}_sd_deg": np.full(len(take.poses), sd) for name in ANGLES}
    return take.with_(kinematics={**take.kinematics, **stated})


def laid(take):
    level = take.rectified.level
    return take.with_(
        rectified=replace(take.rectified, level=level.with_(joints=level.joints[..., [2, 1, 0]]))
    )


def told(take) -> str:
    return trust(take)


def level(take) -> str:
    return re.findall(r'<details class="gauge (\w+)"', told(take))[0]


@pytest.fixture
def good(walk_take):
    """A take without doubts."""
    return known(walk_take, 2.7)


def test_a_take_without_doubts_is_to_be_trusted(good):
    assert level(good) == "good"
    said = told(good)
    assert "Usable." in said
    assert "hold within" not in said
    assert "Up is known to within 2.7° (90 %)." in said
    assert (
        "Mostly known to within 8° (90 %), depending on the angle, as measured for the built-in lifter."
        in said
    )
    assert said.count('<dt class="good">') == 4  # nothing is denied


def said(words: str, about: str = "", weight: str = "warning", code: str = "test.said"):
    """A change: the take says so."""
    return lambda take: take.saying(own_notice(code, words, weight, about=about))


def found(words: str, weight: str):
    """A change: the look at the poses found it."""
    return lambda take: take.with_(findings=(own_notice("test.found", words, weight),))


def lying(take):
    return take.with_(rectified=replace(take.rectified, level_ok=False, level_reason="a lying person"))


def gone(take, share: float, *joints: str):
    """Without a share of the frames at the beginning, or these joints in them."""
    places = take.poses.joints.copy()
    places[: round(share * len(places)), take.poses.layout.indices(joints or H36M17.joints)] = np.nan
    return take.with_(poses=replace(take.poses, joints=places))


def unsure(take, by: str = "movenet@0"):
    """The detector, if one made the keypoints, is unsure of the left wrist."""
    score = np.full(take.keypoints.joints.shape[:2], 0.8)
    score[:, take.keypoints.layout.index("l_wrist")] = 0.4
    made_by = MadeBy("estimated", by) if by else take.keypoints.made_by
    return take.with_(keypoints=take.keypoints.with_(confidence=score, made_by=made_by))


def exchanged(take):
    """Both legs of a man in profile were drawn exchanged, beside "No exchanged limbs were found"."""
    legs = {"off_keypoints": {"r_leg": {"start_s": [3.4], "stop_s": [4.0]}}}
    return take.with_(measures=read_measures(legs))


def shortened(take, times: int):
    return take.with_(poses=take.poses.with_(time_s=take.poses.times / times))


@pytest.mark.parametrize(
    ("change", "expected", "words"),
    [
        (laid, "care", "unless the image is turned.<br>The trunk is tilted by more"),
        (lambda take: known(take, 12.0), "care", "may be off by as much"),
        (lambda take: erring(take, 10.0), "care", "Mostly known to within 16°"),
        (said("exchanged", "left and right"), "care", "exchanged"),
        (said("feet out of view", "view"), "care", "feet out of view"),
        (said("swapped", "left and right", "repair"), "good", "swapped"),
        (found("long legs", "suspicious"), "care", "long legs"),
        (found("no depth", "unusable"), "bad", "no depth"),
        (lying, "bad", "a lying person"),
        # A T-pose of 11 frames was "Good", with arms 12 degrees apart.
        (lambda take: shortened(take, 3), "good", ""),
        (lambda take: shortened(take, 5), "care", "Less than half a second"),
        # With 2D keypoints too, which have no row where nobody was found, and so say nothing there.
        (lambda take: gone(take, 0.4), "care", "of the joints are missing, from 0.00 to"),
        (lambda take: gone(take, 0.4).with_(keypoints=None), "care", "of the joints are missing, from 0.00 to"),
        # A woman walked out of the image, her left foot for a fifth of the time: of all joints 2 % were missing.
        (lambda take: gone(take, 0.25, "l_ankle"), "care", "left ankle is missing in 2"),
        # An arm hidden by the body, of which MoveNet guessed a place with scores of 0.4, was "not out of sight".
        (unsure, "care", "The detector is unsure of the left arm in 100 % of the frames"),
        (lambda take: unsure(take, by=""), "good", ""),  # of scores that nobody knows
        (exchanged, "care", "their keypoints: right leg from 3.40 to 4.00 s."),
    ],
)  # fmt: skip
def test_what_lowers_it(good, change, expected, words):
    take = change(good)
    assert level(take) == expected
    assert words in told(take)


@pytest.mark.parametrize("code", ["rate-against-movement", "fps-contradicts"])
def test_at_a_frame_rate_that_may_be_wrong_times_are_not_said_to_hold(walk_take, code):
    """Of a video played at twice its rate, "97 steps a minute" were 201, and the page said that figures hold."""
    values = {
        "fps": 30,
        "movement": "hands hang",
        "way": "slowly",
        "fits": 60,
        "used_fps": 30,
        "shown_fps": 60,
        "source": "video",
        "times": 2,
    }
    take = known(walk_take, 2.7).saying(notice(code, **values))
    said = told(take)
    assert level(take) == "care"  # another warning, too, is a point to look at
    assert ("only if the frame rate is right" in said) == (code == "rate-against-movement")


def test_the_first_words_do_not_contradict_the_poses(walk_take):
    """ "Do not rely on it" stood beside "The poses are good: No fault was found", and "figures hold within their
    errors" beside "The poses are suspicious". Nor does a page know that they do: of a real take one in five did not."""
    good = known(walk_take, 2.7)
    leaning = good.with_(rectified=replace(good.rectified, level_ok=False, level_reason="the person lies"))
    doubtful = good.with_(findings=(notice("bones", spread_percent=9.0, worst="a to b", worst_percent=50.0),))
    for take, expected, never in (
        (leaning, "bad", "Do not rely on it"),
        (doubtful, "care", "speaks against the figures"),
        (gone(good, 0.6), "care", "The poses are good</dt>"),
    ):
        assert level(take) == expected
        assert never not in told(take)
    assert "The poses are good</dt>" in told(leaning)


def test_no_sentence_is_written_twice(good):
    """Exchanged limbs that make poses suspicious stood under "The poses are suspicious" and "Left and right"."""
    exchanged = own_notice("test.exchanged", "Legs exchanged.", "suspicious", about="left and right")
    take = good.with_(findings=(exchanged,)).saying(exchanged)
    assert told(take).count("Legs exchanged.") == 1
    assert "See the poses." in told(take)


def test_of_unusable_poses_nothing_else_is_judged(walk_take):
    """Up was "known to within 8 degrees" beside limbs that vary by a third of their length."""
    flat = known(walk_take, 2.7).with_(findings=(own_notice("test.flat", "no depth", "unusable"),))
    assert told(flat).count("<dt") == 1


def test_figures_without_errors_are_not_said_to_hold_within_them(walk_take):
    take = known(walk_take, 2.7).with_(angle_errors="none").saying(own_notice("t.a", "swapped", about="view"))
    assert level(take) == "care"
    said = told(take)
    assert "within their errors" not in said
    assert "have no errors" not in said  # it read as if the figures were exact
    assert "Check.</b> The errors of the angles are not known" in said  # "Usable" nobody knows
    # "Some figures may be off by more than their errors" stood above figures of which none had one.
    doubtful = told(take.with_(findings=(own_notice("test.rubber", "Bones vary.", "suspicious"),)))
    assert "Some figures may be off." in doubtful
