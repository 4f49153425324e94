"""4D-Humans' and WHAM's pickles and their kin's, SMPL and SOMA in arrays and JSON, and the 70 keypoints of SAM 3D Body
and InstantHMR in every form that people save (formats.md 6)."""

import json
import pickle
import zipfile
from collections import defaultdict

import numpy as np
import pytest

from golden import estimators, phalp, worlds
from golden.bodies import hips_of, limbs_of, standing, turning
from golden.catalogue import recognised
from golden.estimators import AWAY_M, FOCAL_PX
from golden.pickles import Trap
from pcnet3d.adapters import read, read_all
from pcnet3d.adapters.kit.pickles import load
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core import layouts
from pcnet3d.pipeline.core.layouts import MHR70, SOMA30, SOMA77
from pcnet3d.pipeline.reading.load import adapters
from refusals import refused

FRAMES = 40


@pytest.fixture
def tracks() -> dict:
    return phalp.tracks(turning(FRAMES))


@pytest.mark.parametrize("write", phalp.WRITERS.values(), ids=phalp.WRITERS.keys())
def test_tracks(tracks, tmp_path, write):
    path = tmp_path / "demo_walk.pkl"
    path.write_bytes(write(tracks))
    assert [name for name, each in adapters().items() if each.sniff(path)] == ["phalp"]
    people = {poses.person: poses for poses in read_all(path)}
    assert sorted(people) == ["1", "2"]
    np.testing.assert_array_equal(people["1"].frame_index, np.arange(FRAMES))
    np.testing.assert_array_equal(people["2"].frame_index, np.arange(10, 30))
    poses = people["1"]
    assert (poses.frame.name, poses.frame.unit) == ("CAMERA", "m")
    assert poses.frames_known
    assert poses.time_s is None
    kept = [i for i, joint in enumerate(H36M17.joints) if joint != "spine"]
    np.testing.assert_allclose(poses.joints[:, kept], turning(FRAMES)[:, kept], atol=1e-6)


def test_without_time_the_frames_are_not_known(tracks, tmp_path):
    for frame in tracks.values():
        del frame["time"]
    (tmp_path / "x.pkl").write_bytes(pickle.dumps(tracks))
    assert not read(tmp_path / "x.pkl", person="1").frames_known


def test_other_joints_have_words(tracks, tmp_path):
    path = tmp_path / "x.pkl"
    next(iter(tracks.values()))["3d_joints"][0] = np.zeros((24, 3))
    path.write_bytes(pickle.dumps(tracks))
    with pytest.raises(InputError, match=r"\(45, 3\)"):
        read(path)


def test_arrays_of_objects_become_lists(tmp_path):
    objects = np.empty((2, 2), dtype=object)
    objects[:] = [[{"a": 1}, None], ["b", np.arange(3)]]
    (tmp_path / "x.pkl").write_bytes(pickle.dumps({"a": objects, "one": np.array({"b": 2}, dtype=object)}))
    held = load(tmp_path / "x.pkl")
    assert held["a"][0] == [{"a": 1}, None]
    np.testing.assert_array_equal(held["a"][1][1], [0, 1, 2])
    assert held["one"] == {"b": 2}
    frames = {"1.jpg": {"tid": [1], "3d_joints": np.array([{}], dtype=object), "time": 0}}
    (tmp_path / "y.pkl").write_bytes(pickle.dumps(frames))
    with pytest.raises(InputError, match=r"\(45, 3\)"):
        read(tmp_path / "y.pkl", "phalp")


def test_parameters_alone_are_refused_with_the_way_out(tmp_path):
    with zipfile.ZipFile(tmp_path / "hmr4d_results.pt", "w") as archive:
        archive.writestr("results/data.pkl", pickle.dumps({"smpl_params_global": {}}))
    with refused("format-unknown", "GVHMR", "adapter amass"):
        read(tmp_path / "hmr4d_results.pt")


LIMBS = H36M17.indices(layouts.LIMBS)


