"""Points that were altered are told, and those that nobody saw are gaps; sound ones have nothing of it."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.core.frames import CAMERA, IMAGE, Z_UP
from pcnet3d.pipeline.core.layouts import H36M17, HALPE26
from pcnet3d.pipeline.core.pose import PoseSequence
from pcnet3d.pipeline.signals.altered import alterations, altered, without_altered
from pcnet3d.pipeline.signals.filters import lowpass

WALK = walker(seconds=8.0)


@pytest.fixture(scope="module")
def joints():
    """Of an estimator: the walker with some jitter."""
    return WALK.world - WALK.root[:, None] + np.random.default_rng(0).normal(0, 0.006, WALK.world.shape)


@pytest.fixture(scope="module")
def pixels():
    """The walker from the side, by a detector with a pixel and a half of noise."""
    seen = side_camera(WALK).project(WALK.world)
    return seen + np.random.default_rng(0).normal(0, 1.5, seen.shape)


def points(joints) -> PoseSequence:
    rows = np.arange(len(joints))
    frame = IMAGE if joints.shape[-1] == 2 else CAMERA.with_(origin="pelvis")
    return PoseSequence(joints, H36M17, frame, np.full(joints.shape[:2], 0.9), rows / 30, rows)


def codes(joints) -> set[str]:
    found, said = altered(points(joints))
    assert found.any() <= bool(said)
    return {each.code for each in (*said, *alterations(points(joints)))}


def gaps(joints) -> np.ndarray:
    return altered(points(joints))[0]


def at(*names) -> list[int]:
    return H36M17.indices(names)


def test_a_walk_has_none_of_these(joints, pixels):
    for sound in (joints, pixels, pixels.round(), pixels.round(1), joints[:5]):
        assert not codes(sound)


def test_a_joint_may_be_missing_in_every_frame_and_frames_in_every_joint(joints, pixels):
    for whole in (joints, pixels):
        for joint in ("r_wrist", "l_ankle", "head"):
            without = whole.copy()
            without[:, H36M17.index(joint)] = np.nan
            without[100:110] = np.nan
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                assert not codes(without)
                assert not codes(np.full_like(whole, np.nan))


@pytest.mark.parametrize("decimals", [None, 2])
@pytest.mark.parametrize("rows", [3, 8, 30])
def test_gaps_filled_by_straight_lines_are_gaps_again(pixels, rows, decimals):
    """Of six takes so filled nothing was said."""
    filled, wrist = pixels.copy(), H36M17.index("r_wrist")
    share = np.arange(1, rows + 1)[:, None] / (rows + 1)
    filled[60 : 60 + rows, wrist] = (1 - share) * pixels[59, wrist] + share * pixels[60 + rows, wrist]
    found = gaps(filled if decimals is None else filled.round(decimals))
    assert found[60 : 60 + rows, wrist].all()
    assert found.sum() == rows


def test_values_held_where_they_were_are_gaps(joints):
    held, ankle = joints.copy(), H36M17.index("l_ankle")
    held[100:110, ankle] = joints[99, ankle]
    found = gaps(held)
    assert found[100:110, ankle].all()
    assert found.sum() == 10
    assert np.isnan(without_altered(points(held), found).joints[100:110, ankle]).all()


def test_joints_are_named_in_words():
    """Of a toe that was held: "right smalleft toe"."""
    held, toe = np.random.default_rng(0).normal(300, 20, (60, len(HALPE26), 2)), HALPE26.index("r_small_toe")
    held[20:30, toe] = held[19, toe]
    _, (said,) = altered(PoseSequence(held, HALPE26, IMAGE))
    assert said.values["joints"] == "right small toe"


def test_a_foot_that_stands_still_in_a_world_is_no_gap_and_one_held_in_the_air_is():
    """Of generated motion, whose standing foot keeps its place to the digit, 23 frames were "missing"."""
    world, ankle = WALK.world + np.random.default_rng(0).normal(0, 1e-4, WALK.world.shape), at("l_ankle")[0]
    height = world[60:180, ankle, 2]
    stands, swings = 60 + int(height.argmin()), 60 + int(height.argmax())
    locked, held = world.copy(), world.copy()
    locked[stands : stands + 6, ankle] = world[stands, ankle]
    held[swings : swings + 6, ankle] = world[swings, ankle]
    told = [altered(replace(points(joints), frame=Z_UP))[0].sum() for joints in (locked, held)]
    assert told == [0, 5]


def test_rows_put_between_those_that_were_seen_are_told(pixels):
    twice = np.repeat(pixels[:100], 2, axis=0)[:-1]
    twice[1::2] = (pixels[:99] + pixels[1:100]) / 2
    assert codes(twice) == {"rows-added"}
    assert not gaps(twice).any()


def test_repeated_images_are_another_matter(pixels):
    assert not gaps(np.repeat(pixels, 2, axis=0)).any()


def test_who_stands_still_in_whole_pixels_is_on_no_lines(pixels):
    still = np.repeat(pixels[:1], 200, axis=0) + np.random.default_rng(1).normal(0, 0.3, (200, 17, 2))
    assert not gaps(still.round()).any()


@pytest.mark.parametrize(
    "names",
    [
        *((f"r_{part}", f"l_{part}") for part in ("ankle", "knee", "elbow", "wrist")),
        ("l_elbow", "l_wrist"),
        ("r_knee", "r_ankle"),
    ],
)
def test_joints_whose_names_are_exchanged_are_told_and_gaps(joints, pixels, names):
    """Ankles that a converter exchanged: silent in five of six, and a knee of 10 to 70 degrees was 41 to 88."""
    pair = at(*names)
    for whole in (joints, pixels):
        exchanged = whole.copy()
        exchanged[:, pair] = whole[:, pair[::-1]]
        assert "joints-exchanged" in codes(exchanged)
        assert gaps(exchanged)[:, pair].all()


def test_a_knee_and_an_ankle_are_told_from_each_other_by_a_poor_detector():
    """Of somebody who lifts a box: bones were half as long in each other's place, and it was silent."""
    poor = side_camera(WALK).project(WALK.world) + np.random.default_rng(0).normal(0, 9, (len(WALK), 17, 2))
    pair = at("r_knee", "r_ankle")
    exchanged = poor.copy()
    exchanged[:, pair] = poor[:, pair[::-1]]
    assert "joints-exchanged" in codes(exchanged)
    assert "joints-exchanged" not in codes(poor)


