"""One IMU as a table of text: time, acceleration with gravity in the sensor's axes, orientation as a quaternion.

The first line names the columns, in any order and case; further columns are left alone:
    time_s   seconds
    ax ay az specific force in the sensor's axes, m/s^2 or g (told apart by the mean norm, which is one g)
    qw qx qy qz the rotation that maps the sensor's axes into a right-handed world whose z points up
kit/tables.py says how cells are separated and what is missing.

An accelerometer measures specific force: acceleration minus gravity, so that at rest it reads one g upwards. Rotated by
the sensor's own orientation into a world whose z points up and less that g, it is the acceleration of the place it is
strapped to.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.rotations import angle_deg, is_finite, rotate, transpose
from ..pipeline.signals.filters import rate
from .kit.tables import column_names, read_columns

name = "imu_csv"
gives = "imu"
reads = "one IMU as CSV: time_s, ax ay az with gravity, quaternion qw qx qy qz to a world with z up"

GRAVITY_MPS2 = 9.80665  # standard gravity (CGPM 1901)

# Where on the 17 joints each segment's sensor is: from a joint towards another, and how much of the way. Sensors of
# the forearm sit at the wrist, a foot's goes with the ankle; sacrum and pelvis joint count as one place.
SEGMENTS: dict[str, tuple[str, str, float]] = {
    "pelvis": ("pelvis", "pelvis", 0.0),
    "thorax": ("spine", "thorax", 0.8),
    "head": ("nose", "head", 0.5),
    **{
        f"{side}_{name}": (f"{side}_{start}", f"{side}_{end}", share)
        for side in "rl"
        for name, start, end, share in (
            ("upper_arm", "shoulder", "elbow", 0.6),
            ("forearm", "elbow", "wrist", 0.9),
            ("thigh", "hip", "knee", 0.6),
            ("shank", "knee", "ankle", 0.6),
            ("foot", "knee", "ankle", 1.0),
        )
    },
}

_FORCE = ("ax", "ay", "az")
_QUATERNION = ("qw", "qx", "qy", "qz")
_UNIT_ERROR = 0.05  # printed with few digits, a unit quaternion is still this near to length 1
_UNITS = {"m/s^2": 1.0, "g": GRAVITY_MPS2, "mg": GRAVITY_MPS2 / 1000}
# Norm of the mean specific force over g, in the right unit; the mean of motion itself is about 0.
_NEAR = (0.8, 1.25)
_UP = np.array([0.0, 0.0, 1.0])
# A mean specific force that leans further from up was rotated wrongly, or than with the inverse by this.
_LEAN_DEG, _BETTER_DEG = 10.0, 5.0


@dataclass(frozen=True, eq=False)
class Imu:
    """One sensor's recording.

    time_s: (T,) strictly increasing seconds of the sensor's own clock.
    force_mps2: (T, 3) specific force in the sensor's axes; NaN where missing.
    R_world_from_sensor: (T, 3, 3), into right-handed axes with z up and any heading; sensors that are to be
        subtracted from each other share the world.
    notices: what was done while reading.
    """

    time_s: np.ndarray
    force_mps2: np.ndarray
    R_world_from_sensor: np.ndarray
    notices: tuple[Notice, ...] = ()

    @property
    def rate_hz(self) -> float:
        return rate(self.time_s)

    @property
    def acceleration_mps2(self) -> np.ndarray:
        """(T, 3) in the world, without gravity."""
        return _in_world(self.R_world_from_sensor, self.force_mps2) - [0.0, 0.0, GRAVITY_MPS2]


def sniff(path: Path) -> bool:
    """Whether the first line names the columns of an IMU."""
    return set(_FORCE) <= set(column_names(path))


def read(path: Path) -> tuple[Imu]:
    """The one sensor of the file.

    Raises InputError for missing columns, cells that are no numbers, times that do not increase, and signals that are
    no specific force with its orientation (`imu_from_samples`).
    """
    wanted = ("time_s", *_FORCE, *_QUATERNION)
    table = read_columns(path, "an IMU's CSV file", wanted)
    if not set(wanted) <= table.keys():
        raise InputError(
            "wrong-content",
            f"Expected columns {', '.join(wanted)} in {path}, got {', '.join(column_names(path)) or 'none'}; export "
            "the sensor's times, in seconds, and its orientation too.",
        )
    if len(table["ax"]) < 2:
        raise InputError("nothing-usable", f"Expected samples of an IMU in {path}, got {len(table['ax'])}.")
    time_s = table["time_s"]
    if not np.isfinite(time_s).all() or (np.diff(time_s) <= 0).any():
        raise InputError(
            "times-broken", f"Expected time_s of {path} to increase from line to line; it does not."
        )
    force = np.stack([table[column] for column in _FORCE], axis=-1)
    return (imu_from_samples(time_s, force, _rotations(table)),)


def _rotations(table: dict[str, np.ndarray]) -> np.ndarray:
    """(T, 3, 3) of unit quaternions, NaN where one has a NaN. InputError when their length is not about 1."""
    from scipy.spatial.transform import Rotation

    wxyz = np.stack([table[column] for column in _QUATERNION], axis=-1)
    length = np.linalg.norm(wxyz, axis=-1)
    wrong = np.abs(length - 1) > _UNIT_ERROR
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            "wrong-content",
            f"Expected unit quaternions, got one of length {length[row]:.3g} in row {row}; are these columns angles?",
        )
    R = np.full((len(wxyz), 3, 3), np.nan)
    measured = np.isfinite(length)
    R[measured] = Rotation.from_quat(np.roll(wxyz[measured], -1, axis=-1)).as_matrix()
    return R


def imu_from_samples(time_s: np.ndarray, force: np.ndarray, R_world_from_sensor: np.ndarray) -> Imu:
    """An Imu from specific force (T, 3) in a unit that the norm of its mean in the world, which is one g, tells.

    InputError when the norm fits no unit, as without gravity, and when the orientations do not turn the mean specific
    force upwards, as the right ones do over any take.
    """
    rows = is_finite(force) & is_finite(R_world_from_sensor.reshape(-1, 9))
    if not rows.any():
        raise InputError(
            "nothing-usable",
            "Expected accelerations and orientations of an IMU, got no sample that has both.",
        )
    mean = _in_world(R_world_from_sensor, force)[rows].mean(axis=0)
    norm = float(np.linalg.norm(mean))
    inverse = _in_world(transpose(R_world_from_sensor), force)[rows].mean(axis=0)
    lean, other = (float(angle_deg(each, _UP)) for each in (mean, inverse))
    unit = next((u for u, size in _UNITS.items() if _NEAR[0] < norm * size / GRAVITY_MPS2 < _NEAR[1]), None)
    if unit is None:
        raise InputError(
            "wrong-axes",
            "Expected accelerations that include gravity, about 9.8 m/s^2 or 1 g at rest, and orientations that belong "
            f"to them, got {norm:.3g} in the mean; export the accelerometer's own signal (not linear or free "
            "acceleration), and check the order of the quaternions' numbers (w x y z).",
        )
    if lean > min(_LEAN_DEG, other + _BETTER_DEG):
        raise InputError(
            "wrong-axes",
            "Expected orientations that map the sensor's axes into a world whose z points up; with these, the mean "
            f"acceleration, which is gravity's, leans {lean:.0f} degrees from up: check the order of the quaternions' "
            "numbers (w x y z), which way they map, and which axis is the vertical.",
        )
    notices = () if unit == "m/s^2" else (notice("imu-unit", unit=unit, gravity=norm),)
    return Imu(time_s, force * _UNITS[unit], R_world_from_sensor, notices)


def point_on(segment: str, joints: np.ndarray) -> np.ndarray:
    """(T, 3) where the segment's sensor is on joints (T, 17, 3)."""
    start, end, share = SEGMENTS[segment]
    return (1 - share) * joints[:, H36M17.index(start)] + share * joints[:, H36M17.index(end)]


def _in_world(R_world_from_sensor: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return rotate(R_world_from_sensor, vectors[:, None])[:, 0]
