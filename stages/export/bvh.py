"""skeleton.bvh: the joints as an animated skeleton, for animation programs.

The form is that of Meredith & Maddock, Motion Capture File Formats Explained, Univ. of Sheffield CS-01-11.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...pipeline.core.notices import Notice
from ...pipeline.core.rotations import zxy_deg
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ...pipeline.files.skeletons import Skeleton
from .armature import BoneNames, armature

_ROTATIONS = "Zrotation Xrotation Yrotation"  # a joint turns about its z, then about its own turned x and y
_STUB = 0.25  # End Sites, which close every chain, are as long as this share of the bone before them


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
        *_lines(replace(animated.skeleton, names=animated.bones), 0, ""),
        "MOTION",
        f"Frames: {len(body)}",
        f"Frame Time: {1 / animated.fps:.9f}",
    ]
    with whole_file(path) as partial, open(partial, "w", encoding="ascii", newline="\n") as file:
        file.write("\n".join(head) + "\n")
        np.savetxt(file, np.round(body, 6) + 0.0, fmt="%.6f")
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
