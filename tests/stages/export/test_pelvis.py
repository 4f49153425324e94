"""The trunk's coordinates of angles.mot: they pose a body with OpenSim's axes, whose back does not bend, so that its
joints are as in TRC."""

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
        joints=rotate(R_level_from_before, path.joints), root=rotate(R_level_from_before, path.root)
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


def test_opensim_poses_its_own_body_so(walked, written, tmp_path):
    """OpenSim's own kinematics of joints with the axes of Rajagopal2016.osim."""
    osim = pytest.importorskip("opensim", reason="OpenSim is not installed")
    take = turned(Angles()(walked()), Rotation.from_euler("xyz", ATTITUDES[1], degrees=True).as_matrix())
    found, path = written(take)
    at, (half, thigh) = in_opensim(take), lengths(in_opensim(take))
    (tmp_path / "legs.osim").write_text(_written_model(half, thigh))
    model = osim.Model(str(tmp_path / "legs.osim"))
    state = model.initSystem()
    table = osim.TimeSeriesTable(str(path))
    assert list(table.getColumnLabels()) == list(found)[1:]
    coordinates = model.getCoordinateSet()
    for row in (0, 40, 119):
        values = dict(zip(table.getColumnLabels(), table.getRowAtIndex(row).to_numpy(), strict=True))
        for i in range(coordinates.getSize()):
            name = coordinates.get(i).getName()
            if not name.startswith(
                "hip_rotation"
            ):  # a thigh's turn about itself, which 17 joints do not give
                value = values[name] if name[:-1] == "trunk_t" else np.radians(values[name])
                coordinates.get(i).setValue(state, value)
        model.realizePosition(state)
        for i in range(model.getMarkerSet().getSize()):
            marker = model.getMarkerSet().get(i)
            place = marker.getLocationInGround(state).to_numpy()
            np.testing.assert_allclose(place, at[marker.getName()][row], atol=5e-5, err_msg=marker.getName())


def _written_model(half, thigh):
    """A .osim file's text: pelvis and thighs with markers at hips and knees."""
    x, y, z = np.eye(3)
    moves = [(f"trunk_t{name}", axis) for name, axis in zip("xyz", (x, y, z), strict=True)]
    joints = [
        _joint("ground_pelvis", "/ground", np.zeros(3), "pelvis", zip(TURNS, (z, x, y), strict=True), moves)
    ]
    markers_ = []
    for side, out in (("r", 1), ("l", -1)):
        hip = HIP_IN_PELVIS * (1, 1, 0) + out * half * z
        names = (f"{side}_thigh_trunk_flexion", f"hip_adduction_{side}", f"hip_rotation_{side}")
        turns = zip(names, (z, out * x, out * y), strict=True)
        joints.append(_joint(f"hip_{side}", "/bodyset/pelvis", hip, f"femur_{side}", turns))
        markers_ += [
            f'<Marker name="{side}_{joint}"><socket_parent_frame>/bodyset/femur_{side}</socket_parent_frame>'
            f"<location>0 {down} 0</location></Marker>"
            for joint, down in (("hip", 0), ("knee", -thigh))
        ]
    bodies = [
        f'<Body name="{name}"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>'
        for name in ("pelvis", "femur_r", "femur_l")
    ]
    sets = {"BodySet": bodies, "JointSet": joints, "MarkerSet": markers_}
    inside = "".join(f"<{name}><objects>{''.join(told)}</objects></{name}>" for name, told in sets.items())
    return f'<OpenSimDocument Version="40000"><Model name="legs">{inside}</Model></OpenSimDocument>'


def _joint(name, parent, place, child, turns, moves=()):
    def words(vector):
        return " ".join(map(str, vector))

    axes = [*((f"rotation{i}", *told) for i, told in enumerate(turns, 1))]
    axes += [(f"translation{i}", *told) for i, told in enumerate(moves, 1)]
    transform = "".join(
        f'<TransformAxis name="{kind}"><coordinates>{coordinate}</coordinates><axis>{words(axis)}</axis>'
        '<LinearFunction name="function"><coefficients>1 0</coefficients></LinearFunction></TransformAxis>'
        for kind, coordinate, axis in axes
    )
    coordinates = "".join(f'<Coordinate name="{coordinate}"/>' for _, coordinate, _ in axes)
    frames = "".join(
        f'<PhysicalOffsetFrame name="{frame}"><socket_parent>{of}</socket_parent>'
        f"<translation>{words(at)}</translation></PhysicalOffsetFrame>"
        for frame, of, at in (("above", parent, place), ("below", f"/bodyset/{child}", np.zeros(3)))
    )
    return (
        f'<CustomJoint name="{name}"><socket_parent_frame>above</socket_parent_frame>'
        f"<socket_child_frame>below</socket_child_frame><coordinates>{coordinates}</coordinates>"
        f"<frames>{frames}</frames><SpatialTransform>{transform}</SpatialTransform></CustomJoint>"
    )


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
    found, _ = written(take.with_(filtered=take.filtered.with_(root=None)))
    assert set(TURNS) < set(found)
    assert "trunk_tx" not in found
