"""What was done to keypoints by accident: another frame rate, a stretched image, a zoom, a clip played backwards.

A small network has seen motion capture so changed, before virtual cameras and noisy detectors, and says how likely each
change is. changes.onnx was learned by models/lab/fits/changes.py, which says on what; the limits from which something
is said were set on validation takes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ...pipeline.core.layouts import COCO17, Layout
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.visibility import certain
from ..common.onnx import session_of
from . import CHANGES

# What the network sees: COCO17 without eyes and ears.
LIMBS = Layout("LIMBS", tuple(name for name in COCO17.joints if not name.endswith(("eye", "ear"))))
ROWS, HOP = 96, 48  # of a window, and from one to the next
FPS = 30.0
CHANNELS = 5 * len(LIMBS) + 5
# Logarithms of how many times too fast it plays, too wide the image is, and growth of the image in a frame of 1/30 s.
RATES, WIDTHS, ZOOMS = np.linspace(-2, 1, 16), np.linspace(-0.5, 0.5, 11), np.linspace(-0.02, 0.02, 9)
_WINDOWS = 40  # at most, evenly spread
_FEWEST = 20  # rows
_SPARSE_S = 1.0  # a row; nothing is made of hours with a few
_SEEN = 0.8  # share of the joints that are seen
# Of the frames in which a detector sees each joint: a walk whose feet were cut off looked 1.4 times too high. One in 80
# validation takes is below it.
_OFTEN = 0.5
_GAP_S = 0.15
# What a joint's place leaps from row to row over how far it gets in half a second: keypoints that tremble more say
# nothing of how the body moves. Takes shown three times too quickly: 0.34 in the median, one in 33 over 0.6; those of
# a man who stands still, small in a blurred image, 0.68.
_TREMBLES, _SOON = 0.6, 15  # the latter in rows
# Down to which probability that nothing was changed something is said, from so many rows on, and from which change: of
# the 166 validation takes before four cameras each, and 6,000 pieces of 1 to 3 s, one in 250 has its rate doubted. Of
# brief takes the width is not judged: a woman who walks past in 66 frames of a video was "1.5 times too wide" for sure.
_DOUBT = {
    "rate": ((30, 0.01), (60, 0.03), (ROWS + 1, 0.1)),
    "width": ((ROWS + 1, 0.1),),
    "zoom": ((_FEWEST, 0.1),),
}
_FAR = {"rate": 0.5, "width": 0.2, "zoom": 0.005}
# Of slow motion that is told: takes slowed by 2 are told to be slowed by 1.9 in the median, by 4 by 2.6, by 8 by 3.3.
_MUCH = np.log(2)
_BACKWARDS, _FEWEST_BACKWARDS = 3.0, 42  # log-odds; rows


@dataclass(frozen=True, eq=False)
class Changes:
    """Probabilities of RATES, WIDTHS and ZOOMS, and the log-odds of a clip played backwards."""

    rate: np.ndarray
    width: np.ndarray
    zoom: np.ndarray
    backwards: float


def held(points: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Points (T, J, 2) that are not seen (T, J) where they were last; zero before that."""
    last = np.maximum.accumulate(np.where(seen, np.arange(len(points))[:, None], 0), axis=0)
    points = np.take_along_axis(points, last[..., None], axis=0)
    return np.where(np.take_along_axis(seen, last, axis=0)[..., None], points, 0.0)


