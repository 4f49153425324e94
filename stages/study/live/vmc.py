"""Poses as OSC messages of the Virtual Motion Capture protocol, which Unity's avatars understand.

https://protocol.vmc.info/english.html: a bundle a frame; each bone's place and turn against its parent, Unity's axes.
"""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from ....pipeline.core.anthropometry import ANKLE_HEIGHT, implied_stature
from ....pipeline.core.frames import LEVEL
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import is_finite, rotate, transpose
from ...export.armature import ANIMATION, bone_rotations
from .frames import LivePose

# Unity's bone: its parent, where it begins, and the joint of the armature that turns it. Hands and feet turn with
# forearm and shin, for 17 joints say no more.
BONES = {
    "Hips": ("", "pelvis", "pelvis"),
    "Spine": ("Hips", "pelvis", "lower_back"),
    "Chest": ("Spine", "spine", "thorax"),
    "Neck": ("Chest", "thorax", "neck"),
    "Head": ("Neck", "nose", "nose"),
    "LeftShoulder": ("Chest", "thorax", "l_clavicle"),
    "LeftUpperArm": ("LeftShoulder", "l_shoulder", "l_shoulder"),
    "LeftLowerArm": ("LeftUpperArm", "l_elbow", "l_elbow"),
    "RightShoulder": ("Chest", "thorax", "r_clavicle"),
    "RightUpperArm": ("RightShoulder", "r_shoulder", "r_shoulder"),
    "RightLowerArm": ("RightUpperArm", "r_elbow", "r_elbow"),
    "LeftUpperLeg": ("Hips", "l_hip", "l_hip"),
    "LeftLowerLeg": ("LeftUpperLeg", "l_knee", "l_knee"),
    "RightUpperLeg": ("Hips", "r_hip", "r_hip"),
    "RightLowerLeg": ("RightUpperLeg", "r_knee", "r_knee"),
}
_REST = 150  # frames whose median is how neck and head are held at rest: 5 s


class Performer:
    """One person's bones, in ANIMATION's directions, which mirrored left to right are Unity's: x right, y up, z front.

    A person who faces the camera faces along z. Lengths are the lifter's, about the metres of a person 1.7 m tall. The
    hips are over the origin, as high as the lower ankle makes them: a path through the room, or a jump, is not in it.
    """

    def __init__(self) -> None:
        self._joints: deque[np.ndarray] = deque(maxlen=_REST)

    def bones(self, pose: LivePose) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Place (3,) and quaternion (4,), x y z w, of each bone that is known, against its parent's."""
        from scipy.spatial.transform import Rotation

        if not np.isfinite(pose.level).any():
            return {}
        self._joints.append(rotate(ANIMATION.basis @ LEVEL.basis.T, pose.level))
        kept = np.stack(self._joints)
        at = dict(zip(H36M17.joints, np.moveaxis(kept, 1, 0), strict=True))
        R_world = {name: R[-1] for name, R in bone_rotations(at).items()}
        place = {name: points[-1] for name, points in at.items()}
        soles = [place[f"{side}_ankle"][1] for side in "lr"]
        lowest = np.fmin(*soles) - ANKLE_HEIGHT * implied_stature(kept)
        out = {}
        for bone, (parent, joint, turned) in BONES.items():
            R, point = R_world[turned], np.array([0.0, -lowest, 0.0])
            if parent:
                _, above, turns = BONES[parent]
                R_parent_from_world = transpose(R_world[turns])
                R = R_parent_from_world @ R
                point = rotate(R_parent_from_world, (place[joint] - place[above])[None])[0]
            if is_finite(R).all() and is_finite(point):
                x, y, z, w = Rotation.from_matrix(R).as_quat()
                out[bone] = point * (-1, 1, 1), np.array([x, -y, -z, w])
        return out

    def bundle(self, pose: LivePose) -> bytes:
        """A datagram: whether somebody is there, the time, the root, and the bones that are known."""
        from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder

        bones = self.bones(pose)
        bundle = OscBundleBuilder(IMMEDIATELY)
        bundle.add_content(_message("/VMC/Ext/OK", 1))
        bundle.add_content(_message("/VMC/Ext/T", float(pose.time_s)))
        bundle.add_content(_message("/VMC/Ext/Root/Pos", "root", *map(float, (0, 0, 0, 0, 0, 0, 1))))
        for bone, (point, turn) in bones.items():
            bundle.add_content(_message("/VMC/Ext/Bone/Pos", bone, *map(float, (*point, *turn))))
        return bundle.build().dgram


def _message(address: str, *values: str | float) -> Any:
    from pythonosc.osc_message_builder import OscMessageBuilder

    message = OscMessageBuilder(address)
    for value in values:
        message.add_arg(value)
    return message.build()
