"""Which of several people: by name, the longest, the largest; and whose the keypoints beside their poses are."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from golden.detections import AS_COCO, detected, scored
from golden.estimators import alphapose3d, mhr70
from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.examples.walker.files import write_keypoints
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, Z_UP, InputError, PoseSequence
from pcnet3d.pipeline.core.conversions import change_frame
from pcnet3d.pipeline.core.frames import PC_CAMERA
from pcnet3d.pipeline.inspect.inspect import inspect
from pcnet3d.pipeline.reading.people import choose_detected, choose_person
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_people, open_take
from pcnet3d.pipeline.reading.together import together
from refusals import refused


def person(name: str, size: float, frames: int = 5, frame=CAMERA, facing=None) -> PoseSequence:
    joints = np.repeat(size * facing[None], frames, axis=0)[..., : frame.dims]
    return PoseSequence(joints, H36M17, frame, person=name)


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


@pytest.mark.parametrize(
    ("aside", "lasts", "joints", "told"),
    [(0.1, 8, 17, True), (2.0, 8, 17, False), (0.1, 12, 17, False), (0.1, 8, 2, False)],
)
def test_who_comes_back_where_another_is_lost_may_be_the_other(facing_camera, aside, lasts, joints, told):
    """Three men were one person, and nothing was said. The other is there from frame 10 on, this one not until 17. Of
    two joints nobody can tell; the distance was taken for none."""

    def at(name: str, frames: np.ndarray, away: np.ndarray) -> PoseSequence:
        points = 100 * (facing_camera[:, :2] + np.stack([away, 0 * away], axis=-1)[:, None])
        points[:, joints:] = np.nan
        return PoseSequence(points, H36M17, IMAGE, frame_index=frames, time_s=frames / 10, person=name)

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


def shown(poses, folder):
    """MMPose's 2D JSON of the people of its 3D JSON, each at a place of their own."""
    listed = json.loads(poses.read_text())
    for frame in listed:
        for person in frame["instances"]:
            left, joints = person["bbox"][0][0] + 300, np.array(person["keypoints"])[AS_COCO]
            person["keypoints"] = np.stack([left - 100 * joints[:, 0], 300 - 100 * joints[:, 2]], -1).tolist()
    (folder / "keypoints.json").write_text(json.dumps(listed))
    return folder / "keypoints.json"


def test_keypoints_of_people_without_names_need_one(mmpose, tmp_path):
    path = mmpose()
    options = RunOptions(poses=path, keypoints=shown(path, tmp_path), fps=30)
    for person in ("0", "longest"):
        with refused("choose-person", "read.keypoints_person=NAME"):
            open_take(options.with_(person=person))
    with refused("files-apart", "one --person at a time"):
        open_people(options)
    named = options.with_(person="0", keypoints_person="1")
    assert open_take(named).keypoints.person == "1"
    with refused("option-conflict"):
        open_people(named.with_(person=None))


@pytest.mark.parametrize(
    ("whose", "late", "corner", "warned"),
    [
        ("own", 0, False, False), ("own", 0, True, False), ("own", 9, False, True), ("own", 9, True, True),
        ("other", 0, False, True),
    ],
)  # fmt: skip
def test_keypoints_of_somebody_else_beside_the_poses_are_warned_of(tmp_path, whose, late, corner, warned):
    """The pelvis's path, and a walking speed, came of one person's limbs and another one's image. In a corner
    of a wide image limbs look otherwise than straight ahead, by as much as a third of their spread."""
    walks = {"own": walker(turn_deg=0), "other": walker(turn_deg=0, heading_deg=150, speed_mps=1.0)}
    own = walks["own"]
    camera = aimed(own.root[40], 8.0, heading_deg=90, pitch_deg=10, roll_deg=0)
    if corner:
        right, down, _ = camera.R_camera_from_world
        camera = replace(camera, focal_px=300.0, position=camera.position - 6.4 * right - 3.2 * down)
    rows = np.arange(80)
    np.savez(tmp_path / "poses.npz", joints=camera_poses(own, camera).joints[rows], frame_index=rows)
    write_keypoints(tmp_path / "k.json", walks[whose], camera, rows + late, 0.5, np.random.default_rng(0))
    listed = json.loads((tmp_path / "k.json").read_text())
    for row, entry in zip(rows, listed, strict=True):
        entry["image_id"] = f"{row}.jpg"
    (tmp_path / "k.json").write_text(json.dumps(listed))
    told = {"layout": "H36M17", "frame": "CAMERA", "unit": "m"}
    poses = {"poses": tmp_path / "poses.npz", "adapter": "arrays", "options": told}
    own_files = RunOptions(**poses, keypoints=tmp_path / "k.json", fps=30)
    take = open_take(own_files.with_(image_size=(camera.width, camera.height)))
    assert ("keypoints-not-of-poses" in {event.code for event in take.notices}) == warned


