"""The charts of a page as inline SVG, each as wide as a telephone, so that a page can set them in columns.

Text and grid have the page's colours (page.css), and charts.js lets the values be read off under the pointer; without a
script they stand in a table below each chart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np
from markupsafe import Markup

from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.filters import BRIDGED_S, holes, stretches
from . import palette
from .page import kit
from .palette import as_hex

# The left is dashed too, for print without colour; what has no side has the colour of the page's text.
LEFT, RIGHT, MIDDLE, SOFT = as_hex(palette.LEFT), as_hex(palette.RIGHT), "currentColor", "#9aa3ad"
_OF_SIDES = {"right": RIGHT, "left": LEFT}
SLICES = 400  # of a long curve, about one a pixel

_WIDTH, _HEIGHT = 398, 190  # of a chart, in CSS pixels; text does not scale down below 0.9 on a telephone
_LEFT, _RIGHT, _TOP, _BOTTOM = 42, 384, 8, 156  # of the field within the axes
_BOX = {"width": _WIDTH, "height": _HEIGHT, "left": _LEFT, "right": _RIGHT, "top": _TOP, "bottom": _BOTTOM}
_MOST_DECIMALS = 6  # along x: microseconds


@dataclass(frozen=True, eq=False)
class Curve:
    """values: (T,), broken where NaN. margin: (T,) half the height of the band around it, None without one. mark: where
    along x an upright line in its colour stands."""

    name: str
    values: np.ndarray
    colour: str = MIDDLE
    margin: np.ndarray | None = None
    dashed: bool = False
    width: float = 1.6
    mark: float | None = None


SIDES = "Orange: right. Blue, dashed: left."
BAND = "The band is the ±: it holds the true value in nine of ten frames."


def of_side(
    side: str, values: np.ndarray, margin: np.ndarray | None = None, mark: float | None = None
) -> Curve:
    """A curve of values (T,) in the colour that every chart has for its side, "right" or "left"; of another name in the
    middle's. margin, mark: as of Curve."""
    return Curve(side, values, _OF_SIDES.get(side, MIDDLE), margin, side == "left", mark=mark)


def over_time(
    curves: Sequence[Curve], x: np.ndarray, alt: str, x_name: str = "time (s)", about: str = ""
) -> Markup:
    """A chart of curves over x (T,), with its values in a table below that opens on demand. More than 2 x SLICES rows
    are drawn, and listed, as the range of values of each slice; curves break off where a recording lacks images. alt:
    what it shows, for those who cannot see it. about: what the values are, in a sentence, above the table."""
    curves, x, lacking = _parted(curves, x)
    low_x, high_x = float(x[0]), float(x[-1]) if x[-1] > x[0] else float(x[0]) + 1
    spans = [(ranges(x, curve.values, lacking), _band(x, curve, lacking)) for curve in curves]
    ends = [part for (_, low, high), band in spans for part in (low, high, *band)]
    bottom, top = _limits(np.concatenate(ends))
    across = _scale(low_x, high_x, _LEFT, _RIGHT)
    upward = _scale(bottom, top, _BOTTOM, _TOP)
    lines = []
    for curve, ((at, low, high), band) in zip(curves, spans, strict=True):
        thinned = len(at) < len(x)
        lines.append(
            {
                "name": curve.name,
                "colour": curve.colour,
                "dashed": curve.dashed,
                "width": curve.width,
                "mark": None if curve.mark is None else f"{across(curve.mark):.1f}",
                "bands": [_area(across(at), *map(upward, each)) for each in [band] if each],
                "range": _area(across(at), upward(low), upward(high)) if thinned else "",
                "line": "" if thinned else _line(across(at), upward(low)),
            }
        )
    return kit("chart.html.j2").chart(
        lines,
        [(f"{across(tick):.1f}", words) for tick, words in _ticks(low_x, high_x, 7)],
        [(f"{upward(tick):.1f}", words) for tick, words in _ticks(bottom, top, 6)],
        _BOX,
        {"from": f"{low_x:g}", "to": f"{high_x:g}", "over": x_name, "alt": alt, "about": about},
        _rows(curves, spans, top - bottom, high_x - low_x),
    )


def _parted(curves: Sequence[Curve], x: np.ndarray) -> tuple[Sequence[Curve], np.ndarray, np.ndarray]:
    """Curves and x with a row without a value in each hole of x that filters do not bridge, and these rows (N,)."""
    rows = holes(x, BRIDGED_S)
    if not len(rows):
        return curves, x, rows

    def parted(values: np.ndarray) -> np.ndarray:
        return np.insert(values.astype(float), rows, np.nan)

    curves = [
        replace(
            curve, values=parted(curve.values), margin=None if curve.margin is None else parted(curve.margin)
        )
        for curve in curves
    ]
    return curves, np.insert(x, rows, (x[rows - 1] + x[rows]) / 2), rows + np.arange(len(rows))


