"""TotalCapture's sensors, written here as formats.md 8.2 has them, become tables that adapter imu_csv reads."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from commands import pcnet3d, refused, succeeded
from golden.strapped import STILL, strapped
from golden.worlds import R_Y_UP_FROM_Z_UP
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.reading.find import find_adapter
from pcnet3d.pipeline.reading.imu import point_on

SENSORS = {"R_LowArm": "r_forearm", "Pelvis": "pelvis", "L_LowLeg": "l_shank"}


@pytest.fixture(scope="module")
def walk():
    return walker(fps=60, seconds=5)


def write_sensors(folder: Path, walk, extra: int = 0) -> Path:
    """s1_acting1_Xsens.sensors and its calibration: the inertial frames are turned against the world, each its way."""
    R_inertial_from_world = Rotation.from_euler("z", [[20], [25], [30]], degrees=True).as_matrix()
    imus = {sensor: strapped(walk, segment, STILL, rate_hz=60) for sensor, segment in SENSORS.items()}
    lines = [f"{len(SENSORS)} {len(walk)}"]
    for row in range(len(walk)):
        lines.append(str(row + 1))
        for (name, imu), R in zip(imus.items(), R_inertial_from_world, strict=True):
            x, y, z, w = Rotation.from_matrix(R @ imu.R_world_from_sensor[row]).as_quat()
            numbers = [w, x, y, z, *imu.force_mps2[row], *[0.5] * extra]
            lines.append("\t".join([name, *(f"{number:.8f}" for number in numbers)]))
    path = folder / f"s1_acting1_Xsens{'_AuxFields' if extra else ''}.sensors"
    path.write_text("\n".join(lines) + "\n")
    calibration = [f"{len(SENSORS)}"]
    for name, R in zip(imus, R_inertial_from_world, strict=True):
        x, y, z, w = Rotation.from_matrix(R_Y_UP_FROM_Z_UP @ R.T).as_quat()
        calibration.append(f"{name} {x:.8f} {y:.8f} {z:.8f} {w:.8f}")
    (folder / "s1_acting1_calib_imu_ref.txt").write_text("\n".join(calibration) + "\n")
    return path


def acceleration(path: Path) -> np.ndarray:
    (imu,) = find_adapter(path, gives="imu").read(path)
    assert imu.rate_hz == pytest.approx(60)
    return imu.acceleration_mps2


@pytest.mark.parametrize("extra", [0, 6])
def test_sensors_become_accelerations_of_their_segments_in_the_world(walk, tmp_path, extra):
    succeeded(pcnet3d("lab", "totalcapture", write_sensors(tmp_path, walk, extra), "-o", tmp_path / "out"))
    for sensor, segment in SENSORS.items():
        truth = point_on(segment, walk.acceleration_mps2)
        np.testing.assert_allclose(acceleration(tmp_path / "out" / f"{sensor}.csv"), truth, atol=1e-4)


def test_without_calibration_the_inertial_world_still_has_z_up(walk, tmp_path):
    path = write_sensors(tmp_path, walk)
    (tmp_path / "s1_acting1_calib_imu_ref.txt").unlink()
    succeeded(pcnet3d("lab", "totalcapture", path, "-o", tmp_path / "out"))
    truth = point_on("r_forearm", walk.acceleration_mps2)
    measured = acceleration(tmp_path / "out" / "R_LowArm.csv")
    np.testing.assert_allclose(measured[:, 2], truth[:, 2], atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(measured, axis=-1), np.linalg.norm(truth, axis=-1), atol=1e-4)


def test_damaged_sensors_are_refused_in_words(walk, tmp_path):
    path = write_sensors(tmp_path, walk)
    text, calibration = path.read_text(), tmp_path / "s1_acting1_calib_imu_ref.txt"
    for damaged in ("", text[: len(text) // 2], text.replace("\t0.", "\tnull.", 1)):
        path.write_text(damaged)
        refused(pcnet3d("lab", "totalcapture", path, "-o", tmp_path / "out"), "Expected", path.name)
    path.write_text(text)
    calibration.write_text("\n".join(calibration.read_text().splitlines()[:-1]))
    refused(pcnet3d("lab", "totalcapture", path, "-o", tmp_path / "out"), "Expected", calibration.name)
    assert not (tmp_path / "out").exists()
