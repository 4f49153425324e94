"""MMPose 1.x 3D JSON: mirrored axes, heights rebased frame by frame, people without track numbers (formats.md 3); and
RTMW3D's demo, crop pixels and depth bins of 133 joints (4)."""

import numpy as np
import pytest

from golden import lifters
from golden.bodies import feet_in, feet_of, hips_of, turning
from golden.lifters import as_mmpose, box_of, instance
from pcnet3d.adapters import read, read_all
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.anthropometry import implied_stature
from refusals import refused

FRAMES = 60


@pytest.fixture
def save(tmp_path):
    """save(frames, form): frames lists each frame's instances; form "inferencer" or "demo"."""
    return lambda frames, form="inferencer": lifters.mmpose3d(tmp_path, frames, form)


@pytest.fixture
def alone() -> list[list[dict]]:
    return [[instance(as_mmpose(body), box_of(0, i))] for i, body in enumerate(turning(FRAMES))]


def test_the_unit_is_told_and_scores_of_1_say_nothing(save, alone):
    path = save(alone)
    assert [read(path, metric=metric).frame.unit for metric in (False, True)] == ["arbitrary", "m"]
    assert np.isnan(read(path).confidence).all()


def test_rebase_is_found_and_said(save, alone):
    (poses,) = read_all(save(alone))
    (step,) = [step for step in poses.history if step.name == "rebase"]
    assert step.options["frames"] == FRAMES
    assert [said.code for said in poses.notices] == ["rebased-to-floor"]

    free = [[instance(as_mmpose(body, rebase=False), box_of(0, 0))] for body in turning(FRAMES)]
    assert "rebase" not in [step.name for step in read(save(free)).history]


@pytest.mark.parametrize("boxes", [True, False])
def test_people_are_separated_when_slots_shift(save, boxes):
    """The first person leaves; the second moves to her slot, and is followed. The third comes later."""
    bodies = turning(600)
    own = [bodies[:FRAMES], bodies[200 : 200 + FRAMES], bodies[500 : 500 + FRAMES]]
    here = [range(30), range(FRAMES), range(45, FRAMES)] if boxes else [range(30), range(FRAMES), range(0)]
    frames = [
        [
            instance(as_mmpose(own[person][i]), box_of(person, i) if boxes else None)
            for person in range(3)
            if i in here[person]
        ]
        for i in range(FRAMES)
    ]
    people = read_all(save(frames))
    expected = [(own[p], list(here[p])) for p in range(3) if len(here[p])]
    assert [poses.person for poses in people] == [str(p) for p in range(len(expected))]
    for poses, (joints, rows) in zip(people, expected, strict=True):
        np.testing.assert_array_equal(poses.frame_index, rows)
        np.testing.assert_allclose(poses.joints, joints[rows], atol=1e-6)
        (step,) = [step for step in poses.history if step.name == "link people"]
        assert step.options["method"] == ("nearest box" if boxes else "nearest pose")
        assert ("people-by-poses-alone" in [said.code for said in poses.notices]) == (not boxes)


def test_a_box_in_the_corner_of_the_image_is_followed(save):
    """0, 0 is no joint of keypoints, but a corner of a box all the same."""
    bodies = as_mmpose(turning(FRAMES))
    people = [[instance(body, [left, 0.0, left + 200, 400.0]) for left in (0.0, 600.0)] for body in bodies]
    first, second = read_all(save([pair if i % 2 else pair[::-1] for i, pair in enumerate(people)]))
    assert len(first) == len(second) == FRAMES


def test_scores_that_are_all_above_1_say_nothing(save, alone):
    frames = [[people[0] | {"keypoint_scores": np.linspace(1.2, 3, 17).tolist()}] for people in alone]
    poses = read(save(frames))
    assert np.isnan(poses.confidence).all()
    (step,) = [step for step in poses.history if step.name == "scores"]
    assert step.options == {"unknown": "all are 1.2 to 3"}


def test_2d_results_are_refused_with_who_reads_them(save, alone):
    alone[7] = [{**alone[7][0], "keypoints": [point[:2] for point in alone[7][0]["keypoints"]]}]
    with refused("format-unknown", "walk.json, entry 7", "adapter json2d"):
        read(save(alone), "mmpose3d")


@pytest.fixture
def save_rtmw3d(tmp_path):
    """save_rtmw3d(change) writes results_walk.json of the demo, after change(crop coordinates (T, 133, 3))."""
    return lambda change=lambda crop: crop: lifters.rtmw3d(tmp_path, [turning(FRAMES)], change)


def test_golden_rtmw3d(save_rtmw3d):
    stature = implied_stature(turning(FRAMES))
    path = save_rtmw3d()
    poses = read(path, fps=30, stature_m=stature)
    assert poses.root is None  # a place in the crop
    limbs = [joint for joint in H36M17.joints if joint.endswith(("hip", "knee", "ankle", "elbow", "wrist"))]
    expected = turning(FRAMES)
    hips = hips_of(expected)  # COCO has no pelvis
    for joint in limbs:
        np.testing.assert_allclose(
            poses.joint(joint), expected[:, H36M17.index(joint)] - hips[:, 0], atol=2e-3
        )
    np.testing.assert_allclose(feet_in(poses), feet_of(expected) - hips, atol=4e-3)
    assert (poses.frame.name, poses.frame.unit) == ("CAMERA", "m")
    assert poses.frame_index[0] == 0
    assert np.nanmax(poses.confidence) == 1


def test_what_is_assumed_is_said(save_rtmw3d):
    assert {said.code for said in read(save_rtmw3d()).notices} == {"rebased-to-floor"}


def test_stature_sets_the_plane_and_not_the_depth(save_rtmw3d):
    path = save_rtmw3d()
    small, tall = (read(path, stature_m=stature) for stature in (1.5, 1.9))
    assert implied_stature(tall.joints) == pytest.approx(1.9, abs=1e-3)
    np.testing.assert_allclose(small.joints[..., 2], tall.joints[..., 2], atol=1e-6)
    with pytest.raises(InputError, match="stature_m"):
        read(path, stature_m=17)


def test_an_option_of_the_other_kind_of_file_is_refused(save, alone, save_rtmw3d):
    for path, option in ((save(alone), {"stature_m": 1.8}), (save_rtmw3d(), {"metric": True})):
        with refused("option-conflict"):
            read(path, **option)


def test_depth_without_a_body_is_refused(save_rtmw3d):
    with pytest.raises(InputError, match="deeper than tall"):
        read(save_rtmw3d(lambda crop: crop * [1, 1, 100]), "mmpose3d")
