"""Motion capture files: read, split by subject, labelled, refused."""

import json

import numpy as np
import pytest

from pcnet3d.models.mocap.clips import data_folder, lying, read_clips, read_mocap
from pcnet3d.pipeline import H36M17, InputError


@pytest.fixture
def folder(tmp_path):
    """Six clips of six subjects, 4 frames each."""
    rng = np.random.default_rng(0)
    names = ["01_01", "60_02", "02_01", "03_01", "07_01", "x_zombie"]
    joints = rng.normal(size=(24, 17, 3)).astype(np.float32)
    joints[:, 0] = 0
    arrays = {
        "joints": joints, "root": rng.normal(size=(24, 3)).astype(np.float32), "clip_start": np.arange(0, 25, 4),
        "clip_name": np.array(names), "subject": np.array([name.split("_")[0] for name in names]),
        "source": np.array(["asfamc"] * 6), "fps": np.array(30.0), "joint_names": np.array(H36M17.joints),
    }  # fmt: skip
    np.savez(tmp_path / "cmu_mocap.npz", **arrays)
    np.savez(tmp_path / "hdm05_subset.npz", **arrays)
    split = {"train": ["01", "02", "60", "x"], "val": ["07"], "test": ["03"]}
    (tmp_path / "splits.json").write_text(json.dumps({"cmu_mocap": split}))
    return tmp_path


def names(clips):
    return {clip.name for clip in clips}


def test_world_joints_are_pelvis_plus_root(folder):
    clip = read_mocap(folder / "cmu_mocap.npz")[1]
    with np.load(folder / "cmu_mocap.npz") as file:
        np.testing.assert_allclose(clip.joints, file["joints"][4:8] + file["root"][4:8, None], rtol=1e-6)
    assert (clip.name, clip.subject, clip.fps, len(clip)) == ("60_02", "60", 30.0, 4)


def test_parts_are_split_by_subject(folder):
    assert names(read_clips("train", folder)) == {"01_01", "02_01", "60_02", "x_zombie"}
    assert names(read_clips("val", folder)) == {"07_01"}
    assert names(read_clips("test", folder)) == {"03_01"}
    assert len(read_clips("hdm05", folder)) == 6


def test_halves_of_the_train_subjects_share_nobody(folder):
    a, b = names(read_clips("train-a", folder)), names(read_clips("train-b", folder))
    assert a
    assert b
    assert not a & b
    assert a | b == names(read_clips("train", folder))


def test_lying_is_told_by_the_trunk():
    joints = np.zeros((1, 17, 3))
    for angle, expected in ((0, False), (50, False), (70, True), (90, True), (170, True)):
        up = np.array([np.sin(np.radians(angle)), 0, np.cos(np.radians(angle))]) * 0.5
        joints[:, H36M17.indices(("l_shoulder", "r_shoulder"))] = up
        assert lying(joints)[0] == expected


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda a: a.pop("root"), "root is missing"),
        (lambda a: a.update(joint_names=a["joint_names"][::-1]), "joints of H36M17"),
        (lambda a: a["joints"].__setitem__((3, 4, 1), np.nan), "finite"),
        (lambda a: a.update(subject=np.array([{"pickled": 1}], dtype=object)), "Python objects"),
    ],
)
def test_a_wrong_file_is_refused(folder, change, words):
    with np.load(folder / "cmu_mocap.npz") as file:
        arrays = dict(file)
    change(arrays)
    np.savez(folder / "cmu_mocap.npz", **arrays)
    with pytest.raises(InputError, match=words):
        read_mocap(folder / "cmu_mocap.npz")


def test_a_missing_or_broken_file_is_refused(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="found nothing"):
        read_mocap(tmp_path / "cmu_mocap.npz")
    (tmp_path / "cmu_mocap.npz").write_bytes(b"PK not a zip")
    with pytest.raises(InputError, match=r"damaged or was cut short"):
        read_mocap(tmp_path / "cmu_mocap.npz")
    monkeypatch.setenv("PCNET3D_DATA", str(tmp_path / "nowhere"))
    with pytest.raises(InputError, match="nowhere; set PCNET3D_DATA"):
        data_folder()
    monkeypatch.delenv("PCNET3D_DATA")
    with pytest.raises(InputError, match="set PCNET3D_DATA"):
        data_folder()


def test_a_second_file_brings_its_subjects(folder):
    with np.load(folder / "cmu_mocap.npz") as file:
        arrays = dict(file)
    arrays["clip_name"] = np.array([f"accad-f1_{i}" for i in range(6)])
    np.savez(folder / "accad_mocap.npz", **arrays)
    split = json.loads((folder / "splits.json").read_text())
    (folder / "splits.json").write_text(json.dumps(split | {"accad_mocap": {"train": ["accad-f1"]}}))
    assert len(read_clips("train", folder)) == 4 + 6
    assert names(read_clips("val", folder)) == {"07_01"}


def test_a_subject_in_two_parts_is_refused(folder):
    split = {"train": ["01"], "val": ["07"], "test": ["01"]}
    (folder / "splits.json").write_text(json.dumps({"cmu_mocap": split}))
    with pytest.raises(InputError, match=r"01 \(train and test\)"):
        read_clips("train", folder)


def test_unknown_part_and_missing_split_are_refused(folder):
    with pytest.raises(InputError, match="train-a"):
        read_clips("everything", folder)
    (folder / "splits.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match=r"splits\.json"):
        read_clips("train", folder)
    (folder / "splits.json").unlink()
    with pytest.raises(InputError, match=r"splits\.json"):
        read_clips("train", folder)


@pytest.mark.data
def test_the_real_split(data):
    parts = {
        part: {clip.name.partition("_")[0] for clip in read_clips(part, data)}
        for part in ("train", "val", "test")
    }
    assert not parts["train"] & parts["test"]
    assert not parts["train"] & parts["val"]
    minutes = [sum(map(len, read_clips(part, data))) / 1800 for part in ("train-a", "train-b")]
    assert 0.8 < minutes[0] / minutes[1] < 1.25


def test_a_bare_array_is_no_motion_capture(tmp_path):
    np.save(tmp_path / "poses.npy", np.zeros((3, 17, 3)))
    with pytest.raises(InputError, match="is missing"):
        read_mocap(tmp_path / "poses.npy")
