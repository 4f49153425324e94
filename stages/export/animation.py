"""The filtered joints as an animated skeleton, bones of fixed lengths, a T-pose at rest, a rotation for each joint; and
the files that hold it, for animation programs, game engines and viewers.

Two joints give a bone's direction, and a limb that bends its axis: so a bone's turn about itself is that of the knee's
and the elbow's angle (pipeline/signals/angles.py), a guess while the limb is straight. How shoulders, head and hands
turn about themselves is not in 17 joints.

BVH: Meredith & Maddock, Motion Capture File Formats Explained, Univ. of Sheffield CS-01-11. GLB: glTF 2.0's binary form
(Khronos Group, glTF 2.0 Specification, ISO/IEC 12113:2022), y up, z front, metres, quaternions as x, y, z, w.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.anthropometry import ANKLE_HEIGHT, implied_stature
from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import Frame
from ...pipeline.core.layouts import FEET
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import package_version
from ...pipeline.core.rotations import from_columns, is_finite, known_median, rotate, transpose, unit, zxy_deg
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ...pipeline.files.names import BoneNames
from ...pipeline.files.skeletons import Skeleton
from ...pipeline.signals.angles import arm_reference, hinge_axis, trunk_axes
from ..drawing.facts import provenance
from .markers import evenly, write_numbers

ANIMATION = Frame("ANIMATION", "level", ("left", "up", "front"))  # glTF's axes, and those of most BVH files

# Parent by joint, each parent before its children. Four have no length and only turn what hangs on them: a bone's
# direction is that of two joints, and where three bones meet no single rotation gives all of them.
_PARENTS = {
    "pelvis": "",
    "r_hip": "pelvis", "r_knee": "r_hip", "r_ankle": "r_knee",
    "r_heel": "r_ankle", "r_big_toe": "r_ankle", "r_small_toe": "r_ankle",
    "l_hip": "pelvis", "l_knee": "l_hip", "l_ankle": "l_knee",
    "l_heel": "l_ankle", "l_big_toe": "l_ankle", "l_small_toe": "l_ankle",
    "lower_back": "pelvis", "spine": "lower_back", "thorax": "spine", "neck": "thorax", "nose": "neck", "head": "nose",
    "l_clavicle": "thorax", "l_shoulder": "l_clavicle", "l_elbow": "l_shoulder", "l_wrist": "l_elbow",
    "r_clavicle": "thorax", "r_shoulder": "r_clavicle", "r_elbow": "r_shoulder", "r_wrist": "r_elbow",
}  # fmt: skip
# Mixamo's names of bones, by which other programs move its characters; a heel has none. Without its namespace,
# mixamorig: of a name with a colon three.js' BVHLoader loses the motion.
_MIXAMO = {
    "pelvis": "Hips", "lower_back": "Spine", "spine": "Spine1", "thorax": "Spine2", "neck": "Neck", "nose": "Head",
    "head": "HeadTop_End",
} | {
    f"{word[0].lower()}_{joint}": word + bone
    for word in ("Right", "Left")
    for joint, bone in {
        "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "big_toe": "ToeBase",
        "clavicle": "Shoulder", "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand",
    }.items()
}  # fmt: skip
_X, _Y, _Z = np.eye(3)
_ALONG = 0.05  # of a unit vector across another, below which it does not tell the turn about that
_LOWEST = 2.0  # per cent of the frames whose feet are lower than the floor: noise's
_ROTATIONS = "Zrotation Xrotation Yrotation"  # a joint turns about its z, then about its own turned x and y
_STUB = 0.25  # End Sites, which close every chain, are as long as this share of the bone before them
_TYPES = {np.dtype(np.float32): 5126, np.dtype(np.uint16): 5123, np.dtype(np.uint8): 5121}
_VERTICES, _INDICES = 34962, 34963  # what the bytes are for
_SHORTEST = 1e-6  # what is shorter has neither a direction nor a surface
# Of a bone's surface in its length, the bone along y; triangles are counter-clockwise from outside.
_CORNERS = np.array(
    [(0, 0, 0), (0, 0.15, 0.07), (0.07, 0.15, 0), (0, 0.15, -0.07), (-0.07, 0.15, 0), (0, 1, 0)]
)
_FACES = np.array(
    [(0, 2, 1), (0, 3, 2), (0, 4, 3), (0, 1, 4), (5, 1, 2), (5, 2, 3), (5, 3, 4), (5, 4, 1)], np.uint16
)


@dataclass(frozen=True, eq=False)
class Armature:
    """A skeleton and its motion, in ANIMATION: x left, y up, z front of the person at rest.

    skeleton: the T-pose, its joints named as in files; offsets in `unit`, "m" or "arbitrary". R_parent_from_joint:
    (N, J, 3, 3). root: (N, 3) the pelvis, above the origin in the first frame; y = 0 is where the feet are lowest.
    rest_root: (3,) the pelvis of the T-pose that stands on y = 0. held: by joint, and of the pelvis path, in how many
    frames it is not known and keeps the last value before, or the first of all. time_s: (N,) seconds of the take,
    evenly spaced at fps; frames without a pose at both ends are left out.
    """

    skeleton: Skeleton
    R_parent_from_joint: np.ndarray
    root: np.ndarray
    rest_root: np.ndarray
    held: Mapping[str, int]
    time_s: np.ndarray
    fps: float
    unit: str

    def notes(self, file: str) -> tuple[Notice, ...]:
        """What a reader of a file of it has to know that the file itself does not show."""
        notices = []
        if round(self.time_s[0], 3):
            notices.append(notice("file-begins", file=file, begin_s=float(self.time_s[0])))
        for count in dict.fromkeys(filter(None, self.held.values())):
            joints = ", ".join(name for name, held in self.held.items() if held == count)
            values: dict[str, Any] = {"held": count, "frames": len(self.root), "joints": joints}
            notices.append(notice("animation-held", file=file, **values))
        return (*notices, notice("axial-guessed", file=file))


def armature(take: Take, called: BoneNames = "joints") -> Armature:
    """The take's filtered joints as an animated skeleton, its bones by the names of our joints or of Mixamo's.

    Bones have their median lengths, so joints lie where the take has them but for what its bones change; hips, nose,
    head and feet have their median place at rest. A joint that never has a bone is left out with all that hangs on it.
    InputError for a take without filtered joints, of a single frame, and without one in which pelvis, hips and spine
    are known.
    """
    even = evenly(take, ANIMATION)
    if len(even.time_s) < 2:
        raise InputError(
            "nothing-usable", "Expected two frames or more, to animate a skeleton; the take has one."
        )
    at = dict(zip(even.names, np.moveaxis(even.joints, 1, 0), strict=True))
    R_world = bone_rotations(at)
    rows = np.flatnonzero(is_finite(R_world["pelvis"]).all(axis=-1))
    if not len(rows):
        raise InputError(
            "nothing-usable",
            "Expected a frame in which pelvis, hips and spine are known, to animate a skeleton; the take has none, "
            "or is too short to be smoothed.",
        )
    kept = slice(int(rows[0]), int(rows[-1]) + 1)
    skeleton = _skeleton(_offsets(at, R_world))
    names, parents = skeleton.names, skeleton.parents
    R = np.stack([R_world[name] for name in names], axis=1)[kept]
    local = np.concatenate([R[:, :1], transpose(R[:, parents[1:]]) @ R[:, 1:]], axis=1)
    known = np.asarray(np.isfinite(local).all(axis=(-2, -1)))
    for i in range(len(names)):
        if i in parents:
            local[:, i] = _held(local[:, i], known[:, i], np.eye(3))
        else:  # what turns nothing has nothing to be known
            local[:, i], known[:, i] = np.eye(3), True
    place = np.zeros((len(even.joints), 3)) if even.root is None else even.root
    stature = implied_stature(even.joints)
    floor = (_soles(at, stature) + place[:, 1])[kept]
    height = float(np.nanpercentile(floor, _LOWEST)) if np.isfinite(floor).any() else 0.0
    place_known = is_finite(place[kept])
    place = _held(place[kept], place_known, np.zeros(3))
    moved = np.array([place[0, 0], height, place[0, 2]])
    at_rest = dict.fromkeys(at, np.full((1, 3), np.nan)) | dict(
        zip(names, skeleton.rest[:, None], strict=True)
    )
    standing = -np.nan_to_num(_soles(at_rest, stature)[0])
    bones = tuple(_MIXAMO.get(name, name) for name in names) if called == "mixamo" else names
    unknown = [*(~known).sum(axis=0).tolist(), int((~place_known).sum())]
    return Armature(
        replace(skeleton, names=bones),
        local,
        place - moved,
        standing * _Y,
        dict(zip((*bones, "the pelvis path"), unknown, strict=True)),
        even.time_s[kept],
        even.fps,
        even.unit,
    )


def _skeleton(offsets: dict[str, np.ndarray]) -> Skeleton:
    """The joints that have an offset, as all joints between them and the pelvis have."""
    names: list[str] = []
    for name, above in _PARENTS.items():
        if name in offsets and (not above or above in names):
            names.append(name)
    parents = tuple(names.index(_PARENTS[name]) if _PARENTS[name] else -1 for name in names)
    return Skeleton(tuple(names), parents, np.stack([offsets[name] for name in names]))


def bone_rotations(at: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """R_world_from_joint (N, 3, 3) by joint, the identity in the T-pose, NaN where unknown. at: (N, 3) by joint, in
    ANIMATION."""
    left_hip, left_shoulder = (unit(at[f"l_{part}"] - at[f"r_{part}"]) for part in ("hip", "shoulder"))
    trunk = unit(at["thorax"] - at["pelvis"])
    R = {
        "pelvis": _turned((_X, _Y), (left_hip, at["spine"] - at["pelvis"])),
        "lower_back": _turned((_Y, _X), (at["spine"] - at["pelvis"], left_hip)),
        "spine": _turned((_Y, _X), (at["thorax"] - at["spine"], left_hip + left_shoulder)),
        "thorax": _turned((_X, _Y), (left_shoulder, trunk)),
    }
    thorax = trunk_axes(-left_shoulder.T, trunk.T)
    for side, out in (("r", -1.0), ("l", 1.0)):
        hip, knee, ankle, shoulder, elbow, wrist = (
            at[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
        )
        axis = _hinge(knee - hip, ankle - knee, left_hip)
        R[f"{side}_hip"] = _turned((-_Y, _X), (knee - hip, axis))
        R[f"{side}_knee"] = _turned((-_Y, _X), (ankle - knee, axis))
        R[f"{side}_ankle"] = R[f"{side}_knee"]
        feet = [point for point in FEET.joints if point[0] == side and point in at]
        if {f"{side}_heel", f"{side}_big_toe"} <= set(feet):
            heel = at[f"{side}_heel"]
            R[f"{side}_ankle"] = _turned((_Z, _Y), (at[f"{side}_big_toe"] - heel, ankle - heel))
            R |= {point: R[f"{side}_ankle"] for point in feet}
        reference = arm_reference(unit(elbow - shoulder).T, -left_shoulder.T, *thorax, -out).T
        axis = _hinge(elbow - shoulder, wrist - elbow, reference)
        R[f"{side}_clavicle"] = _turned((out * _X, _Y), (shoulder - at["thorax"], trunk))
        R[f"{side}_shoulder"] = _turned((out * _X, -out * _Y), (elbow - shoulder, axis))
        R[f"{side}_elbow"] = _turned((out * _X, -out * _Y), (wrist - elbow, axis))
        R[f"{side}_wrist"] = R[f"{side}_elbow"]
    neck, crown = at["nose"] - at["thorax"], at["head"] - at["nose"]
    R["neck"] = _turned((_sagittal(neck, R["thorax"]), _X), (neck, left_shoulder))
    R["nose"] = _turned((_sagittal(crown, R["thorax"]), _X), (crown, left_shoulder))
    R["head"] = R["nose"]
    return R


def _offsets(at: dict[str, np.ndarray], R_world: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """(3,) each joint from its parent in the T-pose; joints that never have one are left out."""
    offsets = dict.fromkeys(("pelvis", "lower_back", "neck", "r_clavicle", "l_clavicle"), np.zeros(3))
    for side, out in (("r", -1.0), ("l", 1.0)):
        offsets |= {
            f"{side}_{joint}": _length(at[f"{side}_{joint}"] - at[above]) * along
            for joint, above, along in (
                ("knee", f"{side}_hip", -_Y),
                ("ankle", f"{side}_knee", -_Y),
                ("shoulder", "thorax", out * _X),
                ("elbow", f"{side}_shoulder", out * _X),
                ("wrist", f"{side}_elbow", out * _X),
            )
        }
        offsets[f"{side}_hip"] = _median(at[f"{side}_hip"] - at["pelvis"], R_world["pelvis"])
        for point in FEET.joints:
            if point[0] == side and point in R_world:
                offsets[point] = _median(at[point] - at[f"{side}_ankle"], R_world[f"{side}_ankle"])
    for joint, above in (("spine", "pelvis"), ("thorax", "spine")):
        offsets[joint] = _length(at[joint] - at[above]) * _Y
    for joint, above in (("nose", "thorax"), ("head", "nose")):
        bone = at[joint] - at[above]
        offsets[joint] = _length(bone) * _sagittal(bone, R_world["thorax"])
    return {name: offset for name, offset in offsets.items() if np.isfinite(offset).all()}


def _turned(rest: tuple[np.ndarray, np.ndarray], now: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """(N, 3, 3) the rotation that takes the first direction of `rest` (3,) to that of `now` (N, 3), and the second one
    as near as it can; NaN where one is missing or both point the same way."""
    return _axes(*now) @ transpose(_axes(*rest))


def _hinge(upper: np.ndarray, lower: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """(N, 3) the limb's axis; where the lower bone is missing, what it would be of a straight limb."""
    axis = hinge_axis(unit(upper).T, unit(lower).T, reference.T).T
    return np.where(is_finite(axis)[:, None], axis, reference)


