"""One IMU as a table of text: time, acceleration with gravity in the sensor's axes, orientation as a quaternion.

The first line names the columns, in any order and case; further columns are left alone:
    time_s   seconds; may be absent when the rate is given
    ax ay az specific force in the sensor's axes, m/s^2 or g (told apart by the mean norm, which is one g)
    qw qx qy qz the rotation that maps the sensor's axes into a right-handed world whose z points up
Commas, semicolons or tabs separate the cells; lines that begin with # are comments; an empty cell or "nan" is missing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.rotations import transpose
from ..pipeline.reading.bounds import check_fps
from ..pipeline.reading.imu import MOST_HZ, Imu, imu_from_samples
from .kit.opened import filled_lines, first_bytes

name = "imu_csv"
gives = "imu"
reads = "one IMU as CSV: time_s, ax ay az with gravity, quaternion qw qx qy qz to a world with z up"

_FORCE = ("ax", "ay", "az")
_QUATERNION = ("qw", "qx", "qy", "qz")
_PEEK_BYTES = 4096
_UNIT_ERROR = 0.05  # printed with few digits, a unit quaternion is still this near to length 1


def sniff(path: Path) -> bool:
    """Whether the first line names the columns of an IMU."""
    lines = first_bytes(path, _PEEK_BYTES).decode("utf-8-sig", errors="ignore").splitlines()
    return set(_FORCE) <= set(_names(lines))


def read(
    path: Path,
    rate_hz: float | None = None,
    maps: Literal["world_from_sensor", "sensor_from_world"] = "world_from_sensor",
) -> tuple[Imu]:
    """The one sensor of the file.

    rate_hz: samples a second, for a file without time_s. maps: which way the quaternions turn vectors.
    Raises InputError for missing columns, cells that are no numbers, a rate that contradicts the time stamps, and
    signals that are no specific force with its orientation (pipeline/reading/imu.py).
    """
    if rate_hz is not None:
        check_fps(rate_hz, "rate_hz", MOST_HZ)
    lines = [line for line in filled_lines(path, "an IMU's CSV file") if _content(line)]
    names = _names(lines)
    wanted = (*_FORCE, *_QUATERNION)
    if not set(wanted) <= set(names):
        raise InputError(
            "wrong-content",
            f"Expected columns {', '.join(wanted)} in {path}, got {', '.join(names) or 'none'}; export the sensor's "
            "orientation too.",
        )
    table = _table(path, lines, names)
    return (
        imu_from_samples(
            _times(path, table, rate_hz),
            np.stack([table[column] for column in _FORCE], axis=-1),
            _rotations(table, maps),
        ),
    )


def _content(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _separator(line: str) -> str:
    return next((mark for mark in (";", "\t") if mark in line), ",")


def _names(lines: list[str]) -> list[str]:
    header = next((line for line in lines if _content(line)), "")
    return [cell.strip().strip('"').lower() for cell in header.split(_separator(header))]


def _table(path: Path, lines: list[str], names: list[str]) -> dict[str, np.ndarray]:
    """The columns that an IMU needs, (T,) each."""
    wanted = [column for column in ("time_s", *_FORCE, *_QUATERNION) if column in names]
    places = [names.index(column) for column in wanted]
    separator = _separator(lines[0])
    rows = []
    for number, line in enumerate(lines[1:], 2):
        cells = line.split(separator)
        try:
            rows.append([float(cells[place].strip() or "nan") for place in places])
        except (ValueError, IndexError):
            raise InputError(
                "file-damaged",
                f"Expected {len(names)} numbers in each line of {path}, got '{line[:60]}' in line {number} of its "
                "data and header; write or copy the file again.",
            ) from None
    if len(rows) < 2:
        raise InputError("nothing-usable", f"Expected samples of an IMU in {path}, got {len(rows)}.")
    return dict(zip(wanted, np.array(rows).T, strict=True))


def _times(path: Path, table: dict[str, np.ndarray], rate_hz: float | None) -> np.ndarray:
    rows = len(table["ax"])
    if "time_s" not in table:
        if rate_hz is None:
            raise InputError(
                "needs-rate", f"{path} has no column time_s; give the samples per second (--rate HZ)."
            )
        return np.arange(rows) / rate_hz
    time_s = table["time_s"]
    if not np.isfinite(time_s).all() or (np.diff(time_s) <= 0).any():
        raise InputError(
            "times-broken", f"Expected time_s of {path} to increase from line to line; it does not."
        )
    own = 1 / float(np.median(np.diff(time_s)))
    if rate_hz is not None and abs(own / rate_hz - 1) > 0.02:
        raise InputError(
            "option-conflict",
            f"{path} has time stamps of {own:.4g} samples a second, which contradict the {rate_hz:g} that were given; "
            "leave the rate out, or delete the column time_s if its clock is wrong.",
        )
    return time_s


def _rotations(table: dict[str, np.ndarray], maps: str) -> np.ndarray:
    R = _of_quaternions(np.stack([table[column] for column in _QUATERNION], axis=-1))
    return R if maps == "world_from_sensor" else transpose(R)


def _of_quaternions(wxyz: np.ndarray) -> np.ndarray:
    """(T, 3, 3) of unit quaternions (T, 4), NaN where one has a NaN. InputError when their length is not about 1."""
    from scipy.spatial.transform import Rotation

    length = np.linalg.norm(wxyz, axis=-1)
    if (np.abs(length - 1) > _UNIT_ERROR).any():
        row = int(np.argmax(np.abs(np.nan_to_num(length, nan=1.0) - 1)))
        raise InputError(
            "wrong-content",
            f"Expected unit quaternions, got one of length {length[row]:.3g} in row {row}; are these columns angles?",
        )
    R = np.full((len(wxyz), 3, 3), np.nan)
    measured = np.isfinite(length)
    R[measured] = Rotation.from_quat(np.roll(wxyz[measured], -1, axis=-1)).as_matrix()
    return R
