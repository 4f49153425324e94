"""The charts of a report as SVG, each as wide as a telephone, so that a page can set them in columns."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import palette
from .palette import as_hex

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The left is dashed too, for print without colour; on paper what has no side is darker.
LEFT, RIGHT, MIDDLE, SOFT = as_hex(palette.LEFT), as_hex(palette.RIGHT), "#3c434b", "#9aa3ad"
SLICES = 400  # of a long curve, about one a pixel

_MOST_POINTS = 4000  # of a path
_BOTH = np.array([-1.0, 1.0])
_WIDTH, _HEIGHT = 4.1, 2.0  # inches of 96 CSS pixels
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


@dataclass(frozen=True, eq=False)
class Curve:
    """values: (T,), broken where NaN. margin: (T,) half the height of the band around it, None without one. mark: where
    along x an upright line in its colour stands."""

    name: str
    values: np.ndarray
    colour: str = MIDDLE
    margin: np.ndarray | None = None
    dashed: bool = False
    width: float = 1.3
    mark: float | None = None


def sides(left: np.ndarray, right: np.ndarray, **margins: np.ndarray | None) -> list[Curve]:
    """Both sides (T,) of one quantity in the colours that every chart has for them. margins: left_margin, right_margin
    (T,), by how much the band reaches to each side of the curve."""
    return [
        Curve("right", right, RIGHT, margins.get("right_margin")),
        Curve("left", left, LEFT, margins.get("left_margin"), dashed=True),
    ]


def over_time(curves: Sequence[Curve], x: np.ndarray, x_name: str = "time (s)") -> bytes:
    """An SVG of curves over x (T,). More than 2 x SLICES rows are drawn as the range of values of each slice."""

    def draw(axes: Axes) -> None:
        for curve in curves:
            at, low, high = ranges(x, curve.values)
            dashes = (0, (4, 1.3)) if curve.dashed else "-"
            if curve.mark is not None:
                axes.axvline(curve.mark, color=curve.colour, lw=0.8, ls=dashes)
            if curve.margin is not None:
                _, bottom, _ = ranges(x, curve.values - curve.margin)
                _, _, top = ranges(x, curve.values + curve.margin)
                axes.fill_between(at, bottom, top, color=curve.colour, alpha=0.18, linewidth=0)
            if len(at) < len(x):
                axes.fill_between(
                    at, low, high, color=curve.colour, alpha=0.5, linewidth=0.6, label=curve.name
                )
                continue
            axes.plot(at, low, color=curve.colour, lw=curve.width, ls=dashes, label=curve.name)
        axes.set_xlim(float(x[0]), float(x[-1]) if x[-1] > x[0] else float(x[0]) + 1)
        axes.set_xlabel(x_name, labelpad=1)
        if len(curves) > 1:
            axes.legend(
                loc="lower right", bbox_to_anchor=(1.02, 0.97), ncols=len(curves), frameon=False,
                handlelength=1.9, columnspacing=1.2, borderaxespad=0.2,
            )  # fmt: skip

    return svg(draw, (_WIDTH, _HEIGHT), (0.115, 0.2, 0.85, 0.70 if len(curves) > 1 else 0.77))


def path(wrists: Mapping[str, np.ndarray], centre: np.ndarray, reach: float) -> bytes:
    """An SVG of the ways that points take: (T, 2) to the right and up by colour, within `reach` of the centre (2,); a
    cross marks the origin."""

    def draw(axes: Axes) -> None:
        for colour, points in wrists.items():
            axes.plot(*points[:: -(-len(points) // _MOST_POINTS)].T, color=colour, lw=0.9, alpha=0.85)
        axes.plot(0, 0, marker="+", color=MIDDLE, ms=8)
        axes.set(aspect="equal", xlim=centre[0] + reach * _BOTH, ylim=centre[1] + reach * _BOTH)

    return svg(draw, (_WIDTH, _WIDTH), (0.115, 0.08, 0.85, 0.88))


def side_colour(*joints: str) -> str:
    """Of a joint, or of a bone by its ends."""
    of = {joint[:2] for joint in joints} & {"l_", "r_"}
    return MIDDLE if len(of) != 1 else LEFT if of == {"l_"} else RIGHT


def ranges(x: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where, the lowest and the highest value of each slice of a long curve (T,) over x (T,), NaN where it has none; of
    a short one each value itself, twice."""
    if len(x) <= 2 * SLICES:
        return x, values, values
    each = -(-len(x) // SLICES)
    padded = np.full(-(-len(x) // each) * each, np.nan)
    padded[: len(values)] = values
    slices = padded.reshape(-1, each)
    return x[::each], np.fmin.reduce(slices, axis=1), np.fmax.reduce(slices, axis=1)


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
