"""Which way is up, as the recording shows it: the frames' votes as the camera's pitch and roll, and on a sphere."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...pipeline.core.rotations import angle_deg, from_columns, is_finite, rotate, unit
from ...pipeline.core.take import Take
from ..drawing.facts import shared_up, tilt
from ..drawing.palette import PURPLE, YELLOW, faint
from ..drawing.rerun_log import log_curves, time_columns

if TYPE_CHECKING:
    import rerun as rr

_MOST_VOTES = 10_000  # in the cloud
_WHITE, _GRID, _MARK = (235, 235, 235), (85, 85, 85), (170, 170, 170)
_EARLY, _LATE = np.array([120, 50, 130]), np.array(YELLOW)  # far apart for every common colour vision
# For pitch and roll.
_TAKE = (PURPLE, YELLOW)
_VOTES, _BOUND = ([faint(colour, share) for colour in _TAKE] for share in (0.65, 0.5))


class Cap(NamedTuple):
    """The part of the unit sphere where the votes lie. R_source_from_cap: (3, 3), its middle is +z, the camera's
    viewing direction +y and the camera's right +x. reach_deg: from the middle, a multiple of step_deg."""

    R_source_from_cap: np.ndarray
    reach_deg: float
    step_deg: float


def cap(take: Take) -> Cap:
    """Where to look for a take's votes; some frames must have voted."""
    rectified = take.need("rectified")
    up, votes = shared_up(rectified), rectified.up_votes
    middle = unit(up[is_finite(up)].mean(axis=0))
    ahead, image_up = rotate(take.need("poses").frame.basis, np.array([[0.0, 0, 1], [0, -1, 0]]))
    if abs(ahead @ middle) > 0.98:
        ahead = image_up
    ahead = unit(ahead - (ahead @ middle) * middle)
    spread = np.percentile(angle_deg(votes[is_finite(votes)], middle), 98)
    own = angle_deg(up, middle) + np.nan_to_num(rectified.up_bound_deg)
    reach = max(float(spread), float(np.nanmax(own)), 10.0)
    step = 10.0 if reach <= 40 else 30.0
    reach = min(step * np.ceil(reach / step), 90.0)
    return Cap(from_columns(np.cross(ahead, middle), ahead, middle), reach, step)


def log_up(recording: rr.RecordingStream, take: Take) -> None:
    """tilt: pitch and roll of the camera by the votes and by the take, with the 90 % bound; up: the same on the unit
    sphere in the source's axes. Some frames must have voted."""
    _log_tilt(recording, take)
    _log_votes(recording, take)
    _log_take(recording, take)
    _log_graticule(recording, take)


def _log_tilt(recording: rr.RecordingStream, take: Take) -> None:
    poses, both = take.need("poses"), ("pitch", "roll")
    votes, shared, bound = tilt(take)
    edges = (("low", shared - bound), ("high", shared + bound)) if np.isfinite(bound).any() else ()
    for edge, values in edges:
        names = [f"{angle}, {edge} end of its 90 % bound (deg)" for angle in both]
        log_curves(recording, f"tilt/{edge}", poses, values, names, _BOUND, width=1.0)
    names = [f"{angle}, votes (deg)" for angle in both]
    log_curves(recording, "tilt/votes", poses, votes, names, _VOTES, width=1.0)
    names = [f"{angle} of the camera (deg)" for angle in both]
    log_curves(recording, "tilt/take", poses, shared, names, _TAKE, width=2.0)


