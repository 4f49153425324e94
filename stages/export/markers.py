"""The joints as other programs take them, TRC and C3D files of markers, and the joint angles as a MOT file of motion:
one even rate, the person's own path where it is known, in metres as a motion laboratory's markers.

Layouts of TRC and MOT: OpenSim's documentation, "Marker (.trc) Files" and "Motion (.mot) Files", and its readers
OpenSim/Common/TRCFileAdapter.cpp and STOFileAdapter. A missing value is written "nan", which readers of every age
take; an empty cell shifts the columns of some. C3D is written through ezc3d (the extra `c3d`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import Any

import numpy as np

from ...pipeline.core.anthropometry import floor_height
from ...pipeline.core.errors import InputError, needed_for
from ...pipeline.core.frames import LEVEL, Frame
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import rotate
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ...pipeline.files.markers import C3D_GROUP, LAST
from ...pipeline.signals.filters import breaks, each_path, even_grid, evenly_spaced, holes, rate, resample
from ..drawing.facts import provenance

_APART = 0.75  # usual intervals to the nearest row of uneven stamps, from which on a moment was not seen
OPENSIM = Frame("OPENSIM", "level", ("front", "up", "right"))  # the axes of OpenSim's models
# Our angles that a coordinate of OpenSim's Rajagopal 2016 model measures the same way, and its sign. Those against the
# trunk line are not among them: that model's back bends, so that its hips and arms are against pelvis and torso.
COORDINATES = {
    f"{side}_{angle}": (f"{coordinate}_{side}", sign)
    for side in "rl"
    for angle, coordinate, sign in (
        ("knee_flexion", "knee_angle", 1),
        ("ankle_dorsiflexion", "ankle_angle", 1),
        ("hip_abduction", "hip_adduction", -1),
        ("elbow_flexion", "elbow_flex", 1),
        ("shoulder_abduction", "arm_add", -1),
    )
}
_LONGEST, _MOST = 100, 255  # characters of a text, texts of a parameter: a C3D file counts both in one byte
_EVENTS = {"landings": "Foot Strike", "toe_offs": "Foot Off"}


@dataclass(frozen=True, eq=False)
class Markers:
    """joints: (N, M, 3) in `unit`, NaN where missing. names: (M,). time_s: (N,) evenly spaced at fps. root: (N, 3) the
    pelvis path from the camera or the world's origin, None where it is not known. unit: "m" or "arbitrary"."""

    joints: np.ndarray
    names: tuple[str, ...]
    time_s: np.ndarray
    fps: float
    root: np.ndarray | None
    unit: str


def markers(take: Take, frame: Frame) -> Markers:
    """The take's filtered joints in metres, in the axes of a frame of LEVEL's family, at one rate as by `evenly`.

    The pelvis is the origin, or moves along its path where that is known, over the floor, whose height is 0. InputError
    for a take without a scale or without a filtered skeleton.
    """
    even = evenly(take, frame)
    if even.unit != "m":
        raise InputError(
            "needs-input",
            "TRC and C3D hold metres, and the source has no scale; give the person's height (--stature METRES).",
        )
    if even.root is None:
        return even
    return replace(even, joints=even.joints + over_the_floor(take, even.root, frame)[:, None])


def nothing_in(values: np.ndarray, path: Path) -> tuple[Notice, ...]:
    """The warning that a file is not written where none of its values (...) is known, such as of five frames, which are
    too few to be smoothed."""
    if np.isfinite(values).any():
        return ()
    return (notice("not-written", file=path.name, reason="no frame has a value for it after smoothing"),)


def over_the_floor(take: Take, root: np.ndarray, frame: Frame) -> np.ndarray:
    """The pelvis path (N, 3), in the axes of a frame of LEVEL's family, from the height of the floor; as it is where
    that is not known."""
    up, height = rotate(frame.basis @ LEVEL.basis.T, np.array([[0.0, 0.0, 1.0]]))[0], _floor_height(take)
    return root if height is None else root - height * up


def frame_over_the_floor(take: Take, frame: Frame, unit: str | None = None) -> Frame:
    """The frame, for readers, of points that `over_the_floor` has moved. unit: that of the file, if not the take's."""
    origin, path = "pelvis", take.need("filtered")
    if path.root is not None:
        origin = "world" if take.need("rectified").in_world else "camera"
        origin += "" if _floor_height(take) is None else ", heights from the floor"
    return frame.with_(origin=origin, unit=unit or path.frame.unit)


def _floor_height(take: Take) -> float | None:
    """None where the take is not levelled, or no foot is ever seen."""
    height = floor_height(take.need("filtered")) if take.need("rectified").level_ok else float("nan")
    return height if np.isfinite(height) else None


