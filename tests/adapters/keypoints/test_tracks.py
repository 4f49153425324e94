"""People without names are followed from frame to frame."""

import numpy as np
import pytest

from pcnet3d.adapters import read_all
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.layouts import BODY_25, COCO17, H36M17, HALPE26

UNTRACKED = ["openpose", "coco_results", "mmpose_inferencer"]


def _people(write, form, *scene):
    people = read_all(write(form, {str(i): person for i, person in enumerate(scene)}))
    return {poses.person: poses for poses in people}


@pytest.mark.parametrize("form", UNTRACKED)
def test_order_in_the_file_does_not_matter(write, moving, form):
    """Two people whose places in the file are exchanged in every other frame."""
    left, right = moving(17 if form != "openpose" else 18), moving(17 if form != "openpose" else 18, number=1)
    odd = np.arange(12) % 2 == 1
    mixed = [
        (left[0], np.where(odd[:, None, None], one, other))
        for one, other in ((right[1], left[1]), (left[1], right[1]))
    ]
    people = _people(write, form, *mixed)
    np.testing.assert_allclose(people["0"].joints, left[1][..., :2], atol=1e-4)
    np.testing.assert_allclose(people["1"].joints, right[1][..., :2], atol=1e-4)


@pytest.mark.parametrize("scored", [False, True])
@pytest.mark.parametrize(
    ("form", "layout"),
    [
        ("alphapose", HALPE26),
        ("openpose", BODY_25),
        ("mmpose_demo", COCO17),
        ("detectron", COCO17),
        ("vis2d", H36M17),
    ],
)
def test_a_joint_in_the_images_corner_is_missing(write, moving, form, layout, scored):
    """There exports of YOLO leave a score."""
    frames, points = moving(len(layout))
    points[3, layout.index("r_wrist"), : 2 if scored else 3] = 0
    (poses,) = read_all(write(form, {"0": (frames, points)}), gives="keypoints")
    missing = np.isnan(poses.joints).any(axis=-1)
    assert np.argwhere(missing).tolist() == [[3, layout.index("r_wrist")]]
    assert np.isnan(poses.confidence[3, layout.index("r_wrist")])


def test_one_person_stays_one_over_any_gap(write, moving):
    frames = [0, 1, 2, 400, 401]
    people = _people(write, "coco_results", moving(17, frames))
    assert list(people) == ["0"]
    np.testing.assert_array_equal(people["0"].frame_index, frames)


@pytest.mark.parametrize(
    ("step", "seen", "names"), [(0.4, 17, ["0", "1"]), (0.6, 17, ["0", "1", "2"]), (0.3, 3, ["0", "1"])]
)
def test_reach_is_half_the_body_of_the_larger_sighting(write, moving, step, seen, names):
    """A head alone is small, but the body that it belongs to is not."""
    _, points = moving(17, [0, 0], number=1)
    points[1, :, 0] += step * np.linalg.norm(np.ptp(points[0, :, :2], axis=0))
    points[1, seen:] = 0
    people = _people(write, "coco_results", moving(17, [0, 1]), (np.array([0, 1]), points))
    assert list(people) == names


def test_joints_seen_both_times_count(write, moving):
    """A person whose legs vanish does not move, although the box's centre does."""
    frames, points = moving(17)
    points[6:, 8:] = 0
    people = _people(write, "coco_results", (frames, points), moving(17, number=1))
    assert list(people) == ["0", "1"]
    assert np.isnan(people["0"].joints[6:, 8:]).all()


def test_ghost_without_joints_is_nobody(write, moving):
    frames, points = moving(17)
    people = _people(write, "coco_results", (frames, points), (np.array([3]), np.zeros((1, 17, 3))))
    assert list(people) == ["0"]
    assert len(people["0"]) == 12


@pytest.mark.parametrize(("name", "crowd"), [("idx", "in a frame"), ("track_id", "by name")])
def test_far_too_many_people_are_refused(tmp_path, name, crowd):
    points = ", ".join(["1.5, 2.5, 0.5"] * 17)
    frame = (lambda i: 0) if crowd == "in a frame" else (lambda i: i)
    path = tmp_path / "people.json"
    with path.open("w") as file:
        file.write("[")
        for i in range(6_000):
            file.write(
                f'{"," * (i > 0)}{{"image_id": {frame(i)}, "{name}": {i}, "score": 1, "keypoints": [{points}]}}\n'
            )
        file.write("]")
    with pytest.raises(InputError, match=r"expected at most .* people.*reading stopped"):
        read_all(path)


@pytest.mark.parametrize(("seen", "warned"), [(2, False), (3, True)])
@pytest.mark.parametrize("form", ["coco_tracks", "coco_results"])
def test_who_comes_into_the_picture_does_not_leap(write, moving, form, seen, warned):
    """Of the first joints that are seen the body's size is a tenth of what it is, and their error as large. Everybody
    whom a tracker names comes in at a border."""
    frames, points = moving(17)
    points[:5, seen:] = 0.0
    points[3, :seen, 0] += np.linalg.norm(np.ptp(points[3, :seen, :2], axis=0))
    (poses,) = _people(write, form, (frames, points)).values()
    assert any(said.code.startswith("leap") for said in poses.notices) == warned


@pytest.mark.parametrize("form", ["coco_tracks", "coco_results"])
@pytest.mark.parametrize("row", [5, 11])
@pytest.mark.parametrize(("score", "warned"), [(0.2, False), (0.8, True)])
def test_a_body_that_the_detector_hardly_sees_is_nobody_else(write, moving, form, row, score, warned):
    """A man "may be another person from then on", said the last frame of a video, in which nobody was to be seen."""
    frames, points = moving(17)
    points[row, :, 0] += np.linalg.norm(np.ptp(points[0, :, :2], axis=0))
    points[row, :, 2] *= score
    (poses,) = _people(write, form, (frames, points)).values()
    assert any(said.code.startswith("leap") for said in poses.notices) == warned


@pytest.mark.parametrize(
    ("gap", "bodies", "warned"), [(1, 0.4, False), (1, 0.6, True), (11, 0.9, False), (11, 1.1, True)]
)
@pytest.mark.parametrize("named", [False, True])
def test_two_who_are_never_seen_together_are_doubted(write, moving, gap, bodies, warned, named):
    """Half a body's size at once, and a twentieth more for each frame in which nobody was seen. Of a tracker's names,
    which it gives to another or exchanges, nothing was said."""
    _, points = moving(17, [0] * 10)
    size = np.linalg.norm(np.ptp(points[0, :, :2], axis=0))
    points[5:, :, 0] += bodies * size
    frames = np.arange(10) + (gap - 1) * (np.arange(10) >= 5)
    (poses,) = _people(write, "coco_tracks" if named else "coco_results", (frames, points)).values()
    said = [
        (each.code, each.values["frame"], round(float(each.values["sizes"]), 1)) for each in poses.notices
    ]
    assert said == [("leap-between-people", frames[5], bodies)] * warned
    assert all(("unseen" in each.text) == (gap > 1) for each in poses.notices)
