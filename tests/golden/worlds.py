"""Motion capture's files (formats.md sections 6 and 7.3), of joints (T, 17, 3) in metres, z up unless said."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.bodies import placed
from golden.skeleton import PLACE, Bone, bvh_text, turns
from pcnet3d.pipeline import H36M17, rotate
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, COCO23
from pcnet3d.pipeline.files.skeletons import SMPL

# HALPE_26 of Pose2Sim, in its order; markers at other places than our joints are left to be derived.
POSE2SIM = {
    "Hip": "pelvis", "RHip": "r_hip", "RKnee": "r_knee", "RAnkle": "r_ankle", "LHip": "l_hip", "LKnee": "l_knee",
    "LAnkle": "l_ankle", "Neck": "thorax", "Head": "head", "Nose": "nose", "RShoulder": "r_shoulder",
    "RElbow": "r_elbow", "RWrist": "r_wrist", "LShoulder": "l_shoulder", "LElbow": "l_elbow", "LWrist": "l_wrist",
}  # fmt: skip
# OpenCap's joints, no head among them; the markers that it predicts besides lie near.
OPENCAP = {
    "Neck": "thorax", "midHip": "pelvis",
    **{f"{side}{part}": f"{side.lower()}_{part.lower()}" for side in "RL"
       for part in ("Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Heel")},
    **{f"{side}{size}Toe": f"{side.lower()}_{size.lower()}_toe" for side in "RL" for size in ("Big", "Small")},
    "r_shoulder_study": "r_shoulder", "r_mknee_study": "r_knee", "L_knee_study": "l_knee", "C7_study": "thorax",
}  # fmt: skip


def y_up(points: np.ndarray) -> np.ndarray:
    """Pose2Sim's zup2yup: (X, Y, Z) -> (Y, Z, X)."""
    return points[..., [1, 2, 0]]


def trc(path, names, points, first=0, fps=30, units="m"):
    """The five header lines and rows of Pose2Sim's triangulation; a NaN is an empty cell."""
    header = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{fps}\t{fps}\t{len(points)}\t{len(names)}\t{units}\t{fps}\t{first}\t{len(points)}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, len(names) + 1)),
    ]
    rows = [
        "\t".join([str(i), repr(i / fps), *("" if np.isnan(v) else f"{v:.6f}" for v in row.ravel())])
        for i, row in enumerate(points, first)
    ]
    path.write_text("\n".join(header + rows) + "\n")
    return path


def c3d(path, names, points, unit="mm", rate=50.0, y_screen=None):
    ezc3d = pytest.importorskip("ezc3d")
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    data = np.moveaxis(points, 0, -1).swapaxes(0, 1)
    file["data"]["points"] = np.concatenate([np.nan_to_num(data), np.ones_like(data[:1])])
    missing = np.isnan(data).any(axis=0, keepdims=True)
    file["data"]["meta_points"] = {
        "residuals": np.where(missing, -1.0, 0.0),
        "camera_masks": np.zeros((7, *data.shape[1:]), dtype=bool),
    }
    if y_screen:
        file.add_parameter("POINT", "Y_SCREEN", [y_screen])
    file.write(str(path))
    return path


# Mixamo's names, parents and the joints of ours that they are.
BONES = {
    "Hips": (None, "pelvis"), "Spine": ("Hips", "spine"), "Neck": ("Spine", "thorax"), "Head": ("Neck", "nose"),
    **{f"{side}{name}": (f"{side}{parent}" if parent not in ("Hips", "Spine") else parent, f"{side[0].lower()}_{ours}")
       for side in ("Left", "Right") for name, parent, ours in (
        ("UpLeg", "Hips", "hip"), ("Leg", "UpLeg", "knee"), ("Foot", "Leg", "ankle"),
        ("Arm", "Spine", "shoulder"), ("ForeArm", "Arm", "elbow"), ("Hand", "ForeArm", "wrist"))},
}  # fmt: skip


def bvh(path, world, fps=60, scale=100.0, t_pose=False):
    """A BVH whose joints slide: six channels each, positions from the parent."""
    places = {name: scale * world[:, H36M17.index(ours)] for name, (_, ours) in BONES.items()}
    bones = {}
    for name, (parent, _) in BONES.items():
        turned = np.zeros((len(world), 3))
        turned[int(t_pose) :, 1] = 0.001 * (name == "Head")
        local = places[name] - (places[parent] if parent else 0)
        values = np.concatenate([local, turned], axis=1)
        bones[name] = Bone(parent, local[0], f"{PLACE} {turns('ZXY')}", values)
    path.write_text(bvh_text(bones, 1 / fps))
    return path


_BANDAI = {
    "UpLeg": "UpperLeg",
    "Leg": "LowerLeg",
    "Foot": "Foot",
    "Arm": "UpperArm",
    "ForeArm": "LowerArm",
    "Hand": "Hand",
}
# Names of BONES in programs' rigs.
RIGS = {
    "Mixamo": {bone: f"mixamorig:{bone}" for bone in BONES},
    "Rokoko": {bone: bone.replace("Leg", "Shin").replace("UpShin", "Thigh") for bone in BONES},
    "Bandai Namco": {
        bone: f"{_BANDAI[part]}_{bone[0]}" if (part := re.sub("^(Left|Right)", "", bone)) != bone else bone
        for bone in BONES
    },
}  # fmt: skip
_AT_REST = {"Arm": 1, "ForeArm": 1, "Hand": 1, "UpLeg": -2, "Leg": -2, "Foot": -2}  # left is x, up is y


