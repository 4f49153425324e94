"""The trunk's coordinates of angles.mot: they pose a body with OpenSim's axes, whose back does not bend, so that its
joints are as in TRC."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.pipeline import LEVEL
from pcnet3d.pipeline.core.rotations import rotate
from pcnet3d.pipeline.signals.angles import UNTRUSTED
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.export.markers import OPENSIM, markers
from pcnet3d.stages.export.opensim import write_mot

# Rajagopal2016.osim: hip_r and hip_l in the pelvis, metres.
HIP_IN_PELVIS = np.array([-0.0563, -0.0785, 0.0773])
TURNS = ("trunk_tilt", "trunk_list", "trunk_rotation")


@pytest.fixture
def written(tmp_path):
    """written(take): the columns of its MOT file by name, and the file."""

    def make(take):
        path = tmp_path / "angles.mot"
        write_mot(take, path)
        lines = path.read_text().splitlines()
        end = lines.index("endheader")
        rows = np.array([line.split("\t") for line in lines[end + 2 :]], float)
        return dict(zip(lines[end + 1].split("\t"), rows.T, strict=True)), path

    return make


def turned(take, R_level_from_before):
    """The take with its filtered joints turned about the origin, and the angles of that."""
    path = take.filtered
    moved = path.with_(
        joints=rotate(R_level_from_before, path.joints),
        path=replace(path.path, points=rotate(R_level_from_before, path.root)),
    )
    return take.with_(filtered=moved)


def in_opensim(take):
    """(T, 3) by joint, in OpenSim's axes."""
    found = markers(take, OPENSIM)
    return dict(zip(found.names, np.moveaxis(found.joints, 1, 0), strict=True))


def lengths(at):
    """Half of the hips' distance and the thigh's length, of joints (T, 3), whose bones are rigid."""
    half = np.linalg.norm(at["r_hip"] - at["l_hip"], axis=1) / 2
    thigh = np.linalg.norm(at["r_knee"] - at["r_hip"], axis=1)
    assert np.ptp(half) < 1e-4
    assert np.ptp(thigh) < 1e-4
    return half[0], thigh[0]


# About LEVEL's x (back), y (right) and z (up): as the walker is; leaning and turned; turned round; upside down.
ATTITUDES = [(0, 0, 0), (12, -20, 35), (-8, 15, 170), (20, 130, -80)]


@pytest.mark.parametrize("attitude", ATTITUDES)
def test_hips_and_knees_are_where_the_angles_say(walked, written, attitude):
    """Rotations of the ground's z, the body's x and y; of hips z, x (right) and -x (left): Rajagopal2016.osim."""
    take = Angles()(walked())
    take = turned(take, Rotation.from_euler("xyz", attitude, degrees=True).as_matrix())
    found, _ = written(take)
    at, (half, thigh) = in_opensim(take), lengths(in_opensim(take))
    R = Rotation.from_euler("ZXY", np.stack([found[name] for name in TURNS], axis=1), degrees=True)
    origin = np.stack([found[f"trunk_t{axis}"] for axis in "xyz"], axis=1)
    for side, out in (("r", 1), ("l", -1)):
        hip = origin + R.apply(HIP_IN_PELVIS * (1, 1, 0) + (0, 0, out * half))
        np.testing.assert_allclose(hip, at[f"{side}_hip"], atol=2e-5)
        flexion, adduction = found[f"{side}_thigh_trunk_flexion"], out * found[f"hip_adduction_{side}"]
        of_hip = Rotation.from_euler("ZX", np.stack([flexion, adduction], axis=1), degrees=True)
        knee = hip + (R * of_hip).apply([0, -thigh, 0])
        np.testing.assert_allclose(knee, at[f"{side}_knee"], atol=5e-5)


@pytest.mark.parametrize(
    ("name", "axis", "turn", "change"),
    [
        ("trunk_tilt", "right", -10, -10),  # forward: z is right, and turns x, which is forward, up
        ("trunk_list", "back", -10, 10),  # to the right: x is forward, and turns up to the right
        ("trunk_rotation", "up", 10, 10),  # to the left: y is up
    ],
)
def test_signs_are_those_of_opensim(walked, written, name, axis, turn, change):
    take = Angles()(walked())
    before, _ = written(take)
    R = Rotation.from_euler("xyz"[LEVEL.axes.index(axis)], turn, degrees=True)
    after, _ = written(turned(take, R.as_matrix()))
    ahead = np.abs(before["trunk_rotation"]) < 2  # tilt and list are about the ground's axes then
    assert (after[name] - before[name])[ahead].mean() == pytest.approx(change, abs=0.5)


def test_gaps_are_those_of_the_lines_against_gravity(gappy, written):
    take = Angles()(gappy)
    reason = np.array(take.kinematics["pelvis_obliquity_reason"])
    reason[90:95] = UNTRUSTED
    take = take.with_(kinematics={**take.kinematics, "pelvis_obliquity_reason": reason})
    found, _ = written(take)
    gone = np.zeros(120, bool)
    gone[:4] = gone[60:70] = gone[90:95] = True
    for name in (*TURNS, "trunk_tx", "trunk_ty", "trunk_tz"):
        np.testing.assert_array_equal(np.isnan(found[name]), gone)


def test_a_turn_on_the_spot_goes_on_beyond_180_degrees(walked, written):
    take = Angles()(walked())
    path, angles = take.filtered, np.linspace(0, 700, len(take.poses))
    R = Rotation.from_euler("z", angles[:, None], degrees=True).as_matrix()
    spun = written(take.with_(filtered=path.with_(joints=rotate(R, path.joints))))[0]["trunk_rotation"]
    assert np.abs(np.diff(spun)).max() < 15
    np.testing.assert_allclose(spun - written(take)[0]["trunk_rotation"], angles, atol=10)


def test_without_a_path_the_trunk_turns_and_does_not_move(walked, written):
    take = Angles()(walked())
    found, _ = written(take.with_(filtered=take.filtered.with_(path=None)))
    assert set(TURNS) < set(found)
    assert "trunk_tx" not in found
