"""What a batch is to run: manifests and folders, and what is refused in them."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from commands import recipe_of
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.plugins.removed import removed
from pcnet3d.stages.study.batch.manifest import read_entries
from refusals import refused


@pytest.fixture
def study(tmp_path) -> Path:
    """A folder with two files of poses and a recipe, beside one that is outside."""
    (tmp_path / "study").mkdir()
    for name in ("study/a.npy", "study/b.npy", "study/quick.toml", "outside.npy"):
        (tmp_path / name).write_bytes(b"")
    recipe_of(tmp_path / "study/quick.toml", "rectify", "scale", "export")
    return tmp_path / "study"


def manifest(study: Path, *lines: str) -> Path:
    (study / "manifest.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return study / "manifest.csv"


def given(entry) -> dict[str, object]:
    """What the take's options are told; no settings where there are none."""
    fields = {name: getattr(entry.options, name) for name in entry.options.model_fields_set}
    return {name: value for name, value in fields.items() if value != {}}


def test_every_option_of_a_run_is_a_column(study):
    lines = (
        "name,subject,visit,condition,poses,fps,stature,no-frames,also,pitch,roll,recipe,rectify.rectifier",
        "one,s1,first,barefoot,a.npy,30,1.8,yes,csv;trc,-5,2,quick.toml,geometric",
        ",,,,b.npy,,,,,,,,",
    )
    one, two = read_entries(manifest(study, *lines), {"fps": "25", "camera": "static"})
    assert one.name == "one"
    assert one.labels == {"subject": "s1", "visit": "first", "condition": "barefoot"}
    assert given(one) == {
        "poses": study / "a.npy", "fps": 30, "stature": 1.8, "no_frames": True, "also": ("csv", "trc"),
        "pitch": -5, "roll": 2, "settings": {"rectify.rectifier": "geometric"},
        "recipe": study / "quick.toml", "camera": "static",
    }  # fmt: skip
    assert two.name == "b"
    assert two.labels == {"subject": "", "visit": "", "condition": ""}
    assert given(two) == {"poses": study / "b.npy", "fps": 25, "camera": "static"}


def test_a_flag_that_a_take_switches_off_wins_over_the_common_one(study):
    lines = ("poses,no-frames", "a.npy,no", "b.npy,")
    off, common = read_entries(manifest(study, *lines), {"no-frames": "yes"})
    assert not off.options.no_frames
    assert common.options.no_frames


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ((), ["no take"]),
        (("poses,staturе", "a.npy,1"), ["stat", "did you mean stature"]),
        (("pose", "a.npy"), ["'pose'", "did you mean poses"]),
        (("poses;fps", "a.npy;30"), ["'poses;fps'", "commas"]),
        (("poses,swaps", "a.npy,mask"), ["manifest.csv", removed()["settings"]["read.swaps"]]),
        (("poses,poses", "a.npy,b.npy"), ["'poses'", "twice"]),
        (("poses,fps", "a.npy,30,7"), ["line 2", "2 cells", "3"]),
        (("poses,fps", "a.npy,fast"), ["line 2", "fps=fast"]),
        (("poses,handedness", "a.npy,ignroe"), ["line 2", "--set read.handedness=ignroe"]),
        (("poses,trajectory.cutoff_hz", "a.npy,5"), ["line 2", "did you mean trajectories"]),
        (("poses,no_frames", "a.npy,perhaps"), ["line 2", "--no-frames=perhaps"]),
        (("poses", "a.npy", "none.npy"), ["line 3", "none.npy", "nothing there"]),
        (("poses,rectify.rectifier", "a.npy,none.onnx"), ["line 2", "none.onnx"]),
        (("poses,fps", "a.npy,30", "a.npy,25"), ["line 3", "name 'a'", "line 2"]),
        (("name,poses", "x,a.npy", "X,b.npy"), ["line 3", "name 'X'"]),
        (("name,subject", "x,s1"), ["line 2", "video, poses or keypoints"]),
        (("name,poses", "../x,a.npy"), ["line 2", "'../x'"]),
        (('name,poses', f"{'x' * 200},a.npy"), ["line 2", "xxx"]),
        (("poses", '"a.npy'), ["CSV"]),
        (("poses", "a\0b.npy"), ["line 2"]),
        (("poses", "x" * 5000), ["line 2", "cannot be a path"]),
    ],
    ids=lambda value: "|".join(value)[:40] if isinstance(value, tuple) else "",
)  # fmt: skip
def test_what_is_wrong_is_said_before_anything_runs(study, lines, words):
    with refused(None, *words):
        read_entries(manifest(study, *lines), {})


