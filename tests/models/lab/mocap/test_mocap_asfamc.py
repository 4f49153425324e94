"""ASF/AMC: axis blocks, Euler orders and units with known answers, and the same motion as a BVH file."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.skeleton import SKELETON, bent, bvh
from pcnet3d.models.lab.mocap import asfamc as mocap_asfamc
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.reading.mocap import bvh as mocap_bvh
from pcnet3d.pipeline.reading.mocap.common import How

TWO = """# made by a test
:version 1.10
:units
  mass 1.0
  length {length}
  angle {angle}
:documentation
   begin of nothing
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name one
     direction 0 1 0
     length 2
     axis {axis} XYZ
     dof {dof}
     limits (-1 1)
  end
  begin
     id 2
     name two
     direction 1 0 0
     length 1
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root one
    one two
  end
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
    head = TWO[: TWO.index(":bonedata")].format(length=0.45, angle="deg")
    return head + ":bonedata\n" + "\n".join(bones) + "\n:hierarchy\n" + "\n".join(lines) + "\n"


def amc(frames):
    lines = [":FULLY-SPECIFIED", ":DEGREES"]
    for i, frame in enumerate(frames, start=1):
        lines += [
            str(i),
            *(f"{name} {' '.join(map(repr, map(float, values)))}" for name, values in frame.items()),
        ]
    return "\n".join(lines) + "\n"


def two(axis="0 0 0", dof="rx", length=0.45, angle="deg"):
    return mocap_asfamc.parse_asf(TWO.format(axis=axis, dof=dof, length=length, angle=angle))


def pose(acclaim, text):
    return mocap_asfamc.pose(acclaim, *mocap_asfamc.parse_amc(":DEGREES\n" + text, acclaim))


@pytest.mark.parametrize(
    ("axis", "dof", "values", "end"),
    [
        # The bone "two" hangs at the end of "one", which points up from the root: its beginning tells one's turn.
        ("0 0 0", "rx", "90", (0, 0, 2)),
        ("0 0 0", "rz", "90", (-2, 0, 0)),
        ("0 0 90", "rx", "90", (0, 2, 0)),  # the bone's x is the skeleton's y: it turns about itself
        ("0 90 0", "rx", "90", (2, 0, 0)),  # x is -z
        ("90 0 90", "rz", "90", (0, 0, 2)),  # x first, then z: z goes to -y, then to +x
        ("0 0 0", "rx ry rz", "90 90 0", (2, 0, 0)),  # x first: y -> z; then y: z -> x
        ("0 0 0", "rx ry rz", "90 0 90", (0, 0, 2)),
    ],
)
def test_axis_blocks_and_euler_order(axis, dof, values, end):
    acclaim = two(axis, dof)
    joints, _ = pose(acclaim, f"1\nroot 0 0 0 0 0 0\none {values}\n")
    assert acclaim.skeleton.names == ("root", "one", "two")
    np.testing.assert_allclose(joints[0, 2], np.array(end) * 0.0254 / 0.45, atol=1e-9)


def test_the_root_moves_and_turns_about_fixed_axes():
    joints, R = pose(two(), "1\nroot 1 2 3 90 0 90\none 0\n")
    np.testing.assert_allclose(joints[0, 0], np.array([1, 2, 3]) * 0.0254 / 0.45)
    np.testing.assert_allclose(
        R[0, 0] @ [0, 1, 0], [0, 0, 1], atol=1e-12
    )  # x first: y -> z; then z leaves it


def test_units():
    assert two(length=0.45).metres == pytest.approx(0.056444, abs=1e-6)
    assert two(length=1.0).metres == pytest.approx(0.0254)
    assert (
        mocap_asfamc.parse_asf(TWO.format(axis="0 0 0", dof="rx", length=0.45, angle="deg"), 0.01).metres
        == 0.01
    )
    quarter = np.pi / 2
    radians = two(dof="rx", angle="rad", axis=f"0 0 {quarter}")
    motion = mocap_asfamc.parse_amc(f"1\nroot 0 0 0 0 0 0\none {quarter}\n", radians)
    assert not motion[1]
    np.testing.assert_allclose(mocap_asfamc.pose(radians, *motion)[0][0, 2], [0, 0.112889, 0], atol=1e-6)


