"""Cleaning: what was broken on purpose comes back, and nothing else changes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import CAMERA, H36M17, Z_UP, InputError, PoseSequence, Take
from pcnet3d.pipeline.core.pose import RootPath
from pcnet3d.pipeline.signals.checks import leaps
from pcnet3d.stages.clean import Clean, clean, not_seen

FPS = 30
ROWS = 60
TIMES_S = np.arange(90) / FPS
ANKLES = H36M17.indices(("r_ankle", "l_ankle"))


def moving(rows: int = ROWS) -> PoseSequence:
    """A body with a trunk of 0.5 m whose joints move on smooth curves."""
    base = np.random.default_rng(0).normal(scale=0.4, size=(17, 3))
    base[H36M17.index("pelvis")] = 0
    base[H36M17.index("thorax")] = [0, -0.5, 0]
    time_s = np.arange(rows) / FPS
    joints = base + 0.1 * np.sin(2 * np.pi * time_s)[:, None, None]
    return PoseSequence(joints, H36M17, CAMERA, time_s=time_s, frame_index=np.arange(rows))


def without(poses: PoseSequence, *rows: int, **changes) -> PoseSequence:
    """As an estimator leaves them that drops these frames."""
    kept = np.delete(np.arange(len(poses)), rows)
    arrays = {"joints": poses.joints, "confidence": poses.confidence, "time_s": poses.times} | changes
    return poses.with_(frame_index=kept, **{name: array[kept] for name, array in arrays.items()})


def counts(poses: PoseSequence) -> dict:
    return {k: v for k, v in poses.history[-1].options.items() if k not in ("max_gap_s", "spike")}


def test_dropped_frames_come_back_as_rows_and_short_gaps_are_filled():
    poses = moving()
    cleaned = clean(without(poses, 10, 11, 12))[0]
    assert cleaned.frame_index.tolist() == list(range(ROWS))
    np.testing.assert_allclose(cleaned.times, poses.times, atol=1e-12)
    np.testing.assert_allclose(cleaned.joints, poses.joints, atol=2e-3)
    assert counts(cleaned) == {
        "rows_inserted": 3, "spikes_removed": 0, "strays_removed": 0, "values_filled": 3 * 17, "values_missing": 0,
        "seams": 0,
    }  # fmt: skip


@pytest.mark.parametrize(("length", "filled"), [(5, True), (6, True), (7, False)])
def test_only_gaps_up_to_the_stated_length_are_filled(length, filled):
    """0.2 s are 6 frames at 30 fps."""
    joints = moving().joints.copy()
    joints[20 : 20 + length, 3] = np.nan
    cleaned = clean(moving().with_(joints=joints), max_gap_s=0.2)[0]
    assert np.isfinite(cleaned.joints[20 : 20 + length, 3]).all() == filled
    assert counts(cleaned)["values_filled"] == length * filled
    assert counts(cleaned)["values_missing"] == length * (not filled)


def test_nothing_is_invented_at_the_ends_or_across_a_clip_boundary():
    joints = moving().joints.copy()
    joints[:2, 3] = joints[-2:, 3] = joints[29:31, 3] = np.nan
    cleaned = clean(moving().with_(joints=joints, seams=(30,)))[0]
    assert counts(cleaned)["values_filled"] == 0
    assert np.isnan(cleaned.joints[[0, 1, 29, 30, ROWS - 2, ROWS - 1], 3]).all()


def test_rows_put_back_into_a_video_of_variable_rate_take_its_own_stamps():
    stamps = np.cumsum(np.where(np.arange(ROWS) == 12, 0.5, 1 / FPS))
    dropped = without(moving(), 10, 11, 12, time_s=stamps)
    np.testing.assert_array_equal(clean(dropped, video_time_s=stamps)[0].times, stamps)
    given = dropped.with_(
        time_s=dropped.frame_index / 100.0
    )  # a rate of the user's own: the stamps do not count
    np.testing.assert_allclose(clean(given, video_time_s=stamps)[0].times, np.arange(ROWS) / 100)


@given(st.integers(1, ROWS - 2), st.integers(0, 16))
def test_a_one_frame_jump_is_removed_and_bridged(row, joint):
    poses = moving()
    joints = poses.joints.copy()
    joints[row, joint] += [0.6, -0.6, 0.6]
    cleaned = clean(poses.with_(joints=joints))[0]
    assert counts(cleaned)["spikes_removed"] == 1
    np.testing.assert_allclose(cleaned.joints, poses.joints, atol=3e-3)


@pytest.mark.parametrize("fps", [2, 3, 4, 5, 8, 10, 12, 15, 25, 60, 240])
def test_true_movement_is_no_jump_at_any_frame_rate(fps):
    """At 5 frames a second 116 positions of a runner once went."""
    for speed_mps in [1.25, 2.0, 3.0]:
        walk = walker(fps=fps, speed_mps=speed_mps).poses
        body = walk.with_(joints=walk.joints - walk.joint("pelvis")[:, None])
        cleaned = clean(body)[0]
        assert set(counts(cleaned).values()) == {0}
        assert len(leaps(body)) == 0


def test_only_time_between_frames_excuses_a_jump():
    """A hand 0.8 m away for a frame; a fifth of a second suffices to go there and return. Two metres are too far."""

    def removed(far_m: float, fps: float) -> int:
        joints = moving().joints.copy()
        joints[30, H36M17.index("r_wrist"), 0] += far_m
        return counts(clean(moving().with_(joints=joints, time_s=np.arange(ROWS) / fps))[0])["spikes_removed"]

    assert [removed(0.8, fps) for fps in (120, 30, 15, 5)] == [1, 1, 1, 0]
    assert removed(2.0, 10) == 1


@pytest.mark.parametrize("time_s", [None, np.arange(ROWS) / FPS, np.arange(ROWS) / 5])
def test_somebody_else_is_a_leap_at_any_frame_rate(time_s):
    joints = moving().joints.copy()
    joints[20:22] *= -1
    assert leaps(moving().with_(joints=joints, time_s=time_s)).tolist() == [20, 22]


@pytest.mark.parametrize("fps", [5, 30, 240])
def test_a_path_that_nobody_goes_in_a_frame_is_a_leap(fps):
    """Two recordings in one file gave a walk of 1.7 m/s."""
    time_s = np.arange(ROWS) / fps
    still = moving().with_(
        frame=Z_UP.with_(origin="pelvis"), joints=np.repeat(moving().joints[:1], ROWS, axis=0)
    )
    root = np.outer(12.0 * time_s, [1, 0, 0])
    assert len(leaps(still.with_(path=RootPath(root), time_s=time_s))) == 0
    root[4:] += [0, 6, 0]
    there = still.with_(path=RootPath(root), time_s=time_s)
    assert leaps(there).tolist() == [4]
    assert leaps(there.with_(seams=(4,))).tolist() == []


def test_frame_numbers_that_cannot_be_are_refused():
    poses = moving(3).with_(frame_index=[0, 1, 10**9])
    with pytest.raises(InputError, match="1000000000"):
        clean(poses)


def test_the_stage_says_what_it_did():
    joints = moving().joints.copy()
    joints[4, 2] = joints[20:40, 5] = np.nan
    take = Clean()(Take("t", poses=moving().with_(joints=joints, seams=(30,))))
    said = {each.code: each for each in take.notices}
    assert said["gaps-filled"].values["count"] == 1
    assert said["seam"].rows == (30,)


def test_joints_that_a_file_has_not_are_named():
    joints = moving().joints.copy()
    joints[:, [9, 10]] = np.nan
    said = {each.code: each for each in Clean()(Take("t", poses=moving().with_(joints=joints))).notices}
    assert said["joints-absent"].values["joints"] == "nose and head"


@pytest.mark.parametrize("rows", [range(ROWS - 1, ROWS), range(2), range(20, 23)])
def test_frames_of_somebody_else_are_removed(rows):
    """A tracker's last frame on another person made a trunk lean by 104 degrees."""
    poses = moving()
    rows = np.array(rows)
    joints = poses.joints.copy()
    joints[rows] = -joints[rows]  # upside down: every joint is elsewhere
    cleaned = clean(poses.with_(joints=joints))[0]
    assert counts(cleaned)["strays_removed"] == len(rows)
    inside = rows[0] > 0 and rows[-1] < ROWS - 1
    assert np.isfinite(cleaned.joints[rows]).all() == inside
    np.testing.assert_allclose(
        cleaned.joints[np.isfinite(cleaned.joints)], poses.joints[np.isfinite(cleaned.joints)], atol=5e-3
    )


