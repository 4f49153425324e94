"""`--everyone`: a run of each person in a folder of its own, all of it or none, and an index over them."""

import json
import shutil

import numpy as np
import pytest

from commands import pcnet3d, recipe_of
from golden.detections import AS_COCO, detected, scored
from pcnet3d.examples.walker.camera import aimed
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.rotations import angle_deg
from pcnet3d.pipeline.core.system import is_file_name
from pcnet3d.pipeline.files.atomic import SUMMARY
from pcnet3d.pipeline.files.viewer import find_recording
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.pipeline.running.recipe import Recipe, StageEntry
from pcnet3d.pipeline.running.run import folder_names, run_files, run_people
from refusals import refused

CUTOFF = {"trajectories.cutoff_hz": "7"}
STAGES = ("clean", "scale", "rectify", "trajectories", "export")


@pytest.fixture(scope="module")
def recipe() -> Recipe:
    """What a run needs to write poses and tables; the geometric rectifier, for speed."""
    return Recipe(stages=tuple(StageEntry(use=name) for name in STAGES)).with_options(
        "rectify", rectifier="geometric"
    )


@pytest.fixture(scope="module")
def done(mmpose, recipe, tmp_path_factory):
    output = tmp_path_factory.mktemp("done") / "out"
    return output, run_people(RunOptions(poses=mmpose(ghost=4), fps=30, everyone=True), output, recipe)


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
    assert [run.take is not None for run in people] == [True, True, False]


def test_who_is_hardly_seen_in_the_part_is_left_out_too(mmpose, recipe, tmp_path):
    """The second one comes in frame 15; of both the frames of the whole file were stated."""
    options = RunOptions(poses=mmpose(), fps=30, everyone=True, time_range="0:0.6")
    first, second = run_people(options, tmp_path / "out", recipe)
    assert (first.frames, second.frames, second.take) == (19, 4, None)
    index = json.loads((tmp_path / "out" / SUMMARY).read_text())
    assert [entry["frames"] for entry in (*index["people"], *index["left_out"])] == [19, 4]
    assert index["left_out"][0]["reason"] == "seen in 4 frames; at least 10 are needed"


def test_a_broken_person_does_not_sink_the_others(mmpose, recipe, tmp_path):
    path = mmpose(mirrored=("1",))
    first, second = run_people(RunOptions(poses=path, fps=30, everyone=True), tmp_path / "out", recipe)
    assert first.take is not None
    assert second.take is None
    assert "mirrored" in str(second.refusal)
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
    first, second = run_people(RunOptions(poses=mmpose(), fps=30, everyone=True), tmp_path / "out", recipe)
    assert (str(first.refusal), second.refusal) == ("no.", None)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["1", SUMMARY]


@pytest.mark.parametrize(
    ("mirrored", "told", "words"),
    [
        (("0", "1"), {}, r"no person.*0: .*mirrored.*1: "),
        ((), {"person_id": "P-07"}, r"read\.person_id"),
        ((), {"stature": 1.7}, "--stature is for one person"),
        ((), {"settings": ["rectify=off"]}, "needs rectified"),
    ],
)
def test_what_cannot_be_for_all_people_is_refused_and_leaves_no_folder(
    mmpose, recipe, tmp_path, mirrored, told, words
):
    options = RunOptions(poses=mmpose(mirrored=mirrored), fps=30, everyone=True, **told)
    with pytest.raises(InputError, match=words):
        run_people(options, tmp_path / "out", recipe)
    assert not (tmp_path / "out").exists()


def test_the_folder_is_ours_to_replace_until_somebody_adds_to_it(done, mmpose, recipe, tmp_path):
    output = shutil.copytree(done[0], tmp_path / "out")
    run_files(RunOptions(poses=mmpose(), fps=30, person="1"), output, recipe)
    assert not (output / "0").exists()
    run_people(RunOptions(poses=mmpose(), fps=30, everyone=True), output, recipe)
    (output / "1" / "notes.txt").write_text("years of work")
    with pytest.raises(InputError, match="--force"):
        run_people(RunOptions(poses=mmpose(), fps=30, everyone=True), output, recipe)
    assert (output / "1" / "notes.txt").exists()