def _log_votes(recording: rr.RecordingStream, take: Take) -> None:
    """up/votes: all of them, early ones purple, late ones yellow; up/vote: that of the frame."""
    import rerun as rr

    poses = take.need("poses")
    votes = take.need("rectified").up_votes
    rows = np.flatnonzero(is_finite(votes))
    rows = rows[:: -(-len(rows) // _MOST_VOTES)]
    late = (rows / max(len(votes) - 1, 1))[:, None]
    colours = np.round(_EARLY + late * (_LATE - _EARLY)).astype(np.uint8)
    recording.log("up/votes", rr.Points3D(votes[rows], colors=colours, radii=[-2.0]), static=True)
    recording.log("up/vote", rr.Points3D.from_fields(colors=[_WHITE], radii=[-5.0]), static=True)
    clock = time_columns(poses.frame_index, poses.times)
    recording.send_columns("up/vote", clock, rr.Points3D.columns(positions=votes))


def _log_take(recording: rr.RecordingStream, take: Take) -> None:
    """up/take: an arrow along the take's up, out of the sphere; up/bound: the circle in which it lies with 90 %."""
    import rerun as rr

    poses = take.need("poses")
    rectified = take.need("rectified")
    around = np.linspace(0, 2 * np.pi, 73)
    circle = np.stack([np.cos(around), np.sin(around), np.ones(len(around))], axis=-1)
    recording.log("up/bound", rr.LineStrips3D([circle], colors=[_WHITE], radii=[-1.5]), static=True)
    recording.log("up/take", rr.Arrows3D.from_fields(colors=[_WHITE], radii=[-2.0]), static=True)
    # The circle at height 1 comes to the bound's angle by a matrix, which costs less than a circle a frame.
    bound = np.radians(rectified.up_bound_deg)
    sizes = np.stack([np.sin(bound), np.sin(bound), np.cos(bound)], axis=-1)
    matrix = rectified.R_source_from_level * sizes[:, None, :]
    up = shared_up(rectified)
    length = 0.3 * np.sin(np.radians(cap(take).reach_deg))
    if rectified.R_source_from_level.ndim == 3:
        clock = time_columns(poses.frame_index, poses.times)
        recording.send_columns("up/bound", clock, rr.Transform3D.columns(mat3x3=matrix))
        recording.send_columns("up/take", clock, rr.Arrows3D.columns(origins=up, vectors=length * up))
    else:
        recording.log("up/bound", rr.Transform3D.from_fields(mat3x3=matrix[0]), static=True)
        arrow = rr.Arrows3D.from_fields(origins=up[:1], vectors=length * up[:1])
        recording.log("up/take", arrow, static=True)


def _log_graticule(recording: rr.RecordingStream, take: Take) -> None:
    """up/grid: circles about the middle, and where the camera's axes point; up/picture: the
    image's up."""
    import rerun as rr

    R_source_from_cap, reach, step = cap(take)
    degrees = np.arange(step, reach + 1, step)
    azimuths = np.radians(np.arange(0, 360, 30))
    circles = [_on_cap(np.radians(angle), np.linspace(0, 2 * np.pi, 73)) for angle in degrees]
    meridians = [_on_cap(np.radians(np.linspace(0, reach, 19)), azimuth) for azimuth in azimuths]
    strips = [rotate(R_source_from_cap, strip) for strip in (*circles, *meridians)]
    recording.log("up/grid", rr.LineStrips3D(strips, colors=[_GRID], radii=[-0.7]), static=True)
    rim = _on_cap(np.radians(1.08 * reach), np.radians([0, 90, 180, 270]))
    marks = np.concatenate([rim, _on_cap(np.radians(degrees), np.radians(45.0))])
    names = ["right", "away", "left", "toward", *(f"{angle:.0f}°" for angle in degrees)]
    where = rotate(R_source_from_cap, marks)
    recording.log(
        "up/grid/names",
        rr.Points3D(where, labels=names, colors=[_MARK], radii=[-0.5], show_labels=True),
        static=True,
    )
    image_up = rotate(take.need("poses").frame.basis, np.array([[0.0, -1.0, 0.0]]))
    mark = rr.Points3D(image_up, labels=["picture's up"], colors=[(238, 102, 119)], radii=[-4.0])
    recording.log("up/picture", mark, static=True)


def _on_cap(angle: np.ndarray, azimuth: np.ndarray | float) -> np.ndarray:
    """(N, 3) unit vectors at that angle from +z and that azimuth from +x to +y, radians."""
    angle, azimuth = np.broadcast_arrays(angle, azimuth)
    return np.stack(
        [np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)], axis=-1
    )
