"""Joints of body models: SOMA of GEM-X and Kimodo, SMPL of AlphaPose and WHAM (formats.md section 6)."""

import json
import pickle
from collections import defaultdict

import numpy as np
import pytest

from golden import estimators, phalp, worlds
from golden.bodies import limbs_of, standing, turning
from golden.catalogue import recognised
from golden.estimators import AWAY_M
from pcnet3d.adapters import read, read_all
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core import layouts
from pcnet3d.pipeline.core.layouts import SOMA30, SOMA77
from pcnet3d.pipeline.reading.load import adapters

FRAMES = 40
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
