"""Points by name over time, as motion laboratories keep them: TRC and C3D files."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

import numpy as np

from .errors import InputError

Up = Literal["y", "z"]


@dataclass(frozen=True, eq=False)
class Markers:
    """points: (T, M, 3) in `unit`, NaN where missing. numbers: (T,) the frames' own numbers, from wherever the file
    counts. up: the axis that is up, as such files usually have it or as this one says."""

    names: list[str]
    points: np.ndarray
    time_s: np.ndarray
    unit: str
    up: Up
    numbers: np.ndarray


def check_c3d() -> None:
    """InputError when ezc3d is not installed."""
    if find_spec("ezc3d") is None:
        raise InputError("C3D needs the package ezc3d; install it with: pip install 'pcnet3d[c3d]'.")


def read_trc(path: Path) -> Markers:
    """A TRC file as OpenSim and Pose2Sim write it (OpenSim's documentation, "Marker (.trc) Files"): +y is up.
    InputError for what is none."""
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
        keys, values = lines[1].split("\t"), lines[2].split("\t")
        said = dict(zip((key.strip() for key in keys), (value.strip() for value in values), strict=False))
        names = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
        cells = [line.split("\t") for line in lines[5:] if line.strip()]
        width = 2 + 3 * len(names)
        rows = [[float(cell.strip() or "nan") for cell in row[:width]] for row in cells]
        table = np.array([row + [np.nan] * (width - len(row)) for row in rows]).reshape(len(rows), width)
        points = table[:, 2:].reshape(len(table), len(names), 3)
        unit = said["Units"]
    except (OSError, IndexError, KeyError, ValueError) as error:
        raise InputError(f"expected a TRC file of marker positions, separated by tabs: {error!r}.") from None
    return Markers(names, points, table[:, 1], unit, "y", table[:, 0].astype(np.int64))


def read_c3d(path: Path) -> Markers:
    """The points of a C3D file, those of negative residual missing; +z is up, as in most laboratories, unless the
    file's POINT Y_SCREEN says +Y (formats.md section 7). InputError for what is no C3D."""
    check_c3d()
    import ezc3d

    try:
        file = ezc3d.c3d(str(path))
        point = file["parameters"]["POINT"]
        names, rate = [str(name) for name in point["LABELS"]["value"]], float(point["RATE"]["value"][0])
        units = point["UNITS"]["value"] if "UNITS" in point else []
        drawn_up = point["Y_SCREEN"]["value"] if "Y_SCREEN" in point else []
        points = np.moveaxis(file["data"]["points"][:3], -1, 0).swapaxes(1, 2)
        residuals = np.moveaxis(file["data"]["meta_points"]["residuals"][0], -1, 0)
    except (OSError, RuntimeError, ValueError, KeyError, IndexError) as error:
        raise InputError(f"expected a C3D file with points: {error}.") from None
    if not rate > 0 or not len(points):
        raise InputError("expected a C3D file with points and their rate; it has none.")
    points = np.where((residuals < 0)[..., None], np.nan, points)
    numbers = np.arange(len(points))
    up = "y" if drawn_up[:1] == ["+Y"] else "z"
    return Markers(names, points, numbers / rate, (units[0] if units else "") or "mm", up, numbers)