def test_the_same_motion_as_bvh_gives_the_same_clip(tmp_path):
    """Random axis blocks; the BVH gets R = C M C^-1 as its own angles."""
    rng = np.random.default_rng(0)
    joints = list(SKELETON)
    axes = {joint: rng.uniform(-180, 180, 3).round(2) for joint in joints[1:]}
    angles = bent(20)
    frames, turned = [], np.zeros_like(angles)
    turned[:, 0] = Rotation.from_euler("xyz", angles[:, 0], degrees=True).as_euler("ZXY", degrees=True)
    for i, joint in enumerate(joints[1:], start=1):
        C = Rotation.from_euler("xyz", axes[joint], degrees=True)
        turned[:, i] = (C * Rotation.from_euler("xyz", angles[:, i], degrees=True) * C.inv()).as_euler(
            "ZXY", degrees=True
        )
    for frame in angles:
        root = [0, 0.9 * 0.45 / 0.0254, 0, *frame[0]]
        frames.append({"root": root, **{CMU[joint]: frame[i] for i, joint in enumerate(joints) if i}})
    (tmp_path / "07.asf").write_text(asf(axes))
    (tmp_path / "07_01.amc").write_text(amc(frames))
    (tmp_path / "07_01.bvh").write_text(bvh(turned))
    one = mocap_asfamc.read(tmp_path / "07_01.amc", tmp_path, How())
    other = mocap_bvh.read(tmp_path / "07_01.bvh", tmp_path, How())
    assert (one.clip.name, one.clip.subject, one.clip.source, one.clip.fps) == ("07_01", "07", "asfamc", 120)
    np.testing.assert_allclose(one.clip.joints, other.clip.joints, atol=2e-5)
    assert np.abs(angles).max() > 5


@pytest.fixture
def cmu(tmp_path):
    axes = {joint: np.zeros(3) for joint in SKELETON}
    (tmp_path / "HDM_tr.asf").write_text(asf(axes))
    rest = {"root": [0, 16, 0, 0, 0, 0], **{name: [0, 0, 0] for name in CMU.values()}}
    (tmp_path / "HDM_tr_kick_1.amc").write_text(amc([rest] * 4))
    return tmp_path


def test_the_subject_is_the_skeleton(cmu):
    clip = mocap_asfamc.read(cmu / "HDM_tr_kick_1.amc", cmu, How()).clip
    assert (clip.subject, clip.name) == ("HDM-tr", "HDM-tr_kick_1")
    assert mocap_asfamc.read(cmu / "HDM_tr_kick_1.amc", cmu, How(fps=60)).clip.fps == 60
    assert (
        mocap_asfamc.read(cmu / "HDM_tr_kick_1.amc", cmu, How(subject=r"HDM_([a-z]+)")).clip.subject == "tr"
    )


def test_a_motion_without_its_skeleton_is_refused(cmu):
    (cmu / "HDM_bd.asf").write_text("")
    (cmu / "XY_1.amc").write_text((cmu / "HDM_tr_kick_1.amc").read_text())
    with pytest.raises(InputError, match=r"\.asf"):
        mocap_asfamc.read(cmu / "XY_1.amc", cmu, How())


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("HDM_tr.asf", lambda t: t.replace(":hierarchy", ":hierarchies"), "hierarchy"),
        ("HDM_tr.asf", lambda t: t.replace("direction", "direction x", 1), "damaged"),
        ("HDM_tr.asf", lambda t: t.replace("root tolfemur", "lfoot tolfemur"), "damaged"),
        ("HDM_tr.asf", lambda t: t.replace("dof rx ry rz", "dof rx ry l", 1), "turn only"),
        ("HDM_tr.asf", lambda t: t.replace("lfemur", "thigh"), "skeleton"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("lfemur 0.0 0.0 0.0", "lfemur 0.0", 1), "lfemur"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("lfemur 0.0 0.0 0.0\n", "", 1), "lfemur"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("lfemur", "tail"), "tail"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("16.0", "much"), "damaged"),
        ("HDM_tr_kick_1.amc", lambda t: "", "frames"),
    ],
)
def test_a_damaged_file_is_refused(cmu, file, change, words):
    (cmu / file).write_text(change((cmu / file).read_text()))
    with pytest.raises(InputError, match=words):
        mocap_asfamc.read(cmu / "HDM_tr_kick_1.amc", cmu, How())