def test_the_options_are_those_of_the_command(mmpose, tmp_path):
    """A stature, a filter, a rectifier, a file more and stages less reach both."""
    recipe_of(tmp_path / "short.toml", *STAGES)
    options = RunOptions(
        poses=mmpose(), fps=30, recipe=tmp_path / "short.toml", person="0", stature=1.7,
        also=("csv",), pitch=25, roll=8, settings={"rectify.rectifier": "geometric", **CUTOFF},
    )  # fmt: skip
    run_files(options, str(tmp_path / "python"))
    words = f"--poses {options.poses} --fps 30 --recipe {options.recipe} --person 0 --stature 1.7 "
    words += "".join(f"--set {place}={value} " for place, value in CUTOFF.items())
    words += "--also csv --set read.pitch=25 --set read.roll=8 --set rectify.rectifier=geometric "
    words += f"-o {tmp_path / 'command'}"
    pcnet3d("run", *words.split())
    own, command = (json.loads((tmp_path / name / SUMMARY).read_text()) for name in ("python", "command"))
    assert own == command
    assert own["poses"]["unit"] == "m"
    assert "kinematics.csv" in own["files"]
    run_people(options.with_(person=None, stature=None, everyone=True), str(tmp_path / "out"))
    other = json.loads((tmp_path / "out" / "1" / SUMMARY).read_text())
    assert other["rectification"]["method"] == "geometric"


@pytest.mark.parametrize(
    ("people", "folders"),
    [
        (["0", "12"], ["0", "12"]),
        (["../../etc", "a/b", "a\\b"], ["_etc", "a_b", "a_b_2"]),
        (["Ann", "ann", "ANN"], ["Ann", "ann_2", "ANN_3"]),
        (["", ".", "summary.json"], ["_", "__2", "summary_json"]),
        (["名前", "x" * 300], ["_", "x" * 60]),
        (["nul", "NUL", "a:b", "1"], ["nul_", "NUL__2", "a_b", "1"]),  # as Windows refuses names
    ],
)
def test_folders_have_safe_names_of_their_own(people, folders):
    assert folder_names(people) == folders
    assert all(map(is_file_name, folders))


@pytest.mark.parametrize("cut", [True, False])
def test_people_of_two_scenes_share_no_level(recipe, tmp_path, cut):
    """The same walk twice, before cameras that are rolled by 10 degrees to either side: as people of one scene they get
    one up between both."""
    walk = walker(seconds=4)
    cameras = [
        aimed(walk.root.mean(axis=0), 6, heading_deg=90, pitch_deg=5, roll_deg=roll) for roll in (10, -10)
    ]
    points = np.concatenate([camera.project(walk.world) for camera in cameras])[:, AS_COCO]
    frames, each = np.arange(len(points)), len(walk)
    found = detected(frames, scored(points), frames // each, [each] if cut else [])
    found.save(tmp_path / "keypoints.npz")
    options = RunOptions(keypoints=tmp_path / "keypoints.npz", image_size=(640, 360), everyone=True)
    lifting = Recipe(stages=(StageEntry(use="lift"), *recipe.stages))
    lifting = lifting.with_options("rectify", rectifier="pcnet")
    runs = run_people(options, tmp_path / "out", lifting)
    ups = [run.take.rectified.R_source_from_level[:, 2] for run in runs]
    told = [[event for event in run.take.notices if event.about == "files"] for run in runs]
    scenes = [[event.text for event in each if event.code == "scene-changes"] for each in told]
    warned = [len(texts) == 1 and "1 time, at frame 120" in texts[0] for texts in scenes]
    assert warned == [cut, cut]
    assert (angle_deg(*ups) > 10) == cut
    if cut:
        assert all(angle_deg(up, camera.up) < 6 for up, camera in zip(ups, cameras, strict=True))


def test_the_command(mmpose, tmp_path):
    output = tmp_path / "out"
    recipe = recipe_of(tmp_path / "short.toml", *STAGES)
    words = ("--everyone", "--set", "rectify.rectifier=geometric", "--recipe", recipe, "-o", output)
    said = pcnet3d("run", "--poses", mmpose(ghost=3), "--fps", 30, *words)
    assert said.returncode == 0
    assert "person 2 was left out: seen in 3 frames" in said.stderr
    lines = [line.partition(": ")[0] for line in said.stdout.splitlines()]
    each = f"results in {output}, a folder for each person"
    assert lines[:5] == ["person 0", "person 0", "person 1", "person 1", each]
    (output / "0" / "take.rrd").write_bytes(b"")
    with refused("choose-entry"):
        find_recording(output)
