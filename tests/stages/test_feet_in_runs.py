"""`pcnet3d run` on poses with heels and toes: the feet's angles and points in everything that a run writes."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.io import netcdf_file

from commands import pcnet3d, succeeded
from golden.recordings import Recording
from pcnet3d.examples.walker.camera import aimed
from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.pipeline.core.layouts import FEET, H36M17
from pcnet3d.pipeline.core.rotations import rotate
from pcnet3d.pipeline.files.finished import read_run
from pcnet3d.pipeline.signals.angles import FOOT_ANGLES

ADDED = ("--also", "trc", "--also", "netcdf", "--also", "mot", "--set", "rectify.rectifier=geometric")


@pytest.fixture(scope="module")
def folder(walk, tmp_path_factory):
    """The run on the walker's 26 points in a camera's axes."""
    path = tmp_path_factory.mktemp("feet")
    camera = aimed(walk.root.mean(axis=0), 6, heading_deg=70, pitch_deg=10, roll_deg=3)
    np.savez(path / "points.npz", joints=camera.points(halpe26(walk)), time_s=walk.time_s)
    told = [f"--option={key}" for key in ("layout=HALPE26", "frame=CAMERA", "unit=m")]
    given = ["run", "--poses", path / "points.npz", "--adapter", "arrays", *told, *ADDED, "-o", path / "out"]
    succeeded(pcnet3d(*given))
    return path / "out"


def test_angles_of_the_walkers_feet(folder, walk):
    """But for a sole that lies on the floor; the middle of the toes is 4 degrees outwards."""
    made, columns = walk.angles_deg, pq.read_table(folder / "kinematics.parquet").to_pydict()
    for side in "rl":
        shank = (
            made[f"{side}_thigh_trunk_flexion_deg"]
            - made["trunk_lean_deg"]
            - made[f"{side}_knee_flexion_deg"]
        )
        measured = np.array(columns[f"{side}_ankle_dorsiflexion_deg"])
        off = np.abs(measured - (made[f"{side}_foot_pitch_deg"] - shank))
        assert np.nanmedian(off) < 3
        assert np.nanmedian(columns[f"{side}_foot_progression_deg"]) == pytest.approx(4.4, abs=2)
        assert set(columns[f"{side}_ankle_dorsiflexion_reason"]) == {0}
        assert np.isnan(columns[f"{side}_ankle_dorsiflexion_sd_deg"]).all()


def test_poses_npz_has_the_feet_behind_the_joints(folder, walk):
    with np.load(folder / "poses.npz", allow_pickle=False) as file:
        arrays = dict(file)
    names = arrays["joint_names"].tolist()
    assert names == [*H36M17.joints, *FEET.joints]
    heels = {
        of: arrays[of][:, names.index("r_heel")] - arrays[of][:, names.index("r_ankle")]
        for of in ("source", "level")
    }
    assert np.median(heels["level"][:, 2]) < 0  # below the ankle, up is right
    turned = rotate(arrays["R_source_from_level"], heels["level"])
    np.testing.assert_allclose(turned, heels["source"], atol=1e-5)


def test_the_run_that_is_read_back_has_the_feet(folder):
    run = read_run(folder)
    for poses in (run.poses, run.rectified.level, run.filtered):
        assert np.isfinite(poses.joint("l_big_toe")).all()


def test_exports_for_other_programs_have_the_feet(folder):
    names = (folder / "markers.trc").read_text().splitlines()[3].split("\t")
    assert set(FEET.joints) <= set(names)
    assert len(np.loadtxt((folder / "markers.trc").read_text().splitlines()[5:])[0]) == 2 + 3 * 23
    with netcdf_file(folder / "poses.nc", mmap=False) as file:
        assert file.variables["position"].shape[2] == 23
    head = (folder / "angles.mot").read_text().split("endheader\n")[1].splitlines()[0].split("\t")
    assert {"ankle_angle_r", "ankle_angle_l", "r_foot_progression"} <= set(head)


def test_recording_report_and_measures_have_the_feet(folder):
    recording = Recording(folder / "take.rrd")
    assert "angles/ankle_dorsiflexion" in recording.entities
    assert set(FEET.joints) <= set(recording.static("level/joints", "Points3D:labels"))
    assert "Ankle dorsiflexion" in (folder / "report.html").read_text()
    ranges = json.loads((folder / "summary.json").read_text())["measures"]["range_of_motion"]
    assert FOOT_ANGLES.keys() <= ranges.keys()
    assert ranges["r_ankle_dorsiflexion"]["p05_p95_deg"] > 10
