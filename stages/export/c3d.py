"""markers.c3d: the joints as C3D points, through ezc3d (the extra `c3d`)."""

from __future__ import annotations

from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import Any

import numpy as np

from ...pipeline.core.frames import LEVEL
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ...pipeline.files.c3d import LAST
from ...pipeline.files.markers import C3D_GROUP, check_c3d
from ..drawing.provenance import provenance
from .markers import frame_over_the_floor, markers, nothing_in

_LONGEST, _MOST = 100, 255  # characters of a text, texts of a parameter: a C3D file counts both in one byte

_EVENTS = {"landings": "Foot Strike", "toe_offs": "Foot Off"}


def write_c3d(take: Take, path: Path) -> tuple[Notice, ...]:
    """Points in millimetres, x back, y right, z up, named as our joints; a missing one has the residual -1.

    The number of the first frame says when it begins, counted from 1 at 0 s of the take; returns a note where that is
    no number that the file can hold. The group PCNET3D holds the provenance; POINT X_SCREEN and Y_SCREEN say which axes
    to draw to the right and up; EVENT holds the feet's contacts. More frames than the file can number are not written,
    nor is a single one, which has no rate for the file to state, nor any without a joint, and a warning says so.
    InputError as `markers` raises it.
    """
    check_c3d()
    import ezc3d

    points_in_time = markers(take, LEVEL)
    count, begin_s = len(points_in_time.time_s), float(points_in_time.time_s[0])
    if count > LAST:
        reason = (
            f"C3D numbers {LAST} frames at most, and the take has {count} at an even rate: write TRC (--also trc), or "
            "a part (--time-range)"
        )
        return (notice("not-written", file=path.name, reason=reason),)
    if count < 2:
        return (
            notice(
                "not-written", file=path.name, reason="a single frame has no rate: write TRC (--also trc)"
            ),
        )
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
    lines = [part for name, text in provenance(take, frame).items() for part in _wrapped(f"{name}: {text}")]
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
    events = [(at_s - from_s, side, _EVENTS[name]) for at_s, side, name in contacts(take)]
    if not events:
        return
    times, sides, labels = zip(*events[:_MOST], strict=True)
    file.add_parameter("EVENT", "USED", [len(times)])
    file.add_parameter("EVENT", "CONTEXTS", [side.capitalize() for side in sides])
    file.add_parameter("EVENT", "LABELS", list(labels))
    file.add_parameter("EVENT", "TIMES", np.array([np.floor_divide(times, 60), np.mod(times, 60)]))


def contacts(take: Take) -> list[tuple[float, str, str]]:
    """Of the walks of a take, in order: seconds, the side, and what happens to that foot, "landings" or "toe_offs"."""
    walking = take.figures.group("walking")
    return sorted(
        (at_s, side, name)
        for side in ("right", "left")
        for name in _EVENTS
        for at_s in walking.group(side).times(name)
    )


def _wrapped(line: str) -> list[str]:
    """A line in pieces of plain ASCII, those after the first indented."""
    return wrap(line.encode("ascii", "backslashreplace").decode(), _LONGEST, subsequent_indent="  ")
