"""A file of clips that is not what it should be has words."""

import numpy as np
import pytest

from pcnet3d.models.lab.mocap.clips import read_mocap
from pcnet3d.pipeline import H36M17
from refusals import refused

RNG = np.random.default_rng(0)
HELD = {
    "joints": RNG.normal(size=(8, 17, 3)), "root": RNG.normal(size=(8, 3)), "clip_start": np.array([0, 4, 8]),
    "clip_name": np.array(["01_01", "02_01"]), "subject": np.array(["01", "02"]),
    "source": np.array(["asfamc", "asfamc"]), "fps": np.array(30.0), "joint_names": np.array(H36M17.joints),
}  # fmt: skip


def test_world_joints_are_pelvis_plus_root(tmp_path):
    np.savez(tmp_path / "clips.npz", **HELD)
    clip = read_mocap(tmp_path / "clips.npz")[1]
    np.testing.assert_allclose(clip.joints, HELD["joints"][4:] + HELD["root"][4:, None], rtol=1e-6)
    assert (clip.name, clip.subject, clip.fps, len(clip)) == ("02_01", "02", 30.0, 4)


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"root": HELD["root"][:7]}, "wrong-content"),
        ({"joint_names": HELD["joint_names"][::-1]}, "wrong-content"),
        ({"clip_start": np.array([0, 5, 4])}, "wrong-content"),
        ({"fps": np.array(60.0)}, "wrong-content"),
        ({"joints": np.full((8, 17, 3), np.nan)}, "file-damaged"),
        ({"subject": np.array([{"pickled": 1}], dtype=object)}, "unsafe"),
    ],
)
def test_a_wrong_file_is_refused_with_what_is_wrong_in_it(tmp_path, wrong, code):
    np.savez(tmp_path / "clips.npz", **HELD | wrong)
    with refused(code, *wrong if code == "wrong-content" and "root" not in wrong else ()):
        read_mocap(tmp_path / "clips.npz")
