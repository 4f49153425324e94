"""The 17 joints, and heels and toes where the source has them, as other programs take them: one even rate, the person's
own path where it is known, in metres as a motion laboratory's markers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...pipeline.core.anthropometry import floor_height
from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import LEVEL, Frame
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import rotate
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import breaks, each_path, even_grid, evenly_spaced, holes, rate, resample

_APART = 0.75  # usual intervals to the nearest row of uneven stamps, from which on a moment was not seen
OPENSIM = Frame("OPENSIM", "level", ("front", "up", "right"))  # the axes of OpenSim's models


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