def features(points: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(ROWS, CHANNELS) float32 of points (T, 13, 2), LIMBS in pixels from the image's middle at FPS, `held`, and
    whether they are seen (T, 13), T at most ROWS: joints from the middle of the hips, that itself, and both movements,
    over the body's size; which joints are seen, and which rows there are."""
    hips = points[:, LIMBS.indices(("l_hip", "r_hip"))].mean(axis=1)
    body = points - hips[:, None]
    size = np.sqrt((body**2).sum(axis=-1).mean()) + 1e-6
    body, hips = body.reshape(len(points), -1) / size, hips / size
    moved, went = (np.diff(each, axis=0, prepend=each[:1]) for each in (body, hips))
    found = np.zeros((ROWS, CHANNELS), dtype=np.float32)
    parts = [body, 4 * moved, hips / 4, 4 * went, seen, np.ones((len(points), 1))]
    found[: len(points)] = np.concatenate(parts, axis=1)
    return found


def changes_of(keypoints: PoseSequence, image_size: tuple[int, int]) -> Changes | None:
    """Of keypoints in pixels, in any layout with LIMBS; None where too little of the body is seen, the rate is unknown,
    or the keypoints tremble more than the body moves."""
    if (
        any(name not in keypoints.layout for name in LIMBS.joints)
        or keypoints.time_s is None
        or len(keypoints) < 2
    ):
        return None
    if np.ptp(keypoints.times) > _SPARSE_S * len(keypoints):
        return None
    limbs = keypoints.layout.indices(LIMBS.joints)
    points = keypoints.joints[:, limbs].astype(np.float64)
    seen = is_finite(points)
    if keypoints.confidence is not None:
        often = is_finite(certain(keypoints, image_size).joints[:, limbs]).mean(axis=0)
        if often.mean() < _SEEN or often.min() < _OFTEN:
            return None  # limbs that nobody saw move as the detector guesses
        seen &= ~(keypoints.confidence[:, limbs] <= 0)
    points, seen = _even(points - np.array(image_size) / 2, seen, keypoints.times)
    if len(points) < _FEWEST or seen.mean() < _SEEN or _trembles(points, seen):
        return None
    starts = np.arange(0, max(len(points) - ROWS, 0) + 1, HOP)
    starts = starts[np.unique(np.linspace(0, len(starts) - 1, _WINDOWS).astype(int))]
    x = np.stack([features(points[a : a + ROWS], seen[a : a + ROWS]) for a in starts])
    rate, width, zoom, backwards = _session().run(["rate", "width", "zoom", "backwards"], {"features": x})
    return Changes(_together(rate), _together(width), _together(zoom), float(backwards.mean()))


def change_doubts(keypoints: PoseSequence, image_size: tuple[int, int] | None) -> list[Notice]:
    """Notices where keypoints were changed beyond doubt. Arguments as of `changes_of`."""
    found = None if image_size is None else changes_of(keypoints, image_size)
    if found is None or not _stands(keypoints):
        return []
    said = []
    rows = round(FPS * keypoints.duration_s) + 1
    rate, width, zoom = (
        float(of @ values) for of, values in ((found.rate, RATES), (found.width, WIDTHS), (found.zoom, ZOOMS))
    )
    if _doubted("rate", found.rate, RATES, rows):
        much = rate < -_MUCH
        times, way = np.exp(_MUCH if much else abs(rate)), "quickly" if rate > 0 else "slowly"
        values: dict[str, Any] = {"fps": keypoints.fps, "times": float(times), "way": way}
        values |= {
            "fits": keypoints.fps * float(times ** -np.sign(rate)),
            "about": "at least" if much else "about",
        }
        said.append(notice("movement-against-rate", **values))
    if _doubted("width", found.width, WIDTHS, rows):
        said.append(
            notice("image-stretched", times=float(np.exp(abs(width))), way="wide" if width > 0 else "high")
        )
    if _doubted("zoom", found.zoom, ZOOMS, rows):
        said.append(notice("camera-zooms", percent=100 * zoom))
    if rows >= _FEWEST_BACKWARDS and found.backwards > _BACKWARDS:
        said.append(notice("played-backwards"))
    return said


def _stands(keypoints: PoseSequence) -> bool:
    """Whether the trunk is nearer to the image's vertical than to its horizontal: few who lie were learned from."""
    ends = (("l_shoulder", "r_shoulder"), ("l_hip", "r_hip"))
    top, bottom = (keypoints.joints[:, keypoints.layout.indices(pair)].mean(axis=1) for pair in ends)
    trunk = np.abs(top - bottom)[is_finite(top - bottom)]
    return bool(len(trunk) and np.median(trunk[:, 1]) > np.median(trunk[:, 0]))


def _doubted(what: str, of: np.ndarray, values: np.ndarray, rows: int) -> bool:
    """Whether so many rows are changed beyond doubt, by the probabilities (K,) of values: those of 0 and beside it are
    of none."""
    none = int(np.abs(values).argmin())
    limit = [limit for fewest, limit in _DOUBT[what] if rows >= fewest][-1:]
    return bool(limit) and of[none - 1 : none + 2].sum() < limit[0] and abs(float(of @ values)) > _FAR[what]


def _trembles(points: np.ndarray, seen: np.ndarray) -> bool:
    """Whether points (T, J, 2), LIMBS at FPS, move about the hips by noise more than by anything else."""
    body = points - points[:, LIMBS.indices(("l_hip", "r_hip"))].mean(axis=1, keepdims=True)
    body = np.where(seen[..., None], body, np.nan)
    noise = (
        np.nanmean(np.diff(body, 2, axis=0) ** 2) / 6
    )  # which is what white noise in a place makes of its square
    moved = np.nanmean((body[_SOON:] - body[:-_SOON]) ** 2) / 2
    return bool(noise > _TREMBLES**2 * moved)


def _together(logits: np.ndarray) -> np.ndarray:
    """Probabilities of a take from windows (N, K), which are no independent witnesses: their geometric mean."""
    log = (logits - np.logaddexp.reduce(logits, axis=1, keepdims=True)).mean(axis=0)
    share = np.exp(log - log.max())
    return share / share.sum()


def _even(points: np.ndarray, seen: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (T, J, 2) and whether they are seen, at FPS; between two rows that are far apart nothing is seen."""
    points = held(points, seen)
    at = np.arange(time_s[0], time_s[-1] + 1e-6, 1 / FPS)
    row = np.clip(np.searchsorted(time_s, at + 1e-6, side="right") - 1, 0, len(time_s) - 2)
    step = time_s[row + 1] - time_s[row]
    share = np.clip((at - time_s[row]) / step, 0, 1)[:, None, None]
    there = seen[row] & seen[row + 1] & (step < _GAP_S)[:, None]
    return (1 - share) * points[row] + share * points[row + 1], there


@cache
def _session() -> Any:
    """On the CPU, whatever --device says: it is small."""
    return session_of(CHANGES.read_bytes(), threads=1)
