"""The person whom every golden file shows: upright, knees bent, turning on the spot or walking off."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from golden.detections import Scene, moving
from pcnet3d.pipeline import H36M17, PoseSequence, rotate
from pcnet3d.pipeline.core.layouts import FEET, LIMBS, Layout, body_of

BODY_AND_FEET = body_of(FEET.joints)


def facing_camera() -> np.ndarray:
    """(17, 3) metres, H36M17 in CAMERA, pelvis at the origin: an upright person who faces the camera.

    Right-handed and anatomical: the right hip at smaller x, knees and nose towards the camera (-z).
    """
    joints = {
        "pelvis": (0.0, 0.0, 0.0),
        "r_hip": (-0.10, 0.01, 0.0),
        "r_knee": (-0.11, 0.44, -0.06),
        "r_ankle": (-0.11, 0.87, 0.02),
        "spine": (0.0, -0.24, 0.01),
        "thorax": (0.0, -0.49, 0.0),
        "nose": (0.0, -0.60, -0.09),
        "head": (0.0, -0.75, -0.01),
        "r_shoulder": (-0.18, -0.46, 0.0),
        "r_elbow": (-0.22, -0.18, 0.03),
        "r_wrist": (-0.21, 0.05, -0.05),
    }
    joints |= {
        name.replace("r_", "l_"): (-x, y, z) for name, (x, y, z) in joints.items() if name.startswith("r_")
    }
    return np.array([joints[name] for name in H36M17.joints])


def bone_lengths(joints: np.ndarray) -> np.ndarray:
    """(..., 16) of the bones of joints (..., 17, 3)."""
    start, end = np.array([H36M17.indices(bone) for bone in H36M17.bones]).T
    return np.linalg.norm(joints[..., end, :] - joints[..., start, :], axis=-1)


def feet_of(bodies: np.ndarray) -> np.ndarray:
    """(T, 6, 3) in the order of FEET: the feet of upright bodies (T, 17, 3), flat, straight ahead and 0.2 m long, in
    any axes, mirrored ones too. The heel is 4 cm behind and 7 below the ankle, the toes are as low."""
    at = dict(zip(H36M17.joints, np.moveaxis(bodies, 1, 0), strict=True))
    down = _unit(at["pelvis"] - at["thorax"])
    right = _unit(at["r_hip"] - at["l_hip"])
    nose = at["nose"] - at["thorax"]
    ahead = _unit(
        nose - (nose * down).sum(-1, keepdims=True) * down - (nose * right).sum(-1, keepdims=True) * right
    )
    places = {"heel": (-0.04, 0.0), "big_toe": (0.16, -0.04), "small_toe": (0.16, 0.04)}
    points = []
    for name in FEET.joints:
        forward, out = places[name[2:]]
        outwards = right if name.startswith("r_") else -right
        points.append(at[f"{name[0]}_ankle"] + forward * ahead + out * outwards + 0.07 * down)
    return np.stack(points, axis=1)


def with_feet(bodies: np.ndarray) -> np.ndarray:
    """(T, 23, 3) the same bodies (T, 17, 3) with their `feet_of`, in the order of BODY_AND_FEET."""
    return np.concatenate([bodies, feet_of(bodies)], axis=1)


# At which joint of H36M17 lies one that it lacks, by the first word of its name; others are parts of a hand.
_NEAR = {
    **dict.fromkeys(("eye", "mouth", "jaw"), "nose"), **dict.fromkeys(("ear", "head"), "head"),
    **dict.fromkeys(("neck", "upper", "neck2", "skull"), "thorax"), "hips": "pelvis",
    **dict.fromkeys(("spine1", "spine2", "spine3", "chest"), "spine"),
    **dict.fromkeys(("acromion", "collar", "clavicle"), "shoulder"), **dict.fromkeys(("olecranon", "cubital"), "elbow"),
    **dict.fromkeys(("foot", "toe", "toes"), "ankle"),
}  # fmt: skip


def placed(bodies: np.ndarray, joints: Sequence[str]) -> np.ndarray:
    """(T, J, 3) of any layout's joints on bodies (T, 17, 3): those of H36M17 and of the feet where they are, the foot
    index between the toes, others at the joint that is nearest."""
    whole = with_feet(bodies)
    names = [name for name in FEET.joints if name.endswith("big_toe")]
    index = [
        whole[:, BODY_AND_FEET.indices((name, name.replace("big", "small")))].mean(axis=1) for name in names
    ]
    points = (*BODY_AND_FEET.joints, *(name.replace("big_toe", "foot_index") for name in names))
    rows = []
    for joint in joints:
        side, part = (joint[:2], joint[2:]) if joint[1] == "_" else ("", joint)
        near = _NEAR.get(part.partition("_")[0], "wrist")
        known = joint if joint in points else near if near in points else side + near
        rows.append(points.index(known))
    return np.concatenate([whole, np.stack(index, axis=1)], axis=1)[:, rows]


def limbs_of(bodies: np.ndarray) -> np.ndarray:
    """(T, 12, 3) of joints (T, 17, 3), from the middle of the hips."""
    return (bodies - hips_of(bodies))[:, H36M17.indices(LIMBS)]


def hips_of(bodies: np.ndarray) -> np.ndarray:
    """(T, 1, 3) the middle of the hips of joints (T, 17, 3)."""
    return bodies[:, H36M17.indices(["l_hip", "r_hip"])].mean(axis=1, keepdims=True)


def feet_in(poses: PoseSequence) -> np.ndarray:
    """(T, 6, 3) in the order of FEET, NaN for points that the poses' layout lacks."""
    nothing = np.full_like(poses.joints[:, 0], np.nan)
    return np.stack([poses.joint(name) if name in poses.layout else nothing for name in FEET.joints], axis=1)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


@dataclass(frozen=True)
class Person:
    """Whose bodies a golden file gets: those of `turning` and `standing`, or of the mirrored person; and what files of
    2D keypoints get, mirrored or not."""

    mirrored: bool = False

    def turning(self, count: int) -> np.ndarray:
        return turning(count) * [-1.0 if self.mirrored else 1.0, 1, 1]

    def standing(self, count: int) -> np.ndarray:
        return standing(count) * [-1.0 if self.mirrored else 1.0, 1, 1]

    def two_in_images(self, layout: Layout) -> Scene:
        """Frames and points (T, J, 3) of two people, whom their names "0" and "1" tell apart."""
        return {str(number): moving(len(layout), range(24), number) for number in range(2)}


def turning(count: int) -> np.ndarray:
    """(T, 17, 3): the person of `facing_camera` turning on the spot, every frame different."""
    angle_deg = 0.3 * np.arange(count)
    about_vertical = Rotation.from_rotvec(angle_deg[:, None] * [0, 1, 0], degrees=True).as_matrix()
    return rotate(about_vertical, facing_camera()[None])


def standing(count: int) -> np.ndarray:
    """(T, 17, 3) metres, z up: the same person in a world, bobbing and walking off while turning."""
    x, y, z = np.moveaxis(turning(count), -1, 0)
    walked = np.linspace(0, 1, count)[:, None]
    return np.stack([x + walked, z - 0.5 * walked, 0.9 + 0.03 * np.sin(9 * walked) - y], axis=-1)