@pytest.mark.parametrize("content", [b"poses\n\xff\xfe.npy\n", b"\0" * 100, os.urandom(1000)])
def test_a_file_that_is_no_manifest_is_refused(study, content):
    (study / "manifest.csv").write_bytes(content)
    with pytest.raises(InputError):
        read_entries(study / "manifest.csv", {})


def test_a_manifest_that_excel_saved_is_read(study):
    (study / "manifest.csv").write_bytes("poses,subject\r\na.npy,Jürgen\r\n".encode("utf-8-sig"))
    (entry,) = read_entries(study / "manifest.csv", {})
    assert entry.labels["subject"] == "Jürgen"


@pytest.mark.parametrize("told", [{"naem": "x"}, {"subject": "s"}, {"fps": "fast"}, {"recipe": "none.toml"}])
def test_common_options_are_checked_too(study, told):
    with pytest.raises(InputError, match="--set"):
        read_entries(manifest(study, "poses", "a.npy"), told)


def test_an_option_that_a_take_has_no_use_for_is_refused_with_its_line(study):
    with pytest.raises(InputError, match=r"line 3: --detector is for the stage 'detect'"):
        read_entries(manifest(study, "poses,detector", "a.npy,", "b.npy,movenet"), {})
    for name, value in {
        "detector": "movenet",
        "calibrate.camera_name": "cam01",
        "lift.lifter": "mine",
    }.items():
        with pytest.raises(InputError, match=r"line 2: .* which this run does not have"):
            read_entries(manifest(study, "poses", "a.npy"), {"fps": "30", name: value})


def test_files_of_one_name_are_a_take(tmp_path, facing_camera, capsys):
    for name in (
        "carl.mp4",
        "b.MOV",
        "carl.poses.npy",
        "carl.keypoints.json",
        "dora.keypoints.json",
        ".x.mp4",
    ):
        (tmp_path / name).write_bytes(b"")
    for name in ("notes.txt", "photo.jpg"):
        (tmp_path / name).write_bytes(b"nothing")
    for name in ("b.keypoints", "others"):
        (tmp_path / name).mkdir()
    np.save(tmp_path / "lifted.npy", np.tile(facing_camera, (10, 1, 1)).astype(np.float32))
    (tmp_path / "X3D.npy").write_bytes((tmp_path / "lifted.npy").read_bytes()[:70])  # which its run refuses
    person = {"image_id": "0.jpg", "category_id": 1, "keypoints": [1.0, 2.0, 0.9] * 17, "score": 2.0}
    (tmp_path / "b.json").write_text(json.dumps([person]))
    with refused("choose-entry", "b.json", "b.keypoints"):
        read_entries(tmp_path, {})
    (tmp_path / "b.json").rename(tmp_path / "people.json")
    takes = {
        entry.name: {role: path.name for role, path in given(entry).items()}
        for entry in read_entries(tmp_path, {})
    }
    assert takes == {
        "carl": {"video": "carl.mp4", "poses": "carl.poses.npy", "keypoints": "carl.keypoints.json"},
        "b": {"video": "b.MOV", "keypoints": "b.keypoints"},
        "dora": {"keypoints": "dora.keypoints.json"},
        "people": {"keypoints": "people.json"},
        "lifted": {"poses": "lifted.npy"},
        "X3D": {"poses": "X3D.npy"},
    }
    assert capsys.readouterr().err.splitlines()[-1] == "note: not used: notes.txt, photo.jpg"
    (lifted,) = (entry for entry in read_entries(tmp_path, {"fps": "30"}) if entry.name == "lifted")
    assert lifted.options.fps == 30


def test_what_holds_no_take_is_refused(tmp_path):
    with refused("nothing-usable"):
        read_entries(Path(__file__).parent, {})
    with pytest.raises(InputError, match="manifest or a folder"):
        read_entries(tmp_path / "none.csv", {})
