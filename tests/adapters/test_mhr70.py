"""SAM 3D Body's and InstantHMR's 70 keypoints in every form that people save (formats.md section 6)."""

import json

import numpy as np
import pytest

from golden import estimators
from golden.bodies import hips_of, turning
from golden.catalogue import recognised
from golden.estimators import AWAY_M, FOCAL_PX
from golden.pickles import Trap
from pcnet3d.adapters import read, read_all
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.layouts import MHR70
from pcnet3d.pipeline.reading.load import adapters

FRAMES = 40


def test_a_person_who_walks_has_a_place(tmp_path):
    """The place of somebody who never moves says nothing, by the rule of all sources."""
    bodies = turning(FRAMES)
    rows = estimators.sam3d(bodies)
    walked = np.linspace(0, 1, FRAMES)[:, None] * [1.0, 0, 0.5]
    keypoints, trans = (np.stack([row[key] for row in rows]) for key in ("pred_keypoints_3d", "pred_cam_t"))
    np.savez(tmp_path / "walk.npz", pred_keypoints_3d=keypoints, pred_cam_t=trans + walked)
    poses = read(tmp_path / "walk.npz", fps=25)
    np.testing.assert_allclose(poses.root, hips_of(bodies)[:, 0] + AWAY_M + walked, atol=1e-5)
    assert not poses.frames_known
    np.savez(tmp_path / "walk.npz", pred_keypoints_3d=keypoints)
    assert read(tmp_path / "walk.npz", fps=25).root is None


def test_every_form_holds_the_same(tmp_path):
    people = [turning(FRAMES), turning(FRAMES + 200)[200:]]
    forms = [write(tmp_path, people) for write in (estimators.sam3d_folder, estimators.sam3d_json)]
    rows = [estimators.sam3d(each, i) for i, each in enumerate(people)]
    arrays = {
        key: np.stack([[row[key] for row in own] for own in rows], axis=1)
        for key in ("pred_keypoints_3d", "pred_cam_t", "bbox", "focal_length")
    }
    np.savez(tmp_path / "stacked.npz", **arrays)
    objects = np.empty(FRAMES, dtype=object)
    objects[:] = [list(dicts) for dicts in zip(*rows, strict=True)]
    np.savez(tmp_path / "objects.npz", outputs=objects)
    for path in (*forms, tmp_path / "stacked.npz", tmp_path / "objects.npz"):
        assert recognised(path) == ["mhr70"]
        for found, bodies in zip(adapters()["mhr70"].read(path), people, strict=True):
            at = bodies[:, H36M17.index("l_knee")] + AWAY_M + [2.0 * int(found.person), 0, 0]
            np.testing.assert_allclose(found.joint("l_knee"), at, atol=1e-5)
            np.testing.assert_array_equal(found.frame_index, np.arange(FRAMES))
            said = {step.name: step.options for step in found.history}
            assert said["estimator"] == {"focal_px": pytest.approx(FOCAL_PX, rel=1e-4)}
            assert said["link people"] == {"method": "nearest box"}


def test_people_who_are_not_found_have_no_row(tmp_path):
    path = estimators.instanthmr(tmp_path, [turning(FRAMES)] * 2)
    first, second = read_all(path)
    assert len(first) == FRAMES
    np.testing.assert_array_equal(second.frame_index, [*range(5), *range(8, FRAMES)])


def test_frame_indices_are_the_videos(tmp_path):
    keypoints = estimators.mhr70(turning(FRAMES))
    np.savez(tmp_path / "x.npz", pred_keypoints_3d=keypoints, frame_indices=3 * np.arange(FRAMES))
    poses = read(tmp_path / "x.npz")
    np.testing.assert_array_equal(poses.frame_index, 3 * np.arange(FRAMES))
    assert poses.frames_known
    for wrong in (np.arange(FRAMES) + 0.5, np.arange(FRAMES - 1), -1 - np.arange(FRAMES)):
        np.savez(tmp_path / "x.npz", pred_keypoints_3d=keypoints, frame_indices=wrong)
        with pytest.raises(InputError, match="whole number of its video frame"):
            read(tmp_path / "x.npz")