def ranges(
    x: np.ndarray, values: np.ndarray, alone: Sequence[int] | np.ndarray = ()
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The middle along x, the lowest and the highest value of each slice of a long curve (T,) over x (T,), these NaN
    where it has none; of a short one each value itself, twice. Slices are equally long but for a row, so that the
    nearest middle is that of the slice itself, but for those that end at a row `alone`, which is one by itself: none
    reaches across a hole."""
    if len(x) <= 2 * SLICES:
        return x, values, values
    cuts = np.asarray(alone, dtype=int)
    first = np.unique(np.concatenate([np.arange(SLICES) * len(x) // SLICES, cuts, cuts + 1]))
    last = np.append(first[1:], len(x)) - 1
    return (x[first] + x[last]) / 2, np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)


def _scale(low: float, high: float, start: float, stop: float) -> Callable[[Any], np.ndarray]:
    """A function from values between low and high to pixels between start and stop."""
    return lambda values: start + (np.asarray(values) - low) * (stop - start) / (high - low)


def _band(x: np.ndarray, curve: Curve, alone: np.ndarray) -> tuple[np.ndarray, ...]:
    if curve.margin is None:
        return ()
    low, high = curve.values - curve.margin, curve.values + curve.margin
    return ranges(x, low, alone)[1], ranges(x, high, alone)[2]


def _limits(values: np.ndarray) -> tuple[float, float]:
    """A little below and above all values; of rounding errors about a constant no whole axis."""
    values = values[np.isfinite(values)]
    if not len(values):
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    room = 0.04 * (high - low) or max(abs(high) * 0.05, 1e-3)
    return low - room, high + room


def _ticks(low: float, high: float, most: int) -> list[tuple[float, str]]:
    """Round values (1, 2 or 5 times a power of ten) between the two, at most so many, with their words."""
    rough = (high - low) / most
    power = 10.0 ** np.floor(np.log10(rough))
    step = power * next(factor for factor in (1, 2, 5, 10) if factor * power >= rough * (1 - 1e-9))
    digits = max(0, -int(np.floor(np.log10(step) + 1e-9)))
    at = np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) * step
    return [(float(tick), f"{tick:z.{digits}f}") for tick in at]


def _line(x: np.ndarray, y: np.ndarray) -> str:
    """The `d` of an SVG path through points, begun anew behind every gap; a point between gaps is a dot."""
    parts, drawing = [], False
    drawable = (np.isfinite(x) & np.isfinite(y)).tolist()
    for across, up, here, goes_on in zip(
        x.tolist(), y.tolist(), drawable, [*drawable[1:], False], strict=True
    ):
        if here:
            parts.append(f"{'L' if drawing else 'M'}{across:.1f} {up:.1f}")
            if not drawing and not goes_on:
                parts.append("h.1")
        drawing = here
    return "".join(parts)


def _area(x: np.ndarray, bottom: np.ndarray, top: np.ndarray) -> str:
    """The `d` of an SVG path around what lies between two curves, a piece between every two gaps."""
    drawable = is_finite(np.stack([x, bottom, top], axis=-1))
    pieces = []
    for start, stop in stretches(np.asarray(drawable)):
        there = np.stack([x, bottom], axis=-1)[start:stop]
        back = np.stack([x, top], axis=-1)[start:stop][::-1]
        points = [f"{across:.1f} {up:.1f}" for across, up in [*there.tolist(), *back.tolist()]]
        pieces.append(f"M{'L'.join(points)}z")
    return "".join(pieces)


def _rows(curves: Sequence[Curve], spans: Sequence, height: float, width: float) -> Markup:
    """What the table says: x, then each curve's value and half its band, to a thousandth of the axes. These are numbers
    alone, so nothing has to be escaped."""
    digits = min(max(0, 2 - int(np.floor(np.log10(height)))), 4)
    digits_x = max(2, 2 - int(np.floor(np.log10(width)))) if width < 100 else 1
    columns = [_places(spans[0][0][0], digits_x)]
    for curve, ((at, low, high), _) in zip(curves, spans, strict=True):
        thinned = len(at) < len(curve.values)
        margin = np.full(len(at), np.nan) if thinned or curve.margin is None else curve.margin
        columns.append(
            [
                "–" if not isfinite(a)
                else f"{a:z.{digits}f} to {b:z.{digits}f}" if thinned
                else f"{a:z.{digits}f}" + (f" ± {off:.{digits}f}" if isfinite(off) else "")
                for a, b, off in zip(low.tolist(), high.tolist(), margin.tolist(), strict=True)
            ]
        )  # fmt: skip
    return Markup("".join(f"<tr><td>{'<td>'.join(row)}" for row in zip(*columns, strict=True)))


def _places(at: np.ndarray, digits: int) -> list[str]:
    """Values along x to so many decimals, or to more where two would be alike: charts.js finds its rows by them."""
    places = [f"{x:z.{digits}f}" for x in at.tolist()]
    alike = len({*places}) < len(places)
    return _places(at, digits + 1) if alike and digits < _MOST_DECIMALS else places
