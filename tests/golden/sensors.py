"""TotalCapture's inertial sensors of the walker (formats.md 8.2)."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from golden.strapped import Faults, strapped
from golden.worlds import R_Y_UP_FROM_Z_UP
from pcnet3d.pipeline.signals.imu import Imu

PERFECT = Faults(0.0, (0.0, 0.0, 0.0), 0.0, 1.0, 0.0, 0.0, (30.0, -50.0, 110.0))


SENSORS = {"R_LowArm": "r_forearm", "Pelvis": "pelvis", "L_LowLeg": "l_shank"}


def imus(walk):
    return {sensor: strapped(walk, segment, PERFECT, rate_hz=60) for sensor, segment in SENSORS.items()}


def write_sensors(folder: Path, walk, extra: int = 0) -> Path:
    """s1_acting1_Xsens.sensors and its calibration: the inertial frames are turned against the world, each its way."""
    R_inertial_from_world = Rotation.from_euler("z", [[20], [25], [30]], degrees=True).as_matrix()
    sensors = imus(walk)
    lines = [f"{len(SENSORS)} {len(walk)}"]
    for row in range(len(walk)):
        lines.append(str(row + 1))
        for (name, imu), R in zip(sensors.items(), R_inertial_from_world, strict=True):
            x, y, z, w = Rotation.from_matrix(R @ imu.R_world_from_sensor[row]).as_quat()
            numbers = [w, x, y, z, *imu.force_mps2[row], *[0.5] * extra]
            lines.append("\t".join([name, *(f"{number:.8f}" for number in numbers)]))
    suffix = "_AuxFields" if extra else ""
    path = folder / f"s1_acting1_Xsens{suffix}.sensors"
    path.write_text("\n".join(lines) + "\n")
    calibration = [f"{len(SENSORS)}"]
    for name, R in zip(sensors, R_inertial_from_world, strict=True):
        x, y, z, w = Rotation.from_matrix(R_Y_UP_FROM_Z_UP @ R.T).as_quat()
        calibration.append(f"{name} {x:.8f} {y:.8f} {z:.8f} {w:.8f}")
    (folder / "s1_acting1_calib_imu_ref.txt").write_text("\n".join(calibration) + "\n")
    return path


def write_csv(path: Path, imu: Imu) -> None:
    """The table that adapter imu_csv reads: m/s^2, quaternion w x y z, which is left out where the sensor has none."""
    header, columns = "time_s,ax,ay,az", [imu.time_s, imu.force_mps2]
    if imu.R_world_from_sensor is not None:
        header += ",qw,qx,qy,qz"
        columns.append(np.roll(Rotation.from_matrix(imu.R_world_from_sensor).as_quat(), 1, axis=-1))
    np.savetxt(path, np.column_stack(columns), fmt="%.6f", delimiter=",", header=header, comments="")
