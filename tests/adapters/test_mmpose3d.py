"""MMPose 1.x 3D JSON: mirrored axes, heights rebased frame by frame, people without track numbers (formats.md 3)."""

import json
import tracemalloc

import numpy as np
import pytest

from golden import lifters
from golden.lifters import as_mmpose, box_of, instance
from pcnet3d.adapters import read, read_all
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.reading.find import adapters

FRAMES = 60


@pytest.fixture
def save(tmp_path):
    """save(frames, form): frames lists each frame's instances; form "inferencer" or "demo"."""
    return lambda frames, form="inferencer": lifters.mmpose3d(tmp_path, frames, form)


@pytest.fixture
def alone(turning) -> list[list[dict]]:
    return [[instance(as_mmpose(body), box_of(0, i))] for i, body in enumerate(turning(FRAMES))]


@pytest.mark.parametrize("form", ["inferencer", "demo"])
def test_golden(save, alone, turning, form):
    path = save(alone, form)
    poses = read(path, fps=25)
    np.testing.assert_allclose(poses.joints, turning(FRAMES), atol=1e-6)
    np.testing.assert_array_equal(poses.frame_index, np.arange(FRAMES))
    assert poses.frames_known
    assert (poses.frame.name, poses.frame.unit, poses.frame.origin) == ("CAMERA", "arbitrary", "pelvis")
    assert read(path, metric=True).frame.unit == "m"
    assert np.isnan(poses.confidence).all()  # all scores are 1


def test_rebase_is_found_and_said(save, alone, turning):
    (poses,) = read_all(save(alone))
    (step,) = [step for step in poses.history if step.name == "rebase"]
    assert step.options["frames"] == FRAMES
    assert [said.code for said in poses.notices] == ["rebased-to-floor"]

    free = [[instance(as_mmpose(body, rebase=False), box_of(0, 0))] for body in turning(FRAMES)]
    assert "rebase" not in [step.name for step in read(save(free)).history]


@pytest.mark.parametrize("boxes", [True, False])
def test_people_are_separated_when_slots_shift(save, turning, boxes):
    """The first person leaves; the second moves to her slot, and is followed. The third comes later."""
    bodies = turning(600)
    own = [bodies[:FRAMES], bodies[200 : 200 + FRAMES], bodies[500 : 500 + FRAMES]]
    here = [range(30), range(FRAMES), range(45, FRAMES)] if boxes else [range(30), range(FRAMES), range(0)]
    frames = [
        [
            instance(as_mmpose(own[person][i]), box_of(person, i) if boxes else None)
            for person in range(3)
            if i in here[person]
        ]
        for i in range(FRAMES)
    ]
    people = read_all(save(frames))
    expected = [(own[p], list(here[p])) for p in range(3) if len(here[p])]
    assert [poses.person for poses in people] == [str(p) for p in range(len(expected))]
    for poses, (joints, rows) in zip(people, expected, strict=True):
        np.testing.assert_array_equal(poses.frame_index, rows)
        np.testing.assert_allclose(poses.joints, joints[rows], atol=1e-6)
        (step,) = [step for step in poses.history if step.name == "link people"]
        assert step.options["method"] == ("nearest box" if boxes else "nearest pose")
        assert ("people-by-poses-alone" in [said.code for said in poses.notices]) == (not boxes)


def test_a_box_in_the_corner_of_the_image_is_followed(save, turning):
    """0, 0 is no joint of keypoints, but a corner of a box all the same."""
    bodies = as_mmpose(turning(FRAMES))
    people = [[instance(body, [left, 0.0, left + 200, 400.0]) for left in (0.0, 600.0)] for body in bodies]
    first, second = read_all(save([pair if i % 2 else pair[::-1] for i, pair in enumerate(people)]))
    assert len(first) == len(second) == FRAMES


def test_scores_that_are_all_above_1_say_nothing(save, alone):
    frames = [[people[0] | {"keypoint_scores": np.linspace(1.2, 3, 17).tolist()}] for people in alone]
    poses = read(save(frames))
    assert np.isnan(poses.confidence).all()
    (step,) = [step for step in poses.history if step.name == "scores"]
    assert step.options == {"unknown": "all are 1.2 to 3"}


BAD = {
    "two": (lambda person: person | {"keypoints": [p[:2] for p in person["keypoints"]]}, "adapter json2d"),
    "joints": (lambda person: person | {"keypoints": person["keypoints"][:16]}, r"got shapes \(16, 3\)"),
    "scores": (lambda person: person | {"keypoint_scores": [1.0]}, "x, y, z and score of 17 joints"),
    "text": (lambda person: person | {"keypoints": "none"}, "finite numbers"),
    "no keypoints": (lambda person: {"bbox": person["bbox"]}, "object with 'keypoints'"),
}


@pytest.mark.parametrize(("change", "says"), BAD.values(), ids=BAD.keys())
def test_bad_instances(save, alone, change, says):
    alone[7] = [change(alone[7][0])]
    with pytest.raises(InputError, match=says) as error:
        read(save(alone), "mmpose3d")
    assert "walk.json, entry 7" in str(error.value)


def test_memory_is_bounded(turning, tmp_path):
    """At most three times the arrays that come out, plus a piece of the text that is being read."""
    path, count = tmp_path / "long.json", 20_000
    people = json.dumps([instance(as_mmpose(turning(1)[0] + 1e-9), box_of(0, 0))])
    with path.open("w") as file:
        file.write("[" + ", ".join(f'{{"frame_id": {i}, "instances": {people}}}' for i in range(count)) + "]")
    adapters()  # what is loaded once is no part of it
    tracemalloc.start()
    (poses,) = read_all(path, fps=60, handedness="ignore")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    arrays = poses.joints.nbytes + poses.confidence.nbytes + poses.frame_index.nbytes
    assert len(poses) == count
    assert peak < 3 * arrays + (4 << 20)
