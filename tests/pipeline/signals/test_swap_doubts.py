"""What is uncertain of exchanged limbs is told and left alone; a walk's rhythm decides; what speaks against is said."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, IMAGE, PoseSequence
from pcnet3d.pipeline.signals import swaps
from pcnet3d.pipeline.signals.findings import swap_findings
from pcnet3d.pipeline.signals.swaps import (
    Swap,
    alternation,
    described,
    doubts,
    find_swaps,
    kinds,
    mask_swaps,
    treated,
    worsened,
)

LEGS, ARMS = kinds(H36M17, depth=False)
HIPS = H36M17.indices(("l_hip", "r_hip"))
TIMES = np.arange(120) / 30
STRIDE_S = 1.1


def walk(rows=110) -> PoseSequence:
    """The walker in pixels, hips seen end-on: nothing but motion tells left from right. It walks up to row 101."""
    person = walker()
    rng = np.random.default_rng(0)
    pixels = side_camera(person).project(person.world) + rng.normal(0, 0.5, (len(person), 17, 2))
    pixels[:, HIPS] = pixels[:, HIPS].mean(axis=1, keepdims=True) + rng.normal(0, 0.5, (len(person), 2, 2))
    return PoseSequence(pixels[:rows], H36M17, IMAGE, time_s=person.time_s[:rows])


def exchanged(poses, *spans, way=LEGS) -> PoseSequence:
    joints = poses.joints.copy()
    for first, last in spans:
        joints[first : last + 1] = way.applied(joints[first : last + 1])
    return poses.with_(joints=joints)


def spans(found):
    return [(swap.first_row, swap.last_row) for swap in found]


def swing(scale=1.0) -> np.ndarray:
    """(T, 1, 2) from the left ankle to the right one: wide along (3, 4), as a stride has it."""
    return scale * np.cos(2 * np.pi * TIMES / STRIDE_S)[:, None, None] * np.array([3.0, 4.0])


def test_a_walk_fits_its_rhythm_and_an_exchanged_row_does_not():
    fits = alternation(swing(), TIMES)
    inner = slice(15, -15)  # at the ends half a window is missing
    np.testing.assert_allclose(fits[inner], np.cos(2 * np.pi * TIMES / STRIDE_S)[inner] ** 2, atol=0.05)
    wrong = swing()
    wrong[60:70] *= -1
    expected = np.where((TIMES[60] <= TIMES) & (TIMES[69] >= TIMES), -fits, fits)
    np.testing.assert_allclose(alternation(wrong, TIMES), expected, atol=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_rhythm_needs_no_unit_and_knows_no_left(scale):
    np.testing.assert_allclose(alternation(-swing(scale), TIMES), alternation(swing(), TIMES), atol=1e-9)


@pytest.mark.parametrize(
    "vectors",
    [
        np.abs(swing()),  # hopping: the same side is always in front
        np.ones((120, 1, 2)),  # standing
        np.zeros((120, 1, 2)),
        np.full((120, 1, 2), np.nan),
        swing()[:20],  # shorter than three of the quickest steps
    ],
)
def test_without_a_walk_the_rhythm_says_nothing(vectors):
    np.testing.assert_array_equal(alternation(vectors, TIMES[: len(vectors)]), 0)


def test_a_change_of_sides_in_the_middle_leaves_open_which_side_is_wrong():
    """As likely as its complement: it is told by its ends, and never touched."""
    wrong = exchanged(walk(), (50, 109))
    (found,) = find_swaps(wrong)
    assert found.change > 0.99
    assert found.probability == pytest.approx(0.5)
    assert found.one_sided
    assert len(found) <= 60  # the labeling with fewer frames
    assert (
        described(wrong, (found,))
        == "legs exchanged in frames 0-49 from 0.00 s, or in those beside them (which is unclear)"
    )
    for how in ("report", "mask"):
        _, keypoints, (event,), _ = treated(None, wrong, how)
        assert event.code == "swaps-doubtful"
        assert "--set read.swaps" not in event.text
        np.testing.assert_array_equal(keypoints.joints, wrong.joints)
    assert [finding.weight for finding in swap_findings(wrong, (found,))] == ["note"]


def test_right_rows_of_somebody_who_turns_are_not_called_exchanged_for_certain():
    """From behind at rows 51 to 150, and named as if from the front but for 24 of these. The change edge-on shows in no
    leap, so the 24 that are right look like the wrong ones."""
    person = walker().world[-1] - walker().world[-1, 0]
    angle = np.linspace(0.5 * np.pi, 2.5 * np.pi, 200, endpoint=False)[:, None]
    across = person[:, 0] * np.cos(angle) - person[:, 1] * np.sin(angle)
    pixels = 200 * np.stack([across, np.broadcast_to(-person[:, 2], across.shape)], axis=-1)
    pixels += np.random.default_rng(0).normal(0, 2, pixels.shape)
    turner = PoseSequence(pixels, H36M17, IMAGE, time_s=np.arange(200) / 30)
    wrong = exchanged(turner, (51, 103), (128, 150))
    found = find_swaps(exchanged(wrong, (51, 103), (128, 150), way=ARMS))
    assert spans(found) == [(104, 127)] * 2
    assert all(swap.one_sided for swap in found)


@pytest.mark.parametrize(("turned", "share"), [((), 0.0), ((0, 1, 13), 3 / 14), (range(14), 1.0)])
def test_of_a_run_that_flickers_each_row_is_judged_by_what_is_beside_the_run(turned, share):
    """Of arms that were exchanged in three frames fourteen were called exchanged, for one end cost less than four."""
    vectors = np.tile([[[-100.0, 370.0]]], (40, 3, 1)) + np.random.default_rng(0).normal(0, 20, (40, 3, 2))
    vectors[[20 + row for row in turned]] *= -1
    assert swaps._turned_share(vectors, 20, 34) == pytest.approx(share)


def test_a_row_without_limbs_leaves_an_exchange_certain():
    wrong = exchanged(walk(), (40, 46))
    joints = wrong.joints.copy()
    joints[42, LEGS.pairs] = np.nan
    (found,) = find_swaps(wrong.with_(joints=joints))
    assert spans([found]) == [(40, 46)]
    assert found.certain


def test_the_shorter_part_is_wrong_when_it_is_much_shorter():
    (found,) = find_swaps(exchanged(walk(), (100, 109)))
    assert spans([found]) == [(100, 109)]
    assert found.certain


def test_the_rhythm_of_a_walk_tells_which_side_is_wrong(monkeypatch):
    wrong = exchanged(walk(60), (52, 59))
    (found,) = find_swaps(wrong)
    assert spans([found]) == [(52, 59)]
    assert found.certain
    monkeypatch.setattr(swaps, "_GAIT", 0.0)
    (found,) = find_swaps(wrong)
    assert found.one_sided


def test_the_complement_of_an_exchange_is_never_found():
    """Rows 58 and 82, legs melted into one about the first: not all rows between and behind."""
    poses = walk()
    joints = poses.joints.copy()
    legs = LEGS.pairs.ravel()
    middle = joints[57:60][:, LEGS.pairs].mean(axis=2, keepdims=True).repeat(2, axis=2).reshape(3, -1, 2)
    joints[57:60, legs] = middle + np.random.default_rng(2).normal(0, 1.5, middle.shape)
    wrong = exchanged(poses.with_(joints=joints), (58, 58), (82, 82))
    found = find_swaps(wrong)
    assert (82, 82) in spans(found)
    assert all(first >= 57 and len(swap) <= 3 for swap, (first, _) in zip(found, spans(found), strict=True))


def test_a_swap_against_the_rhythm_is_said_and_not_masked(monkeypatch):
    """The complement of row 82, between the crossing at row 58 and the end, as if it had been found."""
    wrong = exchanged(walk(), (82, 82))
    complement = (Swap("legs exchanged", 58, 81, 9.0), Swap("legs exchanged", 83, 109, 9.0))
    complement = swaps._weighed(wrong, complement)
    assert not any(swap.certain or swap.one_sided for swap in complement)
    monkeypatch.setattr(swaps, "find_swaps", lambda _: complement)
    for how in ("report", "mask"):
        _, keypoints, (event,), _ = treated(None, wrong, how)
        np.testing.assert_array_equal(keypoints.joints, wrong.joints)
        assert event.code == "swaps-doubtful"
        assert "legs exchanged in frames 58-81 from 1.93 s, 83-109 from 2.77 s, but" in event.text
        assert "the legs would not alternate" in event.text


def test_a_swap_that_would_make_joints_leap_is_not_certain_and_others_are():
    right = walk()
    wrong = exchanged(right, (30, 39), way=ARMS)
    arms, legs = Swap("arms exchanged", 30, 39, 9.0), Swap("legs exchanged", 64, 67, 9.0)
    found = swaps._weighed(wrong, (arms, legs))
    assert [swap.certain for swap in found] == [True, False]
    assert "joints would leap farther" in found[1].against
    (said,) = doubts(wrong, found)
    assert said.startswith(
        "legs exchanged in frames 64-67 from 2.13 s, but the other way round joints would leap"
    )
    missing = np.isnan(mask_swaps(wrong, found).joints).any(axis=-1)
    assert not missing[64:68].any()
    assert missing[30:40, ARMS.pairs].all()
    assert worsened(wrong, right) == ()
    assert worsened(right, right) == ()
    assert "joints would leap farther" in worsened(right, wrong)


def test_bones_that_change_their_length_more_are_worse():
    """A mast swings: its tip moves less after the change, but the shank no longer keeps its length."""
    joints = np.zeros((20, 17, 2))
    ankle, knee = H36M17.index("l_ankle"), H36M17.index("l_knee")
    joints[:, knee] = [0, 100]
    joints[:, ankle] = [0, 200]
    joints[10:, ankle] = [100, 100]
    before = PoseSequence(joints, H36M17, IMAGE)
    shorter = joints.copy()
    shorter[10:, ankle] = [0, 120]
    assert worsened(before, before.with_(joints=shorter)) == ("bones would change their lengths more",)
