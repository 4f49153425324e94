"""How each kind of data enters a recording: whole columns at once, looks once, nothing frame by frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.blocks import blocks
from ...pipeline.core.notices import Notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from .palette import DARK, Colour, side_colour
from .rerun_video import Part

if TYPE_CHECKING:
    import pyarrow as pa
    import rerun as rr
    import rerun.blueprint as rrb

_LEVELS = {"warning": "WARN", "repair": "INFO", "mark": "INFO", "note": "DEBUG"}
_ROWS = 1 << 13  # of a skeleton that are sent at a time, four minutes at 30 frames a second
_LETTERS = {"away": "F", "toward": "B", "north": "F", "south": "B", "west": "L", "east": "R"}


def person_view(
    entity: str,
    name: str,
    eye: np.ndarray,
    target: Sequence[float] | np.ndarray = (0, 0, 0),
    contents: str | Sequence[str] = "$origin/**",
) -> rrb.View:
    """A view on dark ground, from where an eye (3,) stands to a target (3,). contents: entities, by default `entity`
    and all below it."""
    import rerun.blueprint as rrb

    controls = rrb.EyeControls3D(position=eye, look_target=target)
    return rrb.Spatial3DView(
        origin=entity,
        contents=contents,
        name=name,
        eye_controls=controls,
        background=DARK,
        line_grid=rrb.LineGrid3D(False),
    )


def half_height(joints: np.ndarray) -> float:
    """About half a person's height, in the unit of joints (T, J, 3) from the pelvis."""
    distance = np.linalg.norm(joints[is_finite(joints)], axis=-1)
    return float(np.percentile(distance, 98)) if len(distance) else 1.0


def time_columns(frame: np.ndarray, time_s: np.ndarray) -> list[rr.TimeColumn]:
    """Both time axes for rows of data: video frame numbers (T,) and seconds (T,)."""
    import rerun as rr

    nanoseconds = np.round(time_s * 1e9).astype("timedelta64[ns]")
    return [rr.TimeColumn("frame", sequence=frame), rr.TimeColumn("video_time", duration=nanoseconds)]


def log_video(
    recording: rr.RecordingStream, parts: Iterable[Part], time_s: np.ndarray, first: int = 0
) -> None:
    """The video's parts, each once it is there, and a reference to each of their frames. time_s: (N,) of all frames of
    the video; first: the number of the first that is in the parts."""
    import rerun as rr

    for number, part in enumerate(parts):
        entity = f"video_parts/{number}"  # apart from "video", so that no view shows them by themselves
        recording.log(entity, part.asset, static=True)
        frames = np.arange(first, first + len(part.stamps_ns))
        references = rr.VideoFrameReference.columns(
            timestamp=part.stamps_ns, video_reference=[entity] * len(frames)
        )
        recording.send_columns("video", time_columns(frames, time_s[frames]), references)
        recording.flush()  # so that no part waits in memory
        first += len(frames)


def log_skeleton(recording: rr.RecordingStream, entity: str, poses: PoseSequence, radius: float) -> None:
    """`entity`/joints and `entity`/bones. radius: of a joint, in scene units or negative in screen points."""
    import rerun as rr

    layout, frame = poses.layout, poses.frame
    points, lines = rr.Points2D, rr.LineStrips2D
    if frame.dims == 3:
        points, lines = rr.Points3D, rr.LineStrips3D
        letters = [_LETTERS.get(word, word[0].upper()) for word in frame.axes]
        recording.log(entity, getattr(rr.ViewCoordinates, "".join(letters)), static=True)
    colours = [side_colour(joint) for joint in layout.joints]
    look = points.from_fields(colors=colours, radii=[radius], labels=layout.joints, show_labels=False)
    recording.log(f"{entity}/joints", look, static=True)
    bones = lines.from_fields(colors=[side_colour(*bone) for bone in layout.bones], radii=[0.55 * radius])
    recording.log(f"{entity}/bones", bones, static=True)
    ends = np.array([layout.indices(bone) for bone in layout.bones])
    for clock, joints in _pieces(recording, poses):
        columns = points.columns(positions=joints.reshape(-1, frame.dims))
        places = columns.partition(np.full(len(joints), len(layout)))
        recording.send_columns(f"{entity}/joints", clock, places)
        columns = lines.columns(strips=_segments(joints[:, ends]))
        recording.send_columns(f"{entity}/bones", clock, columns.partition(np.full(len(joints), len(ends))))


def _pieces(
    recording: rr.RecordingStream, poses: PoseSequence
) -> Iterator[tuple[list[rr.TimeColumn], np.ndarray]]:
    """Times and joints of at most _ROWS rows each; between them what was sent is written, or the columns of a long
    take pile up in memory."""
    for rows in blocks(len(poses), _ROWS):
        yield time_columns(poses.frame_index[rows], poses.times[rows]), poses.joints[rows]
        if len(poses) > _ROWS:
            recording.flush()


def _segments(ends: np.ndarray) -> pa.Array:
    """ends (T, bones, 2, D) as an array of T x bones line strips in rerun's own storage type.

    rerun's conversion from numpy makes a Python object of every strip: seconds for a long take.
    """
    import pyarrow as pa
    import rerun as rr

    batch = rr.components.LineStrip3DBatch if ends.shape[-1] == 3 else rr.components.LineStrip2DBatch
    strips = batch._ARROW_DATATYPE
    assert strips is not None
    points = pa.FixedSizeListArray.from_arrays(pa.array(ends.reshape(-1)), type=strips.value_type)
    starts = pa.array(np.arange(0, len(points) + 1, 2, dtype=np.int32))
    return pa.ListArray.from_arrays(starts, points, type=strips)


def log_curves(
    recording: rr.RecordingStream,
    entity: str,
    clock: PoseSequence,
    values: np.ndarray,
    names: Sequence[str],
    colours: Sequence[Colour],
    width: float = 1.5,
) -> None:
    """One curve a name: values (T, len(names)), or (T,) for a single one."""
    import rerun as rr

    look = rr.SeriesLines(names=names, colors=colours, widths=[width] * len(names))
    recording.log(entity, look, static=True)
    columns = rr.Scalars.columns(scalars=values.reshape(-1)).partition(np.full(len(clock), len(names)))
    recording.send_columns(entity, time_columns(clock.frame_index, clock.times), columns)
    recording.flush()


def log_notices(recording: rr.RecordingStream, notices: Sequence[Notice], clock: PoseSequence) -> None:
    """One line a notice, at the first of its rows; what concerns the whole take stands at the first."""
    import rerun as rr

    if not notices:
        return
    ordered = sorted(notices, key=_first_row)
    rows = [_first_row(each) for each in ordered]
    recording.send_columns(
        "events",
        indexes=time_columns(clock.frame_index[rows], clock.times[rows]),
        columns=rr.TextLog.columns(
            text=[f"{each.code if each.weight == 'mark' else each.weight}: {each.text}" for each in ordered],
            level=[_LEVELS.get(each.weight, "WARN") for each in ordered],
        ),
    )


def _first_row(event: Notice) -> int:
    return event.rows[0] if event.rows else 0
