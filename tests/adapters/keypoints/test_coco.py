"""COCO: visibility flags against scores, image ids against file names, track numbers."""

import json

import numpy as np
import pytest

from pcnet3d.adapters import json2d, read, read_all
from pcnet3d.pipeline import InputError
from refusals import refused


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


@pytest.fixture
def annotations(write, moving):
    """annotations(change, frames): the file of one person after change(content)."""

    def make(change, frames=range(12)):
        path = write("coco_annotations", {"0": moving(17, frames)})
        content = json.loads(path.read_text())
        change(content)
        path.write_text(json.dumps(content))
        return path

    return make


def test_annotations_without_keypoints_are_other_things(annotations):
    other = {"id": 99, "image_id": 1000, "category_id": 2, "bbox": [0, 0, 5, 5]}
    assert len(read(annotations(lambda content: content["annotations"].append(other)))) == 12


def test_annotation_of_an_unlisted_image(annotations):
    path = annotations(lambda content: content["annotations"][5].update(image_id=[7]))
    with pytest.raises(InputError, match=r"annotation 5: expected an image that the file lists, got \[7\]"):
        read(path)


@pytest.mark.parametrize("held", [{}, {"annotations": None}, {"annotations": {"1": {}}}])
def test_a_file_without_a_list_of_annotations_is_said_to_be_none(annotations, held):
    def without(content):
        del content["annotations"]
        content.update(held)

    with refused("wrong-content", "annotation"):
        read(annotations(without))


def test_long_list_of_images_before_the_annotations(annotations):
    more = [{"id": -i, "file_name": f"{i:030d}.jpg"} for i in range(1, 3000)]
    path = annotations(lambda content: content["images"].extend(more))
    assert path.stat().st_size > 100_000
    assert json2d.sniff(path)
    assert len(read(path)) == 12


def test_negative_image_id(write, moving):
    path = write("coco_results", {"0": moving(17)})
    path.write_text(path.read_text().replace('"image_id": 3,', '"image_id": -3,'))
    with pytest.raises(InputError, match=r"expected an image that is numbered.*-3"):
        read(path)


def test_detections_that_a_tracker_did_not_name_are_left_out_and_counted(write, moving):
    """The second person comes first in the file's first frame, so that the order of appearance is not that of names."""
    path = write("coco_tracks", {"5": moving(17, number=1), "4": moving(17)})
    content = json.loads(path.read_text())
    content[6]["track_id"] = None
    del content[9]["track_id"]
    path.write_text(json.dumps(content))
    people = {poses.person: poses for poses in read_all(path)}
    assert sorted(people) == ["4", "5"]
    assert sum(map(len, people.values())) == 22
    np.testing.assert_allclose(people["4"].joints[:, 0, 0], 100.25 + 2 * people["4"].frame_index)
    (step,) = [step for step in people["4"].history if step.name == "track numbers"]
    assert step.options["left_out"] == 2
    (said,) = people["4"].notices
    assert (said.code, dict(said.values)) == ("no-track-number", {"unnamed": 2, "detections": 24})
    assert [len(poses) for poses in read_all(path, track=True)] == [12, 12]


@pytest.mark.parametrize(
    ("names", "frames"),
    [
        (["a/0001.jpg", "a/0002.jpg"], [1, 2]),
        (["a/0001.jpg", "b/0002.jpg"], None),
        (["0001.jpg", "b/0002.jpg"], None),
        (["walk_0001.jpg", "run_0001.jpg"], None),
        (["0001.jpg", "0001.jpg"], None),
        (["walk_mp4-0001_jpg.rf.0f31b2c4.jpg", "walk_mp4-0002_jpg.rf.b7e0a991.jpg"], [1, 2]),
    ],
)
def test_images_are_those_of_one_video(annotations, names, frames):
    def renamed(content):
        for image, name in zip(content["images"], names, strict=True):
            image["file_name"] = name

    path = annotations(renamed, [1, 2])
    if frames is not None:
        assert read(path).frame_index.tolist() == frames
    else:
        with refused("files-apart"):
            read(path)


@pytest.mark.parametrize("beside", [{}, {"box": [0, 0, 9, 9]}])
def test_track_numbers_beside_images_names(write, moving, beside):
    path = write("coco_tracks", {"4": moving(17, range(6)), "5": moving(17, range(6, 12))})
    content = [
        {**entry, **beside, "image_id": f"{entry['image_id']}.jpg"} for entry in json.loads(path.read_text())
    ]
    path.write_text(json.dumps(content))
    people = read_all(path)
    assert people[0].history[0].options["adapter"] == "json2d"
    assert [poses.person for poses in people] == ["4", "5"]
    np.testing.assert_array_equal(people[1].frame_index, np.arange(6, 12))
