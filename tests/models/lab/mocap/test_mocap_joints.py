""".npz files with joints: taken by name or in SMPL's order; body-model parameters and pickles refused."""

import numpy as np
import pytest

from pcnet3d.models.lab.mocap.files import How, joints_clip
from pcnet3d.pipeline import H36M17, InputError, rotate
from refusals import refused

SMPL = [
    "pelvis", "l_hip", "r_hip", "spine1", "l_knee", "r_knee", "spine2", "l_ankle", "r_ankle", "spine3", "l_toes",
    "r_toes", "neck", "l_collar", "r_collar", "head", "l_shoulder", "r_shoulder", "l_elbow", "r_elbow",
    "l_wrist", "r_wrist",
]  # fmt: skip


@pytest.fixture
def standing(facing_camera):
    """(17, 3) the upright person in a Z-up world, facing -x there."""
    R_world_from_camera = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    return rotate(R_world_from_camera, facing_camera) + np.array([0, 0, 0.9])


@pytest.fixture
def smpl(standing):
    """(3, 24, 3) joints in SMPL's order with the first joints of a hand, of somebody who faces -x."""
    at = dict(zip(H36M17.joints, standing, strict=True))
    at["neck"], at["head"] = at["thorax"], at["thorax"] + [0, 0, 0.12]
    at |= {f"spine{i}": at["pelvis"] + (at["neck"] - at["pelvis"]) * i / 4 for i in (1, 2, 3)}
    at |= {f"{s}_toes": at[f"{s}_ankle"] + [-0.15, 0, 0] for s in "lr"}
    at |= {f"{s}_collar": at["neck"] + [0, 0.05, 0] for s in "lr"}
    return np.tile(np.array([at[name] for name in SMPL] + [at["l_wrist"]] * 2), (3, 1, 1))


@pytest.fixture
def read(tmp_path):
    def read(how=None, **arrays):
        np.savez(tmp_path / "s01_walk.npz", **arrays)
        return joints_clip(tmp_path / "s01_walk.npz", tmp_path, how or How()).clip

    return read


def test_h36m17_by_order_and_by_name(read, standing):
    joints = np.tile(standing, (3, 1, 1))
    clip = read(joints=joints, fps=50)
    assert (clip.name, clip.subject, clip.fps, clip.source) == ("s01_walk", "s01", 50, "joints")
    np.testing.assert_allclose(clip.joints, joints, rtol=1e-6)
    shuffled = np.random.default_rng(0).permutation(17)
    names = np.array(H36M17.joints)[shuffled]
    np.testing.assert_array_equal(
        read(joints=joints[:, shuffled], joint_names=names, fps=50).joints, clip.joints
    )


def test_smpl_joints_keep_their_side(read, smpl, standing):
    clip = read(joints=smpl, mocap_framerate=120.0)
    assert clip.fps == 120
    for name in ("l_wrist", "r_wrist", "l_knee", "r_ankle", "l_shoulder"):
        np.testing.assert_allclose(
            clip.joints[0, H36M17.index(name)], standing[H36M17.index(name)], atol=1e-6
        )
    nose, head = (clip.joints[0, H36M17.index(name)] for name in ("nose", "head"))
    neck_end = smpl[0, SMPL.index("head")]
    np.testing.assert_allclose(nose - neck_end, [-0.05, 0, 0], atol=1e-6)
    np.testing.assert_allclose(head - neck_end, [0, 0, 0.13], atol=1e-6)


def test_unit_and_axes_told(read, standing):
    clip = read(joints=np.tile(standing, (3, 1, 1)), fps=30)
    y_up = 1000 * standing[:, [0, 2, 1]] * [1, 1, -1]
    other = read(How(unit="mm", up="y"), joints=np.tile(y_up, (3, 1, 1)), fps=30)
    np.testing.assert_allclose(other.joints, clip.joints, atol=1e-6)


def test_smpl_joints_in_millimetres_are_the_same_body(read, smpl):
    metres, millimetres = read(joints=smpl, fps=30), read(How(unit="mm"), joints=1000 * smpl, fps=30)
    np.testing.assert_allclose(millimetres.joints, metres.joints, atol=1e-6)


def test_body_model_parameters_are_refused(read):
    with refused("wrong-content"):
        read(poses=np.zeros((4, 156)), trans=np.zeros((4, 3)), betas=np.zeros(16), mocap_framerate=120)


def test_a_wrong_file_is_refused(read, standing):
    for change, words in [
        (lambda a: a.pop("fps"), "frame rate"),
        (lambda a: a.pop("joints"), "array `joints`"),
        (lambda a: a.update(joints=a["joints"][:, :9]), "17 joints"),
        (lambda a: a.update(joints=a["joints"][0]), r"shape \(frames, joints, 3\)"),
        (lambda a: a.update(joint_names=np.array(["a", "b"])), "a name for each"),
        (lambda a: a.update(joint_names=np.array([f"j{i}" for i in range(17)])), "common names"),
        (lambda a: a.update(joints=1000 * a["joints"]), "--unit"),
        (lambda a: a["joints"].__setitem__((1, 2, 0), np.nan), "NaN"),
        (lambda a: a["joints"].__setitem__((1, H36M17.index("l_ankle"), 2), -9), "length"),
        (lambda a: a.update(joints=np.array([{"pickled": 1}], dtype=object)), "Python objects"),
    ]:
        arrays = {"joints": np.tile(standing, (3, 1, 1)), "fps": np.array(30.0)}
        change(arrays)
        with pytest.raises(InputError, match=words):
            read(**arrays)