def test_who_folds_the_arms_or_crosses_the_legs_has_no_exchanged_joints(joints):
    """The left wrist lies at the right elbow and the right one at the left, the shanks cross."""
    crossed = joints.copy()
    sway = 0.03 * np.sin(np.arange(len(joints)) / 9)[:, None]
    for middle, end, way in (("elbow", "wrist", 0.9), ("knee", "ankle", 0.9)):
        left, right = (joints[:, H36M17.index(f"{side}_{middle}")] for side in "lr")
        for side, own, other in (("l", left, right), ("r", right, left)):
            bone = way * (other - own) + sway
            length = np.linalg.norm(joints[:, at(f"{side}_{end}")[0]] - own, axis=-1, keepdims=True)
            crossed[:, at(f"{side}_{end}")[0]] = own + length * bone / np.linalg.norm(
                bone, axis=-1, keepdims=True
            )
    assert "joints-exchanged" not in codes(crossed)


def test_joints_that_stay_at_one_point_are_told_and_the_outer_one_is_a_gap(joints):
    one_point = joints.copy()
    one_point[40:90, at("r_wrist")] = joints[40:90, at("nose")]
    one_point[:, at("l_knee")] = joints[:, at("l_hip")]
    assert "joints-coincide" in codes(one_point)
    found = gaps(one_point)
    assert found[40:90, at("r_wrist")].all()
    assert found[:, at("l_knee")].all()
    assert found.sum() == 50 + len(joints)


def test_a_copied_leg_is_told(joints):
    copied = joints.copy()
    for part in ("knee", "ankle"):
        left = joints[:, at(f"l_{part}")] - joints[:, at("l_hip")]
        copied[:, at(f"r_{part}")] = joints[:, at("r_hip")] + left
    assert codes(copied) == {"limbs-copied"}


def test_a_loop_is_told(joints):
    """Where the same joint was never seen, too."""
    unseen = joints.copy()
    unseen[:, at("r_wrist")] = np.nan
    for of in (joints, unseen):
        assert "repeats-itself" in codes(np.tile(of[:60], (3, 1, 1)))


def test_noise_about_one_pose_and_rows_in_another_order_are_told(joints, pixels):
    assert "only-noise" in codes(joints[:1] + np.random.default_rng(1).normal(0, 0.003, joints.shape))
    assert "only-noise" in codes(np.random.default_rng(1).permutation(pixels))


def test_smoothed_keypoints_are_told_and_those_of_a_filter_at_6_hz_are_not(pixels):
    for frames in (11, 31):
        assert codes(uniform_filter1d(pixels, frames, axis=0)) == {"keypoints-smooth"}
    filtered = lowpass(pixels.reshape(len(pixels), -1), np.arange(len(pixels)) / 30).reshape(pixels.shape)
    assert codes(filtered) == set()


def test_rows_that_are_lost_regularly_are_told(joints):
    quiet = (WALK.world - WALK.root[:, None])[:120]
    assert "rows-lost" in codes(np.delete(quiet, np.s_[4::5], axis=0))
    assert "rows-lost" not in codes(np.repeat(quiet, 4, axis=0))  # repeated, of a video that was slowed


def test_rows_that_are_lost_at_once_are_told_where_neither_numbers_nor_times_are(pixels):
    """Ten of a walk were silent: cadence and step times were off by a tenth."""
    rows = np.delete(np.arange(len(pixels)), np.s_[60:70])
    lost, elsewhere = pixels[rows], pixels.copy()
    elsewhere[60] += 300.0  # one row of somebody else: there and back
    assert "rows-lost" in codes(lost)
    assert "rows-lost" not in codes(elsewhere)
    timed = replace(points(lost), time_s=rows / 30)
    assert "rows-lost" not in {each.code for each in alterations(timed)}


def test_a_leap_at_an_end_is_no_loss_of_rows(pixels):
    """The first five seconds of a real boxer were called suspicious: the detector settles in its first frame."""
    settling = pixels.copy()
    settling[0] -= 300.0
    assert "rows-lost" not in codes(settling)


def test_a_joint_that_leaps_at_every_tenth_row_of_a_short_take_loses_none(pixels):
    """Of a real film with OpenPose's keypoints: "at every 10th row the whole body moves further than in one frame"."""
    short = pixels[:95].copy()
    short[5::10, at("r_wrist")] += 200.0
    assert "rows-lost" not in codes(short)
