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
from pcnet3d.pipeline.reading.together import same_person, together


def shown(poses, folder, order=lambda people, frame: people):
    """MMPose's 2D JSON of the people of its 3D JSON, each at a place of their own, in that order in each frame."""
    listed = json.loads(poses.read_text())
    for i, frame in enumerate(listed):
        for person in frame["instances"]:
            left, joints = person["bbox"][0][0] + 300, np.array(person["keypoints"])[AS_COCO]
            person["keypoints"] = np.stack([left - 100 * joints[:, 0], 300 - 100 * joints[:, 2]], -1).tolist()
        frame["instances"] = order(frame["instances"], i)
    (folder / "keypoints.json").write_text(json.dumps(listed))
    return folder / "keypoints.json"


def late_and_reversed(people, frame):
    """The first to be numbered is who comes second in the file of poses."""
    return people[::-1] if frame >= 15 else []


@pytest.mark.parametrize(
    ("order", "numbers"), [(lambda people, frame: people, ["0", "1"]), (late_and_reversed, ["1", "0"])]
)
def test_keypoints_go_with_whom_they_show_whatever_their_number(mmpose, scene, tmp_path, order, numbers):
    path = mmpose()
    options = RunOptions(poses=path, keypoints=shown(path, tmp_path, order), fps=30)
    asked = [open_take(options.with_(person=name)) for name in ("0", "1")]
    assert [take.keypoints.person for take in asked] == numbers
    assert [one.take.keypoints.person for one in open_people(options)] == numbers
    for take, true in zip(asked, scene.poses, strict=True):
        np.testing.assert_array_equal(
            take.keypoints.frame_index, [i for i in true.frame_index if i >= take.keypoints.frame_index[0]]
        )
        knees = take.keypoints.joint("r_knee") - take.keypoints.joint("l_knee")
        rows = np.isin(true.frame_index, take.keypoints.frame_index)
        expected = 100 * (true.joint("r_knee") - true.joint("l_knee"))[rows, :2]
        np.testing.assert_allclose(knees, expected, atol=1e-3)


def test_keypoints_of_whom_nothing_tells_need_a_name(mmpose, tmp_path):
    """Two who do the same: the second one's keypoints are the first one's, 500 pixels further to the right."""
    path = mmpose()

    def twins(people, frame):
        first = people[0]
        moved = [[x + 500, y] for x, y in first["keypoints"]]
        return [first, first | {"keypoints": moved}]

    options = RunOptions(poses=path, keypoints=shown(path, tmp_path, twins), fps=30, person="0")
    with pytest.raises(InputError, match=r"person '0'.*--set read\.keypoints_person=NAME"):
        open_take(options)
    assert all(isinstance(one.take, InputError) for one in open_people(options.with_(person=None)))
    assert open_take(options.with_(keypoints_person="1")).keypoints.person == "1"
    with pytest.raises(InputError, match="the run is for all people"):
        open_people(options.with_(keypoints_person="1"))


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
    if cut and score < 0.25:
        other = track.with_(
            joints=camera.project(walker(turn_deg=0, heading_deg=150).world)[:80], person="other"
        )
        assert same_person(poses, (other, track), "a and b").person == track.person


def test_keypoints_of_one_person_leave_the_others_out(mmpose, tmp_path):
    path = mmpose()
    keypoints = shown(path, tmp_path, lambda people, frame: people[:1])
    first, second = open_people(RunOptions(poses=path, keypoints=keypoints, fps=30))
    assert first.take.keypoints.person == "0"
    assert "person '1'" in str(second.take)


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
