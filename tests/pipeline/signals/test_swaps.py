"""Exchanged and collapsed limbs: put into the walker, found to the row, and nothing elsewhere."""

import json
from pathlib import Path

import numpy as np
import pytest

from commands import pcnet3d, succeeded
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.files import write_keypoints
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.motion import in_doubt
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, PoseSequence, Take
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, COCO17, HALPE26, Layout
from pcnet3d.pipeline.reading.findings import swap_findings
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.pipeline.signals.swaps import find_swaps, kinds, swaps_of_take

ARRAYS = {"layout": "H36M17", "frame": "CAMERA", "unit": "m"}
OPTIONS = ["--adapter", "arrays", *(part for of in ARRAYS.items() for part in ("-O", "=".join(of)))]
WAYS = {way.name: way for way in kinds(H36M17)}
WALK, SQUAT = 40, 150  # rows at 30 frames a second


def seen(fps=30.0) -> PoseSequence:
    """The walker from the side in CAMERA, with an error of 5 mm that lasts as an estimator's does."""
    walk = walker(fps=fps)
    poses = camera_poses(walk, side_camera(walk))
    rng = np.random.default_rng(0)
    error = np.cumsum(rng.normal(0, 0.005 / np.sqrt(fps), (len(walk), 17, 3)), axis=0)
    return poses.with_(joints=poses.joints - poses.joints[:, :1] + error - error[:, :1])


def pictured(fps=30.0) -> PoseSequence:
    """The same in pixels."""
    walk = walker(fps=fps)
    pixels = side_camera(walk).project(walk.world) + np.random.default_rng(0).normal(
        0, 0.5, (len(walk), 17, 2)
    )
    return PoseSequence(pixels, H36M17, IMAGE, time_s=walk.time_s)


PIXELS = pictured()
POSES = seen()


def spoilt(poses, *names, first, last):
    joints = poses.joints.copy()
    for name in names:
        joints[first : last + 1] = WAYS[name].applied(joints[first : last + 1])
    return poses.with_(joints=joints)


def rows(swaps):
    return sorted((swap.kind, swap.first_row, swap.last_row) for swap in swaps)


def rows_of(swap):
    return swap.last_row - swap.first_row + 1


def test_nothing_is_found_in_untouched_takes():
    assert find_swaps(POSES) == ()
    assert find_swaps(PIXELS) == ()


@pytest.mark.parametrize("length", [1, 3, 10, 60])
@pytest.mark.parametrize("names", [*((name,) for name in WAYS), tuple(WAYS)])
def test_every_kind_is_found_to_the_row(names, length):
    for take, first in ((POSES, WALK), (POSES, SQUAT), (PIXELS, SQUAT)):
        wrong = spoilt(take, *names, first=first, last=first + length - 1)
        assert rows(find_swaps(wrong)) == sorted((name, first, first + length - 1) for name in names)


@pytest.mark.parametrize(("first", "last"), [(0, 19), (220, 239), (0, 149)])
def test_what_touches_an_end_of_the_take_is_found_by_anatomy(first, last):
    """Of 240 rows, also where the shorter rest is right: nose and knees show it."""
    wrong = spoilt(POSES, *WAYS, first=first, last=last)
    assert rows(find_swaps(wrong)) == sorted((name, first, last) for name in WAYS)


@pytest.mark.parametrize("fps", [25.0, 60.0, 120.0])
def test_the_frame_rate_does_not_matter(fps):
    first, last = round(1.3 * fps), round(1.7 * fps)
    for name in WAYS:
        assert rows(find_swaps(spoilt(seen(fps), name, first=first, last=last))) == [(name, first, last)]
    wrong = spoilt(pictured(fps), "legs exchanged", first=first, last=last)
    assert rows(find_swaps(wrong)) == [("legs exchanged", first, last)]


