"""Files of clips: read, split by subject, labelled, refused."""

import json

import numpy as np
import pytest

from pcnet3d.models.lab.clips import Clip, data_folder, person, read_clips, read_mocap
from pcnet3d.models.lab.data import write_mocap
from pcnet3d.pipeline import H36M17
from refusals import refused

RNG = np.random.default_rng(0)
HELD = {
    "joints": RNG.normal(size=(8, 17, 3)), "root": RNG.normal(size=(8, 3)), "clip_start": np.array([0, 4, 8]),
    "clip_name": np.array(["01_01", "02_01"]), "subject": np.array(["01", "02"]),
    "source": np.array(["asfamc", "asfamc"]), "fps": np.array(30.0), "joint_names": np.array(H36M17.joints),
}  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"root": HELD["root"][:7]}, "wrong-content"),
        ({"joint_names": HELD["joint_names"][::-1]}, "wrong-content"),
        ({"clip_start": np.array([0, 5, 4])}, "wrong-content"),
        ({"joints": np.full((8, 17, 3), np.nan)}, "file-damaged"),
        ({"subject": np.array([{"pickled": 1}], dtype=object)}, "unsafe"),
    ],
)
def test_a_wrong_file_is_refused_with_what_is_wrong_in_it(tmp_path, wrong, code):
    np.savez(tmp_path / "clips.npz", **HELD | wrong)
    with refused(code, *wrong if code == "wrong-content" and "root" not in wrong else ()):
        read_mocap(tmp_path / "clips.npz")


SPLIT = {
    "cmu_mocap": {"train": ["01", "02", "x"], "val": ["07"], "test": ["03"]},
    "accad_mocap": {"train": ["accad-f1"], "val": ["accad-m1"]},
    "tennis_mocap": {"train": ["tennis-mrios"], "val": ["tennis-jangel"], "test": ["tennis-lvargas"]},
}


def clip(name, subject):
    return Clip(name, subject, "asfamc", 30.0, np.zeros((2, 17, 3), np.float32))


def write(folder, split):
    """A data folder with a clip of everybody in a split, and of somebody who is in none."""
    for file, parts in split.items():
        people = [who for listed in parts.values() for who in listed]
        write_mocap(folder / f"{file}.npz", [clip(f"{who}_run", who) for who in (*people, "nobody")])
    (folder / "splits.json").write_text(json.dumps(split))
    return folder


@pytest.fixture
def folder(tmp_path):
    write_mocap(tmp_path / "hdm05_subset.npz", [clip("bd_run", "bd"), clip("mm_run", "mm")])
    return write(tmp_path, SPLIT)


def people_of(part, folder):
    return {one.name.removesuffix("_run") for one in read_clips(part, folder)}


def test_parts_are_split_by_subject_tennis_is_a_test_set_of_its_own_and_recordings_are_a_file(folder):
    assert people_of("train", folder) == {"01", "02", "x", "accad-f1", "tennis-mrios"}
    assert people_of("val", folder) == {"07", "accad-m1", "tennis-jangel"}
    assert people_of("hdm05", folder) == {"bd", "mm"}
    assert people_of("test", folder) == {"03"}
    assert people_of("tennis", folder) == {"tennis-lvargas"}
    own = write(folder, {"clips": {"train": ["ann"], "val": ["bob"], "test": ["cem"]}})
    assert [people_of(part, own) for part in ("train", "val", "test")] == [{"ann"}, {"bob"}, {"cem"}]
    with refused("nothing-usable"):
        read_clips("tennis", own)


def test_a_folder_that_is_not_there_or_lacks_a_file_is_refused(folder, monkeypatch):
    monkeypatch.setenv("PCNET3D_DATA", str(folder / "nowhere"))
    with refused("cannot-open", "nowhere"):
        data_folder()
    for file in ("tennis_mocap.npz", "splits.json"):
        (folder / file).unlink()
        with refused("cannot-open", file):
            read_clips("train", folder)


def test_a_clip_says_whose_it_is():
    """x_01 is somebody's own file of a person of that name."""
    for name, who in (("tennis-mrios_Reves_0", "tennis-mrios"), ("x_01", "x")):
        assert person(clip(name, who)) == who
    for subject in ("x_charleston", "xq_jumpingjacks"):
        assert person(clip(f"{subject}1", subject)) is None


def test_a_subject_in_two_parts_is_refused(folder):
    split = {"train": ["01"], "val": ["07"], "test": ["01"]}
    (folder / "splits.json").write_text(json.dumps(SPLIT | {"cmu_mocap": split}))
    with refused("wrong-content", "01 is in train and test"):
        read_clips("train", folder)
