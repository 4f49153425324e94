"""Points by name over time, as motion laboratories keep them: TRC and C3D files, and joints of a body model in .npz.

ezc3d, which writes C3D files for us ("The C3D File Format User Guide", c3d.org), ends the whole program on some damaged
ones, so strangers' are read here: numbers of header and parameters are compared with the file's length before use.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ..core.errors import InputError, readable
from ..core.layouts import H36M17
from ..core.messages import how_many
from ..core.pose import UNSAID, MadeBy
from .arrays import keys, load, load_all
from .skeletons import SMPL

C3D_GROUP = "PCNET3D"  # of parameters: the provenance, in our own C3D files
_MARKERLESS = ("theia", "opencap", "pose2sim", "captury", "kinatrax", "freemocap")
_MOST_HZ = 10_000
Up = Literal["y", "z"]

_BLOCK = 512
_INTEL, _OTHERS = 84, (85, 86)  # the processor whose numbers the file has; DEC and MIPS of the 1990s
_ITEM = {-1: 1, 1: 1, 2: 2, 4: 4}  # bytes by a parameter's type: text, byte, integer, real
LAST = 65535  # the greatest number of a frame that the header's two bytes hold


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
        file = parse_c3d(content)
    except ValueError as error:
        raise InputError("format-unknown", f"expected a C3D file with points: {error}.") from None

    def texts(parameter: str) -> list[str]:
        return [*map(str, file.parameters.get(parameter, ()))]

    names = texts("POINT:LABELS")[: file.points.shape[1]]
    if len(names) < file.points.shape[1] or not 0 < file.rate_hz < np.inf:
        raise InputError(
            "wrong-content",
            "expected a C3D file with a name for each of its "
            f"{how_many(file.points.shape[1], 'point')} and their rate, got "
            f"{how_many(len(names), 'name')} and {file.rate_hz:g} a second.",
        )
    ours = f"{C3D_GROUP}:PROVENANCE" in file.parameters  # of anything; all others are motion capture's format
    numbers = (file.first - 1 if ours else 0) + np.arange(len(file.points))
    up = "y" if texts("POINT:Y_SCREEN")[:1] == ["+Y"] else "z"
    unit = "".join(texts("POINT:UNITS")[:1]) or "mm"
    says = (texts(f"MANUFACTURER:{name}")[:1] for name in ("SOFTWARE", "COMPANY"))
    program = " ".join(word.strip() for words in says for word in words).strip()
    made_by = MadeBy("measured", program or "motion capture (C3D)")
    if any(word in program.lower() for word in _MARKERLESS):  # programs that need no markers name themselves
        made_by = MadeBy("estimated", program)
    made_by = UNSAID if ours else made_by
    points = file.points.astype(np.float64)
    return Markers(names, points, numbers / file.rate_hz, unit, up, numbers, made_by)


class C3d(NamedTuple):
    """points: (T, M, 3) float32 in the file's unit, NaN where the residual is negative. first: the number of the first
    frame, usually 1. rate_hz: of the points. parameters: values by "GROUP:NAME", texts or numbers in the file's
    order."""

    points: np.ndarray
    first: int
    rate_hz: float
    parameters: dict[str, list[Any]]


def parse_c3d(content: bytes) -> C3d:
    """ValueError, saying why, for anything but a whole C3D file."""
    if len(content) < _BLOCK or content[0] == 0:
        raise ValueError("it has no header")
    begin = (content[0] - 1) * _BLOCK
    processor = content[begin + 3] if begin + 3 < len(content) else 0
    if processor in _OTHERS:
        raise ValueError("its numbers are those of a DEC or MIPS machine; write it again for Intel's")
    if processor != _INTEL:
        raise ValueError("its parameters are not where its header says")
    parameters = _parameters(content, begin + 4)
    _, count, analog, first, last, _, _, _, block = map(int, np.frombuffer(content[:18], "<u2"))
    # What the header's two bytes cannot hold is told by parameters.
    starts, ends = (parameters.get(f"TRIAL:ACTUAL_{end}_FIELD", []) for end in ("START", "END"))
    if len(starts) == len(ends) == 2 and all(isinstance(value, int) for value in (*starts, *ends)):
        first, last = ((two[0] & 0xFFFF) + 65536 * (two[1] & 0xFFFF) for two in (starts, ends))
    width, frames = 4 * count + analog, last - first + 1
    scale, header_rate = (float(np.frombuffer(content[at : at + 4], "<f4")[0]) for at in (12, 20))
    item = 4 if scale < 0 else 2
    start, promised = (block - 1) * _BLOCK, frames * width * item
    if not count or not block or frames < 1 or len(content) < start + promised:
        raise ValueError(
            f"its header promises {how_many(frames, 'frame')} of {how_many(count, 'point')}, "
            f"{len(content)} bytes do not hold them"
        )
    if last == LAST and len(content) - start - promised >= max(_BLOCK, width * item):
        raise ValueError(
            f"its header counts to frame {LAST}, its maximum, and more data follow, so the file does not say how "
            "many frames it has; export it in parts, or as TRC"
        )
    data = content[start : start + promised]
    values = np.frombuffer(data, "<f4" if item == 4 else "<i2").astype(np.float32)
    points = values.reshape(frames, width)[:, : 4 * count].reshape(frames, count, 4)
    places = points[..., :3] if item == 4 else points[..., :3] * np.float32(scale)
    (rate_hz,) = parameters.get("POINT:RATE", [])[:1] or [header_rate]
    if isinstance(rate_hz, str):
        raise ValueError("its POINT:RATE is text, not a number")
    return C3d(np.where(points[..., 3:] < 0, np.nan, places), first, rate_hz, parameters)


def _parameters(content: bytes, at: int) -> dict[str, list[Any]]:
    """Records one after the other, groups and parameters mixed, each with the distance to the next."""
    groups: dict[int, str] = {}
    records: list[tuple[int, str, list[Any]]] = []
    while at + 2 <= len(content):
        length, group = (int(number) for number in np.frombuffer(content[at : at + 2], np.int8))
        body = at + 2 + abs(length)
        if length == 0 or group == 0:
            break
        name = content[at + 2 : body].decode("latin1").strip().upper()
        distance = int.from_bytes(content[body : body + 2], "little") if body + 2 <= len(content) else 0
        at = body + distance if distance else len(content)
        if group < 0:
            groups[-group] = name
        else:
            records.append((group, name, _values(content[body + 2 : at])))
    return {f"{groups.get(group, '')}:{name}": values for group, name, values in records}


def _values(record: bytes) -> list[Any]:
    """Of a parameter's record: type, number of dimensions, dimensions, data, the first dimension running fastest."""
    kind = int.from_bytes(record[:1], signed=True)
    dims = list(record[2 : 2 + record[1]]) if len(record) > 1 else []
    count = math.prod(dims)
    data = record[2 + len(dims) :][: count * _ITEM.get(kind, 0)]
    if kind not in _ITEM or len(data) < count * _ITEM[kind]:
        raise ValueError("its parameters are damaged")
    if kind == -1:
        length = dims[0] if dims else 1
        pieces = [data[i : i + length] for i in range(0, len(data), length)] if length else []
        return [piece.decode("utf-8", "replace").strip("\0 ") for piece in pieces]
    if kind == 1:
        return list(data)
    return np.frombuffer(data, "<i2" if kind == 2 else "<f4").tolist()


def z_up(joints: np.ndarray, up: Up) -> np.ndarray:
    """Points (..., 3) of a right-handed Y-up or Z-up file in Z-up axes; y: (x, y, z) -> (x, -z, y), a rotation."""
    return joints if up == "z" else joints[..., [0, 2, 1]] * np.array([1, -1, 1])
