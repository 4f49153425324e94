"""A data folder out of motion capture: recognised by content, at one frame rate, what is bad named; ASF/AMC with known
answers, and the same motion as a BVH file."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import commands
from commands import pcnet3d, succeeded
from golden.acclaim import CMU, amc, asf, write_still
from golden.skeleton import SKELETON, bent, bvh
from pcnet3d.models.lab import data as module
from pcnet3d.models.lab.clips import Clip, data_set, read_clips, read_mocap
from pcnet3d.models.lab.data import (
    SPLITS,
    of_accad,
    of_tennis,
    read_folder,
    resampled,
    splits_of,
    with_whole_forearms,
)
from pcnet3d.pipeline import H36M17, InputError

SAMPLE = Path(__file__).parents[2] / "data"


def test_the_sample_becomes_a_folder_by_which_a_row_of_the_readme_is_measured(tmp_path):
    done = succeeded(pcnet3d("lab", "data", "--cmu", SAMPLE, "-o", tmp_path / "data"))
    assert "55 clips of 19 people" in done.stdout
    for part in ("train", "val", "test"):
        made, sample = (read_clips(part, folder) for folder in (tmp_path / "data", SAMPLE))
        assert [clip.name for clip in made] == [clip.name for clip in sample]
        assert {data_set(clip) for clip in made} == {"cmu"}
    np.testing.assert_array_equal(made[0].joints, sample[0].joints)
    before = (tmp_path / "data" / "cmu_mocap.npz").stat().st_mtime_ns
    succeeded(pcnet3d("lab", "data", "--cmu", SAMPLE, "-o", tmp_path / "data"))
    assert (tmp_path / "data" / "cmu_mocap.npz").stat().st_mtime_ns == before
    asked = ("takes", "--sets", "cmu", "--because", "the first row", "-o", tmp_path / "takes")
    succeeded(pcnet3d("lab", "evaluate", *asked, PCNET3D_DATA=str(tmp_path / "data")))
    report = json.loads((tmp_path / "takes" / "evaluation.json").read_text())
    methods = report["takes"]["CMU test, lifted, upright, 2 s and more"]["methods"]
    means = {re.sub("@\\w+", "", name): of["by person"]["rotation"]["mean"] for name, of in methods.items()}
    assert means["geometric, a frame"] > means["pcnet, a frame"] > means["pcnet, a take, with its image"]
    added = report["acceleration"]["CMU test, lifted"]["lift"]
    assert 0 < added["geometric, a take"]["wrist"]["vertical"]["rmse"]["p50"] < 1
    commands.refused(pcnet3d("lab", "data", "--cmu", tmp_path / "none", "-o", tmp_path), "download")
    with open(tmp_path / "data" / "cmu_mocap.npz", "ab") as file:
        file.write(b"changed since")
    commands.refused(
        pcnet3d("lab", "data", "--cmu", SAMPLE, "-o", tmp_path / "data"), "its digest is another one"
    )


def test_recordings_are_converted_with_whole_forearms(tmp_path):
    """Of CMU only those of people who are in a part."""
    acclaim = write_still(tmp_path / "acclaim")
    for person in ("07", "150"):
        folder = write_still(acclaim / person)
        (folder / "HDM_tr.asf").rename(folder / f"{person}.asf")
        (folder / "HDM_tr_kick_1.amc").rename(folder / f"{person}_01.amc")
    succeeded(pcnet3d("lab", "data", "--cmu", acclaim, "--hdm05", acclaim, "-o", tmp_path / "data"))
    (clip,) = read_mocap(tmp_path / "data" / "cmu_mocap.npz")
    assert (clip.name, clip.source) == ("07_01", "asfamc")
    everybody = read_mocap(tmp_path / "data" / "hdm05_subset.npz")
    assert len(everybody) == 3
    assert ("HDM-tr_kick_1", "HDM-tr") in {(clip.name, clip.subject) for clip in everybody}
    elbow, wrist = H36M17.indices(("l_elbow", "l_wrist"))
    length = np.linalg.norm(clip.joints[:, wrist] - clip.joints[:, elbow], axis=-1)
    longer = with_whole_forearms(clip).joints
    np.testing.assert_allclose(
        np.linalg.norm(longer[:, wrist] - longer[:, elbow], axis=-1), 1.38 * length, rtol=1e-5
    )
    np.testing.assert_allclose(length, 1.38 * 0.25, atol=1e-3)  # of golden.skeleton
    split = json.loads((tmp_path / "data" / "splits.json").read_text())
    assert split["cmu_mocap"] == {"train": [], "val": ["07"], "test": []}


def test_of_accad_and_tennis_people_are_named_as_the_splits_name_them(clips):
    """And Arena's short upper arms become as long as people's, beside forearms that stay."""
    clip = replace(clips["train"][0], name="Male1_A5_PickUpBox", subject="Male1", source="bvh")
    walk = of_accad(clip)
    assert (walk.name, walk.subject, walk.source) == ("accad-m1_bvh-a5-pickupbox", "accad-m1", "accad-bvh")
    serve = of_tennis(replace(clip, name="JAngel_Servicio", subject="JAngel"))
    assert (serve.name, serve.subject, serve.source) == ("tennis-jangel_Servicio", "tennis-jangel", "arena")

    def length(of, *bone):
        a, b = H36M17.indices(bone)
        return np.sqrt((np.linalg.norm(of.joints[:, a] - of.joints[:, b], axis=-1) ** 2).mean())

    for side in "lr":
        forearm = length(serve, f"{side}_elbow", f"{side}_wrist")
        assert forearm == pytest.approx(length(clip, f"{side}_elbow", f"{side}_wrist"), rel=1e-5)
        assert length(serve, f"{side}_shoulder", f"{side}_elbow") == pytest.approx(1.05 * forearm, rel=1e-5)


@pytest.mark.data("accad_mocap.npz")
def test_the_people_of_each_part_are_those_of_the_data_folder(data):
    listed = json.loads((data / "splits.json").read_text())
    for file, parts in SPLITS.items():
        assert {part: listed[file].get(part, []) for part in parts} == parts


@pytest.fixture
def folder(tmp_path):
    """Three BVH clips of two people, by file and by folder, 120, 60 and 30 frames a second; one file is there twice."""
    named = (("01_01", 120), ("01_02", 60), ("s7/dance", 30), ("s7/again/01_02", 30))
    for i, (name, fps) in enumerate(named):
        path = tmp_path / "mocap" / f"{name}.bvh"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(bvh(bent(40, seed=i), fps=fps))
    return tmp_path / "mocap"


def test_from_the_command_line(folder, tmp_path):
    (folder / "02_02.bvh").write_text("nothing")
    done = succeeded(pcnet3d("lab", "data", "--own", folder, "-o", tmp_path / "own"))
    clips = read_mocap(tmp_path / "own" / "clips.npz")
    assert [(clip.name, clip.subject, clip.source, clip.fps, len(clip)) for clip in clips] == [
        ("01_01", "01", "bvh", 30, 10), ("01_02", "01", "bvh", 30, 20), ("s7_dance", "s7", "bvh", 30, 40),
    ]  # fmt: skip
    assert "3 clips of 2 people" in done.stdout
    listing = tmp_path / "own" / "splits.json"
    assert json.loads(listing.read_text())["clips"] == {"test": ["01"], "val": ["s7"], "train": []}
    assert "another clip named 01_02" in done.stderr
    assert "02_02.bvh: expected a BVH file" in done.stderr
    for clip, read in zip(clips, read_folder(folder), strict=True):
        np.testing.assert_allclose(clip.joints, read.joints, atol=1.1e-4)
    said = {"clips": {"train": ["01", "02"]}}
    listing.write_text(json.dumps(said))
    assert splits_of(tmp_path / "own")["clips"] == said["clips"]  # what its owner wrote stays


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda a: a.pop("fps"), "frame rate"),
        (lambda a: a.update(joints=1000 * a["joints"]), "in metres"),
        (lambda a: a["joints"].__setitem__((1, 2, 0), np.nan), "NaN"),
        (lambda a: a["joints"].__setitem__((1, H36M17.index("l_ankle"), 2), -9), "length"),
        (lambda a: a.update(joints=a["joints"] * [1, -1, -1]), "the head above the feet"),
        (lambda a: a.update(joints=a["joints"] * [1, -1, 1]), "exchanged"),
    ],
)
def test_what_is_no_persons_recording_is_refused(tmp_path, standing, change, words):
    arrays = {"joints": np.tile(standing, (40, 1, 1)), "fps": np.array(30.0)}
    np.savez(tmp_path / "s01_walk.npz", **arrays)
    (clip,) = read_folder(tmp_path / "s01_walk.npz")
    assert (clip.name, clip.subject, clip.source) == ("s01_walk", "s01", "joints")
    np.testing.assert_allclose(clip.joints, arrays["joints"], rtol=1e-6)
    change(arrays)
    np.savez(tmp_path / "s01_walk.npz", **arrays)
    with pytest.raises(InputError, match=words):
        read_folder(tmp_path / "s01_walk.npz")


@pytest.mark.parametrize("fps", [120, 30, 50, 59.94, 24])
def test_whole_ratios_take_frames_and_others_interpolate(fps):
    """Every joint on a straight line at constant speed."""
    start, speed = np.random.default_rng(0).normal(size=(2, 17, 3))

    def moved(count, fps):
        return (start + speed * np.arange(count)[:, None, None] / fps).astype(np.float32)

    clip = Clip("a_1", "a", "test", fps, moved(73, fps))
    out = resampled(clip)
    if fps % 30 == 0:
        np.testing.assert_array_equal(out.joints, clip.joints[:: fps // 30])
    np.testing.assert_allclose(out.joints, moved(len(out), 30), atol=1e-5)
    assert out.fps == 30
    assert (len(out) - 1) / 30 <= 72 / fps + 1e-9 < len(out) / 30


def test_the_same_motion_as_bvh_gives_the_same_clip(tmp_path):
    """Random axis blocks; the BVH gets R = C M C^-1 as its own angles."""
    rng = np.random.default_rng(0)
    joints = list(SKELETON)
    axes = {joint: rng.uniform(-180, 180, 3).round(2) for joint in joints[1:]}
    angles = bent(20)
    frames, turned = [], np.zeros_like(angles)
    turned[:, 0] = Rotation.from_euler("xyz", angles[:, 0], degrees=True).as_euler("ZXY", degrees=True)
    for i, joint in enumerate(joints[1:], start=1):
        C, M = (Rotation.from_euler("xyz", of, degrees=True) for of in (axes[joint], angles[:, i]))
        turned[:, i] = (C * M * C.inv()).as_euler("ZXY", degrees=True)
    for frame in angles:
        root = [0, 0.9 * 0.45 / 0.0254, 0, *frame[0]]
        frames.append({"root": root, **{CMU[joint]: frame[i] for i, joint in enumerate(joints) if i}})
    (tmp_path / "07.asf").write_text(asf(axes))
    (tmp_path / "07_01.amc").write_text(amc(frames))
    (tmp_path / "07_01.bvh").write_text(bvh(turned, fps=120))
    (one,), (other,) = (
        read_folder(tmp_path, only=lambda file, kind=kind: file.suffix == kind) for kind in (".amc", ".bvh")
    )
    assert (one.name, one.subject, one.source, len(one)) == ("07_01", "07", "asfamc", 5)
    np.testing.assert_allclose(one.joints, other.joints, atol=2e-5)
    assert np.abs(angles).max() > 5


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("HDM_tr.asf", lambda t: t.replace("angle deg", "angle rad"), "degrees"),
        ("HDM_tr.asf", lambda t: t.replace("root tolfemur", "lfoot tolfemur"), "damaged"),
        ("HDM_tr.asf", lambda t: t.replace("dof rx ry rz", "dof rx ry l", 1), "turn only"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("lfemur 0.0 0.0 0.0\n", "", 1), "lfemur"),
        ("HDM_tr_kick_1.amc", lambda t: "", "frames"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, file, change, words):
    acclaim = write_still(tmp_path / "acclaim")
    (acclaim / file).write_text(change((acclaim / file).read_text()))
    with pytest.raises(InputError, match=words):
        module.read_amc(acclaim / "HDM_tr_kick_1.amc")