def test_a_folder_of_one_persons_arrays(tmp_path):
    for frame, row in enumerate(estimators.sam3d(turning(FRAMES))):
        held = {key: value for key, value in row.items() if value is not None}
        np.savez(tmp_path / f"img_{frame:04d}.npz", **held)
    assert recognised(tmp_path) == ["mhr70"]
    assert len(read(tmp_path, fps=25)) == FRAMES
    np.savez(tmp_path / "other_0003.npz", **held)
    with pytest.raises(InputError, match="one \\.npz a frame"):
        read(tmp_path)


def test_json_by_image(tmp_path):
    rows = estimators.sam3d(turning(FRAMES))
    content = {
        f"img_{i:03d}.jpg": [{"pred_keypoints_3d": row["pred_keypoints_3d"].tolist()}]
        for i, row in enumerate(rows, 7)
    }
    (tmp_path / "x.json").write_text(json.dumps({"img_000.jpg": [], **content}))
    assert recognised(tmp_path / "x.json") == ["mhr70"]
    assert read(tmp_path / "x.json").frame_index[0] == 7


def test_translations_of_some_people_only(tmp_path):
    rows = estimators.sam3d(turning(FRAMES))
    trans = np.stack([row["pred_cam_t"] for row in rows])
    trans[4] = np.nan
    keypoints = estimators.mhr70(turning(FRAMES))
    np.savez(tmp_path / "x.npz", pred_keypoints_3d=keypoints, pred_cam_t=trans)
    with pytest.raises(InputError, match="39 of 40"):
        read(tmp_path / "x.npz")


def test_what_is_not_theirs(tmp_path):
    count = len(MHR70)
    for held in (
        {"joints_3d": np.zeros((9, count, 3))},  # anybody's name, without InstantHMR's translation
        {"pred_keypoints_3d": np.zeros((9, 21, 3))},  # hands
        {"pred_keypoints_3d": np.zeros((9, count, 2))},
    ):
        np.savez(tmp_path / "x.npz", **held)
        assert recognised(tmp_path / "x.npz") == []
        with pytest.raises(InputError, match=r"x\.npz"):
            read(tmp_path / "x.npz", "mhr70")
    (tmp_path / "x.json").write_text('[[{"pred_keypoints_3d": [[1, 2], 3]}]]')
    with pytest.raises(InputError, match="equal length"):
        read(tmp_path / "x.json", "mhr70")


def test_nothing_of_a_strangers_is_run(tmp_path):
    rows = [estimators.sam3d(turning(FRAMES))[0] | {"more": Trap(tmp_path / "was here")}]
    np.savez(tmp_path / "x.npz", outputs=np.array(rows, dtype=object))
    assert recognised(tmp_path / "x.npz") == ["mhr70"]
    with pytest.raises(InputError, match="stranger's code"):
        read(tmp_path / "x.npz")
    assert not (tmp_path / "was here").exists()


def test_people_of_one_image_are_people_and_not_frames(tmp_path):
    """Four people of a picture, a file each, were one person of four frames, whose poses were good."""
    rows = estimators.sam3d(turning(4))
    for number, row in enumerate(rows):
        held = {key: value for key, value in row.items() if value is not None}
        held["bbox"] = np.array([200 * number, 100, 200 * number + 150, 500], np.float32)
        np.savez(tmp_path / f"img_subj{number:02d}.npz", **held)
    people = read_all(tmp_path, fps=30)
    assert [poses.frame_index.tolist() for poses in people] == [[0]] * 4
    for number in range(4):
        (tmp_path / f"img_subj{number:02d}.npz").rename(
            tmp_path / f"img_{number // 2:04d}_subj{number % 2}.npz"
        )
    frames = [frame for poses in read_all(tmp_path, fps=30) for frame in poses.frame_index]
    assert sorted(frames) == [0, 0, 1, 1]


def test_the_file_of_one_person_in_one_image_is_one_frame(tmp_path):
    held = {key: value for key, value in estimators.sam3d(turning(1))[0].items() if value is not None}
    assert held["pred_keypoints_3d"].shape == (70, 3)
    np.savez(tmp_path / "img_subj00.npz", **held)
    assert recognised(tmp_path / "img_subj00.npz") == ["mhr70"]
    assert len(read(tmp_path / "img_subj00.npz", fps=30)) == 1