def _axes(along: np.ndarray, beside: np.ndarray) -> np.ndarray:
    along, beside = unit(along), unit(beside)
    across = beside - (beside * along).sum(axis=-1, keepdims=True) * along
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    across = across / np.where(length > _ALONG, length, np.nan)
    return from_columns(along, across, np.cross(along, across))


def _sagittal(bone: np.ndarray, R_world_from_thorax: np.ndarray) -> np.ndarray:
    """(3,) the bone's median direction in the thorax's own axes, neither to the left nor to the right."""
    return unit(_median(unit(bone), R_world_from_thorax) * (0, 1, 1))


def _median(points: np.ndarray, R_world_from_joint: np.ndarray) -> np.ndarray:
    """(3,) the median of points (N, 3) in a joint's own axes; NaN of none."""
    in_joint = rotate(transpose(R_world_from_joint), points[:, None])[:, 0]
    in_joint = in_joint[is_finite(in_joint)]
    return np.median(in_joint, axis=0) if len(in_joint) else np.full(3, np.nan)


def _length(bone: np.ndarray) -> float:
    """The median length of a bone (N, 3); NaN where it is never there."""
    return known_median(np.linalg.norm(bone, axis=-1))


def _held(values: np.ndarray, known: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """values (N, ...) with the last known one in rows that are not known (N,), before the first one that; `otherwise`
    where none is known."""
    if not known.any():
        return np.broadcast_to(otherwise, values.shape)
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), -1))
    return values[np.where(last < 0, np.argmax(known), last)]


