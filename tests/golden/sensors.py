"""A table of an inertial sensor."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pcnet3d.adapters.imu_csv import Imu


def write_csv(path: Path, imu: Imu) -> None:
    """The table that adapter imu_csv reads: m/s^2, quaternion w x y z."""
    header = "time_s,ax,ay,az,qw,qx,qy,qz"
    quaternions = np.roll(Rotation.from_matrix(imu.R_world_from_sensor).as_quat(), 1, axis=-1)
    columns = [imu.time_s, imu.force_mps2, quaternions]
    np.savetxt(path, np.column_stack(columns), fmt="%.6f", delimiter=",", header=header, comments="")
