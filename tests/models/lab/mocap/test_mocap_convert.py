"""The conversion: recognised by content, at one frame rate, what is bad named, what is written read back."""

import numpy as np
import pytest

import commands
from commands import pcnet3d, succeeded
from golden.skeleton import bent, bvh
from pcnet3d.models.lab.mocap.convert import read_folder, resampled
from pcnet3d.models.lab.mocap.files import How, write_mocap
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.reading.mocap import Clip, read_mocap
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
    assert [(clip.name, clip.subject, clip.fps, len(clip)) for clip in clips] == [
        ("01_01", "01", 30, 10), ("01_02", "01", 30, 20), ("02_01", "02", 30, 40),
    ]  # fmt: skip
    assert "2 subjects (clips): 01 (2), 02 (1)" in done.stdout
    assert "left out" in done.stderr
    assert "02_02.bvh: expected a BVH file" in done.stderr
    assert "unit cm" in done.stderr
    assert "Traceback" not in done.stderr


def test_arrays_beside_the_recordings_are_not_left_out_silently(folder):
    assert not any(".npz" in note for note in read_folder(folder)[1])
    np.savez(folder / "03_01.npz", joints=np.zeros((30, 17, 3)), fps=30.0)
    assert "1 .npz file beside them not read; --format joints reads these alone" in read_folder(folder)[1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere"], "found nothing"),
        (["mocap", "--format", "fbx"], "no format 'fbx'"),
        (["mocap", "--format", "asfamc"], "found none"),
        (["mocap", "--unit", "yard"], "unit of m, mm"),
        (["mocap", "--up", "z"], "--up"),
        (["mocap", "--subject", "("], "regular expression"),
        (["mocap", "--subject", "[0-9]+"], "first group"),
        (["empty"], "found none"),
    ],
)
def test_what_cannot_be_is_one_sentence(folder, tmp_path, arguments, words):
    (tmp_path / "empty").mkdir()
    done = pcnet3d("lab", "mocap", tmp_path / arguments[0], *arguments[1:], "-o", tmp_path / "clips.npz")
    commands.refused(done, words)
    assert not (tmp_path / "clips.npz").exists()


def test_a_folder_that_cannot_be_written(folder, tmp_path):
    commands.refused(pcnet3d("lab", "mocap", folder, "-o", tmp_path / "no" / "clips.npz"), "Cannot write")


def test_subjects_by_file_folder_or_pattern(tmp_path):
    text = bvh(np.zeros((2, 16, 3)))
    for name in ("walk1_subject1", "walk2_subject2", "s7/dance"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.bvh").write_text(text)
    clips, _ = read_folder(tmp_path)
    assert [(clip.subject, clip.name) for clip in clips] == [
        ("s7", "s7_dance"), ("walk1", "walk1_subject1"), ("walk2", "walk2_subject2"),
    ]  # fmt: skip
    clips, notes = read_folder(tmp_path, "auto", How(subject="_(subject[0-9])"))
    assert [clip.name for clip in clips] == ["subject1_walk1_subject1", "subject2_walk2_subject2"]
    assert any("dance" in note for note in notes)
    for clip in clips:
        assert clip.name.partition("_")[0] == clip.subject


def test_two_clips_of_one_name_are_not_both_kept(folder):
    (folder / "again").mkdir()
    (folder / "again" / "01_01.bvh").write_text((folder / "01" / "01_01.bvh").read_text())
    clips, notes = read_folder(folder)
    assert len(clips) == 3
    assert any("another clip named 01_01" in note for note in notes)


def test_two_formats_in_one_folder_are_refused(folder):
    (folder / "01" / "01_03.amc").write_text("")
    with pytest.raises(InputError, match="asfamc and bvh"):
        read_folder(folder)
    assert len(read_folder(folder, "bvh")[0]) == 3


def moving(count, fps):
    """Every joint on a straight line at constant speed."""
    t = np.arange(count)[:, None, None] / fps
    start, speed = np.random.default_rng(0).normal(size=(2, 17, 3))
    return Clip("a_1", "a", "test", fps, (start + speed * t).astype(np.float32)), start, speed


@pytest.mark.parametrize("fps", [120, 60, 90, 30])
def test_whole_ratios_take_frames(fps):
    clip, *_ = moving(61, fps)
    np.testing.assert_array_equal(resampled(clip, 30).joints, clip.joints[:: fps // 30])


@pytest.mark.parametrize("fps", [50, 100, 25, 59.94, 24])
def test_other_ratios_interpolate(fps):
    clip, start, speed = moving(73, fps)
    out = resampled(clip, 30)
    t = np.arange(len(out))[:, None, None] / 30
    np.testing.assert_allclose(out.joints, start + speed * t, atol=1e-5)
    assert out.fps == 30
    assert (len(out) - 1) / 30 <= 72 / fps + 1e-9 < len(out) / 30


def test_written_clips_are_read_back(tmp_path, clip_of):
    clips = [clip_of("01_01"), clip_of("x-y_2", count=7)]
    write_mocap(tmp_path / "c.npz", clips)
    for one, other in zip(clips, read_mocap(tmp_path / "c.npz"), strict=True):
        assert (one.name, one.subject, one.source, one.fps) == (
            other.name,
            other.subject,
            other.source,
            other.fps,
        )
        np.testing.assert_allclose(one.joints, other.joints, atol=1.1e-4)


def test_clips_of_two_frame_rates_are_not_written(tmp_path, clip_of):
    with refused("files-apart"):
        write_mocap(tmp_path / "c.npz", [clip_of("a_1"), clip_of("b_1", fps=10.0)])
