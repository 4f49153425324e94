"""What an inertial sensor on a body segment measured, and what it says about motion.

An accelerometer measures specific force: acceleration minus gravity, so that at rest it reads one g upwards. Rotated
by the sensor's own orientation into a world whose z points up and less that g, it is the acceleration of the place
it is strapped to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError
from ..core.layouts import H36M17
from ..core.notices import Notice, notice
from ..core.rotations import angle_deg, is_finite, rotate, transpose
from ..signals.filters import rate

GRAVITY_MPS2 = 9.80665  # standard gravity (CGPM 1901)
MOST_HZ = 10_000.0  # samples a second; sensors for people take up to 2000

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
    notices: what was done or found while reading.

    Raises InputError when shapes or order do not fit.
    """

    time_s: np.ndarray
    force_mps2: np.ndarray
    R_world_from_sensor: np.ndarray
    notices: tuple[Notice, ...] = ()

    def __post_init__(self) -> None:
        rows = len(self.time_s)
        for name, shape in (
            ("time_s", (rows,)),
            ("force_mps2", (rows, 3)),
            ("R_world_from_sensor", (rows, 3, 3)),
        ):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape:
                raise InputError("wrong-content", f"Expected {name} of shape {shape}, got {array.shape}.")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if rows < 2 or not np.isfinite(self.time_s).all() or (np.diff(self.time_s) <= 0).any():
            raise InputError(
                "times-broken", "Expected at least two samples of an IMU whose time increases; it does not."
            )

    @property
    def rate_hz(self) -> float:
        return rate(self.time_s)

    @property
    def acceleration_mps2(self) -> np.ndarray:
        """(T, 3) in the world, without gravity."""
        return _in_world(self.R_world_from_sensor, self.force_mps2) - [0.0, 0.0, GRAVITY_MPS2]


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
    unit, (lean, other) = _unit_of(norm), (float(angle_deg(each, _UP)) for each in (mean, inverse))
    if lean > min(_LEAN_DEG, other + _BETTER_DEG):
        raise InputError(
            "wrong-axes",
            "Expected orientations that map the sensor's axes into a world whose z points up; with these, the mean "
            f"acceleration, which is gravity's, leans {lean:.0f} degrees from up: check the order of the quaternions' "
            "numbers (w x y z), which way they map (-O maps=sensor_from_world), and which axis is the vertical.",
        )
    said = () if unit == "m/s^2" else (notice("imu-unit", unit=unit, gravity=norm),)
    return Imu(time_s, force * _UNITS[unit], R_world_from_sensor, said)


def _unit_of(norm: float) -> str:
    """The unit in which this is about one g; InputError where it is that in none."""
    for name, size in _UNITS.items():
        if _NEAR[0] < norm * size / GRAVITY_MPS2 < _NEAR[1]:
            return name
    raise InputError(
        "wrong-axes",
        "Expected accelerations that include gravity, about 9.8 m/s^2 or 1 g at rest, and orientations that belong to "
        f"them, got {norm:.3g} in the mean; export the accelerometer's own signal (not linear or free acceleration), "
        "and check the order of the quaternions' numbers (w x y z).",
    )


def point_on(segment: str, joints: np.ndarray) -> np.ndarray:
    """(T, 3) where the segment's sensor is on joints (T, 17, 3)."""
    start, end, share = SEGMENTS[segment]
    return (1 - share) * joints[:, H36M17.index(start)] + share * joints[:, H36M17.index(end)]


def _in_world(R_world_from_sensor: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return rotate(R_world_from_sensor, vectors[:, None])[:, 0]