def test_the_unit_and_a_rate_that_is_unknown_do_not_matter():
    wrong = spoilt(POSES, "legs exchanged", first=WALK, last=WALK + 5)
    other = wrong.with_(joints=1000 * wrong.joints, frame=CAMERA.with_(unit="mm"), time_s=None)
    assert rows(find_swaps(other)) == rows(find_swaps(wrong))


def test_missing_joints_have_no_say():
    wrong = spoilt(POSES, "legs exchanged", first=WALK, last=WALK + 9)
    joints = wrong.joints.copy()
    joints[WALK - 10 : WALK + 30, H36M17.index("l_ankle")] = np.nan
    joints[120:] = np.nan
    assert rows(find_swaps(wrong.with_(joints=joints))) == [("legs exchanged", WALK, WALK + 9)]
    assert find_swaps(wrong.with_(joints=np.full_like(joints, np.nan))) == ()
    assert find_swaps(wrong.with_(joints=joints[:2], time_s=None, frame_index=None, confidence=None)) == ()


@pytest.mark.parametrize("step_px", [0, 1, 20])
@pytest.mark.filterwarnings("error")
def test_half_a_body_that_keeps_still_in_whole_pixels_has_no_swaps(step_px):
    """Without hips and with a step of 0 there is no size to judge a hand by; numpy once warned the user of it."""
    joints = np.repeat(pictured().joints[:1].round(), 60, axis=0)
    joints[:, H36M17.indices(("l_hip", "r_hip"))] = np.nan
    joints[30:33, H36M17.index("r_wrist")] += step_px
    assert find_swaps(PoseSequence(joints, H36M17, IMAGE, time_s=np.arange(60) / 30)) == ()


@pytest.mark.parametrize("how", ["seam", "gap"])
def test_a_break_ends_what_continuity_can_say(how):
    """From a clip boundary or a gap on everything is exchanged: no motion goes across, so only anatomy could tell."""
    wrong = spoilt(POSES, "legs exchanged", first=WALK, last=WALK + 9)
    if how == "seam":
        wrong = wrong.with_(seams=(WALK,))
        rest = wrong
    else:
        rest = wrong.with_(frame_index=np.arange(len(wrong)) + 5 * (np.arange(len(wrong)) >= WALK))
    found = find_swaps(rest)
    assert rows(found) == [("legs exchanged", WALK, WALK + 9)]  # by its other end
    assert found[0].evidence < find_swaps(wrong.with_(seams=()))[0].evidence


def test_other_layouts_move_the_feet_and_hands_too():
    way = next(way for way in kinds(BLAZEPOSE33) if way.name == "legs exchanged")
    named = {tuple(BLAZEPOSE33.joints[i] for i in pair) for pair in way.pairs}
    assert ("l_heel", "r_heel") in named
    assert ("l_wrist", "r_wrist") not in named
    face = Layout("FACE", ("nose", "l_eye", "r_eye"))
    assert find_swaps(PoseSequence(np.zeros((9, 3, 2)), face, IMAGE)) == ()
    assert len(kinds(COCO17)) == 2


def saved(path, poses):
    np.savez(path, joints=poses.joints, time_s=poses.time_s, frame_index=np.arange(len(poses)))
    return path


def test_inspect_names_frames_and_doubts_a_take_with_many(tmp_path):
    few = saved(tmp_path / "few.npz", spoilt(POSES, "legs exchanged", first=60, last=61))
    many = saved(tmp_path / "many.npz", spoilt(POSES, "legs exchanged", first=60, last=69))
    result = succeeded(pcnet3d("inspect", few, *OPTIONS))
    assert "legs exchanged in frames 60-61 from 2.00 s (2 of 240 frames)" in result.stdout
    result = pcnet3d("inspect", many, *OPTIONS, "--json")
    assert result.returncode == 3, result.stderr
    (found,) = json.loads(result.stdout)["people"][0]["swaps"]
    assert (found["kind"], found["first_frame"], found["last_frame"]) == ("legs exchanged", 60, 69)


