"""TotalCapture's 13 Xsens sensors, a table each, as `pcnet3d compare RESULTS --imu` reads it (the paper's figure 5):

pcnet3d lab totalcapture s1_acting1_Xsens.sensors -o sensors

The files are `<take>_Xsens.sensors` and `<take>_Xsens_AuxFields.sensors` (formats.md 8.2). First line: number of
sensors and of frames. Then for each frame a line with its number, from 1, and a line for each sensor: name, quaternion
w x y z (inertial from sensor), acceleration x y z in the sensor's axes with gravity; the AuxFields add gyroscope and
magnetometer. `<subject>_<take>_calib_imu_ref.txt` beside them: the number of sensors, then name and quaternion x y z w,
from the inertial into the Vicon world (right-handed, y up). The files hold no clock: the first frame is at 0 s.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy.spatial.transform import Rotation

from ...pipeline.core.errors import InputError, readable
from ...pipeline.core.frames import Y_UP, Z_UP
from ...pipeline.files.atomic import whole_folder
from ...pipeline.reading.flags import Force, Output

RATE_HZ = 60.0
_NUMBERS = (7, 13)  # a sensor's line: quaternion and acceleration, and with gyroscope and magnetometer
_HEADER = "time_s,ax,ay,az,qw,qx,qy,qz"


def totalcapture(
    sensors: Annotated[Path, typer.Argument(help="The .sensors file of a take.")],
    output: Output,
    reference: Annotated[
        Path | None, typer.Option(help="Its calib_imu_ref.txt; by default the one that lies beside it.")
    ] = None,
    force: Force = False,
) -> None:
    """Write each sensor of a TotalCapture take as a CSV file for pcnet3d compare --imu."""
    file = reference or _reference(sensors)
    tables = sensor_tables(sensors, file)
    with whole_folder(output, force, [sensors, *([file] if file else [])]) as folder:
        for name, table in tables.items():
            np.savetxt(folder / f"{name}.csv", table, fmt="%.8g", delimiter=",", header=_HEADER, comments="")
    print(f"{output}: {', '.join(f'{name}.csv' for name in tables)}")


def sensor_tables(path: Path, reference: Path | None) -> dict[str, np.ndarray]:
    """By sensor (T, 8): seconds, specific force in the sensor's axes, m/s², and the quaternion w x y z that maps these
    axes into a world with z up: Vicon's, or Xsens' own without a reference. InputError for a damaged file."""
    names, numbers = _samples(path)
    turns = {} if reference is None else _calibration(reference, names)
    time_s = np.arange(len(numbers)) / RATE_HZ
    tables = {}
    for i, name in enumerate(names):
        w, *xyz = numbers[:, i, :4].T
        world_from_sensor = Rotation.from_quat(np.stack([*xyz, w], axis=-1))
        if name in turns:
            world_from_sensor = turns[name] * world_from_sensor
        x, y, z, w = world_from_sensor.as_quat().T
        tables[name] = np.column_stack([time_s, numbers[:, i, 4:7], w, x, y, z])
    return tables


def _samples(path: Path) -> tuple[list[str], np.ndarray]:
    """The sensors' names (S,) and their numbers (T, S, 7 or 13)."""
    lines = _lines(path)
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
        if not in_order or numbers.shape[2] not in _NUMBERS or not numbers[..., :4].any(axis=-1).all():
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


def _calibration(path: Path, sensors: list[str]) -> dict[str, Rotation]:
    """By sensor, from its inertial axes into the Z-up world."""
    lines = _lines(path)
    try:
        rows = {cells[0]: [float(cell) for cell in cells[1:5]] for cells in map(str.split, lines[1:])}
        xyzw = [rows[sensor] for sensor in sensors]
        if len(rows) != int(lines[0]):
            raise ValueError
        upright = Rotation.from_matrix(Z_UP.basis @ Y_UP.basis.T)
        return {sensor: upright * Rotation.from_quat(row) for sensor, row in zip(sensors, xyzw, strict=True)}
    except (ValueError, LookupError):
        raise InputError(
            "format-unknown",
            f"Expected in {path} the number of sensors, then a line with name and quaternion x y z w for each of "
            f"{', '.join(sensors)}; it holds something else.",
        ) from None


def _lines(path: Path) -> list[str]:
    """Those that hold anything, one at least."""
    with readable(path, "a text file of TotalCapture"):
        lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    if not lines:
        raise InputError("file-damaged", f"Expected a text file of TotalCapture in {path}, but it is empty.")
    return lines
