"""A skeleton of motion capture, and files of how it moves."""

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


def bvh(frames, names=MIXAMO, scale=100.0, order="ZXY", fps=30, root=(0.0, 0.9, 0.0)):
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


def bent(count=30, seed=0):
    """(T, 16, 3) angles in degrees: a person who stands, bends a little everywhere and the knees as knees bend."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, count)[:, None, None]
    angles = rng.uniform(-8, 8, (1, len(SKELETON), 3)) * np.sin(
        2 * np.pi * (t + rng.uniform(size=(1, 16, 1)))
    )
    angles[:, [list(SKELETON).index(f"{s}_knee") for s in "lr"]] = 0
    return angles
