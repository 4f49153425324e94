"""From an animated skeleton, with whatever names and joints it has, to the 17 joints of H36M17.

Readers of skeleton files (BVH, ASF/AMC), markers and SMPL joints share this: joints at rest, turned frame by frame,
found by their names.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError
from ..core.frames import METRES
from ..core.layouts import H36M17, LEG, Layout
from ..core.rotations import is_finite, rotate, unit

_LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
# The joints where thigh, shank, foot, upper arm, forearm and hand begin, as the programs name them.
_WORDS = (
    ("upleg", "leg", "foot", "arm", "forearm", "hand"),  # MotionBuilder, Mixamo, most BVH of CMU
    ("femur", "tibia", "foot", "humerus", "radius", "wrist"),  # ASF of CMU and HDM05
    ("thigh", "shin", "foot", "shldr", "forearm", "hand"),  # Poser, Daz
    ("thigh", "shin", "foot", "arm", "forearm", "hand"),  # Rokoko
    ("thigh", "shin", "foot", "upperarm", "forearm", "hand"),  # Blender's Rigify
    ("thigh", "shin", "foot", "uarm", "farm", "hand"),  # OptiTrack
    ("thighbend", "shin", "foot", "shldrbend", "forearmbend", "hand"),  # Daz Genesis
    ("thigh", "calf", "foot", "upperarm", "forearm", "hand"),  # 3ds Max Biped
    ("thigh", "calf", "foot", "upperarm", "lowerarm", "hand"),  # Unreal
    ("upperleg", "lowerleg", "foot", "upperarm", "lowerarm", "hand"),  # Unity, VRM, Bandai Namco
    ("leg", "shin", "foot", "arm", "forearm", "hand"),  # SOMA
    ("hip", "knee", "ankle", "shoulder", "elbow", "wrist"),  # SMPL and its kin
    ("hjc", "kjc", "ajc", "sjc", "ejc", "wjc"),  # joint centres of gait laboratories
    ("fep", "feo", "tio", "clo", "huo", "rao"),  # Vicon's Plug-in Gait: ends of its bones
)
_SIDES = (
    {"l": "left{}", "r": "right{}"}, {"l": "l{}", "r": "r{}"}, {"l": "{}l", "r": "{}r"},
    {"l": "{}left", "r": "{}right"},
)  # fmt: skip
_NECKS = ("lowerneck", "neck", "neck01", "neck1", "neckbase")

# Points that no skeleton has, as in the motion capture that the shipped networks were trained on: in metres on the
# head; the spine's share of the way from pelvis to neck, and the thorax' from the neck's lower end to its upper.
_NOSE_FORWARD_M = 0.05
_CROWN_UP_M = 0.13
_SPINE = 0.43
_THORAX = 0.25

_SOMA_FACE = ("LeftEye", "RightEye", "HeadEnd")  # joints that other skeletons leave to the head's axes

_ALONG_AXIS = 0.8  # cosine of bones and axes of a body that stands: a leg apart, hips that lean

UNITS = {**METRES, "asf": METRES["inch"] / 0.45}
LEG_M = (0.6, 1.15)  # thigh and shank of an adult
# The body of SMPL; SMPL-H and SMPL-X go on with hands and face (formats.md section 6).
SMPL = (
    "pelvis", "l_hip", "r_hip", "spine1", "l_knee", "r_knee", "spine2", "l_ankle", "r_ankle", "spine3", "l_toes",
    "r_toes", "neck", "l_collar", "r_collar", "head", "l_shoulder", "r_shoulder", "l_elbow", "r_elbow", "l_wrist",
    "r_wrist",
)  # fmt: skip
_SPINE_NAMES = ("spine", "spine1", "spine2", "spine3")


@dataclass(frozen=True, eq=False)
class Skeleton:
    """names (J,); parents (J,), -1 for the root, every parent before its children; offsets (J, 3), a joint from its
    parent in the pose at rest, where all joints' axes are those of the file."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: np.ndarray

    @property
    def rest(self) -> np.ndarray:
        """(J, 3) the joints at rest, the root at 0."""
        return place(self, np.zeros((1, 3)), np.tile(np.eye(3), (1, len(self.names), 1, 1)))[0][0]


