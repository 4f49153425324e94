"""Small motion capture files, written here."""

import numpy as np
import pytest

from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.reading.mocap.clip import Clip

# A T-pose in a Y-up file, facing +z, left at +x: child -> (parent, offset in metres), in hierarchy order.
SKELETON = {
    "hips": (None, (0.0, 0.0, 0.0)),
    "l_hip": ("hips", (0.09, -0.04, 0.0)),
    "l_knee": ("l_hip", (0.0, -0.42, 0.0)),
    "l_ankle": ("l_knee", (0.0, -0.43, 0.0)),
    "r_hip": ("hips", (-0.09, -0.04, 0.0)),
    "r_knee": ("r_hip", (0.0, -0.42, 0.0)),
    "r_ankle": ("r_knee", (0.0, -0.43, 0.0)),
    "spine": ("hips", (0.0, 0.22, 0.0)),
    "neck": ("spine", (0.0, 0.28, 0.0)),
    "head": ("neck", (0.0, 0.12, 0.0)),
    "l_shoulder": ("spine", (0.17, 0.24, 0.0)),
    "l_elbow": ("l_shoulder", (0.28, 0.0, 0.0)),
    "l_wrist": ("l_elbow", (0.25, 0.0, 0.0)),
    "r_shoulder": ("spine", (-0.17, 0.24, 0.0)),
    "r_elbow": ("r_shoulder", (-0.28, 0.0, 0.0)),
    "r_wrist": ("r_elbow", (-0.25, 0.0, 0.0)),
}
MIXAMO = {
    "hips": "Hips", "spine": "Spine", "neck": "Neck", "head": "Head",
    **{f"{s}_{a}": f"{side}{b}" for s, side in (("l", "Left"), ("r", "Right")) for a, b in (
        ("hip", "UpLeg"), ("knee", "Leg"), ("ankle", "Foot"),
        ("shoulder", "Arm"), ("elbow", "ForeArm"), ("wrist", "Hand"),
    )},
}  # fmt: skip


def _bvh(frames, names=MIXAMO, scale=100.0, order="ZXY", fps=30, root=(0.0, 0.9, 0.0)):
    """BVH text: the skeleton and `frames` (T, 16, 3) of Euler angles, degrees, in the channels' order; hips at root."""
    children = {joint: [c for c, (p, _) in SKELETON.items() if p == joint] for joint in SKELETON}
    rotations = " ".join(f"{axis}rotation" for axis in order)
    lines, order_of_joints = ["HIERARCHY"], []

    def write(joint, depth):
        indent, kind = "\t" * depth, "ROOT" if depth == 0 else "JOINT"
        order_of_joints.append(list(SKELETON).index(joint))
        lines.extend([f"{indent}{kind} {names[joint]}", f"{indent}{{"])
        lines.append(f"{indent}\tOFFSET " + " ".join(f"{scale * v:.6f}" for v in SKELETON[joint][1]))
        place = "Xposition Yposition Zposition " if depth == 0 else ""
        lines.append(f"{indent}\tCHANNELS {6 if depth == 0 else 3} {place}{rotations}")
        for child in children[joint]:
            write(child, depth + 1)
        if not children[joint]:
            lines.extend(
                [f"{indent}\tEnd Site", f"{indent}\t{{", f"{indent}\t\tOFFSET 0 1 0", f"{indent}\t}}"]
            )
        lines.append(f"{indent}}}")

    write("hips", 0)
    lines += ["MOTION", f"Frames: {len(frames)}", f"Frame Time: {1 / fps:.7f}"]
    for frame in np.asarray(frames):
        numbers = [*(scale * np.array(root)), *frame[order_of_joints].ravel()]
        lines.append(" ".join(f"{v:.5f}" for v in numbers))
    return "\n".join(lines) + "\n"


def _bent(count=30, seed=0):
    """(T, 16, 3) angles in degrees: a person who stands, bends a little everywhere and the knees as knees bend."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, count)[:, None, None]
    angles = rng.uniform(-8, 8, (1, len(SKELETON), 3)) * np.sin(
        2 * np.pi * (t + rng.uniform(size=(1, 16, 1)))
    )
    angles[:, [list(SKELETON).index(f"{s}_knee") for s in "lr"]] = 0
    return angles


@pytest.fixture(scope="session")
def bvh():
    """Writes the T-posed skeleton with given angles as BVH."""
    return _bvh


@pytest.fixture(scope="session")
def bent():
    return _bent


@pytest.fixture(scope="session")
def skeleton():
    """{joint: (parent, offset in metres)} of the T-pose: Y up, facing +z, the left hand at +x."""
    return SKELETON


@pytest.fixture(scope="session")
def mixamo():
    """{joint: name} as Mixamo names them."""
    return MIXAMO


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
    """Writes a tree as MM-Fi has it: people who face the sensor, 3 m away, bend their knees and move one hand."""

    def make(recordings, count=40, still=False, change=lambda joints: joints):
        rng = np.random.default_rng(0)
        t = np.linspace(0, 2 * np.pi, count)
        for subject, actions in recordings.items():
            for action in actions:
                joints = np.tile(facing_camera, (count, 1, 1))
                if not still:
                    size = rng.uniform(0.95, 1.05)
                    side = "r" if action in ("A14", "A18") else "l"
                    elbow, wrist = (H36M17.index(f"{side}_{part}") for part in ("elbow", "wrist"))
                    angle = 1 + np.sin(t)
                    joints[:, wrist] = joints[:, elbow] + 0.24 * np.stack(
                        [np.zeros(count), np.cos(angle), -np.sin(angle)], axis=-1
                    )
                    joints[:, H36M17.indices(("l_knee", "r_knee")), 2] -= 0.03 * (1 - np.cos(t))[:, None]
                    joints[:, [i for i in range(17) if i not in (2, 3, 5, 6)], 0] += 0.02 * np.sin(t)[:, None]
                    joints *= size
                folder = (
                    tmp_path / "data" / "MMFi" / f"E{(int(subject[1:]) - 1) // 10 + 1:02d}" / subject / action
                )
                folder.mkdir(parents=True)
                np.save(
                    folder / "ground_truth.npy", change(joints + np.array([0.2, 0.1, 3.0])), allow_pickle=True
                )
        return tmp_path / "data" / "MMFi"

    return make
