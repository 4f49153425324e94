"""Acclaim skeletons and motions: the golden skeleton as CMU names it."""

from pathlib import Path

import numpy as np

from golden.skeleton import SKELETON

HEAD = """# made by a test
:version 1.10
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   begin of nothing
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
"""
# The joints that begin a bone, as CMU names them, by the joints of the golden skeleton.
CMU = {
    "spine": "thorax", "neck": "lowerneck", "head": "head",
    **{f"{s}_{a}": f"{s}{b}" for s in "lr" for a, b in (
        ("hip", "femur"), ("knee", "tibia"), ("ankle", "foot"),
        ("shoulder", "humerus"), ("elbow", "radius"), ("wrist", "wrist"),
    )},
}  # fmt: skip


def asf(axes):
    """The golden skeleton as ASF: a bone ends where its first child begins; others hang on bones without freedom."""
    bones, hierarchy = [], {}

    def bone(name, offset, dof, parent, axis):
        length = np.linalg.norm(offset)
        direction = np.asarray(offset) / (length or 1) if length else (0, 1, 0)
        block = [f"name {name}", f"direction {' '.join(map(repr, map(float, direction)))}"]
        block += [f"length {float(length) * 0.45 / 0.0254!r}", f"axis {' '.join(map(str, axis))} XYZ"]
        bones.append("\n".join([" begin", *block, *(["dof rx ry rz"] if dof else []), " end"]))
        hierarchy.setdefault(parent, []).append(name)

    # A helper bone leads from each joint to each of its children; the child's own bone has no length.
    for joint, (parent, offset) in SKELETON.items():
        if parent is None:
            continue
        above = "root" if parent == "hips" else CMU[parent]
        bone(f"to{CMU[joint]}", offset, False, above, (0, 0, 0))
        bone(CMU[joint], (0, 0, 0), True, f"to{CMU[joint]}", axes[joint])
    lines = ["begin", *(f" {parent} {' '.join(children)}" for parent, children in hierarchy.items()), "end"]
    return HEAD + ":bonedata\n" + "\n".join(bones) + "\n:hierarchy\n" + "\n".join(lines) + "\n"


def amc(frames):
    lines = [":FULLY-SPECIFIED", ":DEGREES"]
    for i, frame in enumerate(frames, start=1):
        lines += [
            str(i),
            *(f"{name} {' '.join(map(repr, map(float, values)))}" for name, values in frame.items()),
        ]
    return "\n".join(lines) + "\n"


def write_still(folder: Path) -> Path:
    """A skeleton and a motion of four frames at rest, in a folder as HDM05's, which is made."""
    folder.mkdir()
    (folder / "HDM_tr.asf").write_text(asf({joint: np.zeros(3) for joint in SKELETON}))
    rest = {"root": [0, 16, 0, 0, 0, 0], **{name: [0, 0, 0] for name in CMU.values()}}
    (folder / "HDM_tr_kick_1.amc").write_text(amc([rest] * 4))
    return folder