def test_soma_of_thirty_joints(tmp_path):
    """Kimodo's first examples: the same joints, fewer of them."""
    joints = np.load(estimators.soma(tmp_path, standing(FRAMES)))["posed_joints"]
    np.savez(tmp_path / "motion.npz", posed_joints=joints[:, SOMA77.indices(SOMA30.joints)])
    assert recognised(tmp_path / "motion.npz") == ["soma"]
    found = read(tmp_path / "motion.npz", fps=30)
    np.testing.assert_allclose(found.joints[:, LIMBS], limbs_of(worlds.y_up(standing(FRAMES))), atol=1e-5)


def test_soma_that_lies_or_is_another_skeleton(tmp_path):
    path = estimators.soma(tmp_path, standing(FRAMES))
    joints = np.load(path)["posed_joints"]
    np.savez(path, posed_joints=joints[..., [1, 2, 0]])
    with pytest.raises(InputError, match=r"stands along \+y"):
        read(path)
    np.savez(path, posed_joints=joints[:, :34])  # G1, a robot
    assert recognised(path) == []
    with pytest.raises(InputError, match=r"\(frames, 77, 3\)"):
        read(path, "soma")


def test_gemx_bvh_takes_the_face_from_its_joints(tmp_path):
    """Its pose at rest is in axes of the joints' own, so that the head's axes tell no front."""
    world = worlds.y_up(standing(FRAMES))
    path = estimators.gemx_bvh(tmp_path, standing(FRAMES))
    poses = read(path)
    for joint in ("nose", "head"):
        expected = world[:, H36M17.index(joint)] - world[:, H36M17.indices(["l_hip", "r_hip"])].mean(axis=1)
        np.testing.assert_allclose(poses.joint(joint), expected, atol=1e-4)
    (step,) = [step for step in poses.history if step.name == "bvh"]
    assert step.options["derived"] == ["nose = mean(LeftEye, RightEye)"]


@pytest.fixture
def smpl_json(tmp_path):
    people = [turning(FRAMES), turning(FRAMES + 200)[200:]]
    return estimators.alphapose3d(tmp_path, people), people


def test_alphapose3d(smpl_json):
    path, people = smpl_json
    assert recognised(path) == ["alphapose3d", "json2d"]  # its keypoints are the same file's
    assert [poses.person for poses in read_all(path)] == ["1", "2"]  # 3D comes first
    for poses, bodies in zip(read_all(path, track=True), people, strict=True):
        np.testing.assert_allclose(poses.joints[:, LIMBS], limbs_of(bodies), atol=1e-5)
        assert "nearest box" in str(poses.history)


def test_alphapose3d_in_another_unit(smpl_json):
    path, people = smpl_json
    first, _ = read_all(path, unit_m=2.2)
    np.testing.assert_allclose(first.joints[:, LIMBS], 1.1 * limbs_of(people[0]), atol=1e-5)
    with pytest.raises(InputError, match="unit_m"):
        read_all(path, unit_m=1.0)


def test_alphapose3d_without_tracks_or_joints(smpl_json):
    path, _ = smpl_json
    listed = json.loads(path.read_text())
    path.write_text(json.dumps([{**entry, "idx": 0} for entry in listed]))
    with pytest.raises(InputError, match="track=true"):
        read_all(path)
    assert len(read_all(path, track=True)) == 2
    listed[3]["pred_xyz_jts"] = listed[3]["pred_xyz_jts"][:23]
    path.write_text(json.dumps(listed))
    with pytest.raises(InputError, match=r"entry 3.*\(24, 3\)"):
        read_all(path)


@pytest.fixture
def wham(tmp_path):
    """write(subjects) -> wham_output.pkl beside a regressor."""
    estimators.regressor(tmp_path)
    people = [turning(FRAMES), turning(FRAMES)]

    def write(change=lambda subjects: None):
        subjects = estimators.wham_people(people)
        change(subjects)
        (tmp_path / "wham_output.pkl").write_bytes(phalp.as_joblib(subjects))
        return tmp_path / "wham_output.pkl"

    return write, people[0]


