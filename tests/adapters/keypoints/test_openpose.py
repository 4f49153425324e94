"""OpenPose: a folder of one file a frame, zeros for missing joints, people without names."""

import numpy as np
import pytest

from golden.detections import openpose as write_openpose
from pcnet3d.adapters import read
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.conversions import remap
from pcnet3d.pipeline.core.layouts import BODY_25B, COCO17

# What OpenPose found of a man in one frame of Pose2Sim's demo (BSD-3-Clause), in BODY_25B.
_REAL = (
    (505, 432, 0.66), (516, 411, 0.61), (489, 405, 0.67), (521, 405, 0.13), (453, 400, 0.68),
    (521, 495, 0.71), (384, 479, 0.67), (542, 610, 0.66), (300, 595, 0.69), (568, 721, 0.67),
    (269, 716, 0.71), (479, 736, 0.68), (389, 726, 0.65), (458, 921, 0.64), (369, 899, 0.66),
    (421, 1078, 0.67), (332, 1010, 0.66), (463, 463, 0.65), (516, 342, 0.69), (432, 1147, 0.68),
    (447, 1141, 0.70), (400, 1094, 0.65), (326, 1062, 0.63), (311, 1047, 0.63), (332, 1026, 0.56),
)  # fmt: skip


def test_frames_are_sorted_by_number_and_may_be_empty(write, moving):
    frames, points = moving(25, [0, 2, 9, 10, 11])
    folder = write("openpose", {"0": (frames, points)})
    assert len(list(folder.iterdir())) == 12
    poses = read(folder)
    np.testing.assert_array_equal(poses.frame_index, frames)
    np.testing.assert_allclose(poses.joints, points[..., :2], atol=1e-4)


def test_numbers_without_leading_zeros(write, moving):
    folder = write("openpose", {"0": moving(25)})
    for file in list(folder.iterdir()):
        number = int(file.stem.split("_")[1])
        file.rename(folder / f"walk_{number}_keypoints.json")
    np.testing.assert_array_equal(read(folder).frame_index, np.arange(12))


@pytest.mark.parametrize("name", ["cam01.{:04d}.json", "{}.json", "cam 2 b{:03d}_keypoints.json"])
def test_other_names(write, moving, name):
    """Pose2Sim's and others'; the last number is the frame."""
    folder = write("openpose", {"0": moving(25)})
    for i, file in enumerate(sorted(folder.iterdir())):
        file.rename(folder / name.format(i))
    (folder / "notes.json").write_text("{}")
    poses = read(folder)
    assert poses.history[0].options["adapter"] == "json2d"
    np.testing.assert_array_equal(poses.frame_index, np.arange(12))


def test_body_25b_is_known_by_its_limbs(tmp_path):
    frames, points = np.arange(3), np.array(_REAL)[None] + np.arange(3)[:, None, None] * [2, 1, 0]
    poses = read(write_openpose(tmp_path, {"0": (frames, points)}))
    assert poses.layout == BODY_25B
    np.testing.assert_allclose(poses.joint("r_wrist"), points[:, COCO17.index("r_wrist"), :2])
    shoulders = poses.joints[:, BODY_25B.indices(["l_shoulder", "r_shoulder"])].mean(axis=1)
    np.testing.assert_allclose(remap(poses).joint("thorax"), shoulders)  # not the upper neck


def test_other_files_beside_are_ignored(write, moving):
    folder = write("openpose", {"0": moving(25)})
    for other in ("._walk_000000000003_keypoints.json", "walk.avi", "notes.json"):
        (folder / other).write_bytes(b"\x00\x05\x16\x07")
    assert len(read(folder)) == 12


def test_normalised_coordinates_are_refused(write, moving):
    """--keypoint_scale 3 and 4 write coordinates in [0, 1] and [-1, 1]."""
    frames, points = moving(25)
    with pytest.raises(InputError, match=r"expected pixels.*keypoint_scale 0"):
        read(write("openpose", {"0": (frames, points * [1e-3, 1e-3, 1])}))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("run_000000000000", '{"people": []}', r"one video.*run_\* and walk.v2_\*"),
        ("front", '{"people": []}', r"front_keypoints\.json: expected an image that is numbered"),
        ("walk.v2_000000000007", '{"people": [{"pose_', r"0007_keypoints.json, but its JSON is incomplete"),
    ],
)
def test_a_file_that_does_not_belong_there_is_named(write, moving, name, content, words):
    folder = write("openpose", {"0": moving(25)})
    (folder / f"{name}_keypoints.json").write_text(content)
    with pytest.raises(InputError, match=words):
        read(folder)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("front", r"front_keypoints\.json: expected an image that is numbered"),
        ("walk_000000000000", "no person was found"),
    ],
)
def test_files_without_a_number_or_a_person_are_refused(tmp_path, name, words):
    (tmp_path / f"{name}_keypoints.json").write_text('{"version": 1.3, "people": []}')
    with pytest.raises(InputError, match=words):
        read(tmp_path, "json2d")