def _soles(at: dict[str, np.ndarray], stature: float) -> np.ndarray:
    """(N,) how high above the pelvis the lower sole is, negative in standing; NaN where no foot is known."""
    feet = [at[point][:, 1] for point in FEET.joints if point in at]
    return np.fmin.reduce(feet or [at[f"{side}_ankle"][:, 1] - ANKLE_HEIGHT * stature for side in "rl"])


def write_bvh(take: Take, path: Path, names: BoneNames = "joints") -> tuple[Notice, ...]:
    """The hierarchy in its T-pose, x left, y up and z front, in the take's unit of length; then a line a frame: the
    place of the pelvis, and of each joint the rotations about z, x and y in degrees, R = R_z R_x R_y.

    names: of joints or of Mixamo's bones. A BVH file knows no gaps: returns notes on what was held there, left out and
    guessed. Raises as `armature` does.
    """
    animated = armature(take, names)
    body = np.concatenate(
        [animated.root, _angles(animated.R_parent_from_joint).reshape(len(animated.root), -1)], axis=1
    )
    head = [
        "HIERARCHY",
        *_lines(animated.skeleton, 0, ""),
        "MOTION",
        f"Frames: {len(body)}",
        f"Frame Time: {1 / animated.fps:.9f}",
    ]
    write_numbers(path, head, np.round(body, 6) + 0.0, between=" ")
    return animated.notes(path.name)


