"""ASF/AMC: axis blocks, Euler orders and units with known answers, and the same motion as a BVH file."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.acclaim import CMU, TWO, amc, asf, write_still
from golden.skeleton import SKELETON, bent, bvh
from pcnet3d.models.lab.mocap import asfamc
from pcnet3d.models.lab.mocap.convert import read_folder
from pcnet3d.pipeline import InputError
from refusals import refused


def two(axis="0 0 0", dof="rx", length=0.45, angle="deg"):
    return asfamc.parse_asf(TWO.format(axis=axis, dof=dof, length=length, angle=angle))


def pose(acclaim, text):
    return asfamc.pose(acclaim, asfamc.parse_amc(":DEGREES\n" + text, acclaim))


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


def test_the_root_moves_and_turns_about_fixed_axes_in_the_files_unit():
    joints, R = pose(two(), "1\nroot 1 2 3 90 0 90\none 0\n")
    np.testing.assert_allclose(joints[0, 0], np.array([1, 2, 3]) * 0.0254 / 0.45)
    # x first: y -> z; then z leaves it
    np.testing.assert_allclose(R[0, 0] @ [0, 1, 0], [0, 0, 1], atol=1e-12)
    assert two(length=1.0).metres == pytest.approx(0.0254)
    with refused("file-damaged", "degrees"):
        two(angle="rad")


def test_the_same_motion_as_bvh_gives_the_same_clip(tmp_path):
    """Random axis blocks; the BVH gets R = C M C^-1 as its own angles."""
    rng = np.random.default_rng(0)
    joints = list(SKELETON)
    axes = {joint: rng.uniform(-180, 180, 3).round(2) for joint in joints[1:]}
    angles = bent(20)
    frames, turned = [], np.zeros_like(angles)
    turned[:, 0] = Rotation.from_euler("xyz", angles[:, 0], degrees=True).as_euler("ZXY", degrees=True)
    for i, joint in enumerate(joints[1:], start=1):
        C, M = (Rotation.from_euler("xyz", of, degrees=True) for of in (axes[joint], angles[:, i]))
        turned[:, i] = (C * M * C.inv()).as_euler("ZXY", degrees=True)
    for frame in angles:
        root = [0, 0.9 * 0.45 / 0.0254, 0, *frame[0]]
        frames.append({"root": root, **{CMU[joint]: frame[i] for i, joint in enumerate(joints) if i}})
    (tmp_path / "07.asf").write_text(asf(axes))
    (tmp_path / "07_01.amc").write_text(amc(frames))
    (tmp_path / "07_01.bvh").write_text(bvh(turned, fps=120))
    (one,), (other,) = (
        read_folder(tmp_path, only=lambda file, kind=kind: file.suffix == kind) for kind in (".amc", ".bvh")
    )
    assert (one.name, one.subject, one.source, len(one)) == ("07_01", "07", "asfamc", 5)
    np.testing.assert_allclose(one.joints, other.joints, atol=2e-5)
    assert np.abs(angles).max() > 5


def test_the_subject_is_the_skeleton_and_a_motion_without_one_is_refused(tmp_path):
    acclaim = write_still(tmp_path / "acclaim")
    (clip,) = read_folder(acclaim)
    assert (clip.subject, clip.name) == ("HDM-tr", "HDM-tr_kick_1")
    (acclaim / "HDM_bd.asf").write_text("")
    (acclaim / "XY_1.amc").write_text((acclaim / "HDM_tr_kick_1.amc").read_text())
    with pytest.raises(InputError, match=r"\.asf"):
        asfamc.read(acclaim / "XY_1.amc")


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("HDM_tr.asf", lambda t: t.replace(":hierarchy", ":hierarchies"), "hierarchy"),
        ("HDM_tr.asf", lambda t: t.replace("root tolfemur", "lfoot tolfemur"), "damaged"),
        ("HDM_tr.asf", lambda t: t.replace("dof rx ry rz", "dof rx ry l", 1), "turn only"),
        ("HDM_tr.asf", lambda t: t.replace("lfemur", "thigh"), "skeleton"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("lfemur 0.0 0.0 0.0\n", "", 1), "lfemur"),
        ("HDM_tr_kick_1.amc", lambda t: t.replace("16.0", "much"), "damaged"),
        ("HDM_tr_kick_1.amc", lambda t: "", "frames"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, file, change, words):
    acclaim = write_still(tmp_path / "acclaim")
    (acclaim / file).write_text(change((acclaim / file).read_text()))
    with pytest.raises(InputError, match=words):
        asfamc.read(acclaim / "HDM_tr_kick_1.amc")