def test_frames_of_somebody_else_lose_their_place_too_and_made_places_state_no_error():
    poses = moving()
    walked = np.stack([np.arange(ROWS) / FPS, np.zeros(ROWS), np.full(ROWS, 4.0)], axis=-1)
    rows = np.arange(20, 23)
    joints, root = poses.joints.copy(), walked.copy()
    joints[rows] = -joints[rows]
    root[rows] += [3, 0, 2]
    root[40] += 2
    root[50] = np.nan
    known = np.broadcast_to(0.01 * np.eye(3), (ROWS, 3, 3))
    cleaned = clean(poses.with_(joints=joints, path=RootPath(root, known)))[0]
    np.testing.assert_allclose(cleaned.root, walked, atol=1e-6)
    made = np.flatnonzero(np.isnan(cleaned.path.covariance).all(axis=(1, 2)))
    np.testing.assert_array_equal(made, [*rows, 40, 50])
    assert counts(cleaned)["spikes_removed"] == 1
    assert counts(cleaned)["values_filled"] == 17 * 3 + 5


@pytest.mark.parametrize("rows", [slice(ROWS // 2, None), slice(None, None, 2)], ids=["stays", "in turns"])
def test_a_change_of_pose_that_stays_and_two_people_in_turns_are_no_strays(rows):
    """Which half is wrong, nobody knows."""
    joints = moving().joints.copy()
    joints[rows] *= -1
    assert counts(clean(moving().with_(joints=joints))[0])["strays_removed"] == 0


def test_feet_that_leave_the_image_in_turn_are_told_as_long_as_they_are_out():
    """A walk's right foot was out until 0.7 s and told until 0.4 s, for then the left one was out too for a moment."""
    hidden = np.zeros((90, len(H36M17)), dtype=bool)
    hidden[:22, ANKLES[0]] = hidden[14:41, ANKLES[1]] = hidden[70:80, ANKLES[0]] = True
    said = {each.values["part"]: each.values["when"] for each in not_seen(hidden, hidden, TIMES_S)}
    assert said == {"right foot": "from 0.00 to 0.70 s, 2.33 to 2.63 s", "left foot": "from 0.47 to 1.33 s"}


def test_missing_rows_make_a_moment_out_of_the_image_no_longer():
    """Of one row before a gap of two seconds "from 1.0 to 1.0 s" was told."""
    times = np.concatenate([TIMES_S[:30], TIMES_S[30:] + 2])
    hidden = np.zeros((90, len(H36M17)), dtype=bool)
    hidden[29, ANKLES[0]] = True
    assert not_seen(hidden, hidden, times) == []
