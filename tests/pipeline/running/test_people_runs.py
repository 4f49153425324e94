"""`--person all`: a run of each person in a folder of its own, all of it or none, and an index over them."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from golden.detections import AS_COCO
from golden.estimators import alphapose3d, mhr70
from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.examples.walker.files import write_keypoints
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, IMAGE, InputError, PoseSequence, cli
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.rotations import angle_deg
from pcnet3d.pipeline.files.atomic import SUMMARY
from pcnet3d.pipeline.files.detections import Detections
from pcnet3d.pipeline.files.viewer import find_recording
from pcnet3d.pipeline.reading.choose import misfit, same_person
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_people, open_take
from pcnet3d.pipeline.running.people import folder_names
from pcnet3d.pipeline.running.recipe import Recipe, StageEntry
from pcnet3d.pipeline.running.run import run_files, run_people
from refusals import refused

SAVGOL = {"trajectories.smoother": "savgol"}
STAGES = ("clean", "scale", "rectify", "trajectories", "export")


@pytest.fixture
def recipe() -> Recipe:
    """What a run needs to write poses and tables; the geometric rectifier, for speed."""
    return Recipe(stages=tuple(StageEntry(use=name) for name in STAGES)).with_options(
        "rectify", rectifier="geometric"
    )


@pytest.fixture
def done(mmpose, recipe, tmp_path):
    output = tmp_path / "out"
    return output, run_people(RunOptions(poses=mmpose(ghost=4), fps=30), output, recipe)


def test_a_whole_run_each_in_one_level(done, scene):
    output, people = done
    index = json.loads((output / SUMMARY).read_text())
    assert [entry["folder"] for entry in index["people"]] == ["0", "1"]
    assert [entry["first_frame"] for entry in index["people"]] == [0, 15]
    assert sorted(path.name for path in output.iterdir()) == ["0", "1", SUMMARY] == sorted(index["files"])
    levels = []
    for entry in index["people"]:
        summary = json.loads((output / entry["folder"] / SUMMARY).read_text())
        assert set(summary["files"]) == {path.name for path in (output / entry["folder"]).iterdir()}
        assert summary["poses"]["frames"] == entry["frames"]
        assert summary["rectification"]["level_heading"] == "camera"
        levels.append(np.load(output / entry["folder"] / "poses.npz")["R_source_from_level"])
    np.testing.assert_array_equal(levels[0], levels[1])
    np.testing.assert_allclose(index["level"]["R_source_from_level"], levels[0])
    assert [run.take is not None for run in people] == [True, True, False]


def test_who_is_hardly_seen_is_named_and_left_out(done):
    output, people = done
    (left_out,) = json.loads((output / SUMMARY).read_text())["left_out"]
    assert (left_out["person"], left_out["frames"], left_out["code"]) == ("2", 4, "nothing-usable")
    assert "10 are the least" in left_out["reason"] == people[2].reason


def test_who_is_hardly_seen_in_the_part_is_left_out_too(mmpose, recipe, tmp_path):
    """The second one comes in frame 15; of both the frames of the whole file were stated."""
    options = RunOptions(poses=mmpose(), fps=30, time_range="0:0.6")
    first, second = run_people(options, tmp_path / "out", recipe)
    assert (first.frames, second.frames, second.take) == (19, 4, None)
    index = json.loads((tmp_path / "out" / SUMMARY).read_text())
    assert [entry["frames"] for entry in (*index["people"], *index["left_out"])] == [19, 4]
    assert index["left_out"][0]["reason"] == "seen in 4 frames; 10 are the least"


def test_a_broken_person_does_not_sink_the_others(mmpose, recipe, tmp_path):
    path = mmpose(mirrored=("1",))
    first, second = run_people(RunOptions(poses=path, fps=30), tmp_path / "out", recipe)
    assert first.take is not None
    assert second.take is None
    assert "mirrored" in second.reason
    assert not (tmp_path / "out" / "1").exists()
    # nor one who was not asked for
    assert open_take(RunOptions(poses=path, fps=30, person="0")).poses is not None


def test_a_stage_that_refuses_one_person_leaves_nothing_of_theirs(mmpose, recipe, tmp_path, monkeypatch):
    from pcnet3d.stages.export.stage import Export

    export = Export.__call__

    def refusing(self, take):
        result = export(self, take)
        if take.poses.person == "0":
            raise InputError("bad-value", "no.")
        return result

    monkeypatch.setattr(Export, "__call__", refusing)
    first, second = run_people(RunOptions(poses=mmpose(), fps=30), tmp_path / "out", recipe)
    assert (first.reason, second.reason) == ("no.", "")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["1", SUMMARY]


def test_nobody_left_is_an_error_and_leaves_no_folder(mmpose, recipe, tmp_path):
    with pytest.raises(InputError, match=r"nobody.*0: .*mirrored.*1: "):
        run_people(RunOptions(poses=mmpose(mirrored=("0", "1")), fps=30), tmp_path / "out", recipe)
    assert not (tmp_path / "out").exists()


def test_a_crash_leaves_the_old_folder(done, mmpose, recipe, monkeypatch):
    output, _ = done
    before = (output / SUMMARY).read_text()

    def crash(*_):
        raise RuntimeError

    monkeypatch.setattr("pcnet3d.pipeline.running.run.write_index", crash)
    with pytest.raises(RuntimeError):
        run_people(RunOptions(poses=mmpose(), fps=30), output, recipe)
    assert (output / SUMMARY).read_text() == before
    assert (output / "1" / "poses.npz").exists()
    assert not list(output.parent.glob(".out*"))


def test_the_folder_is_ours_to_replace_until_somebody_adds_to_it(done, mmpose, recipe):
    output, _ = done
    run_files(RunOptions(poses=mmpose(), fps=30, person="1"), output, recipe)
    assert not (output / "0").exists()
    run_people(RunOptions(poses=mmpose(), fps=30), output, recipe)
    (output / "1" / "notes.txt").write_text("years of work")
    with pytest.raises(InputError, match="--force"):
        run_people(RunOptions(poses=mmpose(), fps=30), output, recipe)
    assert (output / "1" / "notes.txt").exists()


def test_a_stature_is_one_persons(mmpose, recipe, tmp_path):
    with pytest.raises(InputError, match="one person's"):
        run_people(RunOptions(poses=mmpose(), fps=30, stature=1.7), tmp_path / "out", recipe)


def test_what_is_told_reaches_a_run_by_a_given_recipe(mmpose, recipe, tmp_path):
    options = RunOptions(poses=mmpose(), fps=30, person="0", stature=1.7, camera="moving", no_frames=True)
    take = run_files(options, tmp_path / "out", recipe)
    summary = json.loads((tmp_path / "out" / SUMMARY).read_text())
    assert summary["poses"]["unit"] == "m"
    assert summary["rectification"]["camera"] == "moving"
    assert not take.told.images
    with pytest.raises(InputError, match="--also mp4"):
        run_files(options.with_(also=("mp4",)), tmp_path / "out", recipe)


def test_the_options_are_those_of_the_command(mmpose, tmp_path, monkeypatch):
    """A stature, a filter, a rectifier, a file more and stages less reach both, and what one person has is refused."""
    (tmp_path / "short.toml").write_text("\n".join(f'[[stages]]\nuse = "{name}"' for name in STAGES))
    options = RunOptions(
        poses=mmpose(), fps=30, recipe=tmp_path / "short.toml", person="0", stature=1.7,
        also=("csv",), pitch=25, roll=8, settings={"rectify.rectifier": "geometric", **SAVGOL},
    )  # fmt: skip
    run_files(options, str(tmp_path / "python"))
    words = f"--poses {options.poses} --fps 30 --recipe {options.recipe} --person 0 --stature 1.7 "
    words += "".join(f"--set {place}={value} " for place, value in SAVGOL.items())
    words += "--also csv --set read.pitch=25 --set read.roll=8 --set rectify.rectifier=geometric "
    words += f"-o {tmp_path / 'command'}"
    monkeypatch.setattr(sys, "argv", ["pcnet3d", "run", *words.split()])
    with pytest.raises(SystemExit):
        cli.main()
    own, command = (json.loads((tmp_path / name / SUMMARY).read_text()) for name in ("python", "command"))
    assert own == command
    assert own["poses"]["unit"] == "m"
    assert "kinematics.csv" in own["files"]
    with pytest.raises(InputError, match="A stature is one person's"):
        run_people(options, tmp_path / "out")
    run_people(options.with_(person=None, stature=None), str(tmp_path / "out"))
    other = json.loads((tmp_path / "out" / "1" / SUMMARY).read_text())
    assert other["rectification"]["method"] == "geometric"


def test_an_id_is_one_persons(mmpose, recipe, tmp_path):
    with pytest.raises(InputError, match=r"read\.person_id"):
        run_people(RunOptions(poses=mmpose(), fps=30, person_id="P-07"), tmp_path / "out", recipe)


@pytest.mark.parametrize(
    ("people", "folders"),
    [
        (["0", "12"], ["0", "12"]),
        (["../../etc", "a/b", "a\\b"], ["_etc", "a_b", "a_b_2"]),
        (["Ann", "ann", "ANN"], ["Ann", "ann_2", "ANN_3"]),
        (["", ".", "summary.json"], ["_", "__2", "summary_json"]),
        (["名前", "x" * 300], ["_", "x" * 60]),
    ],
)
def test_folders_have_safe_names_of_their_own(people, folders):
    assert folder_names(people) == folders


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
    with pytest.raises(InputError, match="everybody is asked for"):
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
    said = [event.values for event in take.notices if event.code == "keypoints-of-somebody-else"]
    assert len(said) == warned
    assert not any(
        event.code == "keypoints-of-somebody-else" for event in open_take(own_files).notices
    )  # of no known image
    assert all((values["person"], values["track"]) == ("0", "1") for values in said)


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
    warned = misfit(poses, track, (camera.width, camera.height))
    assert bool(warned) == (cut == "guessed" and score == 0.6)
    if cut and score < 0.25:
        other = track.with_(
            joints=camera.project(walker(turn_deg=0, heading_deg=150).world)[:80], person="other"
        )
        assert same_person(poses, (other, track), ("a", "b")).person == track.person


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


@pytest.mark.parametrize("cut", [True, False])
def test_people_of_two_scenes_share_no_level(recipe, tmp_path, cut):
    """The same walk twice, before cameras that are rolled by 10 degrees to either side: as people of one scene they get
    one up between both."""
    walk = walker(seconds=4)
    cameras = [
        aimed(walk.root.mean(axis=0), 6, heading_deg=90, pitch_deg=5, roll_deg=roll) for roll in (10, -10)
    ]
    points = np.concatenate([camera.project(walk.world) for camera in cameras])[:, AS_COCO].astype(np.float32)
    frames, each = np.arange(len(points)), len(walk)
    Detections(
        frame_index=frames,
        time_s=frames / 30,
        person=frames // each,
        joints=points,
        confidence=np.full(points.shape[:2], 0.9, np.float32),
        box=np.concatenate([points.min(axis=1), points.max(axis=1)], axis=1),
        cuts=np.array([each] if cut else [], np.int64),
        thumbnail=np.zeros((0, 0), np.uint8),
        frames=len(frames),
        frames_seen=len(frames),
        layout=COCO17.name,
        method="movenet@0",
        source="",
        damaged=np.zeros(0, np.int64),
    ).save(tmp_path / "keypoints.npz")
    options = RunOptions(keypoints=tmp_path / "keypoints.npz", image_size=(640, 360))
    lifting = Recipe(stages=(StageEntry(use="lift"), *recipe.stages))
    lifting = lifting.with_options("rectify", rectifier="pcnet")
    runs = run_people(options, tmp_path / "out", lifting)
    ups = [run.take.rectified.R_source_from_level[:, 2] for run in runs]
    told = [[event for event in run.take.notices if event.about == "files"] for run in runs]
    scenes = [[event.text for event in each if event.code == "scene-changes"] for each in told]
    warned = [len(texts) == 1 and "1 time, at frame 120" in texts[0] for texts in scenes]
    level = json.loads((tmp_path / "out" / SUMMARY).read_text())["level"]
    assert (level is None, warned) == (cut, [cut, cut])
    assert (angle_deg(*ups) > 10) == cut
    assert [any(event.code == "scenes-apart" for event in each) for each in told] == [cut, cut]
    if cut:
        assert all(angle_deg(up, camera.up) < 6 for up, camera in zip(ups, cameras, strict=True))


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


def test_the_command(mmpose, tmp_path, monkeypatch, capsys):
    output = tmp_path / "out"
    stages = "\n".join(f'[[stages]]\nuse = "{name}"' for name in STAGES)
    (tmp_path / "short.toml").write_text(stages)
    command = ["pcnet3d", "run", "--poses", str(mmpose(ghost=3)), "--fps", "30", "--person", "all"]
    command += [
        "--set",
        "rectify.rectifier=geometric",
        "--recipe",
        str(tmp_path / "short.toml"),
        "-o",
        str(output),
    ]
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 0
    said = capsys.readouterr()
    assert "person 2 was left out: seen in 3 frames" in said.err
    assert "warning: person 0: " in said.err
    assert f"{output}: 0, 1, summary.json" in said.out
    ends = [line.partition(": ")[0] for line in said.out.splitlines()[-4:]]
    assert ends == ["person 0", "person 0", "person 1", "person 1"]
    (output / "0" / "take.rrd").write_bytes(b"")
    with refused("choose-entry"):
        find_recording(output)


def test_a_chain_that_cannot_work_is_refused_before_the_work(mmpose, tmp_path):
    with pytest.raises(InputError, match="needs rectified"):
        run_people(
            RunOptions(poses=mmpose(), fps=30), tmp_path / "out", Recipe(stages=(StageEntry(use="angles"),))
        )