def test_a_take_tells_its_exchanged_limbs_and_is_not_changed(tmp_path):
    wrong = spoilt(POSES, "legs exchanged", first=60, last=69)
    take = open_take(RunOptions(poses=saved(tmp_path / "poses.npz", wrong), adapter="arrays", options=ARRAYS))
    (said,) = [each for each in take.notices if "legs exchanged" in each.text]
    assert (said.code, said.values["wrong"], said.values["of"]) == ("swaps-found", 10, 240)
    np.testing.assert_allclose(take.poses.joints, wrong.joints - wrong.joints[:, :1], atol=1e-6)


def exchanged_file(path, first, last) -> Path:
    """AlphaPose's file of the walker, legs and arms exchanged in some frames."""
    walk = walker()
    write_keypoints(path, walk, side_camera(walk), np.arange(len(walk)), 0.5, np.random.default_rng(0))
    detections = json.loads(path.read_text())
    for detection in detections[first : last + 1]:
        points = np.reshape(detection["keypoints"], (1, 26, 3))
        for way in kinds(HALPE26):
            points = way.applied(points)
        detection["keypoints"] = points.ravel().tolist()
    path.write_text(json.dumps(detections))
    return path


def test_poses_beside_exchanged_keypoints_are_told(tmp_path):
    poses_file = saved(tmp_path / "poses.npz", POSES)
    keypoints = exchanged_file(tmp_path / "alphapose-results.json", 60, 69)
    take = open_take(
        RunOptions(poses=poses_file, keypoints=keypoints, adapter="arrays", options=ARRAYS, fps=30)
    )
    assert np.isfinite(take.poses.joints).all()
    assert [each.values for each in take.notices if each.code == "swapped-keypoints"] == [{"wrong": 10}]


def slid(poses: PoseSequence, name: str, first: int, last: int) -> PoseSequence:
    """Exchanged in the image alone, depth kept, and over three rows at either end, as a lift smooths an exchange."""
    wrong = WAYS[name].applied(poses.joints)
    share = np.clip(np.minimum(np.arange(len(poses)) - first + 2, last + 2 - np.arange(len(poses))) / 3, 0, 1)
    joints = poses.joints.copy()
    joints[..., :2] += share[:, None, None] * (wrong - poses.joints)[..., :2]
    return poses.with_(joints=joints)


def reaching(poses: PoseSequence) -> PoseSequence:
    """Who stands with one arm forward and one back, in the plane of the image."""
    joints = np.repeat(poses.joints[SQUAT - 20 : SQUAT - 19], len(poses), axis=0)
    joints += np.random.default_rng(1).normal(0, 0.003, joints.shape)
    for side, way in (("l", 1.0), ("r", -1.0)):
        shoulder = joints[:, H36M17.index(f"{side}_shoulder")]
        for part, reach in (("elbow", 0.28), ("wrist", 0.55)):
            joints[:, H36M17.index(f"{side}_{part}")] = shoulder + way * reach * np.array([1.0, 0.1, 0.3])
    return poses.with_(joints=joints)


def test_an_exchange_that_a_lift_has_smoothed_is_told_as_doubtful():
    """Of a cyclist whose arms are exchanged for 1.5 s: "No exchanged limbs were found", "chest turned 46 to 65"."""
    sound = reaching(POSES)
    assert find_swaps(sound) == ()
    found = find_swaps(slid(sound, "arms exchanged", 100, 144))
    assert {swap.kind for swap in found} == {"elbows exchanged", "wrists exchanged"}
    assert all(abs(swap.first_row - 100) + abs(swap.last_row - 144) <= 4 for swap in found)
    assert not any(swap.certain for swap in found)


