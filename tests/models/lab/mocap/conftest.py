"""Small motion capture files, written here."""

import numpy as np
import pytest

from golden.acclaim import write_still
from pcnet3d.models.lab.mocap.clips import Clip
from pcnet3d.pipeline import H36M17


@pytest.fixture
def clip_of(standing):
    """A clip of somebody who stands, leans and sways a little, by name."""

    def make(name, count=40, fps=30.0, seed=0):
        rng = np.random.default_rng([seed, *name.encode()])
        lean = np.radians(15) * np.sin(np.linspace(0, 6, count) + rng.uniform(0, 6))
        upper = [i for i, joint in enumerate(H36M17.joints) if joint not in ("pelvis", *LEGS)]
        joints = np.tile(standing, (count, 1, 1))
        x, z = joints[:, upper, 0] - standing[0, 0], joints[:, upper, 2] - standing[0, 2]
        c, s = np.cos(lean)[:, None], np.sin(lean)[:, None]
        joints[:, upper, 0] = standing[0, 0] + c * x - s * z
        joints[:, upper, 2] = standing[0, 2] + s * x + c * z
        return Clip(name, name.partition("_")[0], "test", fps, joints.astype(np.float32))

    return make


LEGS = tuple(f"{side}_{part}" for side in "lr" for part in ("hip", "knee", "ankle"))


@pytest.fixture
def mmfi_tree(tmp_path, facing_camera):
    """Writes a tree as MM-Fi has it: people of several sizes who face the sensor, 3 m away, bend their knees and
    move one hand."""

    def make(recordings, count=40, still=False, change=lambda joints: joints):
        rng = np.random.default_rng(0)
        t = np.linspace(0, 2 * np.pi, count)
        for subject, action in [(subject, action) for subject, of in recordings.items() for action in of]:
            joints = np.tile(facing_camera, (count, 1, 1))
            if not still:
                side = "r" if action in ("A14", "A18") else "l"
                lifted = 0.24 * np.stack(
                    [np.zeros(count), np.cos(1 + np.sin(t)), -np.sin(1 + np.sin(t))], axis=-1
                )
                joints[:, H36M17.index(f"{side}_wrist")] = joints[:, H36M17.index(f"{side}_elbow")] + lifted
                joints[:, H36M17.indices(("l_knee", "r_knee")), 2] -= 0.03 * (1 - np.cos(t))[:, None]
                joints[:, [i for i in range(17) if i not in (2, 3, 5, 6)], 0] += 0.02 * np.sin(t)[:, None]
                joints *= rng.uniform(0.95, 1.05)
            environment = f"E{(int(subject[1:]) - 1) // 10 + 1:02d}"
            folder = tmp_path / "data" / "MMFi" / environment / subject / action
            folder.mkdir(parents=True)
            np.save(
                folder / "ground_truth.npy", change(joints + np.array([0.2, 0.1, 3.0])), allow_pickle=True
            )
        return tmp_path / "data" / "MMFi"

    return make


@pytest.fixture
def acclaim(tmp_path):
    """A folder of somebody who stands still, as ASF and AMC."""
    (tmp_path / "acclaim").mkdir()
    return write_still(tmp_path / "acclaim")
