"""A model follows joints whose coordinates are known, and a run becomes files that OpenSim opens."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from commands import pcnet3d, recipe_of
from pcnet3d.pipeline import InputError

opensim = pytest.importorskip("opensim", reason="the extra opensim is not installed")

from golden.musculoskeletal import small_model, write_small_model  # noqa: E402  # both need the package
from pcnet3d.stages import opensim as musculoskeletal  # noqa: E402

_EMPTY = b"<OpenSimDocument Version='40000'><Model name='m'/></OpenSimDocument>"
LARGER = 1.1
# Joint by joint the body whose origin it is.
AT = {
    f"{side}_{joint}": f"{body}_{side}"
    for side in "rl"
    for joint, body in {
        "hip": "femur", "knee": "tibia", "ankle": "talus", "heel": "calcn", "shoulder": "humerus", "elbow": "ulna",
        "wrist": "hand",
    }.items()
}  # fmt: skip
TOLD = {  # degrees over twelve frames; limbs stay bent
    "pelvis_tilt": np.linspace(-10, 10, 12), "pelvis_rotation": np.linspace(0, 170, 12),
    "lumbar_bending": np.linspace(-10, 5, 12), "hip_flexion_r": np.linspace(-20, 60, 12),
    "hip_adduction_l": np.linspace(-25, 5, 12), "hip_rotation_r": np.linspace(-15, 15, 12),
    "knee_angle_r": np.linspace(20, 90, 12), "knee_angle_l": np.linspace(90, 20, 12),
    "ankle_angle_r": np.linspace(-20, 20, 12), "arm_flex_r": np.linspace(-30, 80, 12),
    "arm_rot_l": np.linspace(-20, 20, 12), "elbow_flex_r": np.linspace(20, 100, 12),
    "elbow_flex_l": np.full(12, 60.0),
}  # fmt: skip


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    return write_small_model(tmp_path_factory.mktemp("model"))


@pytest.fixture(scope="module")
def joints() -> tuple[np.ndarray, tuple[str, ...]]:
    """(12, J, 3) metres and their names: the centres of a model a tenth larger, posed as TOLD."""
    person = small_model()
    state, sizes = person.initSystem(), opensim.ScaleSet()
    for body in person.getBodySet():
        size = opensim.Scale()
        size.setSegmentName(body.getName())
        size.setScaleFactors(opensim.Vec3(LARGER))
        size.setApply(True)
        sizes.cloneAndAppend(size)
    person.scale(state, sizes, True)
    state, frames = person.initSystem(), []
    for i in range(12):
        for name, angles in TOLD.items():
            person.getCoordinateSet().get(name).setValue(state, float(np.radians(angles[i])), False)
        person.realizePosition(state)
        at = {joint: _place(person, state, body) for joint, body in AT.items()}
        at |= {f"{side}_big_toe": _place(person, state, f"toes_{side}") for side in "rl"}
        at["pelvis"] = (at["r_hip"] + at["l_hip"]) / 2
        at["thorax"] = (at["r_shoulder"] + at["l_shoulder"]) / 2
        frames.append([*at.values()])
    return np.array(frames), tuple(at)


def _place(person, state, body: str) -> np.ndarray:
    place = person.getBodySet().get(body).getPositionInGround(state)
    return np.array([place.get(i) for i in range(3)])


def follow(path, joints, names, mass_kg=None):
    with musculoskeletal.opensim() as package:
        return musculoskeletal.follow(package, path, joints, names, np.arange(len(joints)) / 30, mass_kg)


def test_the_coordinates_come_back(path, joints):
    solved = follow(path, *joints, mass_kg=60.0)
    coordinates = dict(zip(solved.names, solved.coordinates.T, strict=True))
    for name, angles in TOLD.items():
        np.testing.assert_allclose(coordinates[name], angles, atol=1.0, err_msg=name)
    assert np.nanmax(solved.residuals_m) < 0.003
    untold = {f"{name}_{side}" for name in ("mtp_angle", "pro_sup", "wrist_flex") for side in "rl"}
    assert {*solved.fixed} == {"lumbar_extension", *untold}
    np.testing.assert_allclose([*solved.scales.values()], LARGER, rtol=1e-3)
    assert solved.model.getTotalMass(solved.model.initSystem()) == pytest.approx(60.0)


def test_what_is_missing_is_left_out(path, joints):
    points, names = joints[0].copy(), joints[1]
    points[3] = np.nan
    points[5, names.index("r_wrist")] = np.nan
    solved = follow(path, points, names)
    assert len(solved.time_s) == 11
    assert 3 / 30 not in solved.time_s
    missing = np.isnan(solved.residuals_m)
    assert missing.sum() == 1
    assert missing[4, solved.markers.index("r_wrist")]
    legs = [name for name in names if not name.endswith(("heel", "toe"))]
    without_feet = follow(path, points[:, [names.index(name) for name in legs]], legs)
    assert {"ankle_angle_r", "ankle_angle_l"} <= {*without_feet.fixed}


@pytest.mark.parametrize("content", [b"", b"garbage", _EMPTY])
def test_no_model_is_refused(tmp_path, joints, content):
    (tmp_path / "no.osim").write_bytes(content)
    with pytest.raises(InputError) as refused:
        follow(tmp_path / "no.osim", *joints)
    assert refused.value.code == "wrong-content"
    with pytest.raises(InputError) as refused:
        follow(tmp_path / "nothing.osim", *joints)
    assert refused.value.code == "cannot-open"


@pytest.fixture
def run(tmp_path, facing_camera):
    """run(*arguments): the folder of a run of a person who barely moves."""

    def make(*arguments) -> Path:
        jitter = np.random.default_rng(0).normal(scale=0.002, size=(30, 17, 3))
        np.save(tmp_path / "X3D.npy", (facing_camera * 0.8 + jitter - jitter[:, :1]).astype(np.float32))
        stages = ("scale", "rectify", "trajectories", "angles", "measures", "export")
        recipe = recipe_of(tmp_path / "recipe.toml", *stages)
        result = pcnet3d(
            "run", "--poses", tmp_path / "X3D.npy", "--adapter", "motionbert", "--fps", 30, "--recipe", recipe,
            *arguments, "--set", "rectify.rectifier=geometric", "-o", tmp_path / "run",
        )  # fmt: skip
        assert result.returncode == 0, result.stderr
        return tmp_path / "run"

    return make


def test_a_run_becomes_a_scaled_model_and_its_motion(run, path):
    folder = run("--stature", 1.7)
    result = pcnet3d("opensim", folder, "--model", path)
    assert result.returncode == 0, result.stderr
    out = folder / "opensim"
    assert {file.name for file in out.iterdir()} == {
        "scaled.osim", "markers.trc", "ik.mot", "opensim.json", "summary.json",
    }  # fmt: skip
    scaled, motion = opensim.Model(str(out / "scaled.osim")), opensim.TimeSeriesTable(str(out / "ik.mot"))
    assert {*motion.getColumnLabels()} == {each.getName() for each in scaled.getCoordinateSet()}
    assert motion.getNumRows() == 30
    markers = opensim.TimeSeriesTableVec3(str(out / "markers.trc"))
    assert {each.getName() for each in scaled.getMarkerSet()} <= {*markers.getColumnLabels()}
    content = json.loads((out / "opensim.json").read_text())
    assert 0 < content["residuals_m"]["r_knee"]["rms"] < 0.1
    assert "opensim" in json.loads((folder / "summary.json").read_text())["files"]
    assert not [file for file in Path.cwd().glob("opensim*.log")]
    own = pq.read_table(folder / "kinematics.parquet")["r_knee_flexion_deg"].to_numpy()
    assert np.std(motion.getDependentColumn("knee_angle_r").to_numpy() - own) < 1


def test_the_terminal_says_whether_the_take_is_levelled(run, path):
    folder = run("--stature", 1.7)
    summary = json.loads((folder / "summary.json").read_text())
    summary["rectification"] |= {"level_ok": False, "level_reason": "nobody stands"}
    (folder / "summary.json").write_text(json.dumps(summary))
    for _ in range(2):
        result = pcnet3d("opensim", folder, "--model", path)
        assert "could not be levelled: nobody stands" in result.stdout


def test_a_run_without_metres_is_refused(run, path):
    folder = run()
    result = pcnet3d("opensim", folder, "--model", path)
    assert result.returncode == 2
    assert "--stature" in result.stderr
    assert not (folder / "opensim").exists()
