"""Angle definitions: known answers, mirror symmetry, invariance, continuity, one axis for a hinge."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.rotations import rotate, transpose
from pcnet3d.pipeline.signals.angles import (
    ANGLES,
    MIDLINE,
    MIRRORED_SIGN,
    OF_BOTH,
    REASONS,
    angles,
    near,
    of_both,
)

FREE = [name for name, angle in ANGLES.items() if not angle.needs_gravity]
STANDING = {
    "pelvis": (0, 0, 0), "r_hip": (0, 0.1, 0), "r_knee": (0, 0.1, -0.4), "r_ankle": (0, 0.1, -0.8),
    "spine": (0, 0, 0.25), "thorax": (0, 0, 0.5), "nose": (-0.08, 0, 0.6), "head": (0, 0, 0.75),
    "r_shoulder": (0, 0.18, 0.5), "r_elbow": (0, 0.18, 0.2), "r_wrist": (0, 0.18, -0.05),
}  # fmt: skip
FORWARD, BACK, RIGHT, UP, DOWN = np.array(
    [(-1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1)], dtype=float
)


def standing(**bones):
    """(17, 3) in BODY: someone who stands straight with hanging arms; `bones` point a bone, such as r_elbow for the
    upper arm, somewhere else, and what hangs on it is carried along."""
    joints = {name: np.array(place, dtype=float) for name, place in STANDING.items()}
    mirrored = {"l" + name[1:]: place * (1, -1, 1) for name, place in joints.items() if name.startswith("r_")}
    joints |= mirrored
    parents = {child: parent for parent, child in H36M17.bones}
    for name, direction in bones.items():
        parent = parents[name]
        length = np.linalg.norm(joints[name] - joints[parent])
        moved = joints[parent] + length * np.asarray(direction) / np.linalg.norm(direction) - joints[name]
        for joint in below(name, parents):
            joints[joint] = joints[joint] + moved
    return np.array([joints[name] for name in H36M17.joints])


def below(name, parents):
    out = [name]
    for child, parent in parents.items():
        if parent == name:
            out += below(child, parents)
    return out


def between(a, b, degrees):
    """The direction that many degrees from a towards b, which is square to it."""
    return np.cos(np.radians(degrees)) * a + np.sin(np.radians(degrees)) * b


@pytest.fixture(scope="module")
def body(walk):
    return rotate(transpose(R_world_from_body(walk.world)), walk.world - walk.root[:, None])


SIGNS = [
    ({"r_ankle": between(DOWN, BACK, 70)}, "r_knee_flexion", 70),
    ({"r_ankle": between(DOWN, FORWARD, 8)}, "r_knee_flexion", -8),  # bent back a little
    ({"r_wrist": between(DOWN, FORWARD, 100)}, "r_elbow_flexion", 100),
    ({"r_wrist": between(DOWN, BACK, 8)}, "r_elbow_flexion", -8),
    ({"r_wrist": between(DOWN, -RIGHT, 90)}, "r_elbow_flexion", 90),  # hand on the belly
    ({"r_elbow": RIGHT, "r_wrist": RIGHT}, "r_elbow_flexion", 0),  # T-pose
    ({"r_elbow": RIGHT, "r_wrist": between(RIGHT, FORWARD, 90)}, "r_elbow_flexion", 90),
    (
        {"r_elbow": RIGHT, "r_wrist": between(RIGHT, UP, 15)},
        "r_elbow_flexion",
        13,
    ),  # half of it is out of plane
    ({"r_elbow": FORWARD, "r_wrist": between(FORWARD, UP, 40)}, "r_elbow_flexion", 40),
    ({"r_knee": between(DOWN, FORWARD, 90)}, "r_thigh_trunk_flexion", 90),
    ({"r_knee": between(DOWN, BACK, 20)}, "r_thigh_trunk_flexion", -20),
    ({"r_knee": between(DOWN, RIGHT, 30)}, "r_hip_abduction", 30),
    ({"r_elbow": between(DOWN, FORWARD, 178)}, "r_shoulder_flexion", 178),
    ({"r_elbow": between(DOWN, FORWARD, 185)}, "r_shoulder_flexion", 185),
    ({"r_elbow": between(DOWN, RIGHT, 80)}, "r_shoulder_abduction", 80),
    ({"r_elbow": between(DOWN, RIGHT, 150)}, "r_shoulder_elevation", 150),
    ({"spine": between(UP, FORWARD, 25), "thorax": between(UP, FORWARD, 25)}, "trunk_lean_sagittal", 25),
    ({"spine": between(UP, RIGHT, 25), "thorax": between(UP, RIGHT, 25)}, "trunk_lean_frontal", 25),
    ({"r_hip": between(RIGHT, UP, 5), "l_hip": between(-RIGHT, DOWN, 5)}, "pelvis_obliquity", 5),
    (
        {"r_shoulder": between(RIGHT, FORWARD, 30), "l_shoulder": between(-RIGHT, BACK, 30)},
        "thorax_pelvis_rotation",
        30,
    ),
    ({"r_knee": between(DOWN, FORWARD, 40)}, "r_thigh_sagittal", 40),
    ({"r_ankle": between(DOWN, BACK, 40)}, "r_shank_sagittal", -40),
    ({"r_elbow": between(DOWN, BACK, 40)}, "r_upper_arm_sagittal", -40),
]


def test_every_angle_has_a_known_sign_and_size():
    assert {of_both(name) for _, name, _ in SIGNS} == set(OF_BOTH), "add it to SIGNS"
    for bones, name, expected in SIGNS:
        assert angles(standing(**bones))[name] == pytest.approx(expected, abs=1.0)


def test_someone_who_stands_straight_has_no_angles():
    for name, value in angles(standing()).items():
        assert value == pytest.approx(0, abs=1e-9), name


def test_a_mirror_exchanges_the_sides():
    body = np.random.default_rng(0).normal(0, 0.1, (200, 17, 3)) + standing(r_elbow=RIGHT)
    mirrored = (body * (1, -1, 1))[:, H36M17.mirror]
    found, seen = angles(body), angles(mirrored)
    for name in ANGLES:
        other = name if name in MIDLINE else {"r": "l", "l": "r"}[name[0]] + name[1:]
        sign = -1 if name in MIRRORED_SIGN else 1
        np.testing.assert_allclose(
            near(seen[other] - sign * found[name], 0),
            0 * found[name],
            atol=1e-9,
            err_msg=f"{name}: does a mirror change its sign, as MIRRORED_SIGN says?",
        )


def test_angles_between_segments_do_not_depend_on_the_axes(body):
    turned = rotate(Rotation.random(len(body), rng=np.random.default_rng(1)).as_matrix(), 3.0 * body) + 7.0
    found, seen = angles(body), angles(turned)
    for name in FREE:
        np.testing.assert_allclose(near(seen[name] - found[name], 0), 0, atol=1e-8, err_msg=name)
    assert all(np.nanmax(np.abs(near(seen[n] - found[n], 0))) > 5 for n in ANGLES if ANGLES[n].needs_gravity)


def test_flexion_goes_on_through_180():
    raised = np.array([standing(r_elbow=between(DOWN, FORWARD, angle)) for angle in range(-40, 230, 2)])
    for name in ("r_shoulder_flexion", "r_upper_arm_sagittal"):
        np.testing.assert_allclose(angles(raised)[name], range(-40, 230, 2), atol=1e-9)


def test_a_straight_limb_of_noisy_joints_reads_straight_on_average():
    """An unsigned angle would read 8 degrees here."""
    noisy = standing() + np.random.default_rng(2).normal(0, 0.019, (4000, 17, 3))
    found = angles(noisy)
    thigh, shank = (
        noisy[:, H36M17.index(b)] - noisy[:, H36M17.index(a)]
        for a, b in (("r_hip", "r_knee"), ("r_knee", "r_ankle"))
    )
    cosine = (thigh * shank).sum(-1) / np.linalg.norm(thigh, axis=-1) / np.linalg.norm(shank, axis=-1)
    assert np.degrees(np.arccos(cosine)).mean() > 8
    assert abs(np.nanmean(found["r_knee_flexion"])) < 3


@pytest.mark.parametrize("turn", [-60, -30, 30, 60])
def test_a_bent_limb_keeps_its_angle_when_it_is_turned_about_itself(turn):
    """A projection on the plane square to the hip line would read 63 degrees at a turn of 60, not 75."""
    back = between(BACK, RIGHT, turn)
    assert angles(standing(r_ankle=between(DOWN, back, 75)))["r_knee_flexion"] == pytest.approx(75, abs=3)
    forward = between(FORWARD, RIGHT, turn)
    assert angles(standing(r_wrist=between(DOWN, forward, 75)))["r_elbow_flexion"] == pytest.approx(75, abs=3)


def test_the_elbow_has_an_axis_wherever_an_arm_can_point():
    """A small bend to the front, up or inwards reads as flexion all over the front and the side."""
    for azimuth in range(-30, 100, 10):  # from across the body to the side
        for height in range(-80, 90, 10):
            level = between(FORWARD, RIGHT, azimuth)
            arm = between(level, UP, height)
            found = angles(standing(r_elbow=arm, r_wrist=arm))["r_elbow_flexion"]
            assert found == pytest.approx(0, abs=1e-6), (azimuth, height)


def test_missing_joints_and_undefined_axes_are_nan(body):
    holed = body.copy()
    holed[:, H36M17.index("r_wrist")] = np.nan
    found = angles(holed)
    assert np.isnan(found["r_elbow_flexion"]).all()
    assert np.isfinite(found["l_elbow_flexion"]).all()
    out = angles(standing(r_elbow=RIGHT))
    assert np.isnan(out["r_shoulder_flexion"])  # an arm along the shoulder line has no flexion about it
    assert out["r_shoulder_abduction"] == pytest.approx(90)
    assert out["r_shoulder_elevation"] == pytest.approx(90)


def test_definitions_name_their_joints():
    assert set(REASONS) == {*range(8)} - {6}  # which stood for a reason that is gone
    for name, angle in ANGLES.items():
        body = standing()[None].repeat(17, 0)
        body[np.arange(17), np.arange(17)] = np.nan
        lost = np.isnan(angles(body)[name])
        assert {H36M17.joints[i] for i in np.flatnonzero(lost)} == set(angle.joints), name


def test_an_arm_is_elevated_against_the_line_that_its_words_name():
    body = np.random.default_rng(0).normal(size=(50, 17, 3))
    pelvis, thorax, right, left, elbow = (
        body[:, H36M17.index(name)] for name in ("pelvis", "thorax", "r_shoulder", "l_shoulder", "r_elbow")
    )
    across = (right - left) / np.linalg.norm(right - left, axis=-1, keepdims=True)
    down = pelvis - thorax
    down -= (down * across).sum(axis=-1, keepdims=True) * across
    arm = elbow - right
    share = (arm * down).sum(axis=-1) / np.linalg.norm(arm, axis=-1) / np.linalg.norm(down, axis=-1)
    found = angles(body)["r_shoulder_elevation"]
    known = np.isfinite(found)
    assert known.sum() > 30
    np.testing.assert_allclose(found[known], np.degrees(np.arccos(share[known])), atol=1e-5)
    assert "trunk line made perpendicular to the shoulder line" in ANGLES["r_shoulder_elevation"].definition