def _angles(R: np.ndarray) -> np.ndarray:
    """(N, J, 3) degrees about z, x and y of R (N, J, 3, 3). Two triples give one rotation: the one nearer to that of
    the frame before, and without whole turns between them, since programs draw and smooth these as curves."""
    angles = zxy_deg(R.reshape(-1, 3, 3)).reshape(*R.shape[:2], 3)
    for before, now in pairwise(angles):
        for other in (now.copy(), (now + 180) * (1, -1, 1) + (0, 360, 0)):
            near = other - 360 * np.round((other - before) / 360)
            better = np.abs(near - before).sum(axis=1) < np.abs(now - before).sum(axis=1)
            now[better] = near[better]
    return angles


def _lines(skeleton: Skeleton, joint: int, indent: str) -> Iterator[str]:
    """A joint of the hierarchy with all that hangs on it."""
    root = skeleton.parents[joint] < 0
    children = [i for i, parent in enumerate(skeleton.parents) if parent == joint]
    yield f"{indent}{'ROOT' if root else 'JOINT'} {skeleton.names[joint]}"
    yield f"{indent}{{"
    yield f"{indent}\tOFFSET {_numbers(skeleton.offsets[joint])}"
    yield f"{indent}\tCHANNELS {'6 Xposition Yposition Zposition' if root else '3'} {_ROTATIONS}"
    for child in children:
        yield from _lines(skeleton, child, indent + "\t")
    if not children:
        yield f"{indent}\tEnd Site"
        yield f"{indent}\t{{"
        yield f"{indent}\t\tOFFSET {_numbers(_STUB * skeleton.offsets[joint])}"
        yield f"{indent}\t}}"
    yield f"{indent}}}"


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.6f}" for value in np.round(values, 6) + 0.0)  # no -0


