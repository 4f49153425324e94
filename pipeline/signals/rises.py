"""How high a jump of lifted poses is: by heights over the floor, and by how fast the body goes up.

Lifted ankles and bodies are off by 2 to 3 cm, and a take-off found 20 ms too late would make the rise 4 cm too small.
So the rise is a weighted mean of two figures that hardly depend on that moment: how much higher the body gets than it
is on stretched legs with the heels off the floor, and the height from which it would fall to be as fast as it goes up.
"""

from __future__ import annotations

import numpy as np

from .filters import rate

_STANDS_S = 1.0  # before and after a flight: where the floor is
# Statures: floors before and after a flight that differ by less count as one; a path may be off by half of that.
_STAIRS = 0.15
_STRETCH_S = 0.1  # around the take-off: in which the legs are stretched most
_STRETCHED = 90  # per cent of that time in which the centre of mass is nearer to the ankles
# Statures by which the lower ankle is higher at the take-off than it mostly is on the floor: median of 57 captured
# jumps of train people, of which nine in ten are within 0.009.
_HEEL = 0.054
_SPEED_S = 0.2  # to either side of a moment: over which its speed is taken
_BEFORE_S = 0.15  # the take-off: from when on the body may be fastest
# The rise by speed in statures: _LEAST and _BY_FALL times the height of a free fall that ends with that speed, a line
# through 67 captured jumps of train people, which are off it by 2.4 cm (standard deviation).
_LEAST, _BY_FALL = 0.018, 1.80
# Weight of the rise by speed in the mean, from the errors in lifted jumps of train people: by speed 3.5 cm, by heights
# 2.8.
_SHARE = 0.3


def lifted_rise(
    time_s: np.ndarray,
    centre: np.ndarray,
    ankle: np.ndarray,
    stands: np.ndarray,
    rows: slice,
    off_s: float,
    apex_s: float,
    fall: float,
) -> float:
    """By how many statures the centre of mass rises after the feet have left the floor, at off_s.

    time_s (T,). In statures: centre (T,) the height of the centre of mass, ankle (T,) of the lower ankle. stands (T,):
    whether a foot is on the floor; there are some rows of the same clip before and after the flight, which has `rows`
    and is highest at apex_s. fall: of gravity, statures / s2.
    """
    known = np.isfinite(centre[rows])
    way_s = (time_s[rows] - apex_s)[known]
    drift, level = np.polyfit(way_s, centre[rows][known] + fall / 2 * way_s**2, 1)
    highest = level + drift**2 / (2 * fall)
    sooner, later = np.flatnonzero(stands[: rows.start]), rows.stop + np.flatnonzero(stands[rows.stop :])
    before = float(np.median(ankle[sooner[time_s[sooner] >= time_s[sooner[-1]] - _STANDS_S]]))
    after = float(np.median(ankle[later[time_s[later] <= time_s[later[0]] + _STANDS_S]]))
    floor = (before + after) / 2 if abs(after - before) < _STAIRS else before
    push = np.abs(time_s - off_s) <= _STRETCH_S
    stretched = float(np.nanpercentile((centre - ankle)[push], _STRETCHED))
    by_height = highest - floor - stretched - _HEEL
    speed = _steepest(time_s, centre, off_s - _BEFORE_S, apex_s)
    if np.isnan(speed):
        return max(by_height, 0.0)
    by_speed = _LEAST + _BY_FALL * speed**2 / (2 * fall)
    return max((1 - _SHARE) * by_height + _SHARE * by_speed, 0.0)


def _steepest(time_s: np.ndarray, height: np.ndarray, since_s: float, until_s: float) -> float:
    """The largest speed upward, a second, of lines through a height _SPEED_S to either side of moments of that time;
    NaN where some of it is missing."""
    reach = round(_SPEED_S * rate(time_s))
    speeds = [
        np.polyfit(time_s[i - reach : i + reach + 1], height[i - reach : i + reach + 1], 1)[0]
        for i in np.flatnonzero((time_s >= since_s) & (time_s <= until_s))
        if i >= reach and i + reach < len(height) and np.isfinite(height[i - reach : i + reach + 1]).all()
    ]
    return max(speeds, default=float("nan"))
