"""Layouts as data, and the remap by name."""

import numpy as np
import pytest

from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, InputError, Layout, PoseSequence, remap
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, COCO17, HALPE26, LAYOUTS, MPI3DHP17, layout_named
from refusals import refused

EVERY = pytest.mark.parametrize("layout", LAYOUTS.values(), ids=lambda layout: layout.name)


def numbered(layout: Layout, dims: int = 3) -> PoseSequence:
    """Every joint at a place of its own, its index on each axis."""
    joints = np.repeat(np.arange(len(layout), dtype=float)[None, :, None], dims, axis=2)
    return PoseSequence(
        joints, layout, CAMERA if dims == 3 else IMAGE, confidence=np.full((1, len(layout)), 0.5)
    )


@EVERY
def test_mirror_twice_is_identity_and_h36m17_is_reached_by_name(layout):
    np.testing.assert_array_equal(layout.mirror[layout.mirror], np.arange(len(layout)))
    for joint, partner in zip(layout.joints, layout.mirror, strict=True):
        assert (layout.joints[partner] != joint) == joint.startswith(("l_", "r_"))
    source = numbered(layout)
    result = remap(source)
    assert result.layout == H36M17
    for joint in H36M17.joints:
        if joint in layout:
            np.testing.assert_array_equal(result.joint(joint), source.joint(joint))
    assert np.isfinite(result.joints).all()


def test_the_binding_order():
    """design.md section 3 and formats.md section 1, order A."""
    right_leg, left_leg = ["r_hip", "r_knee", "r_ankle"], ["l_hip", "l_knee", "l_ankle"]
    assert H36M17.indices(["pelvis", *right_leg, *left_leg]) == list(range(7))
    arms = ["l_shoulder", "l_elbow", "l_wrist", "r_shoulder", "r_elbow", "r_wrist"]
    assert H36M17.indices(["spine", "thorax", "nose", "head", *arms]) == list(range(7, 17))


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("H36M17_B", [0, 4, 5, 6, 1, 2, 3, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]),
        ("H36M17_C", [0, 4, 5, 6, 1, 2, 3, 7, 8, 9, 10, 14, 15, 16, 11, 12, 13]),
        ("MPI3DHP17", [14, 8, 9, 10, 11, 12, 13, 15, 1, 16, 0, 5, 6, 7, 2, 3, 4]),  # formats.md section 7.3
    ],
)
def test_orders_of_formats_md(name, rows):
    np.testing.assert_array_equal(remap(numbered(layout_named(name))).joints[0, :, 0], rows)


def test_blazepose_as_formats_md_section_5_says():
    got = remap(numbered(BLAZEPOSE33)).joints[0, :, 0]
    pelvis, thorax = (23 + 24) / 2, (11 + 12) / 2
    expected = [pelvis, 24, 26, 28, 23, 25, 27, (pelvis + thorax) / 2, thorax, 0, 7.5, 11, 13, 15, 12, 14, 16]
    np.testing.assert_array_equal(got, expected)


def test_derived_joints_are_named_in_the_history_and_aliases_are_not():
    derived = remap(numbered(COCO17)).history[-1].options["derived"]
    assert [text.split(" = ")[0] for text in derived] == ["pelvis", "spine", "thorax", "head"]
    assert [t.split(" = ")[0] for t in remap(numbered(HALPE26)).history[-1].options["derived"]] == ["spine"]
    assert "head = mean(head_top)" not in remap(numbered(MPI3DHP17)).history[-1].options["derived"]


def test_a_derived_joint_is_as_missing_and_as_uncertain_as_its_parts():
    source = numbered(COCO17)
    joints, confidence = source.joints.copy(), source.confidence.copy()
    joints[0, COCO17.index("l_hip")] = np.nan
    confidence[0, COCO17.index("r_shoulder")] = 0.1
    result = remap(source.with_(joints=joints, confidence=confidence))
    assert np.isnan(result.joint("pelvis")).all()
    assert np.isnan(result.joint("spine")).all()
    assert result.confidence[0, H36M17.index("thorax")] == pytest.approx(0.1)


def test_unknown_names_are_refused_with_what_there_is():
    with pytest.raises(InputError, match="r_wrist"):
        H36M17.index("r_hand")
    with pytest.raises(InputError, match="COCO17"):
        layout_named("coco")
    with refused("bad-value"):
        Layout("BAD", ("nose", "nose"))
    with pytest.raises(InputError, match="pelvis"):
        remap(numbered(Layout("FACE", ("nose", "l_eye", "r_eye"))))