def write_glb(take: Take, path: Path, names: BoneNames = "joints") -> tuple[Notice, ...]:
    """An armature of one joint node for each joint, named so, at rest in the T-pose, its y axis along its bone; the
    animation turns them and moves the pelvis, in the take's unit of length from 0 s on. One mesh with the bones'
    surfaces is its skin.
    asset.extras holds the provenance. names: of joints or of Mixamo's bones.

    Returns notes on what was held, left out and guessed. Raises as `armature` does.
    """
    animated = armature(take, names)
    frame = ANIMATION.with_(origin="below the first pelvis, where the feet are lowest", unit=animated.unit)
    arrays, skeleton = _Arrays(), animated.skeleton
    rest, R_scene_from_rest = skeleton.rest + animated.rest_root, _rest_axes(skeleton)
    joints = list(range(len(rest)))
    binds = arrays.add(_inverse_binds(rest, R_scene_from_rest))
    content = {
        "asset": {
            "version": "2.0",
            "generator": f"pcnet3d {package_version()}",
            "extras": {"provenance": provenance(take, frame)},
        },
        "scene": 0,
        "scenes": [{"name": take.name, "nodes": [len(joints), len(joints) + 1]}],
        "nodes": [
            *_joint_nodes(animated, R_scene_from_rest),
            {"name": "armature", "children": [0]},
            {"name": "body", "mesh": 0, "skin": 0},
        ],
        "skins": [{"name": "armature", "inverseBindMatrices": binds, "joints": joints, "skeleton": 0}],
        **_mesh(skeleton, rest, arrays),
        "animations": [{"name": take.name, **_animation(animated, R_scene_from_rest, arrays)}],
        "accessors": arrays.accessors,
        "bufferViews": arrays.views,
        "buffers": [{"byteLength": len(arrays.content)}],
    }
    text = json.dumps(content, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    chunks = (b"JSON", text), (b"BIN\0", bytes(arrays.content))
    body = b"".join(struct.pack("<I", len(data)) + kind + data for kind, data in chunks)
    with whole_file(path) as partial:
        partial.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    return animated.notes(path.name)


class _Arrays:
    """A file's arrays: accessors, views of its bytes, and the bytes."""

    def __init__(self) -> None:
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self.content = bytearray()

    def add(self, values: np.ndarray, target: int | None = None) -> int:
        """The number of the accessor of values (N,), (N, D), or (N, 4, 4) matrices."""
        rows = values.reshape(len(values), -1)
        kind = {1: "SCALAR", 2: f"VEC{rows.shape[1]}", 3: f"MAT{values.shape[-1]}"}[values.ndim]
        view = {"buffer": 0, "byteOffset": len(self.content), "byteLength": values.nbytes}
        self.views.append(view if target is None else {**view, "target": target})
        self.content += values.tobytes()
        self.content += bytes(-len(self.content) % 4)
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": _TYPES[values.dtype],
                "count": len(values),
                "type": kind,
                "min": rows.min(axis=0).tolist(),
                "max": rows.max(axis=0).tolist(),
            }
        )
        return len(self.accessors) - 1


