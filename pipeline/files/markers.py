"""Points by name over time, as motion laboratories keep them: TRC and C3D files, and joints of a body model in .npz."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from ..core.errors import InputError, readable
from ..core.layouts import H36M17
from ..core.messages import how_many
from ..core.pose import UNSAID, MadeBy
from .arrays import keys, load, load_all
from .c3d import parse, texts
from .skeletons import SMPL

C3D_GROUP = "PCNET3D"  # of parameters: the provenance, in our own C3D files
_MARKERLESS = ("theia", "opencap", "pose2sim", "captury", "kinatrax", "freemocap")
_MOST_HZ = 10_000
Up = Literal["y", "z"]


@dataclass(frozen=True, eq=False)
class Markers:
    """points: (T, M, 3) in `unit`, NaN where missing. numbers: (T,) the frames' own numbers, from wherever the file
    counts. up: the axis that is up, as such files usually have it or as this one says. made_by: who made them, by the
    file."""

    names: list[str]
    points: np.ndarray
    time_s: np.ndarray
    unit: str
    up: Up
    numbers: np.ndarray
    made_by: MadeBy = UNSAID


def by_subject(markers: Markers) -> dict[str, Markers]:
    """The points of each subject by its name, which stands before a colon ("Ann:RHip", as Vicon writes it) and is taken
    away. Of a file with one subject, all points under its name; with none, under ""."""
    parted = [name.rpartition(":") for name in markers.names]
    plain = [name for _, _, name in parted]
    subjects = list(dict.fromkeys(subject for subject, _, _ in parted if subject))
    if len(subjects) < 2:
        return {"".join(subjects): replace(markers, names=plain)}
    rows = {name: [i for i, (subject, _, _) in enumerate(parted) if subject == name] for name in subjects}
    return {
        name: replace(markers, names=[plain[i] for i in own], points=markers.points[:, own])
        for name, own in rows.items()
    }


def read_trc(path: Path) -> Markers:
    """A TRC file as OpenSim and Pose2Sim write it (OpenSim's documentation, "Marker (.trc) Files"): +y is up. Lines may
    be separated by blanks in place of tabs, and numbers may have decimal commas. InputError for what is none."""
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
        header = dict(zip(_cells(lines[1]), _cells(lines[2]), strict=False))
        names = [name for name in _cells(lines[3])[2:] if name]
        unit = header["Units"]
    except (OSError, IndexError, KeyError) as error:
        raise InputError(
            "format-unknown",
            f"expected a TRC file of marker positions, with its five lines of header: {error!r}.",
        ) from None
    width = 2 + 3 * len(names)
    rows = [(number, line) for number, line in enumerate(lines[5:], 6) if line.strip()]
    table = np.full((len(rows), width), np.nan)
    for values, (number, line) in zip(table, rows, strict=True):
        for column, cell in enumerate(_cells(line)[:width]):
            try:
                values[column] = float(cell.replace(",", ".") or "nan")
            except ValueError:
                raise InputError(
                    "wrong-content",
                    f"line {number}, column {column + 1}: expected a number, got {cell!r:.60}.",
                ) from None
    numbers = table[:, 0] if np.isfinite(table[:, 0]).all() else np.arange(len(table))
    return Markers(
        names,
        table[:, 2:].reshape(len(table), len(names), 3),
        table[:, 1],
        unit,
        "y",
        numbers.astype(np.int64),
    )


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in (line.split("\t") if "\t" in line else line.split())]


PARAMETERS = {"poses", "trans", "betas"}  # of AMASS's own files
RATES = ("mocap_framerate", "mocap_frame_rate", "fps")


def read_joints(path: Path, fps: float | None = None) -> Markers:
    """An .npz of `joints` (T, J, 3) and a frame rate, metres and z up as AMASS has it; J is 17 (H36M17), 22 and more in
    SMPL's order, or named by `joint_names`. Measured where AMASS's parameters and rate stand beside. fps: instead of
    the file's rate. InputError for anything else."""
    held = set(keys(path))
    if "joints" not in held:
        raise InputError(
            "wrong-content",
            f"{path}: expected an array `joints`, got {', '.join(sorted(held)) or 'none'}; with a body model's "
            "parameters alone (AMASS), run the body model and save its joints with a frame rate.",
        )
    joints = load(path, ("frames", "joints", 3), key="joints").astype(np.float64)
    rate = fps or next((float(load(path, (), (1,), key=key).squeeze()) for key in RATES if key in held), 0.0)
    if not 0 < rate < _MOST_HZ:
        raise InputError(
            "needs-rate",
            f"{path}: expected a frame rate in {', '.join(RATES)}, got {rate or 'none'}; add an array fps or give "
            "the rate where the command takes it.",
        )
    if "joint_names" in held:
        names = [str(name) for name in load_all(path, "joint_names")["joint_names"].ravel()]
    else:
        names = [*SMPL, *(f"more{i}" for i in range(joints.shape[1] - len(SMPL)))]
        names = [*H36M17.joints] if joints.shape[1] == len(H36M17) else names
    if len(names) != joints.shape[1]:
        raise InputError(
            "wrong-content",
            f"{path}: expected H36M17's 17 joints, SMPL's {len(SMPL)} and more, or a name for each in joint_names; "
            f"got {how_many(joints.shape[1], 'joint')} and {how_many(len(names), 'name')}.",
        )
    # Who saves an estimator's joints has no such rate.
    captured = held >= PARAMETERS and not held.isdisjoint(RATES[:2])
    rows = np.arange(len(joints))
    made_by = MadeBy("measured", "motion capture (AMASS)") if captured else UNSAID
    return Markers(names, joints, rows / rate, "m", "z", rows, made_by)


def read_c3d(path: Path) -> Markers:
    """The points of a C3D file, those of negative residual missing; +z is up, as in most laboratories, unless the
    file's POINT Y_SCREEN says +Y (formats.md section 6). Time begins with the first row, but in our own files where
    that frame's number says, as the take's does. InputError for what is no C3D."""
    with readable(path, "a C3D file"):
        content = path.read_bytes()
    try:
        file = parse(content)
    except ValueError as error:
        raise InputError("format-unknown", f"expected a C3D file with points: {error}.") from None
    parameters = {name: texts(file.parameters, f"POINT:{name}") for name in ("LABELS", "UNITS", "Y_SCREEN")}
    names = parameters["LABELS"][: file.points.shape[1]]
    if len(names) < file.points.shape[1] or not 0 < file.rate_hz < np.inf:
        raise InputError(
            "wrong-content",
            "expected a C3D file with a name for each of its "
            f"{how_many(file.points.shape[1], 'point')} and their rate, got "
            f"{how_many(len(names), 'name')} and {file.rate_hz:g} a second.",
        )
    ours = f"{C3D_GROUP}:PROVENANCE" in file.parameters  # of anything; all others are motion capture's format
    numbers = (file.first - 1 if ours else 0) + np.arange(len(file.points))
    up = "y" if parameters["Y_SCREEN"][:1] == ["+Y"] else "z"
    unit = "".join(parameters["UNITS"][:1]) or "mm"
    says = (texts(file.parameters, f"MANUFACTURER:{name}")[:1] for name in ("SOFTWARE", "COMPANY"))
    program = " ".join(word.strip() for words in says for word in words).strip()
    made_by = MadeBy("measured", program or "motion capture (C3D)")
    if any(word in program.lower() for word in _MARKERLESS):  # programs that need no markers name themselves
        made_by = MadeBy("estimated", program)
    made_by = UNSAID if ours else made_by
    points = file.points.astype(np.float64)
    return Markers(names, points, numbers / file.rate_hz, unit, up, numbers, made_by)


def z_up(joints: np.ndarray, up: Up) -> np.ndarray:
    """Points (..., 3) of a right-handed Y-up or Z-up file in Z-up axes; y: (x, y, z) -> (x, -z, y), a rotation."""
    return joints if up == "z" else joints[..., [0, 2, 1]] * np.array([1, -1, 1])