def test_knees_that_leap_beside_ankles_that_flicker_are_told():
    """Of a man from the side, legs exchanged from where they crossed on, the detector unsure which ankle is where:
    "No exchanged limbs were found"."""
    ankles, knees = (H36M17.indices((f"l_{part}", f"r_{part}")) for part in ("ankle", "knee"))
    rng, joints = np.random.default_rng(0), PIXELS.joints.copy()
    for row in range(len(joints)):
        joints[row, ankles] = joints[row, ankles][rng.integers(2, size=2)]
    apart = np.abs(joints[:, knees[0], 0] - joints[:, knees[1], 0])
    first = WALK + int(np.argmin(apart[WALK : WALK + 15]))
    last = first + int(np.argmax(apart[first : first + 12]))
    joints[first : last + 1, knees] = joints[first : last + 1, knees[::-1]]
    assert ("knees exchanged", first, last) in rows(find_swaps(PIXELS.with_(joints=joints)))


@pytest.mark.parametrize("length", [3, 10, 30])
@pytest.mark.parametrize("part", ["knee", "ankle", "elbow", "wrist"])
def test_a_pair_of_joints_that_is_exchanged_alone_is_found_to_the_row(part, length):
    """A slip of a tracker: right and left ankle exchanged, the knees as they were; knee 41 to 88 for 10 to 70."""
    for take in (PIXELS, POSES):
        first = widest(take, part) - 1
        joints, pair = take.joints.copy(), H36M17.indices((f"l_{part}", f"r_{part}"))
        joints[first : first + length, pair] = joints[first : first + length, pair[::-1]]
        found = find_swaps(take.with_(joints=joints))
        (swap,) = (swap for swap in found if swap.kind == f"{part}s exchanged")
        assert abs(swap.first_row - first) + abs(swap.last_row - first - length + 1) <= 3


def test_limbs_that_swing_fast_are_not_told():
    """The walk at three times its speed: legs pass each other as a sprinter's do."""
    for take in (PIXELS, POSES):
        joints = take.joints[::3]
        fast = PoseSequence(joints, take.layout, take.frame, time_s=np.arange(len(joints)) / 30)
        assert find_swaps(fast) == ()


def end_on(rows=110) -> PoseSequence:
    """The walker in pixels, hips seen end-on: nothing but motion tells left from right. It walks up to row 101."""
    hips, rng = H36M17.indices(("l_hip", "r_hip")), np.random.default_rng(0)
    pixels = pictured().joints.copy()
    pixels[:, hips] = pixels[:, hips].mean(axis=1, keepdims=True) + rng.normal(0, 0.5, (len(pixels), 2, 2))
    return PoseSequence(pixels[:rows], H36M17, IMAGE, time_s=pictured().time_s[:rows])


def test_a_change_of_sides_in_the_middle_leaves_open_which_side_is_wrong():
    """As likely as its complement: it is told by its ends, and its angles are withheld."""
    wrong = spoilt(end_on(), "legs exchanged", first=50, last=109)
    (found,) = find_swaps(wrong)
    assert not found.certain
    assert rows_of(found) <= 60  # the labeling with fewer frames
    (said,), swaps = swaps_of_take(wrong, None)
    assert (said.code, swaps) == ("swaps-doubtful", (found,))
    assert in_doubt(Take("take", poses=wrong).saying(said))["leg"].sum() == rows_of(found)
    assert [finding.weight for finding in swap_findings(wrong, (found,))] == ["note"]


def test_right_rows_of_somebody_who_turns_are_not_called_exchanged_for_certain():
    """From behind at rows 51 to 150, and named as if from the front but for 24 of these. The change edge-on shows in no
    leap, so the 24 that are right look like the wrong ones."""
    person = walker().world[-1] - walker().world[-1, 0]
    angle = np.linspace(0.5 * np.pi, 2.5 * np.pi, 200, endpoint=False)[:, None]
    across = person[:, 0] * np.cos(angle) - person[:, 1] * np.sin(angle)
    pixels = 200 * np.stack([across, np.broadcast_to(-person[:, 2], across.shape)], axis=-1)
    pixels += np.random.default_rng(0).normal(0, 2, pixels.shape)
    wrong = PoseSequence(pixels, H36M17, IMAGE, time_s=np.arange(200) / 30)
    for first, last in ((51, 103), (128, 150)):
        wrong = spoilt(wrong, *WAYS, first=first, last=last)
    found = find_swaps(wrong)
    assert rows(found) == sorted((name, 104, 127) for name in WAYS)
    assert not any(swap.certain for swap in found)


