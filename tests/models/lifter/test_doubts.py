"""Doubts about keypoints: exchanged sides, by the built-in lifter; other rates and zooms, by a network."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lifter.builtin import lifted
from pcnet3d.models.lifter.changes import RATES, WIDTHS, ZOOMS, Changes, change_doubts, changes_of, held
from pcnet3d.models.lifter.sides import sides_doubts
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.lifted import ToLift
from pcnet3d.pipeline.core.pose import MadeBy, PoseSequence

WALK = walker(seconds=6.0)
CAMERA = side_camera(WALK)
SIZE = (CAMERA.width, CAMERA.height)
PIXELS = CAMERA.project(WALK.world) + np.random.default_rng(0).normal(0, 1.5, (len(WALK), 17, 2))


def keypoints(pixels=PIXELS, fps=30.0, score=0.9):
    rows = np.arange(len(pixels))
    return PoseSequence(pixels, H36M17, IMAGE, np.full(pixels.shape[:2], score), rows / fps, rows)


@pytest.mark.parametrize("exchanged", [False, True])
def test_exchanged_sides_are_told(exchanged):
    asked = ToLift(keypoints(PIXELS[:, H36M17.mirror] if exchanged else PIXELS), SIZE)
    said = [each.code for each in sides_doubts(asked, lifted(asked).poses)]
    assert said == (["left-and-right"] if exchanged else [])


def test_nothing_is_said_of_the_sides_of_a_moment():
    asked = ToLift(keypoints(PIXELS[:20]), SIZE)
    assert not sides_doubts(asked, lifted(asked).poses)


@pytest.mark.parametrize(
    ("better", "unseen", "score", "told"),
    [
        ((-0.061, -0.028, -0.455), [], 0.9, ["left-and-right"]),
        # A man who leans aside.
        ((0.061, 0.028, -0.455), [], 0.9, []),
        ((0.064, -0.222, -0.06), [], 0.9, ["left-and-right"]),
        # A woman to the hips, facing us.
        ((0.064, -0.222, -0.06), ["l_knee", "r_knee", "l_ankle", "r_ankle"], 0.9, []),
        # A small man in a street.
        ((0.064, -0.222, -0.06), [], 0.45, []),
    ],
)
def test_neither_one_sign_alone_nor_a_trunk_exchanges_sides(monkeypatch, better, unseen, score, told):
    misfits = iter([np.exp(better), np.ones(3)])
    monkeypatch.setattr("pcnet3d.models.lifter.sides._misfits", lambda *_: next(misfits))
    pixels = PIXELS.copy()
    pixels[:, H36M17.indices(unseen)] = np.nan
    seen = keypoints(pixels, score=score)
    asked = ToLift(seen.with_(made_by=MadeBy("estimated", "movenet@0")), SIZE)
    assert [each.code for each in sides_doubts(asked, lifted(asked).poses)] == told


def test_a_walk_as_it_was_filmed_has_no_changes():
    assert not change_doubts(keypoints(), SIZE)


def test_a_zoom_is_told():
    grown = 1.01 ** np.arange(len(PIXELS))[:, None, None]
    middle = np.array(SIZE) / 2
    (said,) = change_doubts(keypoints((PIXELS - middle) * grown / grown.mean() + middle), SIZE)
    assert said.code == "camera-zooms"
    assert 0.5 < said.values["percent"] < 1.5


@pytest.mark.parametrize(
    ("rows", "unchanged", "told"),
    [
        (25, 0.005, []),
        (45, 0.02, []),
        (45, 0.005, ["rate"]),
        (65, 0.04, []),
        (65, 0.02, ["rate"]),
        (97, 0.04, ["rate", "width"]),
    ],
)
def test_a_brief_take_is_called_changed_only_for_sure(monkeypatch, rows, unchanged, told):
    """A woman who walks past in 65 frames of a video as it was filmed was "1.4 times too wide"."""

    def likely(classes):
        of = np.zeros(len(classes))
        of[[np.abs(classes).argmin(), -2]] = unchanged, 1 - unchanged
        return of

    found = Changes(likely(RATES), likely(WIDTHS), np.eye(len(ZOOMS))[len(ZOOMS) // 2], -9.0)
    monkeypatch.setattr("pcnet3d.models.lifter.changes.changes_of", lambda *_: found)
    codes = {"rate": "movement-against-rate", "width": "image-stretched"}
    said = [each.code for each in change_doubts(keypoints(PIXELS[:rows]), SIZE)]
    assert said == [codes[each] for each in told]


@pytest.mark.parametrize("first", range(0, 120, 30))
@pytest.mark.parametrize("rows", [30, 45])
def test_nothing_is_said_of_a_moment(rows, first):
    """Of nearly every second of a video as it was filmed the page said that the body moves too quickly."""
    assert not change_doubts(keypoints(PIXELS[first : first + rows]), SIZE)


def test_nothing_is_said_of_keypoints_that_tremble_more_than_the_body_moves():
    """A man who stood beside a road moved "2.3 times too quickly"."""
    still = np.repeat(PIXELS[:1], 90, axis=0)
    assert changes_of(keypoints(still + np.random.default_rng(1).normal(0, 6, still.shape)), SIZE) is None


def test_nothing_is_said_of_a_body_whose_feet_are_cut_off():
    """A walk, cut out of its video, "looks about 1.4 times too high"."""
    cut = np.tile(0.9, PIXELS.shape[:2])
    for share, told in ((0.2, True), (0.8, False)):
        cut[: round(share * len(cut)), H36M17.indices(("l_ankle", "r_ankle"))] = 0.1
        assert (changes_of(keypoints().with_(confidence=cut), SIZE) is not None) == told


@pytest.mark.parametrize("times", [4, 8])
def test_slow_motion_is_told(times):
    slow = walker(seconds=3.0, fps=30.0 * times)
    pixels = side_camera(slow).project(slow.world) + np.random.default_rng(0).normal(
        0, 1.5, (len(slow), 17, 2)
    )
    said = change_doubts(keypoints(pixels), SIZE)
    told = [(each.code, each.values["way"], each.values["about"]) for each in said]
    assert told == [("movement-against-rate", "slowly", "at least")]


def test_changes_do_not_depend_on_the_rate_in_which_the_same_is_seen():
    """Every second row of a walk at half of the rate is the same walk; a clock told twice too fast is another one."""
    at_30, at_15 = changes_of(keypoints(), SIZE), changes_of(keypoints(PIXELS[::2], 15.0), SIZE)
    wrong = changes_of(keypoints(PIXELS[::2], 30.0), SIZE)
    rate = [float(each.rate @ RATES) for each in (at_30, at_15, wrong)]
    assert abs(rate[0] - rate[1]) < 0.1
    assert rate[2] > rate[0] + 0.3


@pytest.mark.parametrize(
    "of",
    [
        keypoints(PIXELS[:10]),
        keypoints(np.full_like(PIXELS, np.nan)),
        keypoints(score=0.2),  # as detectors have it of limbs out of the image
        keypoints().with_(time_s=None),
        keypoints(fps=1e-9),  # which would take terabytes at an even rate
    ],
)
def test_nothing_is_said_where_little_is_known(of):
    assert changes_of(of, SIZE) is None
    assert not change_doubts(of, None)


def test_what_is_not_seen_stays_where_it_was():
    points = np.arange(6.0).reshape(3, 1, 2)
    seen = np.array([[False], [True], [False]])
    assert held(points, seen).ravel().tolist() == [0, 0, 2, 3, 2, 3]
