"""COCO: visibility flags against scores, image ids against file names, track numbers."""

import json

import numpy as np
import pytest

from pcnet3d.adapters import coco, read, read_all
from pcnet3d.pipeline import InputError


def test_annotations_take_frames_from_file_names(write, moving):
    """The image ids of the fixture run the other way."""
    path = write("coco_annotations", {"0": moving(17, [4, 9, 10])})
    assert json.loads(path.read_text())["images"][0]["id"] == 996
    np.testing.assert_array_equal(read(path).frame_index, [4, 9, 10])


def test_visibility_flags_are_no_confidence(write, moving):
    frames, points = moving(17)
    points[..., 2] = 2
    points[2, 5, 2] = 1  # hidden, but labelled
    points[3, 6, 2] = 0  # not labelled, whatever stands there
    poses = read(write("coco_annotations", {"0": (frames, points)}))
    assert np.isnan(poses.confidence).all()
    missing = np.isnan(poses.joints).any(axis=-1)
    assert missing[3, 6]
    assert missing.sum() == 1
    np.testing.assert_allclose(poses.joints[2, 5], points[2, 5, :2])
    assert poses.history[-1].options == {"unknown": "visibility flags"}


def test_annotations_without_keypoints_are_other_things(write, moving):
    path = write("coco_annotations", {"0": moving(17)})
    content = json.loads(path.read_text())
    content["annotations"].append({"id": 99, "image_id": 1000, "category_id": 2, "bbox": [0, 0, 5, 5]})
    path.write_text(json.dumps(content))
    assert len(read(path)) == 12


def test_annotation_of_an_unlisted_image(write, moving):
    path = write("coco_annotations", {"0": moving(17)})
    content = json.loads(path.read_text())
    content["annotations"][5]["image_id"] = [7]
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"annotation 5: expected an image that the file lists, got \[7\]"):
        read(path)


def test_track_in_one_frame_twice(write, moving):
    path = write("coco_tracks", {"4": moving(17), "5": moving(17, number=1)})
    assert [poses.person for poses in read_all(path)] == ["4", "5"]
    path.write_text(path.read_text().replace('"track_id": 5', '"track_id": 4'))
    with pytest.raises(InputError, match=r"person 4 more than once in frame 0.*track=true"):
        read_all(path)
    assert [poses.person for poses in read_all(path, track=True)] == ["0", "1"]


def test_image_names_in_results_are_not_cocos(write, moving):
    path = write("coco_results", {"0": moving(17)})
    assert coco.sniff(path)
    path.write_text(path.read_text().replace('"image_id": 0,', '"image_id": "0.jpg",'))
    assert not coco.sniff(path)


def test_long_list_of_images_before_the_annotations(write, moving):
    path = write("coco_annotations", {"0": moving(17)})
    content = json.loads(path.read_text())
    content["images"] += [{"id": -i, "file_name": f"{i:030d}.jpg"} for i in range(1, 3000)]
    path.write_text(json.dumps(content))
    assert path.stat().st_size > 100_000
    assert coco.sniff(path)
    assert len(read(path)) == 12


def test_negative_image_id(write, moving):
    path = write("coco_results", {"0": moving(17)})
    path.write_text(path.read_text().replace('"image_id": 3,', '"image_id": -3,'))
    with pytest.raises(InputError, match="entry 3: expected an image that is numbered"):
        read(path)
