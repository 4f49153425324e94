"""Leaps of what is seen: cuts within a scene, where images were taken out or the picture enlarged, and rows of one
track at which somebody else goes on."""

from __future__ import annotations

import numpy as np

from ...pipeline.files.detections import MOVES, Detections
from ...pipeline.reading.tracks import LARGER, extent, steps
from ...pipeline.signals.visibility import LEAST_SCORE

# Joints and image change this many times as much as in each of the images beside, and joints move by that much of the
# body's size. Where two seconds were cut out, or the picture was enlarged 1.3 times, both changed 3 times as much or
# more; in ninety other clips, films among them, never 1.6 times.
_TIMES, _BESIDE, _MOVES = 2.0, 3, 0.04
# Somebody else goes on where joints move by so much of the body's size from one frame to the next, or farther by so
# much a second that nobody is seen, and then stay: so far from where they were going, or LARGER times larger or
# smaller, by medians over so long before and after, or over _PATH frames where these last longer.
_STEP, _A_SECOND, _FRAME_S = 0.12, 2.5, 1 / 30
_APART, _NEAR_S = 0.15, 0.25
_PATH = 4  # frames that show where somebody was going
_FEWEST = 3  # joints that tell how far a body has moved


def leaps(detections: Detections) -> np.ndarray:
    """(L,) frames at which somebody and the image leap, and neither before nor after it."""
    frames = set[int]()
    change = detections.change.astype(np.float64)
    change[detections.repeated] = np.nan
    visible = np.where((detections.confidence < LEAST_SCORE)[..., None], np.nan, detections.joints).astype(
        np.float64
    )
    for person in np.unique(detections.person):
        rows = np.flatnonzero(detections.person == person)
        if len(rows) <= 2 * _BESIDE + 1:
            continue
        at = detections.frame_index[rows[1:]]
        went = np.where(np.diff(detections.frame_index[rows]) == 1, steps(visible[rows]), np.nan)
        large = (went >= np.maximum(_MOVES, _TIMES * _beside(went))) & (
            change[at] >= np.maximum(MOVES, _TIMES * _beside(change[at]))
        )
        frames |= set(at[large].tolist())
    return np.array(sorted(frames), np.int64)


def _beside(values: np.ndarray) -> np.ndarray:
    """(T,) the largest of the three values on either side of each of (T,); NaN where one of them is not known."""
    result = np.full(len(values), np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * _BESIDE + 1)
    result[_BESIDE:-_BESIDE] = np.delete(windows, _BESIDE, axis=1).max(axis=1)
    return result


def exchanges(time_s: np.ndarray, points: np.ndarray) -> list[tuple[int, float]]:
    """Rows of one track at which somebody else goes on, and how far away in body sizes: of people who cross, a detector
    may follow the other one. time_s: (T,) increasing. points: (T, J, 2), NaN where missing. A cut within a scene is the
    same to it."""
    somebody = np.flatnonzero(np.isfinite(points).any(axis=(1, 2)))
    time_s, points = time_s[somebody], points[somebody]
    went = steps(points)
    wander = _A_SECOND * np.maximum(np.diff(time_s) - _FRAME_S, 0)
    rows = np.flatnonzero(went > _STEP + wander) + 1
    starts, stops = np.searchsorted(time_s, (time_s[rows - 1] - _NEAR_S, time_s[rows] + _NEAR_S))
    # At ten frames a second as many as show where somebody was going.
    starts = np.minimum(starts, np.maximum(rows - _PATH, 0))
    stops = np.maximum(stops, np.minimum(rows + _PATH, len(points)))
    rows_of_others = []
    for row, start, stop in zip(rows.tolist(), starts.tolist(), stops.tolist(), strict=True):
        parts = slice(start, row), slice(row, stop)
        # Joints seen throughout: by others the same body would be larger, and elsewhere.
        both = np.isfinite(points[start:stop]).all(axis=(0, 2))
        both |= both.sum() < _FEWEST
        bodies = [points[part][:, both] for part in parts]
        before, after = (float(np.nanmedian(extent(body))) for body in bodies)
        off = 0.0
        if min(row - start, stop - row) >= _PATH:
            at_s = float(time_s[row - 1] + time_s[row]) / 2
            was, goes_on = (
                _on_path(time_s[part], np.nanmean(body, axis=1), at_s)
                for part, body in zip(parts, bodies, strict=True)
            )
            off = float(np.linalg.norm(goes_on - was))
        larger, smaller = max(before, after), min(before, after)
        if larger > LARGER * smaller or off > (_APART + wander[row - 1]) * larger:
            rows_of_others.append((int(somebody[row]), float(went[row - 1])))
    return rows_of_others


def _on_path(time_s: np.ndarray, points: np.ndarray, at_s: float) -> np.ndarray:
    """(2,) where points (T, 2) are at a moment by the line through them, of medians (Theil 1950)."""
    first, last = np.triu_indices(len(points), 1)
    speed = np.nanmedian((points[last] - points[first]) / (time_s[last] - time_s[first])[:, None], axis=0)
    return np.nanmedian(points + speed * (at_s - time_s)[:, None], axis=0)
