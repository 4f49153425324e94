"""The take's joint angles in a recording: both sides in one view, with the band that holds nine in ten errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.take import Take
from ...pipeline.signals.angles import MIDLINE, sides_of
from ...pipeline.signals.foot_angles import ALL_ANGLES, ALL_OF_BOTH
from ..drawing.facts import angle_bands
from ..drawing.palette import LEFT, RIGHT
from ..drawing.rerun_log import log_curves

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

_GROUPS: dict[str, list[str]] = {}
for _name in ALL_OF_BOTH:
    _GROUPS.setdefault(ALL_ANGLES[sides_of(_name)[0]].group, []).append(_name)
_ONE = (110, 140, 255)  # colour of an angle without sides


def angled(take: Take) -> bool:
    """Whether the take has any angle that the recording shows."""
    return any(angle_bands(take, name) for name in ALL_OF_BOTH)


def log_angles(recording: rr.RecordingStream, take: Take) -> None:
    """angles/<angle>: one curve, or right and left; angles/<angle>/low and /high: the ends of the 90 % band, where the
    standard deviation is stated. Rows are those of take.poses."""
    poses = take.need("poses")
    for name in ALL_OF_BOTH:
        if (shown := angle_bands(take, name)) is None:
            continue
        (value, band), parts = shown, sides_of(name)
        colours = [_ONE] if len(parts) == 1 else [RIGHT, LEFT]
        log_curves(recording, f"angles/{name}", poses, value, [f"{p} (deg)" for p in parts], colours)
        if np.isfinite(band).any():
            faint = [(red // 2, green // 2, blue // 2) for red, green, blue in colours]
            for end, values in (("low", value - band), ("high", value + band)):
                names = [f"{part}, {end} end of its 90 % band (deg)" for part in parts]
                log_curves(recording, f"angles/{name}/{end}", poses, values, names, faint, width=0.75)


def angle_views(take: Take) -> rrb.Container:
    """A tab for each part of the body, with a view for each of its angles."""
    import rerun.blueprint as rrb

    tabs = []
    for title, group in _GROUPS.items():
        shown = [name for name in group if angle_bands(take, name)]
        # The viewer names the tab of a single view after the view, so its name must be short.
        named = {name: title if len(shown) == 1 else _title(name) for name in shown}
        views = [
            rrb.TimeSeriesView(
                origin=f"angles/{name}",
                name=f"{words} (deg)",
                plot_legend=rrb.PlotLegend(visible=False),  # the band's thin lines would fill it
            )
            for name, words in named.items()
        ]
        if views:
            tabs.append(rrb.Vertical(*views, name=title) if len(views) > 1 else views[0])
    return rrb.Tabs(*tabs, active_tab=0)


def _title(name: str) -> str:
    words = name.replace("_", " ").capitalize()
    if name not in MIDLINE:
        return f"{words}, right orange, left blue"
    return f"{words}, positive: {ALL_ANGLES[name].positive}"
