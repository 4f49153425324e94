"""The conversion: recognised by content, at one frame rate, what is bad named, what is written read back."""

import numpy as np
import pytest

import commands
from commands import pcnet3d, succeeded
from golden.skeleton import MIXAMO, bent, bvh
from pcnet3d.models.lab.mocap.clips import Clip, read_mocap
from pcnet3d.models.lab.mocap.convert import read_folder, resampled
from pcnet3d.pipeline import H36M17, InputError
from refusals import refused


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
    done = succeeded(pcnet3d("lab", "mocap", folder, "-o", tmp_path / "clips.npz"))
    clips = read_mocap(tmp_path / "clips.npz")
    assert [(clip.name, clip.subject, clip.source, clip.fps, len(clip)) for clip in clips] == [
        ("01_01", "01", "bvh", 30, 10), ("01_02", "01", "bvh", 30, 20), ("02_01", "02", "bvh", 30, 40),
    ]  # fmt: skip
    assert "2 subjects (clips): 01 (2), 02 (1)" in done.stdout
    assert "left out" in done.stderr
    assert "02_02.bvh: expected a BVH file" in done.stderr
    for clip, read in zip(clips, read_folder(folder), strict=True):
        np.testing.assert_allclose(clip.joints, read.joints, atol=1.1e-4)


def test_what_cannot_be_is_one_sentence(tmp_path):
    done = pcnet3d("lab", "mocap", tmp_path / "nowhere", "-o", tmp_path / "clips.npz")
    commands.refused(done, "found nothing")


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