@pytest.mark.parametrize("score", [0.1, 0.6])
@pytest.mark.parametrize("cut", ["", "bottom", "guessed"])
def test_legs_that_are_out_of_the_picture_are_nobody_elses(cut, score):
    """Detectors put them at the border, or with a low score somewhere; a lifter of images has them where they are."""
    own = walker(turn_deg=0)
    camera = aimed(own.root[40] + [0.0, 0.0, 0.6], 4.0, heading_deg=90, pitch_deg=0, roll_deg=0)
    poses = camera_poses(own, camera).rows(0, 80)
    pixels = camera.project(own.world)[:80]
    legs = H36M17.indices([f"{side}_{joint}" for side in "lr" for joint in ("knee", "ankle")])
    scores = np.full(pixels.shape[:2], 0.9)
    if cut:
        pixels[:, legs, 1] = camera.height - 1 if cut == "bottom" else pixels[:, legs[:1], 1] - 60
        scores[:, legs] = score
    track = PoseSequence(pixels, H36M17, IMAGE, scores, frame_index=poses.frame_index)
    said = together(poses, track, (camera.width, camera.height))
    assert bool(said) == (cut == "guessed" and score == 0.6)


def test_keypoints_go_with_the_person_of_the_same_name_where_the_file_names_them(scene, tmp_path):
    """AlphaPose's idx of both files; a 2D file of others is refused."""
    first, second = (poses.joints for poses in scene.poses)
    poses = alphapose3d(tmp_path, [first[-len(second) :], second])
    listed = json.loads(poses.read_text())
    for i, entry in enumerate(listed):
        del entry["pred_xyz_jts"]
        entry["keypoints"] = [float(200 + (7 * i + j) % 31) if j % 3 < 2 else 0.5 for j in range(51)]
    keypoints = tmp_path / "keypoints.json"
    keypoints.write_text(json.dumps(listed[::-1]))
    people = open_people(RunOptions(poses=poses, keypoints=keypoints, fps=30))
    assert [(one.name, one.take.keypoints.person) for one in people] == [("1", "1"), ("2", "2")]
    keypoints.write_text(json.dumps([entry | {"idx": entry["idx"] + 1} for entry in listed]))
    with pytest.raises(InputError, match="who is who"):
        open_people(RunOptions(poses=poses, keypoints=keypoints, fps=30))


def test_the_first_frame_is_the_files(mmpose):
    people = open_people(RunOptions(poses=mmpose(), fps=30, first_frame=100))
    assert [person.take.poses.frame_index[0] for person in people] == [100, 115]
    assert (
        open_take(RunOptions(poses=mmpose(), fps=30, first_frame=100, person="1")).poses.frame_index[0] == 115
    )


def test_the_first_frame_is_that_of_the_first_row_where_nothing_numbers_the_rows(scene, tmp_path):
    """InstantHMR's arrays, whose first three rows show nobody and whose second person comes later."""
    first, second = (mhr70(poses.joints) for poses in scene.poses)
    joints = np.full((len(first), 2, *first.shape[1:]), np.nan, np.float32)
    joints[3:, 0], joints[15:, 1] = first[3:], second
    places = np.broadcast_to(np.float32([[0, 0, 6], [2, 0, 6]]), (len(joints), 2, 3))
    np.savez(tmp_path / "x.npz", joints_3d=joints, cam_trans=places)
    people = open_people(RunOptions(poses=tmp_path / "x.npz", fps=30, first_frame=100))
    assert [person.take.poses.frame_index[0] for person in people] == [103, 115]
    assert all(person.take.poses.frames_known for person in people)
