"""skeleton.glb: the joints as an animated armature with a skin of plain bones in glTF 2.0's binary form, which
animation programs, game engines and viewers open.

Khronos Group, glTF 2.0 Specification (ISO/IEC 12113:2022): y up, z front, metres, quaternions as x, y, z, w.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.notices import Notice
from ...pipeline.core.pose import package_version
from ...pipeline.core.rotations import rotate, transpose, unit
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ...pipeline.files.skeletons import Skeleton
from ...pipeline.signals.filters import stretches
from ..drawing.provenance import provenance
from .armature import ANIMATION, Armature, BoneNames, armature

_TYPES = {np.dtype(np.float32): 5126, np.dtype(np.uint16): 5123, np.dtype(np.uint8): 5121}
_VERTICES, _INDICES = 34962, 34963  # what the bytes are for
_SHORTEST = 1e-6  # what is shorter has neither a direction nor a surface
# Of a bone's surface in its length: along it, and to two sides; triangles are counter-clockwise from outside.
_CORNERS = np.array(
    [(0, 0, 0), (0.15, 0.07, 0), (0.15, 0, 0.07), (0.15, -0.07, 0), (0.15, 0, -0.07), (1, 0, 0)]
)
_FACES = np.array(
    [(0, 2, 1), (0, 3, 2), (0, 4, 3), (0, 1, 4), (5, 1, 2), (5, 2, 3), (5, 3, 4), (5, 4, 1)], np.uint16
)


def write_glb(take: Take, path: Path, names: BoneNames = "joints") -> tuple[Notice, ...]:
    """An armature of one joint node for each joint, named so, at rest in the T-pose, its y axis along its bone; the
    animation turns them, and moves the pelvis where its path is known, in the take's unit of length from 0 s on. One
    mesh with the bones' surfaces is its skin.
    asset.extras holds the provenance, and in which frames, from the first to before the last number, the turn of a
    joint's bone about its own length is guessed. names: of joints or of Mixamo's bones.

    Returns notes on what was held, left out and guessed. Raises as `armature` does.
    """
    animated = armature(take, names)
    frame = ANIMATION.with_(origin="below the first pelvis, where the feet are lowest", unit=animated.unit)
    arrays, skeleton = _Arrays(), animated.skeleton
    armature_node, body_node = len(skeleton.names), len(skeleton.names) + 1
    R_scene_from_rest = _rest_axes(skeleton)
    content = {
        "asset": {
            "version": "2.0",
            "generator": f"pcnet3d {package_version()}",
            "extras": {"provenance": provenance(take, frame), "axial_guessed_frames": _guessed(animated)},
        },
        "scene": 0,
        "scenes": [{"name": take.name, "nodes": [armature_node, body_node]}],
        "nodes": [
            *_joint_nodes(animated, R_scene_from_rest),
            {"name": "armature", "children": [0]},
            {"name": "body", "mesh": 0, "skin": 0},
        ],
        "skins": [
            {
                "name": "armature",
                "inverseBindMatrices": arrays.add(
                    _inverse_binds(skeleton.rest + animated.rest_root, R_scene_from_rest)
                ),
                "joints": list(range(len(skeleton.names))),
                "skeleton": 0,
            }
        ],
        **_mesh(animated, arrays),
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
        for name, offset, turn in zip(animated.bones, offsets, turns, strict=True)
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


def _guessed(animated: Armature) -> dict[str, list[list[int]]]:
    """By bone the spans of frames in which its turn about its own length is guessed."""
    return {
        bone: stretches(~known).tolist()
        for bone, known in zip(animated.bones, animated.axial_known.T, strict=True)
        if not known.all()
    }


def _mesh(animated: Armature, arrays: _Arrays) -> dict[str, Any]:
    """The skin: the surfaces of all bones that have a length, each turned by the joint where it begins. Without normals
    programs draw their faces flat."""
    skeleton = animated.skeleton
    rest = skeleton.rest + animated.rest_root
    long = np.linalg.norm(skeleton.offsets, axis=1) > _SHORTEST
    ends = [joint for joint, parent in enumerate(skeleton.parents) if parent >= 0 and long[joint]]
    starts = [skeleton.parents[joint] for joint in ends]
    surfaces = [
        rest[start] + _surface(skeleton.offsets[end]) for start, end in zip(starts, ends, strict=True)
    ]
    points = np.concatenate(surfaces).astype(np.float32)
    turned_by = np.zeros((len(points), 4), np.uint8)
    turned_by[:, 0] = np.repeat(starts, len(_CORNERS))
    faces = np.concatenate([_FACES + np.uint16(i * len(_CORNERS)) for i in range(len(ends))])
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


def _surface(bone: np.ndarray) -> np.ndarray:
    """(V, 3) the corners of a bone's surface from 0 to `bone` (3,)."""
    along = unit(bone)
    across = unit(np.cross(along, np.eye(3)[np.abs(along).argmin()]))
    R_rest_from_bone = np.stack([along, across, np.cross(along, across)], axis=-1)
    return rotate(R_rest_from_bone, np.linalg.norm(bone) * _CORNERS)


def _animation(animated: Armature, R_scene_from_rest: np.ndarray, arrays: _Arrays) -> dict[str, Any]:
    """Channels and samplers."""
    parents = animated.skeleton.parents
    time = arrays.add((np.arange(len(animated.root)) / animated.fps).astype(np.float32))
    moving = []
    if animated.moves:
        moving.append((0, "translation", arrays.add(animated.root.astype(np.float32))))
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
