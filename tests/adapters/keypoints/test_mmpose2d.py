"""MMPose: frames from 0 or from 1, or by images' names, 3D output and other joint orders refused."""

import json

import numpy as np
import pytest

from pcnet3d.adapters import json2d, mmpose3d, read
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.reading.load import adapters
from refusals import refused


@pytest.fixture(params=["mmpose_inferencer", "mmpose_demo"])
def path(request, write, moving):
    return write(request.param, {"0": moving(17, [0, 1, 5, 6])})


def _edited(path, edit):
    content = json.loads(path.read_text())
    edit(content["instance_info"] if isinstance(content, dict) else content)
    path.write_text(json.dumps(content))
    return path


def test_null_is_missing(path):
    def null(frames):
        frames[0]["instances"][0]["keypoints"][4] = [None, None]

    assert np.argwhere(np.isnan(read(_edited(path, null)).joints).any(axis=-1)).tolist() == [[0, 4]]


def test_3d_output_is_refused(path):
    def deepen(frames):
        for frame in frames:
            for person in frame["instances"]:
                person["keypoints"] = [[*xy, 0.5] for xy in person["keypoints"]]

    path = _edited(path, deepen)
    assert not json2d.sniff(path)
    with refused("format-unknown"):
        json2d.read(path)


def test_demo_frame_zero(write, moving):
    path = write("mmpose_demo", {"0": moving(17)})
    with refused("times-broken"):
        read(_edited(path, lambda frames: frames[0].update(frame_id=0)))


def test_recognised_though_the_first_frames_are_empty(write, moving):
    path = write("mmpose_inferencer", {"0": moving(17, range(500, 512))})
    assert json2d.sniff(path)
    assert read(path).frame_index[0] == 500


def test_images_are_numbered_by_their_names(write, moving):
    folder = write("mmpose_images", {"0": moving(17, [3, 4, 8])})
    for path in (folder, folder / "predictions"):
        np.testing.assert_array_equal(read(path).frame_index, [3, 4, 8])


def test_3d_of_images(tmp_path, facing_camera):
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
