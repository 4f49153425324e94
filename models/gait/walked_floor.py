"""The floor under a walk: its height, its slope along the way, and stairs, by where feet stand."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

import numpy as np

from ...pipeline.core.measures import CANNOT_BE_TOLD, NONE, SD_90

FEWEST = 4  # places: a line through fewer says nothing of its error
_BEYOND = 2.0  # standard deviations of a difference of two heights
# Of the way from place to place, for a rise to be a stair: stairs have 20 degrees and more (ISO 14122-1), and ramps for
# people 5 to 7.
_STEEP = float(np.tan(np.radians(15)))
_MEDIAN = 0.6745  # median size of a Gaussian value of standard deviation 1
_STAIRS = 3  # rises in a row, all up or all down


@dataclass(frozen=True, eq=False)
class WalkedFloor:
    """height: mean of the places, in their unit. slope_deg: positive where it rises along the way, of there and back
    along the way there. height_sd, slope_sd_deg: their standard deviations. rises: (N - 1,) 1, -1 or 0 from place to
    place, up, down or level; may_rise: (N - 1,) the same, of all that may be stairs within their 90 % error."""

    height: float
    height_sd: float
    slope_deg: float
    slope_sd_deg: float
    rises: np.ndarray
    may_rise: np.ndarray

    @property
    def stairs(self) -> str:
        """ "up", "down", "none" or "cannot-be-told": three places in a row that each lie higher, or lower, than the one
        before."""
        return _stairs(self.rises) or (CANNOT_BE_TOLD if _stairs(self.may_rise) else NONE)


def _stairs(rises: np.ndarray) -> str:
    for rise, of_rise in groupby(rises.tolist()):
        if rise and len(list(of_rise)) >= _STAIRS:
            return "up" if rise > 0 else "down"
    return ""


def walked_floor(
    places: np.ndarray, sd: float, shared_sd: float, up_sd_deg: float, deeper: np.ndarray | float = 0.0
) -> WalkedFloor | None:
    """The line through the heights of at least four places (N, 3) in LEVEL, in the order of the feet that stand there;
    None of fewer, or where they are not apart.

    sd: standard deviation of one place's height, shared_sd: of all alike, in the places' unit; up_sd_deg: of up about
    any horizontal axis; deeper: (N, 3) by how much places lie elsewhere with the longest focal length that the camera
    may have, at which a rise has to be a stair too. Where heights are off the line by more than `sd`, that is what the
    line's errors rest on; where they jump from place to place by more, rises have to exceed that, and what an up that
    is off makes of a step, by two standard deviations. They have to be steeper than a ramp, too.
    """
    if len(places) < FEWEST:
        return None
    middle = places.mean(axis=0)
    across = places - middle
    way = np.linalg.svd(across[:, :2], full_matrices=False)[2][0]
    along, height = across[:, :2] @ way, across[:, 2]
    apart = float(along @ along)
    if not apart > 0:
        return None
    slope = float(along @ height) / apart
    # Who comes back ends where they began, or short of it.
    farthest = along[np.argmax(np.abs(along - along[0]))]
    longer = across + deeper
    run, rises_by = (np.diff(of, axis=0) for of in (longer[:, :2], longer[:, 2]))
    longer = longer - longer.mean(axis=0)
    at = longer[:, :2] @ way
    by_focal = (float(at @ longer[:, 2]) / float(at @ at) - slope) / SD_90
    scatter = max(sd, float(np.linalg.norm(height - slope * along)) / np.sqrt(len(places) - 2))
    tilt = np.tan(np.radians(up_sd_deg))
    rise, step = np.diff(height), np.linalg.norm(np.diff(across[:, :2], axis=0), axis=1)
    # None on a ramp, few on stairs.
    bends = float(np.median(np.abs(np.diff(height, 2)))) / (_MEDIAN * np.sqrt(6))
    difference_sd = np.hypot(np.sqrt(2) * max(sd, bends), tilt * step)
    stair, error = _STEEP * step, SD_90 * difference_sd

    def beyond(least: np.ndarray) -> np.ndarray:
        return (np.sign(rise) * (np.abs(rise) > least)).astype(int)

    steep = np.sign(rise) * rises_by > _STEEP * np.linalg.norm(run, axis=1)
    return WalkedFloor(
        height=float(middle[2]),
        height_sd=float(
            np.sqrt(scatter**2 / len(places) + shared_sd**2 + (tilt * np.linalg.norm(middle[:2])) ** 2)
        ),
        slope_deg=float(np.degrees(np.arctan(slope))) * (1 if farthest >= along[0] else -1),
        slope_sd_deg=float(np.degrees(np.arctan(np.sqrt(scatter**2 / apart + tilt**2 + by_focal**2)))),
        rises=beyond(np.maximum(_BEYOND * difference_sd, stair)) * steep,
        may_rise=beyond(np.maximum(stair - error, 0.0)),
    )
