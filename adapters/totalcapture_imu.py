"""The 13 Xsens sensors of TotalCapture: `<take>_Xsens.sensors`, `<take>_Xsens_AuxFields.sensors` (formats.md 8.2).

First line: number of sensors and of frames. Then for each frame a line with its number, from 1, and a line for each
sensor: name, quaternion w x y z (inertial from sensor), acceleration x y z in the sensor's axes with gravity; the
AuxFields add gyroscope and magnetometer. `<subject>_<take>_calib_imu_ref.txt` beside them: the number of sensors,
then name and quaternion x y z w, from the inertial into the Vicon world (right-handed, y up).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import Y_UP, Z_UP
from ..pipeline.signals.imu import MOST_HZ, Imu, imu_from_samples
from ..pipeline.signals.rates import check_fps
from .kit.beginning import first_bytes
from .kit.quaternions import rotations
from .kit.tables import filled_lines

name = "totalcapture_imu"
gives = "imu"
reads = "TotalCapture's .sensors (13 Xsens IMUs), with calib_imu_ref.txt beside them"

_RATE_HZ = 60.0
_WHAT = "a text file of TotalCapture"
_SEGMENTS = {
    "Head": "head", "Sternum": "thorax", "Pelvis": "pelvis",
    **{
        f"{side.upper()}_{theirs}": f"{side}_{ours}"
        for side in "lr"
        for theirs, ours in (
            ("UpArm", "upper_arm"), ("LowArm", "forearm"), ("UpLeg", "thigh"), ("LowLeg", "shank"), ("Foot", "foot"),
        )
    },
}  # fmt: skip
_NUMBERS = (7, 13)  # a sensor's line: quaternion and acceleration, and with gyroscope and magnetometer


def sniff(path: Path) -> bool:
    """Whether the file is called .sensors and begins with two whole numbers and a frame's number, which is 1."""
    if path.suffix != ".sensors":
        return False
    first, _, rest = first_bytes(path, 400).partition(b"\n")
    numbers = first.split()
    return (
        len(numbers) == 2 and all(map(bytes.isdigit, numbers)) and rest.partition(b"\n")[0].split() == [b"1"]
    )


def read(path: Path, reference: Path | None = None, rate_hz: float = _RATE_HZ) -> tuple[Imu, ...]:
    """Every sensor, on its segment, in a Z-up world: Vicon's, or without a calibration Xsens' own.

    reference: the calib_imu_ref.txt, when it is not the one that lies beside the file. The files hold no clock: the
    first frame is at 0 s. Raises InputError for a file that is cut short or damaged.
    """
    check_fps(rate_hz, "rate_hz", MOST_HZ)
    names, numbers = _samples(path)
    unknown = [sensor for sensor in names if sensor not in _SEGMENTS]
    if unknown:
        raise InputError(
            "wrong-content", f"Expected TotalCapture's sensors in {path}, got {', '.join(unknown)}."
        )
    file = reference or _reference(path)
    to_world = _calibration(file, names) if file else {}
    time_s = np.arange(len(numbers)) / rate_hz
    imus = []
    for i, sensor in enumerate(names):
        R_world_from_sensor = rotations(numbers[:, i, :4])
        if file:
            R_world_from_sensor = to_world[sensor] @ R_world_from_sensor
        imus.append(imu_from_samples(_SEGMENTS[sensor], time_s, numbers[:, i, 4:7], R_world_from_sensor))
    return tuple(imus)


def _samples(path: Path) -> tuple[list[str], np.ndarray]:
    """The sensors' names (S,) and their numbers (T, S, 7 or 13)."""
    lines = filled_lines(path, _WHAT)
    try:
        sensors, frames = map(int, lines[0].split())
        body = [line.split() for line in lines[1:]]
        blocks = [body[start : start + 1 + sensors] for start in range(0, len(body), 1 + sensors)]
        if frames < 2 or len(blocks) != frames or len(blocks[-1]) != 1 + sensors:
            raise ValueError
        names = [row[0] for row in blocks[0][1:]]
        numbers = np.array([[row[1:] for row in block[1:]] for block in blocks], dtype=np.float64)
        in_order = all(
            int(block[0][0]) == number and [row[0] for row in block[1:]] == names
            for number, block in enumerate(blocks, 1)
        )
        if not in_order or numbers.shape[2] not in _NUMBERS:
            raise ValueError
    except (ValueError, IndexError):
        raise InputError(
            "file-damaged",
            f"Expected {path} to hold, after the numbers of sensors and frames, a line for each frame and below it "
            f"{' or '.join(map(str, _NUMBERS))} numbers a sensor; it is cut short or damaged, copy it again.",
        ) from None
    return names, numbers


def _reference(path: Path) -> Path | None:
    """The calib_imu_ref.txt of this take in the same folder: the one there is, or the one named as the take is."""
    take = path.stem.partition("_Xsens")[0].lower()
    files = sorted(path.parent.glob("*calib_imu_ref.txt"))
    named = [file for file in files if take in file.name.lower()]
    return next(iter(named if len(files) > 1 else files), None)


def _calibration(path: Path, sensors: list[str]) -> dict[str, np.ndarray]:
    """R_world_from_inertial (3, 3) by sensor, Z-up."""
    lines = filled_lines(path, _WHAT)
    try:
        rows = {cells[0]: [float(cell) for cell in cells[1:5]] for cells in map(str.split, lines[1:])}
        xyzw = np.array([rows[sensor] for sensor in sensors])
        if len(rows) != int(lines[0]) or xyzw.shape != (len(sensors), 4):
            raise ValueError
    except (ValueError, LookupError):
        raise InputError(
            "format-unknown",
            f"Expected in {path} the number of sensors, then a line with name and quaternion x y z w for each of "
            f"{', '.join(sensors)}; it holds something else.",
        ) from None
    R_z_from_y = Z_UP.basis @ Y_UP.basis.T
    return dict(zip(sensors, R_z_from_y @ rotations(np.roll(xyzw, 1, axis=-1)), strict=True))
