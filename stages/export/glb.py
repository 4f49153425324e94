"""skeleton.glb: the joints as an animated skeleton in glTF 2.0's binary form, which viewers and game engines open.

Khronos Group, glTF 2.0 Specification (ISO/IEC 12113:2022): y up, z front, metres, quaternions as x, y, z, w.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.files.atomic import whole_file
from ...pipeline.pose import package_version
from ...pipeline.take import Event, Take
from ..drawing.palette import LEFT, MIDDLE, RIGHT, Colour
from .armature import Armature, armature
from .provenance import provenance

_TYPES = {np.dtype(np.float32): 5126, np.dtype(np.uint16): 5123}
_VERTICES, _INDICES = 34962, 34963  # what the bytes are for
_MATERIALS = {"left": LEFT, "right": RIGHT, "middle": MIDDLE}
# A bone is two pyramids foot to foot: its ends are corners 0 and 5, outer faces go counter-clockwise.
_FACES = [(0, 1 + (i + 1) % 4, 1 + i) for i in range(4)] + [(5, 1 + i, 1 + (i + 1) % 4) for i in range(4)]
_WIDTH, _WAIST = 0.09, 0.2  # of a bone's length: half its width, and where along it that is


def write_glb(take: Take, path: Path) -> tuple[Event, ...]:
    """One node a joint, named so, at rest in the T-pose; its animation turns them and moves the pelvis, in the take's
    unit of length from 0 s on. Bones hang on the joints as small meshes; while a joint's rotation or that of one above
    it is not known, they have no size. asset.extras holds the provenance, the unit, the second of the take at which
    the file begins, where its origin is, and in how many frames of which joint what was last known is held.

    Returns notes on what was held and left out. Raises as `armature` does.
    """
    found = armature(take)
    arrays, skeleton = _Arrays(), found.skeleton
    count = len(skeleton.names)
    indices = arrays.add(np.array(_FACES, np.uint16).ravel(), _INDICES)
    nodes: list[dict[str, Any]] = [
        {"name": name, "translation": offset.tolist()}
        for name, offset in zip(skeleton.names, skeleton.offsets, strict=True)
    ]
    nodes[0]["translation"] = found.root[0].tolist()
    meshes: list[dict[str, Any]] = []
    bones: list[tuple[int, int]] = []  # node of a bone, joint that turns it
    for joint, parent in enumerate(skeleton.parents[1:], 1):
        nodes[parent].setdefault("children", []).append(joint)
        if not skeleton.offsets[joint].any():
            continue
        name = f"{skeleton.names[parent]} to {skeleton.names[joint]}"
        corners = arrays.add(_corners(skeleton.offsets[joint]), _VERTICES)
        nodes[parent]["children"].append(len(nodes))
        bones.append((len(nodes), parent))
        nodes.append({"name": name, "mesh": len(meshes)})
        side = {"l": "left", "r": "right"}.get(skeleton.names[joint].partition("_")[0], "middle")
        surface = {
            "attributes": {"POSITION": corners},
            "indices": indices,
            "material": list(_MATERIALS).index(side),
        }
        meshes.append({"name": name, "primitives": [surface]})
    time = arrays.add((np.arange(len(found.root)) / found.fps).astype(np.float32))
    moving = [(0, "translation", time, arrays.add(found.root.astype(np.float32)), "LINEAR")]
    for joint in range(count):
        if joint in skeleton.parents:
            turns = arrays.add(_quaternions(found.R_parent_from_joint[:, joint]))
            moving.append((joint, "rotation", time, turns, "LINEAR"))
    moving += _hidden(found, bones, arrays)
    content = {
        "asset": {
            "version": "2.0",
            "generator": f"pcnet3d {package_version()}",
            "extras": _extras(take, found),
        },
        "scene": 0,
        "scenes": [{"name": take.name, "nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(name, colour) for name, colour in _MATERIALS.items()],
        "animations": [
            {
                "name": take.name,
                "channels": [
                    {"sampler": i, "target": {"node": node, "path": what}}
                    for i, (node, what, *_) in enumerate(moving)
                ],
                "samplers": [
                    {"input": at, "output": values, "interpolation": between}
                    for _, _, at, values, between in moving
                ],
            }
        ],
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
    return found.notes(path.name)


class _Arrays:
    """A file's arrays: accessors, views of its bytes, and the bytes."""

    def __init__(self) -> None:
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self.content = bytearray()

    def add(self, values: np.ndarray, target: int | None = None) -> int:
        """The number of the accessor of values (N,) or (N, D)."""
        view = {"buffer": 0, "byteOffset": len(self.content), "byteLength": values.nbytes}
        self.views.append(view if target is None else {**view, "target": target})
        self.content += values.tobytes()
        self.content += bytes(-len(self.content) % 4)
        rows = values.reshape(len(values), -1)
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": _TYPES[values.dtype],
                "count": len(values),
                "type": "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}",
                "min": rows.min(axis=0).tolist(),
                "max": rows.max(axis=0).tolist(),
            }
        )
        return len(self.accessors) - 1


def _corners(bone: np.ndarray) -> np.ndarray:
    """(6, 3) of a bone from 0 to `bone` (3,)."""
    least = np.eye(3)[np.abs(bone).argmin()]
    across = np.cross(bone, least) / np.linalg.norm(np.cross(bone, least))
    other = np.cross(bone / np.linalg.norm(bone), across)
    width = _WIDTH * np.linalg.norm(bone)
    waist = [_WAIST * bone + width * way for way in (across, other, -across, -other)]
    return np.array([np.zeros(3), *waist, bone], np.float32)


def _quaternions(R: np.ndarray) -> np.ndarray:
    """(N, 4) x, y, z, w of R (N, 3, 3), each on the same side as the one before."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_matrix(R).as_quat()
    flips = np.cumprod(np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    turns[1:] *= flips[:, None]
    return turns.astype(np.float32)


def _hidden(
    found: Armature, bones: list[tuple[int, int]], arrays: _Arrays
) -> Iterator[tuple[int, str, int, int, str]]:
    """Channels that give the bones no size while they are not known."""
    known = found.known.copy()
    for joint, parent in enumerate(found.skeleton.parents[1:], 1):
        known[:, joint] &= known[:, parent]
    for node, joint in bones:
        shown = known[:, joint]
        if shown.all():
            continue
        rows = np.concatenate([[0], np.flatnonzero(np.diff(shown.astype(int))) + 1])
        size = np.repeat(shown[rows, None].astype(np.float32), 3, axis=1)
        yield node, "scale", arrays.add((rows / found.fps).astype(np.float32)), arrays.add(size), "STEP"


def _extras(take: Take, found: Armature) -> dict[str, Any]:
    return {
        "provenance": provenance(take),
        "length_unit": found.unit,
        "begins_s": float(found.time_s[0]),
        "fps": found.fps,
        "origin": found.moved.tolist(),
        "frames": len(found.root),
        "held_frames": found.held,
    }


def _material(name: str, colour: Colour) -> dict[str, Any]:
    part = np.array(colour) / 255
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)  # IEC 61966-2-1
    surface = {"baseColorFactor": [*linear.tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}
    return {"name": name, "pbrMetallicRoughness": surface}
