"""The view that a recording opens with: the person on the levelled floor, and beside them, thin, as the camera's axes
had them. It goes along with the person."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import transpose
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import on_lines
from ..drawing.palette import faint, side_colour
from ..drawing.rerun_log import person_view, time_columns
from .walk import camera_sides, ground, walked

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

# In sizes of the person, before LEVEL's person, who faces -x, to the right and above.
_EYE = (-2.2, 1.1, 0.55)
_ASIDE = np.radians(40.0)  # from the camera's direction: tilts to the side and to the front can both be seen
_APART = 1.15  # sizes of the person between the two pelvises
_FLOOR, _MOST_LINES, _AROUND = (70, 70, 70), 60, 2.5  # lines of the floor to each side; its margin, in sizes
_FAINT = 0.5  # share of its colour that the thin skeleton keeps
_U = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # R_z_up_from_camera of a camera that is level


def log_first(recording: rr.RecordingStream, take: Take, size: float) -> None:
    """Places in the room, LEVEL, of what is logged by itself: level; source, upright as in its image, beside it; and
    walk/along, which goes along with the pelvis over the floor. walk/floor: the floor's lines.

    Without a path all stay where they are."""
    import rerun as rr

    rectified, poses = take.need("rectified"), take.need("poses")
    level, clock = rectified.level, time_columns(poses.frame_index, poses.times)
    root = np.zeros((len(level), 3)) if walked(rectified) is None else level.root
    assert root is not None
    path = on_lines(root[:, :2], np.arange(len(root)))
    over_floor = np.column_stack([np.nan_to_num(path), np.full(len(root), ground(rectified, size))])
    recording.send_columns("level", clock, rr.Transform3D.columns(translation=root))
    recording.send_columns("walk/along", clock, rr.Transform3D.columns(translation=over_floor))
    _log_floor(recording, over_floor, size)
    if _has_ghost(take):
        R = _upright(np.broadcast_to(rectified.R_source_from_level, (len(root), 3, 3)), poses)
        beside = root + _APART * size * _left(take)
        recording.send_columns("source", clock, rr.Transform3D.columns(translation=beside, mat3x3=R))


def first_view(take: Take, size: float) -> rrb.View:
    """size: about half the person's height."""
    import rerun as rr

    rectified, source = take.need("rectified"), take.need("poses")
    shown = ["walk/floor", "walk/path/**", "level/**"]
    name, middle = "The person on the floor, LEVEL", np.zeros(3)
    if _has_ghost(take):
        shown.append("source/bones")
        middle = 0.5 * _APART * size * _left(take)
        name += "; thin: before, in the camera's axes"
    middle[2] = -0.95 * ground(rectified, size) if walked(rectified) is None else 0.85 * size
    colours = [faint(side_colour(*bone), _FAINT) for bone in source.layout.bones]
    thin = rr.LineStrips3D.from_fields(colors=colours, radii=[0.006 * size])
    return person_view(
        "walk/along",
        name if rectified.level_ok else f"{name}; not levelled",
        middle + size * _eye(take),
        middle,
        contents=[f"+ /{entity}" for entity in shown],
        overrides={"source/bones": thin},
    )


def _has_ghost(take: Take) -> bool:
    return take.need("poses").frame.family == "camera"


def _eye(take: Take) -> np.ndarray:
    """(3,) where the eye stands, in LEVEL: by the camera, turned to the side that the person faces."""
    sides = camera_sides(take)
    if sides is None:
        return np.array(_EYE)
    ahead, aside = sides
    reach = np.linalg.norm(_EYE[:2])
    return np.append(reach * (np.sin(_ASIDE) * aside - np.cos(_ASIDE) * ahead), _EYE[2])


def _left(take: Take) -> np.ndarray:
    """(3,) unit, what is to the left for the eye."""
    x, y, _ = _eye(take)
    return np.array([y, -x, 0.0]) / np.hypot(x, y)


def _upright(R_source_from_level: np.ndarray, poses: PoseSequence) -> np.ndarray:
    """(T, 3, 3) from the source's axes to the room's as if its camera were level, with the camera's heading: the
    rotation about the vertical that comes nearest to the true one."""
    R_z_up_from_source = _U @ poses.frame.basis.T
    R = transpose(R_source_from_level) @ R_z_up_from_source.T
    turn = np.arctan2(R[:, 1, 0] - R[:, 0, 1], R[:, 0, 0] + R[:, 1, 1])
    about = np.zeros_like(R)
    about[:, 0, 0] = about[:, 1, 1] = np.cos(turn)
    about[:, 1, 0], about[:, 0, 1], about[:, 2, 2] = np.sin(turn), -np.sin(turn), 1
    return about @ R_z_up_from_source


def _log_floor(recording: rr.RecordingStream, over_floor: np.ndarray, size: float) -> None:
    """walk/floor: lines under the path and around it, as far apart as a quarter of the person's height."""
    import rerun as rr

    low, high = np.percentile(over_floor[:, :2], (1, 99), axis=0) + _AROUND * size * np.array([[-1], [1]])
    step = max(size / 2, float((high - low).max()) / _MOST_LINES)
    low, high = np.floor(low / step) * step, np.ceil(high / step) * step
    strips = [[(x, low[1]), (x, high[1])] for x in np.arange(low[0], high[0] + step / 2, step)]
    strips += [[(low[0], y), (high[0], y)] for y in np.arange(low[1], high[1] + step / 2, step)]
    lines = np.array(strips)
    lines = np.concatenate([lines, np.full((*lines.shape[:2], 1), over_floor[0, 2])], axis=-1)
    recording.log("walk/floor", rr.LineStrips3D(lines, colors=[_FLOOR], radii=[-0.7]), static=True)
