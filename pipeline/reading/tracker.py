"""The same person under the same name from frame to frame, in images or in any other plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.limits import limit

REACH = limit("tracks.reach")  # body sizes
LARGER = limit("tracks.larger")  # times
MEMORY = limit("tracks.memory")  # frames
PACE = limit("tracks.pace")  # frames
_NEVER = 1e6


@dataclass(frozen=True, eq=False)
class Sighting:
    """Where a person is in a frame. points: (J, 2), finite. weight: (J,) trust in each, 0 for one that is not there.
    box: (4,) left, top, right, bottom around the person."""

    frame: int
    points: np.ndarray
    weight: np.ndarray
    box: np.ndarray


def sighted(frame: int, points: np.ndarray, there: np.ndarray) -> Sighting:
    """A sighting by points (J, 2) alone, of which those count that are there (J,), one at least."""
    box = np.concatenate([points[there].min(axis=0), points[there].max(axis=0)])
    return Sighting(frame, np.where(there[:, None], points, 0.0), there.astype(np.float64), box)


class Tracker:
    """Names people 0, 1, ... in order of appearance.

    Each frame's people are joined to those of the last 30 frames, who are taken to have gone on as they went in the 10
    frames before they were lost; all at once, so that the sum of distances is the least (Hungarian method). The
    distance is that of the joints, weighted by trust in them, over the size of the larger box, and must stay below half
    of it; less the part that the boxes share. People who cross may be exchanged all the same.
    """

    def __init__(self) -> None:
        self._tracks: dict[int, list[Sighting]] = {}  # the last sightings of everybody who may come back
        self._people = 0

    def names(self, people: Sequence[Sighting]) -> list[int]:
        """The name of each person of a frame; frames come in order."""
        if not people:
            return []
        frame = people[0].frame
        self._tracks = {
            name: track for name, track in self._tracks.items() if frame - track[-1].frame <= MEMORY
        }
        # Of equal costs that of whoever was seen last.
        lost = sorted(self._tracks, key=lambda name: -self._tracks[name][-1].frame)
        names = [-1] * len(people)
        if lost:
            cost = np.array([_costs(_expected(self._tracks[name], frame), people) for name in lost])
            for row, column in _pairs(cost):
                if cost[row, column] < _NEVER:
                    names[column] = lost[row]
        for i, sighting in enumerate(people):
            names[i] = self._people if names[i] < 0 else names[i]
            self.knows(names[i], sighting)
        return names

    def knows(self, name: int, sighting: Sighting) -> None:
        """Adds a sighting to that person's track; sightings come in order of time."""
        before = [earlier for earlier in self._tracks.pop(name, []) if sighting.frame - earlier.frame <= PACE]
        self._tracks[name] = [*before, sighting]
        self._people = max(self._people, name + 1)

    def cut(self) -> None:
        """After a cut of the video: everybody who follows is a new person."""
        self._tracks = {}


def steps(points: np.ndarray) -> np.ndarray:
    """(T - 1,) mean distance over the body's size from each row of points (T, J, 2) to the next, 0 where fewer than
    three joints are visible in both: of a person who enters the image only a hand may be visible, and its error would
    be as large as that body."""
    apart = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    size = extent(points)
    both = np.isfinite(apart).sum(axis=1)
    sizes = both * np.fmax(size[1:], size[:-1])
    enough = (sizes > 0) & (both >= limit("tracks.joints"))
    return np.divide(np.nansum(apart, axis=1), sizes, out=np.zeros(len(apart)), where=enough)


def extent(points: np.ndarray) -> np.ndarray:
    """(T,) of the body in the image, corner to corner; NaN of nobody."""
    return np.linalg.norm(np.fmax.reduce(points, axis=1) - np.fmin.reduce(points, axis=1), axis=-1)


def _expected(track: Sequence[Sighting], frame: int) -> Sighting:
    """Where a track's person is expected in `frame`: the last sighting, moved on as its joints moved on average."""
    first, last = track[0], track[-1]
    weight = np.minimum(first.weight, last.weight)
    if first is last or not weight.any():
        return last
    moved = weight @ (last.points - first.points) / weight.sum()
    moved = moved * (frame - last.frame) / (last.frame - first.frame)
    return replace(last, points=last.points + moved, box=last.box + np.tile(moved, 2))


def _pairs(cost: np.ndarray) -> list[tuple[int, int]]:
    """Rows and columns of cost (N, M), each at most once, whose sum is the least."""
    if 1 in cost.shape:  # one person: without an import that takes half a second
        row, column = np.unravel_index(int(cost.argmin()), cost.shape)
        return [(int(row), int(column))]
    from scipy.optimize import linear_sum_assignment

    return list(zip(*linear_sum_assignment(cost), strict=True))


def _costs(sighting: Sighting, people: Sequence[Sighting]) -> list[float]:
    """The cost of each person as the continuation of a track, of which `sighting` is what is expected."""
    weight = np.minimum(sighting.weight, np.array([person.weight for person in people]))
    step = np.linalg.norm(sighting.points - np.array([person.points for person in people]), axis=-1)
    total = weight.sum(axis=1)
    step = np.divide((step * weight).sum(axis=1), total, out=np.full(len(people), np.inf), where=total > 0)
    corners = np.array([sighting.box, *(person.box for person in people)])
    size = np.linalg.norm(corners[:, 2:] - corners[:, :2], axis=1)
    near = step < REACH * np.maximum(size[1:], size[0])
    return [
        float(step[i] / max(size[i + 1], size[0])) - overlap(sighting.box, people[i].box)
        if near[i]
        else _NEVER
        for i in range(len(people))
    ]


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """The part that two boxes (4,) share over what they cover together."""
    (left, top, right, bottom), (left2, top2, right2, bottom2) = a.tolist(), b.tolist()
    width, height = min(right, right2) - max(left, left2), min(bottom, bottom2) - max(top, top2)
    shared = max(width, 0.0) * max(height, 0.0)
    together = (right - left) * (bottom - top) + (right2 - left2) * (bottom2 - top2) - shared
    return shared / together if together > 0 else 0.0
