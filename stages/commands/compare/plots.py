"""Plots of a comparison that are no curves over time, as SVG."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",  # letters stay letters
    "svg.hashsalt": "pcnet3d",  # the same chart gives the same file
    "font.family": "sans-serif",
    "font.sans-serif": ["Helvetica", "Arial", "DejaVu Sans"],
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#8a939d",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "grid.color": "#e4e8ec",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,  # there is no room above the axis for one
    "xtick.color": "#8a939d",
    "ytick.color": "#8a939d",
    "xtick.labelcolor": "#3c434b",
    "ytick.labelcolor": "#3c434b",
    "path.simplify": True,
}


def svg(
    draw: Callable[[Axes], None], size: tuple[float, float], place: tuple[float, float, float, float]
) -> bytes:
    """What is drawn in axes that take the place (left, bottom, width, height; shares) of a figure of that size."""
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size)
        axes = figure.add_axes(place)
        axes.tick_params(length=2.5, pad=2)
        axes.locator_params(nbins=6)
        draw(axes)
        FigureCanvasSVG(figure).print_svg(
            buffer, metadata=dict.fromkeys(("Date", "Creator", "Format", "Type"))
        )
    return buffer.getvalue()
