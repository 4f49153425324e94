"""Every 2D file and video is recognised by its own adapter alone, and comes back as it was written."""

import numpy as np
import pytest

from pcnet3d.adapters import read_all
from pcnet3d.pipeline.core.layouts import BODY_25, COCO17, H36M17, HALPE26, OPENPOSE18
from pcnet3d.pipeline.reading.find import adapters, find_adapter

FORMS = [
    ("alphapose", "json2d", COCO17),
    ("alphapose", "json2d", HALPE26),
    ("openpose", "json2d", BODY_25),
    ("openpose", "json2d", OPENPOSE18),
    ("coco_results", "json2d", COCO17),
    ("coco_results", "json2d", HALPE26),
    ("coco_tracks", "json2d", COCO17),
    ("coco_annotations", "json2d", COCO17),
    ("mmpose_inferencer", "json2d", COCO17),
    ("mmpose_inferencer", "json2d", HALPE26),
    ("mmpose_demo", "json2d", COCO17),
    ("mmpose_images", "json2d", COCO17),
    ("mmpose_images", "json2d", HALPE26),
    ("detectron", "detectron", COCO17),
    ("vis2d", "vis2d", H36M17),
    ("vis2d_scores", "vis2d", H36M17),
]


@pytest.mark.parametrize(("form", "adapter", "layout"), FORMS)
def test_two_people_and_gaps(write, moving, form, adapter, layout):
    """The second person is missing at first, and for a while; the rows are those frames where she is."""
    here, there = range(14), (*range(2, 5), *range(9, 14))
    scene = {"0": moving(len(layout), here), "1": moving(len(layout), there, number=1)}
    people = read_all(write(form, scene), gives="keypoints")
    assert [poses.person for poses in people] == ["0", "1"]
    for poses, (frames, points) in zip(people, scene.values(), strict=True):
        rows = np.isfinite(poses.joints).all(axis=(1, 2))
        if adapter != "vis2d":  # which has a row for every frame
            assert rows.all()
        np.testing.assert_array_equal(poses.frame_index[rows], frames)
        np.testing.assert_allclose(poses.joints[rows], points[..., :2], atol=1e-4)


@pytest.mark.parametrize("scored", [False, True])
@pytest.mark.parametrize(("form", "adapter", "layout"), FORMS)
def test_missing_joint(write, moving, form, adapter, layout, scored):
    """In the image's corner, where exports of YOLO leave a score."""
    frames, points = moving(len(layout))
    points[3, layout.index("r_wrist"), : 2 if scored else 3] = 0
    (poses,) = read_all(write(form, {"0": (frames, points)}), gives="keypoints")
    missing = np.isnan(poses.joints).any(axis=-1)
    assert missing[3, layout.index("r_wrist")]
    assert missing.sum() == 1
    assert np.isnan(poses.confidence[3, layout.index("r_wrist")])


@pytest.mark.parametrize("name", ["clip.mp4", "clip.mkv", "clip.avi", "clip.ts"])
def test_video(film, tmp_path, name):
    path = film(tmp_path / name, range(0, 400, 40), codec="mpeg4" if name.endswith("avi") else "libx264")
    assert [adapter for adapter, each in adapters().items() if each.sniff(path)] == ["video"]
    assert find_adapter(path).gives == "video"
