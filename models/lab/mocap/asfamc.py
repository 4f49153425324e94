"""Acclaim skeletons and motions (ASF/AMC), as CMU and HDM05 give them.

A bone's motion M turns it about its own axes C, which `axis` turns from the skeleton's at rest: R = C M C^-1, behind
its parent's R (Lander, Working with Motion Capture File Formats, Game Developer 1/1998). Angles are about fixed axes
in the order written. Lengths are inches over the skeleton's `length` unit (CMU's FAQ: 0.45), +Y is up.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....pipeline.core.errors import InputError, readable
from ....pipeline.core.rotations import transpose
from ....pipeline.files.markers import z_up
from ....pipeline.files.skeletons import Skeleton, h36m17_of_skeleton, place

FPS = 120.0  # of CMU and HDM05; the files do not say it
_INCH_M = 0.0254
_BONE = re.compile(r"^\s*begin\s*$(.*?)^\s*end\s*$", re.M | re.S)


@dataclass(frozen=True, eq=False)
class Acclaim:
    """An ASF file. skeleton: joints where bones begin, the root first, metres. C: (J, 3, 3) each bone's own axes.
    dofs: by bone, what an AMC line says, for example ("rx", "rz"). metres: one unit of the file."""

    skeleton: Skeleton
    C: np.ndarray
    dofs: dict[str, tuple[str, ...]]
    metres: float


def read(path: Path) -> tuple[np.ndarray, str]:
    """(T, 17, 3) joints of an AMC file, metres, +Z up, and the name of its skeleton: the ASF file beside it whose name
    its own begins with, or the only one. InputError without."""
    skeletons = sorted(path.parent.glob("*.[aA][sS][fF]"))
    named = [file for file in skeletons if path.stem.lower().startswith(file.stem.lower())]
    if not named and len(skeletons) != 1:
        raise InputError("needs-input", "expected its .asf skeleton in the same folder.")
    skeleton_file = max(named, key=lambda file: len(file.stem)) if named else skeletons[0]
    acclaim = parse_asf(_text(skeleton_file))
    joints, R = pose(acclaim, parse_amc(_text(path), acclaim))
    return z_up(h36m17_of_skeleton(acclaim.skeleton, joints, R)[0], "y"), skeleton_file.stem


def _text(path: Path) -> str:
    """Without comments; InputError when the file cannot be read as text."""
    with readable(path, "motion capture"):
        return re.sub(r"^\s*#.*$", "", path.read_text(encoding="utf-8", errors="replace"), flags=re.M)


def parse_asf(text: str) -> Acclaim:
    """The skeleton of an ASF file. InputError for what is no ASF, and for bones that slide or turn in radians."""
    sections = {m[1]: m[2] for m in re.finditer(r"^:(\w+)(.*?)(?=^:|\Z)", text, re.M | re.S)}
    try:
        units, root = _records(sections["units"]), _records(sections["root"])
        metres = _INCH_M / float(units.get("length", ["1"])[0])
        bones = {bone["name"][0]: bone for bone in map(_records, _BONE.findall(sections["bonedata"]))}
        parent_of = {  # of whom each hangs on comes first
            child: words[0]
            for words in map(str.split, sections["hierarchy"].strip().splitlines())
            for child in words[1:]
        }
        names = ("root", *parent_of)
        parents = (-1, *(names.index(parent) for parent in parent_of.values()))
        own_axes = [root.get("orientation", ["0"] * 3) + root.get("axis", ["XYZ"])]
        own_axes += [bones[name].get("axis", ["0", "0", "0", "XYZ"]) for name in parent_of]
        C = np.stack([_turn(order, _numbers(angles)) for *angles, order in own_axes])
        offsets = metres * np.stack([_offset(bones.get(parent_of.get(name, ""))) for name in names])
        dofs = {name: tuple(map(str.lower, bone.get("dof", []))) for name, bone in bones.items()}
        if any(parent >= bone for bone, parent in enumerate(parents)):
            raise ValueError("a bone hangs on nothing")
        if not set().union(*dofs.values()) <= {"rx", "ry", "rz"}:
            raise ValueError("expected bones that turn only")
        if not units.get("angle", ["deg"])[0].lower().startswith("deg"):
            raise ValueError("expected angles in degrees")
        dofs["root"] = tuple(map(str.lower, root["order"]))
        if not {"tx", "ty", "tz"} <= {*dofs["root"]}:
            raise ValueError("expected a root that moves")
    except (ValueError, KeyError, IndexError) as error:
        raise InputError("file-damaged", f"the ASF skeleton is damaged: {error}.") from None
    return Acclaim(Skeleton(names, parents, offsets), C, dofs, metres)


def _records(section: str) -> dict[str, list[str]]:
    """{first word: the others} of every line."""
    return {words[0]: words[1:] for words in map(str.split, section.splitlines()) if words}


def _offset(parent: Mapping[str, list[str]] | None) -> np.ndarray:
    """(3,) from where a parent's bone begins to where it ends, which is where its children begin; 0 of the root."""
    if parent is None:
        return np.zeros(3)
    direction = _numbers(parent["direction"])
    return direction / np.linalg.norm(direction) * float(parent["length"][0])


def _numbers(words: Iterable[str]) -> np.ndarray:
    return np.array([float(word) for word in words])


def parse_amc(text: str, acclaim: Acclaim) -> dict[str, np.ndarray]:
    """By bone, (T, dofs) as the file has them, angles in degrees. InputError for what is no AMC of that skeleton."""
    lines: dict[str, list[list[str]]] = {}
    frames = 0
    for words in map(str.split, text.splitlines()):
        if len(words) == 1 and words[0].isdigit():
            frames += 1
        elif words and not words[0].startswith(":"):
            if len(words) - 1 != len(acclaim.dofs.get(words[0], ())):
                raise InputError(
                    "files-apart",
                    f"frame {frames}: '{words[0]}' does not fit its skeleton; another skeleton's file?",
                )
            lines.setdefault(words[0], []).append(words[1:])
    short = [name for name, rows in lines.items() if len(rows) != frames]
    if short or "root" not in lines:
        raise InputError(
            "file-damaged", f"expected {frames} frames of each bone: {', '.join(short) or 'root'}."
        )
    try:
        return {name: np.array(rows, dtype=float) for name, rows in lines.items()}
    except ValueError as error:
        raise InputError("file-damaged", f"the AMC file is damaged: {error}.") from None


def pose(acclaim: Acclaim, motion: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Joints (T, J, 3), metres, and R_world_from_joint (T, J, 3, 3)."""
    R = np.tile(np.eye(3), (len(motion["root"]), len(acclaim.skeleton.names), 1, 1))
    for i, name in enumerate(acclaim.skeleton.names):
        dofs = acclaim.dofs[name]
        if name in motion and (turns := [k for k, dof in enumerate(dofs) if dof[0] == "r"]):
            M = _turn("".join(dofs[k][1] for k in turns), motion[name][:, turns])
            R[:, i] = acclaim.C[i] @ M @ transpose(acclaim.C[i])
    moves = [acclaim.dofs["root"].index(f"t{axis}") for axis in "xyz"]
    return place(acclaim.skeleton, acclaim.metres * motion["root"][:, moves], R)


def _turn(order: str, angles: np.ndarray) -> np.ndarray:
    """(..., 3, 3) of angles (..., len(order)), degrees, about fixed axes, the first named one first."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler(order.lower(), angles, degrees=True).as_matrix()