def rig(program: str, path: Path, world: np.ndarray, fps: int = 60) -> Path:
    """A BVH of turned bones, centimetres, of a rigid trunk, y up. At rest the body is in a T-pose and looks along z;
    Bandai Namco's bones all lie along x of their own, and so does the way up the head, which looks along y."""
    at = {bone: world[:, H36M17.index(ours)] for bone, (_, ours) in BONES.items()}
    below = {parent: bone for bone, (parent, _) in reversed(BONES.items())}
    left, up = _unit(at["LeftUpLeg"] - at["RightUpLeg"]), _unit(at["Neck"] - at["Hips"])
    forward = _unit(np.cross(left, up))
    R, bones = {}, {}
    for bone, (parent, _) in BONES.items():
        children = [child for child, (above, _) in BONES.items() if above == bone]
        trunk = bone in ("Hips", "Spine", "Neck", "Head")
        ahead = up if trunk else at[below[bone]] - at[bone] if children else None
        rest = np.eye(3)
        if program != "Bandai Namco":
            axis = _AT_REST.get(re.sub("^(Left|Right)", "", bone), 2)
            side = -1 if axis == 1 and bone.startswith("Right") else 1
            rest = _frame(np.sign(axis) * np.eye(3)[abs(axis) - 1] * side, np.array([0.0, 0, 1]))
        R[bone] = R[parent] if ahead is None else _frame(ahead, forward) @ rest.T
        R_from_parent = np.eye(3) if parent is None else np.swapaxes(R[parent], 1, 2)
        offset = (
            np.zeros(3)
            if parent is None
            else 100 * rotate(R_from_parent, (at[bone] - at[parent])[:, None])[0, 0]
        )
        channels, values = (
            turns("ZXY"),
            Rotation.from_matrix(R_from_parent @ R[bone]).as_euler("ZXY", degrees=True),
        )
        if parent is None:
            channels, values = f"{PLACE} {channels}", np.concatenate([100 * at[bone], values], axis=1)
        named = RIGS[program][parent] if parent else None
        bones[RIGS[program][bone]] = Bone(named, offset, channels, values)
    path.write_text(bvh_text(bones, 1 / fps), encoding="utf-8")
    return path


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _frame(along: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """(..., 3, 3) whose columns are a bone's direction, what is forward across it, and the third."""
    x = _unit(along)
    z = _unit(np.cross(x, forward))
    return np.stack([x, np.cross(z, x), z], axis=-1)


def smpl(world) -> np.ndarray:
    """(T, 24, 3) in SMPL's order, hands at the wrists; the collars are of no matter."""
    names = ["nose" if name == "head" else name for name in SMPL]
    return placed(world, [*names, "l_hand", "r_hand"])


R_Y_UP_FROM_Z_UP = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], float)  # the inverse of (x, y, z) -> (z, x, y)


def freemocap(world: np.ndarray) -> np.ndarray:
    """(T, 33, 3) millimetres in MediaPipe's order; what our layout lacks lies near the head, hands and feet."""
    return 1000 * placed(world, BLAZEPOSE33.joints)


def freemocap_rtmpose(world: np.ndarray) -> np.ndarray:
    """(T, 23, 3) millimetres in COCO-WholeBody's order of body and feet; eyes lie at the nose, ears at the head."""
    return 1000 * placed(world, COCO23.joints)


def freemocap_csv(folder: Path, joints: np.ndarray) -> Path:
    """freemocap_data_by_frame.csv of joints (T, 23, 3): a row a point, by frame, with other trajectories between."""
    sides = {"l": "left", "r": "right"}
    names = [f"{sides[joint[0]]}{joint[1:]}" if joint[1] == "_" else joint for joint in COCO23.joints]
    lines = ["frame,keypoint,x,y,z,model,trajectory,reprojection_error"]
    for frame, row in enumerate(joints):
        lines.append(f"{frame},total_body_center_of_mass,1,2,3,rtmpose.body,total_body_center_of_mass,")
        for joint, (x, y, z) in zip(names, row, strict=True):
            lines.append(f"{frame},{joint},{x:.4f},{y:.4f},{z:.4f},rtmpose.body,3d_xyz,")
            lines.append(f"{frame},{joint},{2 * x:.4f},{y:.4f},{z:.4f},rtmpose.body,rigid_3d_xyz,")
        lines.append(f"{frame},hand_root,4,5,6,rtmpose.left_hand,3d_xyz,")
    path = folder / "freemocap_data_by_frame.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def anipose(folder: Path, world: np.ndarray) -> Path:
    """anipose's pose-3d CSV, millimetres: coordinates, errors, numbers of cameras and scores of each joint, at the end
    the transform and the frame."""
    lines = [
        ",".join(
            [
                *(
                    f"{name}_{what}"
                    for name in POSE2SIM
                    for what in ("x", "y", "z", "error", "ncams", "score")
                ),
                *(f"M_{i}{j}" for i in range(3) for j in range(3)),
                "center_0",
                "center_1",
                "center_2",
                "fnum",
            ]
        )
    ]
    for frame, row in enumerate(1000 * world[:, H36M17.indices(list(POSE2SIM.values()))]):
        cells = [value for point in row for value in (*point, 1.2, 3, 0.9)]
        lines.append(",".join(map(str, [*cells, *np.eye(3).ravel(), 0, 0, 0, frame])))
    (folder / "walk.csv").write_text("\n".join(lines) + "\n")
    return folder / "walk.csv"