def test_a_row_without_limbs_leaves_an_exchange_certain():
    wrong = spoilt(end_on(), "legs exchanged", first=40, last=46)
    joints = wrong.joints.copy()
    joints[42, WAYS["legs exchanged"].pairs] = np.nan
    (found,) = find_swaps(wrong.with_(joints=joints))
    assert (found.first_row, found.last_row, found.certain) == (40, 46, True)


def test_the_complement_of_an_exchange_is_never_found():
    """Rows 58 and 82, legs melted into one about the first: not all rows between and behind."""
    pairs, joints = WAYS["legs exchanged"].pairs, end_on().joints.copy()
    middle = joints[57:60][:, pairs].mean(axis=2, keepdims=True).repeat(2, axis=2).reshape(3, -1, 2)
    joints[57:60, pairs.ravel()] = middle + np.random.default_rng(2).normal(0, 1.5, middle.shape)
    wrong = end_on().with_(joints=joints)
    for row in (58, 82):
        wrong = spoilt(wrong, "legs exchanged", first=row, last=row)
    found = find_swaps(wrong)
    assert ("legs exchanged", 82, 82) in rows(found)
    assert all(swap.first_row >= 57 and rows_of(swap) <= 3 for swap in found)


def on_one(poses: PoseSequence, limb: str, first: int, last: int) -> PoseSequence:
    """The right leg, or arm, drawn where the left one is, as of a detector that sees one of the two."""
    parts, joints = {"leg": ("knee", "ankle"), "arm": ("elbow", "wrist")}[limb], poses.joints.copy()
    to, of = (H36M17.indices([f"{side}_{part}" for part in parts]) for side in "rl")
    joints[first : last + 1, to] = joints[first : last + 1, of]
    noise = np.random.default_rng(3).normal(0, 0.3, (last + 1 - first, 2, joints.shape[-1]))
    joints[first : last + 1, to] += noise * (0.01 if poses.frame.dims == 3 else 1.0)
    return poses.with_(joints=joints)


def widest(poses: PoseSequence, part: str) -> int:
    """The row of the walk with the right joint farthest from the left one in the image."""
    ends = poses.joints[WALK : WALK + 40, H36M17.indices((f"l_{part}", f"r_{part}")), :2]
    return WALK + int(np.argmax(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1)))


@pytest.mark.parametrize(("limb", "part"), [("leg", "ankle"), ("arm", "wrist")])
def test_limbs_that_both_lie_on_one_are_withheld_as_exchanged_ones(limb, part):
    """A runner from the side, both legs on the one that stands: "knees 17 to 60", true 95, and not a word."""
    for take in (PIXELS, POSES):
        middle = widest(take, part)
        wrong = on_one(take, limb, middle - 3, middle + 4)
        (found,) = find_swaps(wrong)
        assert (found.kind, found.certain) == (f"{limb}s both on one", True)
        assert abs(found.first_row - middle + 3) + abs(found.last_row - middle - 4) <= 2
        said, _ = swaps_of_take(wrong, None)
        assert in_doubt(Take("take", poses=wrong).saying(*said))[limb].sum() == rows_of(found)


def test_legs_side_by_side_are_not_on_one():
    """Who stands, squats or jumps seen from the side: the legs come together and part, but in no leap."""
    knees = H36M17.indices(("l_knee", "l_ankle")), H36M17.indices(("r_knee", "r_ankle"))
    joints, share = PIXELS.joints.copy(), np.clip(np.abs(np.arange(len(PIXELS)) - 70) / 6 - 2, 0, 1)
    left, right = (joints[:, side] for side in knees)
    joints[:, knees[1]] = left + share[:, None, None] * (right - left)
    assert find_swaps(PIXELS.with_(joints=joints)) == ()
