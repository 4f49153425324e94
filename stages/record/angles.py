"""The take's joint angles in a recording: both sides in one view, with the band that holds nine in ten errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.figures import label_of
from ...pipeline.core.measures import Moments
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.take import Take
from ...pipeline.signals.angles import ALL_ANGLES, ALL_OF_BOTH, MIDLINE, sides_of
from ...pipeline.signals.filters import nearest_row
from ..drawing.facts import angle_bands
from ..drawing.palette import LEFT, MIDDLE, RIGHT, Colour, faint
from ..drawing.rerun_log import log_curves, time_columns

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb
    from rerun.components import MarkerShapeLike as MarkerShape

_GROUPS: dict[str, list[str]] = {}
for _name in ALL_OF_BOTH:
    _GROUPS.setdefault(ALL_ANGLES[sides_of(_name)[0]].group, []).append(_name)
_FIRST = ("knee_flexion", "elbow_flexion", "trunk_lean_sagittal")
# Of each kind of moment: its marker, and its words behind the movement.
_MARKS: dict[str, tuple[MarkerShape, str]] = {
    "landings": ("down", "initial contact"),
    "toe_offs": ("up", "toe-off"),
    "start": ("plus", "begins"),
    "stop": ("cross", "ends"),
    "peak_at": ("diamond", "peak"),
}
_MOVED = {"walking": "legs", "knee_bends": "legs", "jumps": "legs", "arm_raises": "arms"}
_SIDES: dict[str, Colour] = {"right": RIGHT, "left": LEFT, "": MIDDLE}


def log_angles(recording: rr.RecordingStream, take: Take, clock: PoseSequence, gaps: np.ndarray) -> None:
    """angles/<angle>: one curve, or right and left; angles/<angle>/low and /high: the ends of the 90 % band, where the
    standard deviation is stated. clock: the poses with their gaps marked. gaps: (N,) rows before which one is NaN."""
    for name in ALL_OF_BOTH:
        if (shown := angle_bands(take, name)) is None:
            continue
        value, band = (np.insert(values, gaps, np.nan, axis=0) for values in shown)
        parts = sides_of(name)
        colours = [MIDDLE] if len(parts) == 1 else [RIGHT, LEFT]
        log_curves(recording, f"angles/{name}", clock, value, [f"{p} (deg)" for p in parts], colours)
        if np.isfinite(band).any():
            thin = [faint(colour, 0.4) for colour in colours]
            for end, values in (("low", value - band), ("high", value + band)):
                names = [f"{part}, {end} end of its 90 % band (deg)" for part in parts]
                log_curves(recording, f"angles/{name}/{end}", clock, values, names, thin, width=0.75)


def log_marks(recording: rr.RecordingStream, take: Take) -> None:
    """marks/<legs or arms>/<movement>/<kind>/<side>: the moments of events that the measures tell, at 0."""
    import rerun as rr

    poses = take.need("poses")
    for row in take.figures:
        limbs = _MOVED.get(row.group[0]) if row.group else None
        if not isinstance(row, Moments) or row.name not in _MARKS or not limbs:
            continue
        shape, words = _MARKS[row.name]
        movement, side = row.group[0], row.side
        entity = f"marks/{limbs}/{movement}/{row.name}/{side or 'both'}"
        name = f"{side} {movement.replace('_', ' ')}: {words}".strip()
        look = rr.SeriesPoints(names=name, colors=_SIDES[side], markers=shape, marker_sizes=4)
        recording.log(entity, look, static=True)
        at_s = np.array(row.at_s)
        frame = poses.frame_index[nearest_row(poses.times, at_s)]
        recording.send_columns(entity, time_columns(frame, at_s), rr.Scalars.columns(scalars=0 * at_s))


def first_angles(take: Take) -> list[rrb.View]:
    """Knees, elbows and trunk, with the marks of events."""
    return [_view(name, _title(name)) for name in _FIRST if angle_bands(take, name)]


def angle_views(take: Take) -> list[rrb.Container]:
    """A tab for each part of the body, with a view for each of its angles; empty where the take has none."""
    import rerun.blueprint as rrb

    tabs = []
    for title, group in _GROUPS.items():
        shown = [name for name in group if angle_bands(take, name)]
        # The viewer names the tab of a single view after the view, so its name must be short.
        named = {name: title if len(shown) == 1 else _title(name) for name in shown}
        views = [_view(name, words) for name, words in named.items()]
        if views:
            tabs.append(rrb.Vertical(*views, name=title) if len(views) > 1 else views[0])
    return [rrb.Tabs(*tabs, active_tab=0)] if tabs else []


def _view(name: str, words: str) -> rrb.View:
    import rerun.blueprint as rrb

    joints = " ".join(ALL_ANGLES[sides_of(name)[0]].joints)
    limbs = "" if name in MIDLINE else "/arms" if "elbow" in joints else "/legs"
    return rrb.TimeSeriesView(
        origin=f"angles/{name}",
        contents=["+ $origin/**", f"+ /marks{limbs}/**"],
        name=f"{words} (deg)",
        plot_legend=rrb.PlotLegend(visible=False),  # the band's thin lines would fill it
    )


def _title(name: str) -> str:
    words = label_of(name).capitalize()
    if name not in MIDLINE:
        return f"{words}, right orange, left blue"
    positive = ALL_ANGLES[name].positive
    return words if words.endswith(positive) else f"{words}, positive: {positive}"