def evenly(take: Take, frame: Frame) -> Markers:
    """The take's filtered joints from the pelvis, in its own unit and the axes of a frame of LEVEL's family.

    The files of other programs know no time stamps but a rate: rows that a take lacks are NaN, and one whose stamps are
    not evenly spaced is brought to its usual rate by cubic splines, none of which crosses a gap. InputError for a take
    without a filtered skeleton.
    """
    if take.filtered is None:
        raise InputError(
            "needs-stage",
            "Files for other programs hold the filtered joints; put the stage 'trajectories' before 'export'.",
        )
    path = take.filtered
    joints = path.joints.astype(np.float64)
    points = joints if path.root is None else np.concatenate([joints, path.root[:, None]], axis=1)
    time_s, fps = path.times, rate(path.times)
    if not evenly_spaced(time_s, fps):
        points, time_s, fps = _at_even_times(points, path)
    points, count = rotate(frame.basis @ LEVEL.basis.T, points), joints.shape[1]
    root = None if path.root is None else points[:, count]
    return Markers(points[:, :count], path.layout.joints, time_s, fps, root, path.frame.unit)


def _at_even_times(points: np.ndarray, path: PoseSequence) -> tuple[np.ndarray, np.ndarray, float]:
    """points (T, M, 3) of a path's rows, at even times (N,) and how many those are a second. Rows of an even rate of
    which some are missing stay what they are: a spline would lose those beside each gap, whose rounded stamps lie a
    little beyond the even ones."""
    time_s, fps = path.times, rate(path.times)
    on_grid = even_grid(time_s)
    if on_grid is None:
        even_s = np.arange(time_s[0], time_s[-1] + 1e-9, 1 / fps)
        seams = (*breaks(path), *holes(time_s).tolist())
        splines = each_path(lambda path: resample(path, time_s, even_s, seams), points, len(even_s))
        behind = np.searchsorted(time_s, even_s).clip(1, len(time_s) - 1)
        apart_s = np.minimum(abs(even_s - time_s[behind - 1]), abs(even_s - time_s[behind]))
        near = (apart_s * fps < _APART)[:, None, None]
        return np.where(near, splines, np.nan), even_s, fps
    even_s, rows = on_grid
    placed = np.full((len(even_s), *points.shape[1:]), np.nan)
    placed[rows] = points
    return placed, even_s, (len(even_s) - 1) / float(even_s[-1] - even_s[0])


def write_trc(take: Take, path: Path) -> tuple[Notice, ...]:
    """markers.trc: metres, x forward, y up, z right; markers are named as our joints. Without any joint it is not
    written, and a warning says so. Raises as `markers` does."""
    points = markers(take, OPENSIM)
    if nothing := nothing_in(points.joints, path):
        return nothing
    rows, count = points.joints.shape[:2]
    rate = f"{points.fps:.6f}"
    labels = "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, count + 1))
    values = [rate, rate, rows, count, "m", rate, 1, rows]
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        "\t".join(map(str, values)),
        "Frame#\tTime\t" + "\t\t\t".join(points.names) + "\t\t",
        "\t\t" + labels,
        "",
    ]
    body = np.column_stack([np.arange(1, rows + 1), points.time_s, points.joints.reshape(rows, -1)])
    write_numbers(path, head, body, ["%d", "%.6f", *["%.6f"] * (3 * count)])
    return ()


def write_mot(take: Take, path: Path) -> tuple[Notice, ...]:
    """angles.mot: the joint angles in degrees over time in seconds.

    Angles that OpenSim's Rajagopal model has as coordinates bear its names and signs, the others ours. Without any
    angle it is not written, and a warning says so. InputError when no stage made angles.
    """
    columns = take.kinematics or {}
    angles = {
        name.removesuffix("_deg"): values
        for name, values in columns.items()
        if name.endswith("_deg") and not name.endswith("_sd_deg")
    }
    if not angles:
        raise InputError("needs-stage", "MOT holds joint angles; put the stage 'angles' before 'export'.")
    if nothing := nothing_in(np.stack([*angles.values()]), path):
        return nothing
    renamed = {name: COORDINATES.get(name, (name, 1)) for name in angles}
    notes = [
        f"{ours} is {'-' * (sign < 0)}{theirs}" for ours, (theirs, sign) in renamed.items() if ours != theirs
    ]
    coordinates = {theirs: sign * angles[ours] for ours, (theirs, sign) in renamed.items()}
    write_motion(take, path, take.need("poses").times, coordinates, notes)
    return ()


