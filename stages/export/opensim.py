"""What OpenSim opens: the joints as a TRC file of markers, the joint angles as a MOT file of motion.

Layouts: OpenSim's documentation, "Marker (.trc) Files" and "Motion (.mot) Files", and its readers
OpenSim/Common/TRCFileAdapter.cpp and STOFileAdapter. A missing value is written "nan", which readers of every age
take; an empty cell shifts the columns of some.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.notices import Notice
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ..drawing.provenance import provenance
from .markers import OPENSIM, frame_over_the_floor, markers, nothing_in

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
    with whole_file(path) as partial:
        _write(partial, head, body, ["%d", "%.6f", *["%.6f"] * (3 * count)])
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
    with whole_file(path) as partial:
        body = np.column_stack([time_s, *coordinates.values()])
        _write(partial, head, body, ["%.6f"] * body.shape[1])


def _write(path: Path, head: list[str], body: np.ndarray, formats: list[str]) -> None:
    """The lines of a head, and (N, C) numbers below them, tabs between."""
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join(head) + "\n")
        np.savetxt(file, body, fmt=formats, delimiter="\t")
