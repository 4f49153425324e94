"""A data folder out of motion capture: recognised by content, at one frame rate, what is bad named; ASF/AMC with known
answers, and the same motion as a BVH file."""

import json
import re
from dataclasses import replace
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import commands
from commands import pcnet3d, succeeded
from golden.acclaim import CMU, TWO, amc, asf, write_still
from golden.skeleton import MIXAMO, SKELETON, bent, bvh
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
from refusals import refused

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


@pytest.mark.parametrize(
    ("words", "what"),
    [((), "mocap.cs.cmu.edu"), ((), "accad.osu.edu"), (("--cmu", "nowhere"), "all ASF/AMC files")],
)
def test_where_nothing_is_it_says_what_to_fetch_from_where(tmp_path, words, what):
    said = pcnet3d("lab", "data", *words, "-o", "data", cwd=tmp_path)
    commands.refused(said, "download", what)
    assert not (tmp_path / "data" / "cmu_mocap.npz").exists()


@pytest.mark.data("accad_mocap.npz")
def test_the_people_of_each_part_are_those_of_the_data_folder(data):
    listed = json.loads((data / "splits.json").read_text())
    for file, parts in SPLITS.items():
        assert {part: listed[file].get(part, []) for part in parts} == parts


@pytest.mark.data("accad_mocap.npz")
def test_the_sample_is_what_its_program_makes_of_the_data_folder(data):
    arrays, splits = run_path(str(SAMPLE / "make.py"))["sample"](data)
    with np.load(SAMPLE / "cmu_mocap.npz") as file:
        assert set(file) == set(arrays)
        for name in file:
            np.testing.assert_array_equal(file[name], arrays[name])
            assert file[name].dtype == arrays[name].dtype
    assert json.loads((SAMPLE / "splits.json").read_text()) == splits


@pytest.fixture
def folder(tmp_path):
    """Three BVH clips of two people, 120, 60 and 30 frames a second."""
    for i, (name, fps) in enumerate((("01/01_01", 120), ("01/01_02", 60), ("02/02_01", 30))):
        path = tmp_path / "mocap" / f"{name}.bvh"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(bvh(bent(40, seed=i), fps=fps))
    return tmp_path / "mocap"


def test_from_the_command_line(folder, tmp_path):
    (folder / "02" / "02_02.bvh").write_text("nothing")
    done = succeeded(pcnet3d("lab", "data", "--own", folder, "-o", tmp_path / "own"))
    clips = read_mocap(tmp_path / "own" / "clips.npz")
    assert [(clip.name, clip.subject, clip.source, clip.fps, len(clip)) for clip in clips] == [
        ("01_01", "01", "bvh", 30, 10), ("01_02", "01", "bvh", 30, 20), ("02_01", "02", "bvh", 30, 40),
    ]  # fmt: skip
    assert "3 clips of 2 people" in done.stdout
    listing = tmp_path / "own" / "splits.json"
    assert json.loads(listing.read_text())["clips"] == {"test": ["01"], "val": ["02"], "train": []}
    assert "left out" in done.stderr
    assert "02_02.bvh: expected a BVH file" in done.stderr
    for clip, read in zip(clips, read_folder(folder), strict=True):
        np.testing.assert_allclose(clip.joints, read.joints, atol=1.1e-4)
    said = {"clips": {"train": ["01", "02"]}}
    listing.write_text(json.dumps(said))
    assert splits_of(tmp_path / "own")["clips"] == said["clips"]  # what its owner wrote stays


