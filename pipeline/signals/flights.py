"""People in the air: how fast they fall tells whether a take runs at real time.

In flight nothing but gravity pulls, so the body's centre of mass falls at 9.81 m/s2 and drifts evenly, whatever the
limbs do; shown k times too slowly it falls at 9.81 / k^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..core.anthropometry import implied_stature
from ..core.layouts import H36M17
from ..core.pose import PoseSequence
from .filters import stretches

# Segment masses as shares of the body's, with the centre of mass at a share of the way from the first joint to the
# second: Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, table 4.1 (after Dempster). Feet go
# with the ankles.
_MASSES = (
    ("pelvis", "thorax", 0.578, 0.66),
    *(
        (f"{side}_{start}", f"{side}_{end}", mass, share)
        for side in "rl"
        for start, end, mass, share in (
            ("shoulder", "elbow", 0.028, 0.436),
            ("elbow", "wrist", 0.022, 0.682),
            ("hip", "knee", 0.100, 0.433),
            ("knee", "ankle", 0.0465, 0.433),
            ("knee", "ankle", 0.0145, 1.0),
        )
    ),
)
# Joints that a frame of a flight needs.
NEEDED = tuple(dict.fromkeys(joint for start, end, _, _ in _MASSES for joint in (start, end)))
_UP = 0.07  # statures by which both ankles are above their floor in the air; standing on the toes lifts them by 0.05
# The lower ankle passes that height so long after the feet have left the floor, and before they land (medians of 88
# captured flights).
_SINCE_S, _UNTIL_S = 0.008, 0.03
_FEWEST = 6  # frames of a flight
_TRIMMED = 0.1  # of the frames at either end, in which a foot may still push
_NOISE = 0.04  # of the parabola's height: what the path may be off it
_DRIFT = 0.25  # of the fall: how far sideways the path may bend
_HEIGHT = 0.02  # statures, of the parabola
_MIDDLE = 0.15  # of the flight's duration: how far from its middle the highest point may be


def falls(level: PoseSequence) -> np.ndarray:
    """How fast the body falls in each flight that is well seen, in statures / s2, (N,).

    level: H36M17 in axes whose z is up, relative to the pelvis, with a measured root, unfiltered; in any unit. Empty
    where the source does not say how high the person is, and where nobody flies: in flight both ankles are off the
    floor, and the centre of mass rises and falls in a parabola, within noise.
    """
    return np.array([flight.fall for flight in flights(level)])


@dataclass(frozen=True)
class Flight:
    """off_s, land_s: when the feet leave the floor and meet it, by the lower ankle; apex_s: when the centre of mass is
    highest. fall: how fast it falls, in statures / s2. rise: statures, by how much it rises after the feet have left,
    half of the fall times the square of the time that it takes (Linthorne, Am J Phys 69(11), 2001)."""

    off_s: float
    apex_s: float
    land_s: float
    fall: float

    @property
    def rise(self) -> float:
        return self.fall * (self.apex_s - self.off_s) ** 2 / 2


def flights(level: PoseSequence) -> list[Flight]:
    """Those of `falls`, in order."""
    stature = implied_stature(level.joints) if level.measured_root is not None and len(level) else np.nan
    if level.root is None or not stature > 0:
        return []
    world = (level.joints + level.root[:, None]).astype(np.float64) / stature
    mass = sum(share for _, _, share, _ in _MASSES)
    parts = [
        share / mass * ((1 - along) * world[:, H36M17.index(a)] + along * world[:, H36M17.index(b)])
        for a, b, share, along in _MASSES
    ]
    centre = np.sum(parts, axis=0)
    lowest = world[:, H36M17.indices(("r_ankle", "l_ankle")), 2].min(axis=1)
    found = []
    for rows, height in _spells(lowest, level.seams):
        fit = _fall(centre[rows], level.times[rows])
        if fit is not None:
            found.append(
                Flight(
                    off_s=_passes(lowest, level.times, rows.start - 1, height) - _SINCE_S,
                    apex_s=fit[1],
                    land_s=_passes(lowest, level.times, rows.stop - 1, height) + _UNTIL_S,
                    fall=fit[0],
                )
            )
    return found


def _passes(height: np.ndarray, time_s: np.ndarray, row: int, level: float) -> float:
    """When a height passes a level between a row and the next."""
    share = (level - height[row]) / (height[row + 1] - height[row])
    return float(time_s[row] + share * (time_s[row + 1] - time_s[row]))


def _spells(height: np.ndarray, seams: tuple[int, ...]) -> list[tuple[slice, float]]:
    """Rows in which a height (T,) is well above what it is for a fifth of its unbroken piece, between two lows that
    were seen, and the height that they are above."""
    spells, edges = [], [0, *seams, len(height)]
    for start, stop in pairwise(edges):
        piece = height[start:stop]
        if not np.isfinite(piece).any():
            continue
        least = float(np.nanpercentile(piece, 20)) + _UP
        up = piece > least
        spells += [
            (slice(start + a, start + b), least)
            for a, b in stretches(up)
            if a > 0 and b < len(piece) and b - a >= _FEWEST and np.isfinite(piece[[a - 1, b]]).all()
        ]
    return spells


def _fall(centre: np.ndarray, time_s: np.ndarray) -> tuple[float, float] | None:
    """The downward acceleration of a path (N, 3) that rises and falls, and when it is highest; None where it is no
    parabola."""
    inner = slice(int(_TRIMMED * len(centre)), len(centre) - int(_TRIMMED * len(centre)))
    middle_s = float(time_s[inner].mean())
    centre, time_s = centre[inner], time_s[inner] - middle_s
    if not np.isfinite(centre).all():
        return None
    design = np.vander(time_s, 3)
    weights = np.linalg.lstsq(design, centre, rcond=None)[0]
    (*drift, bend), speed = 2 * weights[0], weights[1, 2]
    duration = np.ptp(time_s)
    height = -bend * duration**2 / 8
    off = np.sqrt(((centre - design @ weights) ** 2).mean(axis=0))[2]
    seen = height > _HEIGHT and off < _NOISE * height
    falls = np.hypot(*drift) < _DRIFT * -bend and abs(speed / bend) < _MIDDLE * duration
    return (-float(bend), middle_s - float(speed / bend)) if seen and falls else None