def _rest_axes(skeleton: Skeleton) -> np.ndarray:
    """R_scene_from_rest (J, 3, 3) of the joints in the T-pose. Programs draw a joint's bone along its y axis: so that
    is along the longest bone that begins there, at a limb's end as at the joint before it. Pelvis and thorax, on which
    joints without a length hang, stay upright. Knees and elbows bend about their x axis."""
    axes = [np.eye(3)]
    for joint, parent in enumerate(skeleton.parents[1:], 1):
        bones = [skeleton.offsets[i] for i, above in enumerate(skeleton.parents) if above == joint]
        lengths = [float(np.linalg.norm(bone)) for bone in bones]
        if not bones:
            axes.append(axes[parent])
        else:
            axes.append(_turn_to(bones[int(np.argmax(lengths))]) if min(lengths) > _SHORTEST else np.eye(3))
    return np.stack(axes)


def _turn_to(bone: np.ndarray) -> np.ndarray:
    """(3, 3) the smallest rotation of the y axis to the direction of `bone` (3,); downwards about the x axis."""
    from scipy.spatial.transform import Rotation

    x, y, _ = np.eye(3)
    axis = np.cross(y, unit(bone))
    sine = np.linalg.norm(axis)
    axis = axis / sine if sine > _SHORTEST else x
    return Rotation.from_rotvec(np.arctan2(sine, unit(bone) @ y) * axis).as_matrix()


def _joint_nodes(animated: Armature, R_scene_from_rest: np.ndarray) -> list[dict[str, Any]]:
    """A node for each joint, at rest."""
    skeleton, root = animated.skeleton, animated.rest_root
    above = R_scene_from_rest[np.maximum(skeleton.parents, 0)]
    offsets = rotate(transpose(above), np.concatenate([root[None], skeleton.offsets[1:]])[:, None])[:, 0]
    turns = _quaternions(transpose(above) @ R_scene_from_rest)
    nodes: list[dict[str, Any]] = [
        {"name": name, "translation": offset.tolist(), "rotation": turn.tolist()}
        for name, offset, turn in zip(skeleton.names, offsets, turns, strict=True)
    ]
    for joint, parent in enumerate(skeleton.parents[1:], 1):
        nodes[parent].setdefault("children", []).append(joint)
    return nodes


