"""AlphaPose: images in numerical order, track numbers, untracked people, and the traps of its dict forms."""

import json

import numpy as np
import pytest

from pcnet3d.adapters import json2d, read, read_all
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.layouts import OPENPOSE18


@pytest.fixture
def results(tmp_path):
    """Write a list of (image_id, idx, x of every joint, score); idx None is left out."""

    def make(*rows, joints=17):
        listed = []
        for image, idx, x, score in rows:
            flat = np.column_stack(
                [np.full(joints, x), np.arange(joints) * 10.0, np.full(joints, score)]
            ).ravel()
            entry = {"image_id": image, "category_id": 1, "keypoints": flat.tolist(), "score": 3.1}
            listed.append(entry if idx is None else {**entry, "box": [0, 0, 9, 9], "idx": idx})
        path = tmp_path / "alphapose-results.json"
        path.write_text(json.dumps(listed))
        return path

    return make


def test_images_are_sorted_by_number(results):
    path = results(
        ("10.jpg", 1, 110, 0.5), ("9.jpg", 1, 109, 0.6), ("100.jpg", 1, 200, 0.7), ("2.jpg", 1, 102, 0.4)
    )
    poses = read(path)
    np.testing.assert_array_equal(poses.frame_index, [2, 9, 10, 100])
    np.testing.assert_array_equal(poses.joints[:, 0, 0], [102, 109, 110, 200])
    np.testing.assert_allclose(poses.confidence[:, 0], [0.4, 0.6, 0.5, 0.7], atol=1e-6)


@pytest.mark.parametrize("image", ["7.jpg", "frame_0007.png", "cam2_0007.jpeg", "take.v2_000007.jpg", "7", 7])
def test_image_numbers(results, image):
    assert read(results((image, 3, 200, 0.5))).frame_index.tolist() == [7]


@pytest.mark.parametrize("image", ["portrait.jpg", "", -1, True, None, 7.5, [7], 10**30, "9" * 5000 + ".jpg"])
def test_images_without_number(results, image):
    with pytest.raises(InputError, match="numbered by its video frame"):
        json2d.read(results((image, 1, 200, 0.5), ("3.jpg", 1, 200, 0.5)))


@pytest.mark.parametrize("idx", [4, 4.0, [4], [[4.0], [4.0]]])
def test_track_numbers(results, idx):
    first, second = read_all(
        results(("0.jpg", 1, 100, 0.5), ("0.jpg", idx, 300, 0.5), ("1.jpg", idx, 301, 0.6))
    )
    assert (first.person, second.person) == ("1", "4")
    np.testing.assert_array_equal(second.joints[:, 0, 0], [300, 301])


@pytest.mark.parametrize("idx", [[[4.0], [5.0]], [], None, "a", {"a": 1}, 1.5])
def test_no_single_track_number(results, idx):
    path = results(("0.jpg", [idx], 100, 0.5))
    with pytest.raises(InputError, match=r"idx|finite numbers"):
        json2d.read(path)
    assert read(path, track=True).person == "0"


@pytest.mark.parametrize("idx", [0, [[0.0]]])
def test_without_tracking_two_people_are_refused(results, idx):
    """AlphaPose without --pose_track gives everybody idx 0."""
    path = results(
        ("0.jpg", idx, 100, 0.5), ("0.jpg", idx, 400, 0.5), ("1.jpg", idx, 401, 0.6), ("1.jpg", idx, 101, 0.6)
    )
    with pytest.raises(InputError, match=r"more than once in frame 0.*track=true"):
        read_all(path)
    first, second = read_all(path, track="true")
    np.testing.assert_array_equal(first.joints[:, 0, 0], [100, 101])
    np.testing.assert_array_equal(second.joints[:, 0, 0], [400, 401])
    assert first.history[-1].options == {"method": "nearest"}


def test_scores_above_one_are_clipped_and_counted(results):
    poses = read(results(("0.jpg", 1, 100, 1.25), ("1.jpg", 1, 101, 0.5)))
    np.testing.assert_allclose(poses.confidence[:, 0], [1, 0.5])
    assert poses.history[-1].options == {"clipped": 17, "highest": 1.25}


def test_equal_scores_are_unknown(results):
    poses = read(results(("0.jpg", 1, 100, 1.0), ("1.jpg", 1, 101, 1.0)))
    assert np.isnan(poses.confidence).all()
    assert "all are 1" in poses.history[-1].options["unknown"]


@pytest.mark.parametrize("joints", [1, 16, 19, 200])
def test_other_numbers_of_joints(results, joints):
    with pytest.raises(InputError, match=rf"expected people of 17, .* joints.* 308, got {joints}\."):
        read(results(("0.jpg", 1, 100, 0.5), joints=joints))


@pytest.mark.parametrize(("joints", "layout"), [(136, "HALPE26"), (133, "COCO23"), (94, "HALPE26")])
def test_of_whole_body_models_the_body_is_read(results, joints, layout):
    poses = read(results(("0.jpg", 1, 100, 0.5), joints=joints))
    assert poses.layout.name == layout
    np.testing.assert_allclose(poses.joints[0, :, 1], 10.0 * np.arange(len(poses.layout)))


def test_neck_that_is_a_head_is_refused(write, moving):
    """With Halpe models --format cmu writes the top of the head where the neck belongs."""
    frames, points = moving(18)
    shoulders = points[:, OPENPOSE18.indices(["l_shoulder", "r_shoulder"]), :2].mean(axis=1)
    points[:, OPENPOSE18.index("neck"), :2] = shoulders - [0, 60]
    with pytest.raises(InputError, match="without --format"):
        read(write("alphapose_cmu", {"0": (frames, points)}))


@pytest.mark.data("lifter", "native")
def test_real_file(data):
    """301 frames of Halpe-26, which the data folder also holds as an array; 89 scores exceed 1."""
    poses = read(data / "native" / "motionbert" / "boxing_alphapose-results.json", fps=30)
    with np.load(data / "lifter" / "boxing.npz") as known:
        points = known["alphapose_kp2d"]
    np.testing.assert_array_equal(poses.joints, points[..., :2])
    np.testing.assert_array_equal(poses.confidence, np.clip(points[..., 2], 0, 1))
    np.testing.assert_array_equal(poses.frame_index, np.arange(301))
    assert poses.layout.name == "HALPE26"
    assert any(step.options.get("clipped") == (points[..., 2] > 1).sum() for step in poses.history)
