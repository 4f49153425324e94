"""Keypoints beside poses of several people: whose they are, by the limbs, the names and the frames."""

import json
from dataclasses import replace

import numpy as np
import pytest

from golden.detections import AS_COCO
from golden.estimators import alphapose3d, mhr70
from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.examples.walker.files import write_keypoints
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, IMAGE, InputError, PoseSequence
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_people, open_take
from pcnet3d.pipeline.reading.together import together
from refusals import refused


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
    fit = together(poses, track, (camera.width, camera.height))
    assert bool(fit.notice()) == (cut == "guessed" and score == 0.6)


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