def _inverse_binds(rest: np.ndarray, R_scene_from_rest: np.ndarray) -> np.ndarray:
    """(J, 4, 4) from the scene's axes to those of joints at rest (J, 3), column by column, as glTF stores matrices."""
    columns = np.tile(np.eye(4, dtype=np.float32), (len(rest), 1, 1))
    columns[:, :3, :3] = R_scene_from_rest  # the columns of its inverse
    columns[:, 3, :3] = -rotate(transpose(R_scene_from_rest), rest[:, None])[:, 0]
    return columns


def _mesh(skeleton: Skeleton, rest: np.ndarray, arrays: _Arrays) -> dict[str, Any]:
    """The skin: the surfaces of all bones that have a length, each turned by the joint where it begins. Without normals
    programs draw their faces flat. rest: (J, 3) the joints in the T-pose."""
    long = np.linalg.norm(skeleton.offsets, axis=1) > _SHORTEST
    ends = [joint for joint, parent in enumerate(skeleton.parents) if parent >= 0 and long[joint]]
    starts = [skeleton.parents[joint] for joint in ends]
    bones = skeleton.offsets[ends]
    surfaces = np.linalg.norm(bones, axis=1)[:, None, None] * rotate(
        np.stack([*map(_turn_to, bones)]), _CORNERS
    )
    points = (rest[starts][:, None] + surfaces).reshape(-1, 3).astype(np.float32)
    turned_by = np.zeros((len(points), 4), np.uint8)
    turned_by[:, 0] = np.repeat(starts, len(_CORNERS))
    faces = np.concatenate([_FACES + np.uint16(first) for first in range(0, len(points), len(_CORNERS))])
    primitive = {
        "attributes": {
            "POSITION": arrays.add(points, _VERTICES),
            "JOINTS_0": arrays.add(turned_by, _VERTICES),
            "WEIGHTS_0": arrays.add(np.tile(np.eye(1, 4, dtype=np.float32), (len(points), 1)), _VERTICES),
        },
        "indices": arrays.add(faces.ravel(), _INDICES),
        "material": 0,
    }
    material = {"name": "bone", "pbrMetallicRoughness": {"metallicFactor": 0.0}}
    return {"meshes": [{"name": "body", "primitives": [primitive]}], "materials": [material]}


def _animation(animated: Armature, R_scene_from_rest: np.ndarray, arrays: _Arrays) -> dict[str, Any]:
    """Channels and samplers."""
    parents = animated.skeleton.parents
    time = arrays.add((np.arange(len(animated.root)) / animated.fps).astype(np.float32))
    moving = [(0, "translation", arrays.add(animated.root.astype(np.float32)))]
    for joint in sorted(set(parents[1:])):
        above = R_scene_from_rest[max(parents[joint], 0)]
        R = above.T @ animated.R_parent_from_joint[:, joint] @ R_scene_from_rest[joint]
        moving.append((joint, "rotation", arrays.add(_continuous(_quaternions(R)))))
    return {
        "channels": [
            {"sampler": i, "target": {"node": node, "path": what}} for i, (node, what, _) in enumerate(moving)
        ],
        "samplers": [{"input": time, "output": values, "interpolation": "LINEAR"} for _, _, values in moving],
    }


def _quaternions(R: np.ndarray) -> np.ndarray:
    """(N, 4) x, y, z, w of R (N, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_quat().astype(np.float32)


def _continuous(turns: np.ndarray) -> np.ndarray:
    """Quaternions (N, 4) of the same rotations, each on the same side as the one before."""
    flips = np.cumprod(np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0, np.float32(-1), np.float32(1)))
    return np.concatenate([turns[:1], turns[1:] * flips[:, None]])
