"""TRC files of joint centres: OpenSim's, and those of Pose2Sim (formats.md section 6).

Five header lines (PathFileType; names, values; markers; X1 Y1 Z1 ...), then Frame#, Time and three numbers a marker,
separated by tabs. +y is up: Pose2Sim turns its world so, OpenSim's models stand so. Sports2D writes the same form from
one camera, with a depth that is a constant for each marker and visible side: such files are refused.

What the file cannot know: which video frame a row is (OpenSim counts from 1, Pose2Sim from 0), and the true frame
rate of Pose2Sim's cameras, which it rounds, or takes for 30 where it cannot read it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.files.markers import Markers, read_trc
from ..pipeline.files.opened import first_bytes
from .kit.world import reader_of

name = "trc"
gives = "poses"
reads = "TRC of OpenSim and Pose2Sim: joint centres in a world, y up"

_BEGINS = b"PathFileType"
_DEPTHS = 4  # of one marker in Sports2D's tables: for right, left, front and back
_ENOUGH = 20  # frames that say whether a depth is measured


def sniff(path: Path) -> bool:
    return first_bytes(path, len(_BEGINS)) == _BEGINS


def _points(path: Path) -> Markers:
    """InputError for a file without rows, and for one whose depth is Sports2D's."""
    markers = read_trc(path)
    if len(markers.points) == 0:
        raise InputError("nothing-usable", "expected rows of marker positions after the header, got none.")
    if _invented_depth(markers):
        raise InputError(
            "wrong-content",
            "expected positions in space, got a Sports2D file, whose z is a constant from a table for each "
            "marker and not measured; give its 2D detections with --keypoints and have them lifted.",
        )
    return markers


def _invented_depth(markers: Markers) -> bool:
    """Whether each marker moves in x and y but has only the few depths of Sports2D's table."""
    if len(markers.points) < _ENOUGH or not markers.names:
        return False
    depths = [len(np.unique(z[np.isfinite(z)])) for z in markers.points[..., 2].T]
    moved = [len(np.unique(x[np.isfinite(x)])) for x in markers.points[..., 0].T]
    return max(depths) <= _DEPTHS < max(moved)


read = reader_of(_points)