def place(
    skeleton: Skeleton, root: np.ndarray, R_parent_from_joint: np.ndarray, offsets: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Forward kinematics: root (T, 3), R_parent_from_joint (T, J, 3, 3) -> joints (T, J, 3) and their
    R_world_from_joint (T, J, 3, 3). offsets: (T, J, 3) instead of the skeleton's, for joints that also slide."""
    joints = np.empty((*R_parent_from_joint.shape[:2], 3))
    R_world = np.empty_like(R_parent_from_joint)
    for joint, parent in enumerate(skeleton.parents):
        if parent < 0:
            joints[:, joint], R_world[:, joint] = root, R_parent_from_joint[:, joint]
            continue
        offset = skeleton.offsets[joint] if offsets is None else offsets[:, joint]
        step = rotate(R_world[:, parent], np.broadcast_to(offset, root.shape)[:, None])[:, 0]
        joints[:, joint] = joints[:, parent] + step
        R_world[:, joint] = R_world[:, parent] @ R_parent_from_joint[:, joint]
    return joints, R_world


def h36m17_of_skeleton(
    skeleton: Skeleton, joints: np.ndarray, R_world_from_joint: np.ndarray
) -> tuple[np.ndarray, dict[str, str]]:
    """joints (T, J, 3) metres -> (T, 17, 3) H36M17, in the same axes: those of these names where it has all of them, as
    our own BVH files do, else by the names in use; and how points on the head were made, which the skeleton has not.
    InputError naming what has no known name."""
    if is_ours(skeleton.names):
        return joints[:, [skeleton.names.index(joint) for joint in H36M17.joints]], {}
    named = match(skeleton.names)
    at = {joint: joints[:, i] for joint, i in named.items()}
    R_world_from_head = R_world_from_joint[:, named["head"]]
    rest = skeleton.rest
    axes = _head_axes({joint: rest[i] for joint, i in named.items()}, at, R_world_from_head)
    chain, joint = [], skeleton.parents[named["neck"]]
    while joint > 0 and skeleton.parents[joint] >= 0:
        chain.insert(0, joint)
        joint = skeleton.parents[joint]
    made = h36m17(at, joints[:, chain], *np.moveaxis(rotate(R_world_from_head, axes), 1, 0))
    derived = {"nose": "before the head, as it faces at rest or in most frames", "head": "above it"}
    if {"LeftShin", *_SOMA_FACE} <= set(skeleton.names):
        # GEM-X writes SOMA's joints in axes of their own: the pose at rest is none, and does not tell the head's front.
        left_eye, right_eye, top = (joints[:, skeleton.names.index(name)] for name in _SOMA_FACE)
        made[:, H36M17.index("nose")] = (left_eye + right_eye) / 2
        made[:, H36M17.index("head")] = top
        derived = {"nose": "mean(LeftEye, RightEye)"}
    return made, derived


def is_ours(names: Sequence[str]) -> bool:
    """Whether these names of joints are H36M17's and maybe more, as in our own BVH files."""
    return set(H36M17.joints) <= set(names)


def h36m17(
    points: Mapping[str, np.ndarray], spine: np.ndarray, forward: np.ndarray, up: np.ndarray
) -> np.ndarray:
    """(T, 17, 3) from points by name (T, 3), metres: hips to wrists, the neck's ends as "neck" (below) and "head".

    spine: (T, S, 3) joints between pelvis and neck, from below; S may be 0. forward, up: (T, 3) the head's own axes.
    pelvis is mid-hips, spine lies 43 % of the way along the back, thorax a quarter up the neck, nose 5 cm in front
    of the neck's upper end and head (its top) 13 cm above that end.
    """
    hips = (points["l_hip"] + points["r_hip"]) / 2
    made = {
        "pelvis": hips,
        "spine": _along(np.concatenate([hips[:, None], spine, points["neck"][:, None]], axis=1), _SPINE),
        "thorax": (1 - _THORAX) * points["neck"] + _THORAX * points["head"],
        "nose": points["head"] + _NOSE_FORWARD_M * forward,
        "head": points["head"] + _CROWN_UP_M * up,
    }
    return np.stack([made.get(joint, points.get(joint)) for joint in H36M17.joints], axis=1)


def h36m17_named(joints: np.ndarray, names: list[str]) -> np.ndarray:
    """(T, 17, 3) from joints (T, J, 3), metres, by their names. InputError when a joint has no known name."""
    if is_ours(names):
        return joints[:, [names.index(joint) for joint in H36M17.joints]]
    points = {joint: joints[:, i] for joint, i in match(names).items()}
    # Nothing says where the head looks: straight ahead, along the neck and across the shoulders.
    up = unit(points["head"] - points["neck"])
    forward = unit(np.cross(points["l_shoulder"] - points["r_shoulder"], up))
    spine = [names.index(name) for name in _SPINE_NAMES if name in names]
    return h36m17(points, joints[:, spine], forward, up)


def h36m17_of_limbs(joints: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """(T, 17, 3) from joints (T, J, 3), metres, by their names: the legs, and the arms where they are there. The pelvis
    is mid-hips; all other joints are NaN. InputError without hips, knees and ankles."""
    if not (limbs := _limbs(names, LEG)):
        raise InputError(
            "wrong-content",
            f"Expected hips, knees and ankles under common names, got {', '.join(names[:40])}.",
        )
    made = np.full((len(joints), len(H36M17), 3), np.nan)
    made[:, H36M17.indices(tuple(limbs))] = joints[:, list(limbs.values())]
    made[:, H36M17.index("pelvis")] = (joints[:, limbs["l_hip"]] + joints[:, limbs["r_hip"]]) / 2
    return made


def match(names: Sequence[str]) -> dict[str, int]:
    """Position of hips, knees, ankles, shoulders, elbows, wrists, "neck" and "head" in a list of names.

    A name's case, separators and a prefix that all names share do not matter. InputError when a joint is not found.
    """
    at, limbs = _by_plain_name(names), _limbs(names, _LIMBS)
    neck = next((name for name in _NECKS if name in at), None)
    if limbs and neck and "head" in at:
        return limbs | {"neck": at[neck], "head": at["head"]}
    raise InputError(
        "wrong-content",
        "Expected a skeleton with hips, knees, ankles, shoulders, elbows, wrists, neck and head under common names, "
        f"got {', '.join(names[:40])}.",
    )


def _by_plain_name(names: Sequence[str]) -> dict[str, int]:
    """Position by a name's letters and digits alone, without a prefix that all share; the first of equal names."""
    plain = [re.sub(r"[^a-z0-9]", "", name.rpartition(":")[2].lower()) for name in names]
    shared = len(os.path.commonprefix(plain))  # noqa: RUF071 (characters are meant, these are no paths)
    return {name[shared:]: i for i, name in reversed(list(enumerate(plain)))}


def _limbs(names: Sequence[str], parts: Sequence[str]) -> dict[str, int]:
    """Position of each joint of the limbs, of the first program of whose names all these parts of both sides are there;
    none where there is no such program."""
    at = _by_plain_name(names)
    for words in _WORDS:
        for sides in _SIDES:
            limbs = {
                f"{side}_{joint}": at[pattern.format(word)]
                for side, pattern in sides.items()
                for joint, word in zip(_LIMBS, words, strict=True)
                if pattern.format(word) in at
            }
            if all(f"{side}_{part}" in limbs for side in "lr" for part in parts):
                return limbs
    return {}


def _head_axes(
    rest: Mapping[str, np.ndarray], at: Mapping[str, np.ndarray], R_world_from_head: np.ndarray
) -> np.ndarray:
    """(2, 3) forward and up in the head's own axes, of points by name at rest (3,) and in the take (T, 3).

    A pose at rest that is a standing body tells them, unless the take contradicts it. Many rigs' is none: there each
    bone lies along an axis of its own. Then it is the axes next to where the trunk faces and points in the take.
    """
    R_head_from_world = np.swapaxes(R_world_from_head, -1, -2)
    left, up = _across_and_along(at)
    usual = rotate(R_head_from_world, np.stack([np.cross(left, up), up], axis=1)).mean(axis=0)
    left, up = (_nearest_axis(v) for v in _across_and_along(rest))
    axes = np.stack([np.cross(left, up), up])
    if _stands(rest, left, up) and (axes * usual).sum() > 0:
        return axes
    up = _nearest_axis(usual[1])
    return np.stack([_nearest_axis(usual[0] - (usual[0] @ up) * up), up])


def _across_and_along(at: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """(..., 3) unit vectors to the left and up the trunk."""
    left = unit(at["l_hip"] - at["r_hip"]) + unit(at["l_shoulder"] - at["r_shoulder"])
    return unit(left), unit(at["neck"] - (at["l_hip"] + at["r_hip"]) / 2)


def _stands(rest: Mapping[str, np.ndarray], left: np.ndarray, up: np.ndarray) -> bool:
    """Whether points by name are those of a body that stands along `up`, its left side on the left (3,)."""
    pairs = [("r_hip", "l_hip", left), ("r_shoulder", "l_shoulder", left), ("l_hip", "neck", up)]
    pairs += [(f"{s}_{a}", f"{s}_{b}", up) for s in "lr" for a, b in (("knee", "hip"), ("ankle", "knee"))]
    return all(unit(rest[end] - rest[start]) @ axis > _ALONG_AXIS for start, end, axis in pairs)


def _nearest_axis(v: np.ndarray) -> np.ndarray:
    """The coordinate axis (3,) next to v: a pose at rest stands along the file's axes, its hips lean a little."""
    axis = np.zeros(3)
    axis[np.abs(v).argmax()] = np.sign(v[np.abs(v).argmax()])
    return axis


def _along(path: np.ndarray, share: float) -> np.ndarray:
    """The point (T, 3) a share of the way along a path of points (T, P, 3), by the lengths of the first frame that has
    all of them."""
    whole = path[is_finite(path).all(axis=1).argmax()]
    length = np.linalg.norm(np.diff(whole, axis=0), axis=-1)
    before = np.concatenate([[0.0], np.cumsum(length)])
    i = int(np.clip(np.searchsorted(before, share * before[-1], side="right") - 1, 0, len(length) - 1))
    t = (share * before[-1] - before[i]) / max(length[i], 1e-9)
    return (1 - t) * path[:, i] + t * path[:, i + 1]


def unit_by_legs(leg: float, units: Iterable[str] = UNITS) -> str:
    """The unit in which a leg (thigh and shank) of that length is an adult's. InputError when none or several fit."""
    fits = [unit for unit in units if LEG_M[0] <= leg * UNITS[unit] <= LEG_M[1]]
    if len(fits) != 1:
        raise InputError(
            "needs-input",
            f"legs of {leg:.4g} do not show which unit of {', '.join(units)} it is; give it with unit=UNIT (-O "
            "unit=cm, of a comparison --unit cm).",
        )
    return fits[0]


def leg_length(joints: np.ndarray, layout: Layout = H36M17) -> float:
    """Thigh and shank of joints (T, J, 3), the median over the frames that have them and the mean of both sides."""
    legs = joints[:, layout.indices([f"{side}_{joint}" for side in "lr" for joint in LEG])]
    bones = np.linalg.norm(np.diff(legs.reshape(len(joints), 2, 3, 3), axis=2), axis=-1)
    return float(np.nanmedian(bones, axis=0).sum(axis=-1).mean())


def upright_share(joints: np.ndarray) -> float:
    """Share of frames of joints (T, 17, 3), +Z up, whose head is above both feet by half a leg; of those that know the
    head and both legs, NaN where none does. Where no frame has the head, the middle of the hips stands for it."""
    top = "head" if np.isfinite(joints[:, H36M17.index("head")]).any() else "pelvis"
    legs = tuple(f"{side}_{joint}" for side in "lr" for joint in LEG)
    joints = joints[np.isfinite(joints[:, H36M17.indices((top, *legs))]).all(axis=(1, 2))]
    if not len(joints):
        return float("nan")
    highest, feet = joints[:, H36M17.index(top), 2], joints[:, H36M17.indices(("l_ankle", "r_ankle")), 2]
    return float((highest > feet.max(axis=1) + leg_length(joints) / 2).mean())
