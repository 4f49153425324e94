"""MMPose's inferencer over images: a folder with one JSON each."""

import json

import numpy as np
import pytest

from pcnet3d.adapters import json2d, mmpose3d, read
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.reading.find import adapters


@pytest.fixture
def folder(write, moving):
    return write("mmpose_images", {"0": moving(17, [3, 4, 8])})


def test_frames_are_the_numbers_in_the_names(folder):
    for path in (folder, folder / "predictions"):
        np.testing.assert_array_equal(read(path).frame_index, [3, 4, 8])


def test_3d(tmp_path, facing_camera):
    """Pose3DInferencer over images; the first of them shows nobody."""
    mirrored = facing_camera[:, [0, 2, 1]] * [-1, 1, -1]
    person = {"keypoints": mirrored.tolist(), "keypoint_scores": [1.0] * 17, "bbox": [[1.0, 1, 9, 9]]}
    for number in range(25):
        (tmp_path / f"{number}.json").write_text(json.dumps([person] if number else []))
    assert [name for name, each in adapters().items() if each.sniff(tmp_path)] == ["mmpose3d"]
    poses = read(tmp_path, fps=25)
    np.testing.assert_array_equal(poses.frame_index, np.arange(1, 25))
    np.testing.assert_allclose(poses.joints, np.repeat(facing_camera[None], 24, axis=0), atol=1e-6)
    person["keypoints"] = mirrored[:, :2].tolist()
    (tmp_path / "7.json").write_text(json.dumps([person]))
    with pytest.raises(InputError, match=r"7\.json.*json2d reads"):
        mmpose3d.read(tmp_path)


@pytest.mark.parametrize("content", ["{}", "[1]", "[[", "null"])
def test_other_folders_are_not_its_own(tmp_path, content):
    (tmp_path / "1.json").write_text(content)
    assert not json2d.sniff(tmp_path)
    assert not mmpose3d.sniff(tmp_path)
    with pytest.raises(InputError, match=r"1\.json"):
        json2d.read(tmp_path)