def write_motion(
    take: Take, path: Path, time_s: np.ndarray, coordinates: Mapping[str, np.ndarray], notes: Sequence[str]
) -> None:
    """A file of motion: coordinates (N,) at time_s (N,), degrees and metres, by their names; the take's provenance and
    the notes are in its head."""
    lines = [
        f"{name}: {text}" for name, text in provenance(take, frame_over_the_floor(take, OPENSIM)).items()
    ]
    head = [
        path.name,
        "version=1",
        f"nRows={len(time_s)}",
        f"nColumns={len(coordinates) + 1}",
        "inDegrees=yes",
        *(line.replace("=", ":") for line in [*lines, *notes]),
        "endheader",
        "\t".join(["time", *coordinates]),
    ]
    write_numbers(path, head, np.column_stack([time_s, *coordinates.values()]))


def write_numbers(
    path: Path,
    head: Sequence[str],
    body: np.ndarray,
    formats: str | Sequence[str] = "%.6f",
    between: str = "\t",
) -> None:
    """The lines of a head, and (N, C) numbers below them."""
    with whole_file(path) as partial, open(partial, "w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join(head) + "\n")
        np.savetxt(file, body, fmt=formats, delimiter=between)


def write_c3d(take: Take, path: Path) -> tuple[Notice, ...]:
    """Points in millimetres, x back, y right, z up, named as our joints; a missing one has the residual -1.

    The number of the first frame says when it begins, counted from 1 at 0 s of the take; returns a note where that is
    no number that the file can hold. The group PCNET3D holds the provenance; POINT X_SCREEN and Y_SCREEN say which axes
    to draw to the right and up; EVENT holds the feet's contacts. More frames than the file can number are not written,
    nor is a single one, which has no rate for the file to state, nor any without a joint, and a warning says so.
    InputError as `markers` raises it.
    """
    with needed_for("C3D", "c3d"):
        import ezc3d

    points_in_time = markers(take, LEVEL)
    count, begin_s = len(points_in_time.time_s), float(points_in_time.time_s[0])
    reason = "a single frame has no rate: write TRC (--also trc)"
    if count > LAST:
        reason = (
            f"C3D numbers {LAST} frames at most, and the take has {count} at an even rate: write TRC (--also trc), or "
            "a part (--time-range)"
        )
    if not 1 < count <= LAST:
        return (notice("not-written", file=path.name, reason=reason),)
    if nothing := nothing_in(points_in_time.joints, path):
        return nothing
    before = round(begin_s * points_in_time.fps)
    numbered = 0 <= before <= LAST - count
    points = 1000 * np.moveaxis(points_in_time.joints, 0, -1).swapaxes(0, 1)  # (3, M, N)
    missing = np.isnan(points).any(axis=0, keepdims=True)
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["UNITS"]["value"] = ["mm"]
    point["RATE"]["value"] = [points_in_time.fps]
    point["LABELS"]["value"] = list(points_in_time.names)
    file["header"]["points"]["first_frame"] = before if numbered else 0
    file["data"]["points"] = np.concatenate([points, np.ones_like(points[:1])])
    file["data"]["meta_points"] = {
        "residuals": np.where(missing, -1.0, 0.0),
        "camera_masks": np.zeros((7, *points.shape[1:]), dtype=bool),
    }
    file.add_parameter("POINT", "X_SCREEN", ["-X"])
    file.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    _add_events(file, take, 0.0 if numbered else begin_s)
    frame = frame_over_the_floor(take, LEVEL, "mm")
    lines = []
    for name, text in provenance(take, frame).items():
        plain = f"{name}: {text}".encode("ascii", "backslashreplace").decode()
        lines += wrap(plain, _LONGEST, subsequent_indent="  ")
    file.add_parameter(C3D_GROUP, "PROVENANCE", lines[:_MOST])
    with whole_file(path) as partial, TemporaryDirectory() as folder:
        made = Path(folder) / "take.c3d"  # ezc3d takes no path whose bytes are not UTF-8
        file.write(str(made))
        copyfile(made, partial)
    if numbered:
        return ()
    return (notice("file-begins", file=path.name, begin_s=begin_s),)


def _add_events(file: Any, take: Take, from_s: float) -> None:
    """The group EVENT: initial contacts and toe-offs of the walks by the names that gait programs look for, at minutes
    and seconds after from_s, in order; none where nobody walks. As many as a parameter can hold (C3D's user guide, "The
    EVENT group")."""
    walking = take.figures.group("walking")
    events = sorted(
        (at_s - from_s, side, label)
        for side in ("right", "left")
        for name, label in _EVENTS.items()
        for at_s in walking.group(side).times(name)
    )
    if not events:
        return
    times, sides, labels = zip(*events[:_MOST], strict=True)
    file.add_parameter("EVENT", "USED", [len(times)])
    file.add_parameter("EVENT", "CONTEXTS", [side.capitalize() for side in sides])
    file.add_parameter("EVENT", "LABELS", list(labels))
    file.add_parameter("EVENT", "TIMES", np.array([np.floor_divide(times, 60), np.mod(times, 60)]))