def test_subjects_by_file_or_folder_and_of_two_clips_of_one_name_one_is_kept(tmp_path, capsys):
    text = bvh(np.zeros((2, 16, 3)))
    for name in ("walk1_subject1", "walk2_subject2", "s7/dance"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.bvh").write_text(text)
    (tmp_path / "again").mkdir()
    (tmp_path / "again" / "walk1_subject1.bvh").write_text(text)
    clips = read_folder(tmp_path)
    assert [(clip.subject, clip.name) for clip in clips] == [
        ("walk1", "walk1_subject1"), ("s7", "s7_dance"), ("walk2", "walk2_subject2"),
    ]  # fmt: skip
    assert "another clip named walk1_subject1" in capsys.readouterr().err


def test_joints_of_an_array(tmp_path, standing):
    joints = np.tile(standing, (3, 1, 1))
    np.savez(tmp_path / "s01_walk.npz", joints=joints, fps=30)
    (clip,) = read_folder(tmp_path / "s01_walk.npz")
    assert (clip.name, clip.subject, clip.source) == ("s01_walk", "s01", "joints")
    np.testing.assert_allclose(clip.joints, joints, rtol=1e-6)
    (tmp_path / "01_01.bvh").write_text(bvh(np.zeros((3, 16, 3)), scale=60))
    with refused("format-unknown", "unit"):  # a child
        read_folder(tmp_path / "01_01.bvh")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda a: a.pop("fps"), "frame rate"),
        (lambda a: a.update(joints=1000 * a["joints"]), "in metres"),
        (lambda a: a["joints"].__setitem__((1, 2, 0), np.nan), "NaN"),
        (lambda a: a["joints"].__setitem__((1, H36M17.index("l_ankle"), 2), -9), "length"),
        (lambda a: a.update(joints=a["joints"] * [1, 1, -1]), "the head above the feet"),
        (lambda a: a.update(joints=np.array([{"pickled": 1}], dtype=object)), "Python objects"),
    ],
)
def test_what_is_no_persons_recording_is_refused(tmp_path, standing, change, words):
    arrays = {"joints": np.tile(standing, (3, 1, 1)), "fps": np.array(30.0)}
    change(arrays)
    np.savez(tmp_path / "s01_walk.npz", **arrays)
    with pytest.raises(InputError, match=words):
        read_folder(tmp_path / "s01_walk.npz")


def test_a_mirrored_skeleton_is_refused(tmp_path):
    """Left and right names exchanged, knees bent: the knees bend the wrong way."""
    sides = {"l": "r", "r": "l"}
    other = MIXAMO | {name: MIXAMO[sides[name[0]] + name[1:]] for name in MIXAMO if name[1] == "_"}
    frames = np.zeros((40, 16, 3))
    frames[:, [2, 5], 1] = 60  # shanks back about x
    frames[:, [1, 4], 1] = -30
    frames[:, 0, 0] = 1
    path = tmp_path / "01_01.bvh"
    path.write_text(bvh(frames))
    assert len(read_folder(path)) == 1
    path.write_text(bvh(frames, names=other))
    with pytest.raises(InputError, match="exchanged"):
        read_folder(path)


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


def two(axis="0 0 0", dof="rx", length=0.45, angle="deg"):
    return module.parse_asf(TWO.format(axis=axis, dof=dof, length=length, angle=angle))


def pose(acclaim, text):
    return module.pose(acclaim, module.parse_amc(":DEGREES\n" + text, acclaim))


def test_the_root_moves_and_turns_about_fixed_axes_in_the_files_unit():
    joints, R = pose(two(), "1\nroot 1 2 3 90 0 90\none 0\n")
    np.testing.assert_allclose(joints[0, 0], np.array([1, 2, 3]) * 0.0254 / 0.45)
    # x first: y -> z; then z leaves it
    np.testing.assert_allclose(R[0, 0] @ [0, 1, 0], [0, 0, 1], atol=1e-12)
    assert two(length=1.0).metres == pytest.approx(0.0254)
    with refused("file-damaged", "degrees"):
        two(angle="rad")


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


def test_the_subject_is_the_skeleton_and_a_motion_without_one_is_refused(tmp_path):
    acclaim = write_still(tmp_path / "acclaim")
    (clip,) = read_folder(acclaim)
    assert (clip.subject, clip.name) == ("HDM-tr", "HDM-tr_kick_1")
    (acclaim / "HDM_bd.asf").write_text("")
    (acclaim / "XY_1.amc").write_text((acclaim / "HDM_tr_kick_1.amc").read_text())
    with pytest.raises(InputError, match=r"\.asf"):
        module.read_amc(acclaim / "XY_1.amc")


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("HDM_tr.asf", lambda t: t.replace(":hierarchy", ":hierarchies"), "hierarchy"),
        ("HDM_tr.asf", lambda t: t.replace("root tolfemur", "lfoot tolfemur"), "damaged"),
        ("HDM_tr.asf", lambda t: t.replace("dof rx ry rz", "dof rx ry l", 1), "turn only"),
        ("HDM_tr.asf", lambda t: t.replace("lfemur", "thigh"), "skeleton"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("lfemur 0.0 0.0 0.0\n", "", 1), "lfemur"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("16.0", "much"), "damaged"),
        ("HDM_tr_kick_1.amc", lambda t: "", "frames"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, file, change, words):
    acclaim = write_still(tmp_path / "acclaim")
    (acclaim / file).write_text(change((acclaim / file).read_text()))
    with pytest.raises(InputError, match=words):
        module.read_amc(acclaim / "HDM_tr_kick_1.amc")
