"""A skeleton of motion capture, and files of how it moves."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

# A T-pose, Y up, facing +z, left at +x: child -> (parent, offset in metres), in hierarchy order.
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


class Bone(NamedTuple):
    """Of a BVH: the bone that it hangs on, where (3,), and its channels by name with their values (T, C)."""

    parent: str | None
    offset: Sequence[float]
    channels: str
    values: np.ndarray


PLACE = "Xposition Yposition Zposition"


def turns(order: str) -> str:
    """The names of rotation channels."""
    return " ".join(f"{axis}rotation" for axis in order)


def bvh_text(bones: Mapping[str, Bone], frame_s: float, end: str | None = None) -> str:
    """bones: by name, the root first. end: the offset of a last bone's End Site; None for files without."""
    lines, order = ["HIERARCHY"], []

    def write(name: str, depth: int) -> None:
        bone, pad = bones[name], "\t" * depth
        order.append(name)
        lines.extend([f"{pad}{'JOINT' if depth else 'ROOT'} {name}", f"{pad}{{"])
        lines.append(f"{pad}\tOFFSET " + " ".join(f"{v:.6f}" for v in bone.offset))
        lines.append(f"{pad}\tCHANNELS {bone.values.shape[1]} {bone.channels}")
        children = [child for child, each in bones.items() if each.parent == name]
        for child in children:
            write(child, depth + 1)
        if end and not children:
            lines.extend(f"{pad}\t{line}" for line in ("End Site", "{", f"\tOFFSET {end}", "}"))
        lines.append(f"{pad}}}")

    write(next(iter(bones)), 0)
    rows = np.concatenate([bones[name].values for name in order], axis=1)
    lines += ["MOTION", f"Frames: {len(rows)}", f"Frame Time: {frame_s:.7f}"]
    return "\n".join([*lines, *(" ".join(f"{v:.6f}" for v in row) for row in rows)]) + "\n"


def bvh(frames, names=MIXAMO, scale=100.0, order="ZXY", fps=30, root=(0.0, 0.9, 0.0)):
    """BVH text: the skeleton and `frames` (T, 16, 3) of Euler angles, degrees, in the channels' order; hips at root."""
    frames, bones = np.asarray(frames), {}
    for i, (joint, (parent, offset)) in enumerate(SKELETON.items()):
        channels, values = turns(order), frames[:, i]
        if parent is None:
            place = np.tile(scale * np.array(root), (len(frames), 1))
            channels, values = f"{PLACE} {channels}", np.concatenate([place, values], axis=1)
        bones[names[joint]] = Bone(parent and names[parent], scale * np.array(offset), channels, values)
    return bvh_text(bones, 1 / fps, end="0 1 0")


def bent(count=30, seed=0):
    """(T, 16, 3) angles in degrees: a person who stands, bends a little everywhere and the knees as knees bend."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, count)[:, None, None]
    angles = rng.uniform(-8, 8, (1, len(SKELETON), 3)) * np.sin(
        2 * np.pi * (t + rng.uniform(size=(1, 16, 1)))
    )
    angles[:, [list(SKELETON).index(f"{s}_knee") for s in "lr"]] = 0
    return angles