def test_wham_with_smpls_regressor(wham):
    write, bodies = wham
    path = write()
    _, second = read_all(path, regressor=estimators.REGRESSOR)
    np.testing.assert_allclose(
        adapters()["wham"].read(path, regressor=estimators.REGRESSOR)[0].joint("l_knee"),
        bodies[:, H36M17.index("l_knee")] + AWAY_M,
        atol=1e-5,
    )
    np.testing.assert_array_equal(second.frame_index, np.arange(FRAMES) + 10)


def test_wham_with_human36ms_regressor(wham, tmp_path):
    """In SPIN's order, where the left leg comes first; and in another, where left and right tell."""
    write, bodies = wham
    names = ["pelvis", "l_hip", "l_knee", "l_ankle", "r_hip", "r_knee", "r_ankle", *H36M17.joints[7:]]
    rows = np.zeros((17, 6890), np.float32)
    rows[np.arange(17), 200 + np.arange(17)] = 1

    def with_joints(subjects):
        for values in subjects.values():
            values["verts"][:, 200:217] = bodies[:, H36M17.indices(names)] + AWAY_M

    np.save(tmp_path / "J_regressor_h36m.npy", rows)
    path = write(with_joints)
    poses = read(path, person="0", regressor=str(tmp_path / "J_regressor_h36m.npy")).without_feet
    np.testing.assert_allclose(poses.joints, bodies - bodies[:, :1], atol=1e-5)
    np.save(tmp_path / "J_regressor_h36m.npy", rows[[0, 4, 5, 6, 1, 2, 3, *range(7, 17)]])
    with pytest.raises(InputError, match="swap-legs"):
        read(path, person="0", regressor=str(tmp_path / "J_regressor_h36m.npy"))


def test_wham_without_regressor_meshes_or_frames(wham, tmp_path):
    write, _ = wham
    with pytest.raises(InputError, match="regressor="):
        read(write())
    np.save(tmp_path / "zeros.npy", np.zeros((24, 6890)))
    with pytest.raises(InputError, match="add up to 1"):
        read(write(), regressor="zeros.npy")
    for key, says in (("verts", "subject 1, verts"), ("frame_ids", "subject 1, frame_ids")):
        with pytest.raises(InputError, match=says):
            read(write(lambda subjects, key=key: subjects[1].pop(key)), regressor=estimators.REGRESSOR)


def test_a_long_wham_file_is_recognised_by_its_beginning(tmp_path):
    """The keys behind the first array are megabytes away."""
    subjects = {0: {"pose": np.zeros((9000, 72)), "pose_world": np.zeros((9, 72))}}
    (tmp_path / "a.pkl").write_bytes(phalp.as_joblib(subjects))
    assert recognised(tmp_path / "a.pkl") == []  # an ordinary dict may be anybody's
    (tmp_path / "a.pkl").write_bytes(phalp.as_joblib(defaultdict(dict, subjects)))
    assert recognised(tmp_path / "a.pkl") == ["wham"]
    (tmp_path / "b.pkl").write_bytes(pickle.dumps({0: {"poses": [1], "pose_world": [2]}}))
    assert recognised(tmp_path / "b.pkl") == []


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
    (tmp_path / "x.csv").write_text("frame,nose_x,nose_y,nose_z\n0,1,2,3\n")
    with refused("wrong-content", "70 keypoints of MHR", "nose"):
        read(tmp_path / "x.csv", "mhr70")
    (tmp_path / "none").mkdir()
    with refused("nothing-usable"):
        read(tmp_path / "none", "mhr70")
    np.savez(tmp_path / "y.npz", pred_keypoints_3d=np.zeros((9, count, 3)), joints_3d=np.array([{}], object))
    with refused("nothing-usable"):
        read(tmp_path / "y.npz", "mhr70")


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
