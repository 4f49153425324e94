"""Which of several people: by name, the longest, the largest."""

import json
from pathlib import Path

import numpy as np
import pytest

from golden.detections import AS_COCO, detected, scored
from golden.estimators import alphapose3d
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, Z_UP, InputError, PoseSequence
from pcnet3d.pipeline.core.frames import PC_CAMERA, change_frame
from pcnet3d.pipeline.inspect.inspect import inspect
from pcnet3d.pipeline.reading.choose import choose_detected, choose_person
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_people, open_take
from refusals import refused


def person(name: str, size: float, frames: int = 5, frame=CAMERA, facing=None) -> PoseSequence:
    joints = np.repeat(size * facing[None], frames, axis=0)[..., : frame.dims]
    return PoseSequence(joints, H36M17, frame, person=name)


@pytest.mark.parametrize("frame", [CAMERA, IMAGE])
def test_largest(facing_camera, frame):
    people = tuple(
        person(str(i), size, frame=frame, facing=facing_camera) for i, size in enumerate((1, 3, 2))
    )
    assert choose_person(people, "largest", "x").person == "1"


def test_largest_is_what_the_image_shows_not_depth(facing_camera):
    deep = facing_camera * [1, 1, 50]
    people = (person("deep", 1, facing=deep), person("wide", 1.1, facing=facing_camera))
    assert choose_person(people, "largest", "x").person == "wide"
    turned = tuple(change_frame(one, PC_CAMERA) for one in people)
    assert choose_person(turned, "largest", "x").person == "wide"


def test_the_mean_over_frames_counts_and_missing_joints_do_not(facing_camera):
    near = person("near", 2, frames=3, facing=facing_camera)
    joints = near.joints.copy()
    joints[:, H36M17.index("l_wrist")] = np.nan
    joints[0] = np.nan
    far = person("far", 1.5, frames=300, facing=facing_camera)
    assert choose_person((near.with_(joints=joints), far), "largest", "x").person == "near"
    assert choose_person((near, far), "longest", "x").person == "far"


def test_equals_are_to_be_chosen_by_name(facing_camera):
    """The advice was what had just been tried."""
    people = tuple(person(name, 1, facing=facing_camera) for name in "ab")
    for rank in ("longest", "largest"):
        said = rf"x holds 2 people who are equally the {rank}: a \(5 frames\), b \(5 frames\); choose one by name"
        with pytest.raises(InputError, match=said):
            choose_person(people, rank, "x")


@pytest.mark.parametrize(("aside", "lasts", "told"), [(0.1, 8, True), (2.0, 8, False), (0.1, 12, False)])
def test_who_comes_back_where_another_is_lost_may_be_the_other(facing_camera, aside, lasts, told):
    """Three men were one person, and nothing was said. The other is there from frame 10 on, this one not until 17."""

    def at(name: str, frames: np.ndarray, away: np.ndarray) -> PoseSequence:
        joints = 100 * (facing_camera[:, :2] + np.stack([away, 0 * away], axis=-1)[:, None])
        return PoseSequence(joints, H36M17, IMAGE, frame_index=frames, time_s=frames / 10, person=name)

    seen = np.r_[:10, 18:40]
    one = at("0", seen, np.where(seen < 18, 0.0, 1.0 + aside))
    other = at("1", np.arange(10, 10 + lasts), np.ones(lasts))
    said = [
        each.values["frame"]
        for each in choose_detected((one, other), None, "x").notices
        if each.code == "leap-between-people"
    ]
    assert said == [18] * told


@pytest.mark.parametrize("source", ["", f"{'0' * 64} 1"])
def test_of_a_runs_own_detections_the_run_on_them_takes_whom_the_first_one_took(tmp_path, source):
    """It refused to choose, and that there were others was said by the first run alone. Of a live camera's keypoints no
    video is known."""
    points = np.random.default_rng(0).random((17, 2)) * 50
    frames, people = np.concatenate([np.arange(12)] * 3), np.repeat([0, 1, 2], 12)
    scale = np.array([1, 3, 2])[people][:, None, None]
    rows = ~((people == 0) & (frames == 5))  # the first is missing once, of the others the second is larger
    found = detected(frames[rows], scored((scale * points)[rows]), people[rows], source=source)
    found.save(tmp_path / "keypoints.npz")
    options = RunOptions(keypoints=tmp_path / "keypoints.npz", image_size=(640, 360))
    listed = "2 (frames 0 to 11), 0 (frames 0 to 11)"
    told = [{"others": 2, "listed": listed, "person": "1"}]
    for asked, used, said in ((None, "1", told), ("longest", "1", told), ("0", "0", [])):
        take = open_take(options.model_copy(update={"person": asked}))
        assert take.keypoints.person == used
        assert [each.values for each in take.notices if each.code == "person-chosen"] == said
    # Where everybody is taken, or looked at, nobody is chosen.
    everybody = [each.take.notices for each in open_people(options)]
    everybody += [each.findings for each in inspect(options.keypoints).people]
    assert not any(each.code == "person-chosen" for said in everybody for each in said)
    with pytest.raises(InputError, match=r"no person '7'; it holds 0 \(11 frames\), 1 \(12 frames\), 2"):
        open_take(options.model_copy(update={"person": "7"}))


def test_a_world_has_no_image(facing_camera):
    with pytest.raises(InputError, match="world's axes"):
        choose_person((person("a", 1, frame=Z_UP, facing=facing_camera),) * 2, "largest", "x")


def results_2d(path: Path, scene, names: str) -> Path:
    """Results of a 2D detector in which the second walker, the smaller one, is seen from nearer by."""
    listed = []
    for poses, name, px in zip(scene.poses, names, (100, 300), strict=True):
        pixels = 400 + px * poses.joints[:, AS_COCO, :2].astype(float)
        for frame, row in zip(poses.frame_index, pixels, strict=True):
            seen = np.concatenate([row, np.ones((17, 1))], axis=-1)
            listed.append(
                {
                    "image_id": int(frame), "category_id": 1, "keypoints": seen.ravel().tolist(), "score": 0.9,
                    "bbox": [0, 0, 900, 900], "track_id": int(name),
                }
            )  # fmt: skip
    path.write_text(json.dumps(listed), encoding="utf-8")
    return path


def test_who_is_chosen_by_rank_in_the_poses_has_that_name_in_the_keypoints(scene, tmp_path):
    """AlphaPose's 3D results name people."""
    second = scene.poses[1].joints
    poses = alphapose3d(tmp_path, [scene.poses[0].joints[-len(second) :], second])
    keypoints = results_2d(tmp_path / "keypoints.json", scene, "12")
    options = RunOptions(poses=poses, keypoints=keypoints, fps=30, person="largest", image_size=(900, 900))
    take = open_take(options)
    assert (take.poses.person, take.keypoints.person) == ("1", "1")
    others = options.model_copy(update={"keypoints": results_2d(tmp_path / "others.json", scene, "78")})
    with refused("name-unknown", "'1'", "7", "8"):
        open_take(others)
