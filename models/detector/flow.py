"""Whether keypoints are of this video: the image at each joint has to move as the joint's keypoint does.

The optical flow between two frames (Kroeger et al., Fast Optical Flow using Dense Inverse Search, ECCV 2016) is read at
the keypoints and held against their own movement, for the keypoints as they are numbered and for other ones: some rows
earlier or later, as of a part; from some frame on, as where rows were left out; by another rate; backwards; mirrored.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...pipeline.core.blocks import blocks
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.reading.together import RATES

Movements = tuple[np.ndarray, np.ndarray]  # of images and of keypoints

SIDE = 480  # pixels of the longer side of what is looked at
_STEP_S = 0.07  # between the two images of a pair
_PAIRS, _BURST = 32, 4  # pairs looked at, in runs of so many frames
_FEWEST_KEYS = 4  # so many moments of a video tell as much as eight
_JOINTS = tuple(
    f"{side}_{part}" for side in "lr" for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)
_SCORE = 0.3  # of a keypoint that was seen
NEAR_LAGS = range(-15, 16)  # rows
# Of a lag that grows from the first row on, as where every so many-th row was left out: how much at most, and in how
# many steps, of so many rows at the end.
_GROWS, _AT_THE_END = 0.15, 2
_FEWEST = 60  # movements of a joint
_MOVES = 1.5  # pixels of SIDE: the root mean square of keypoints' movements below which nothing can be told
# Of eight real and rendered films with their own keypoints (MoveNet's; walk_crop, the demo, four cameras of Pose2Sim's
# take, the walker) movements are alike by 0.45 and more; of other recordings, mirrored and reversed ones and those of
# half the rate by 0.37 at most.
_ALIKE = 0.41
# No other numbering betters those films' own by more than 0.04; where one row in 16 was left out it is 0.05 to 0.36, of
# keypoints made at 25 frames a second for 30 0.19 to 0.51. Where somebody goes is nearly the same some rows later, how
# the limbs move about the body is not: of the whole body's movement so large a share is left out.
_BETTER, _COMMON = 0.05, 0.7
_OTHER_WAY = 0.15
_ALL = (-3, -2, -1)  # axes of movements: pairs, joints, coordinates
_AT_ONCE = 512  # ways that are tried together: some megabytes
_OF_A_PART = 0.6  # of the best of all shifts: among so many one is alike by chance


class Way(NamedTuple):
    """How keypoints are numbered: `lag` rows later, from the video's frame `since` on, or `rate` times as fast."""

    lag: int = 0
    rate: float = 1.0
    since: int | None = None

    def numbers(self, first: int) -> Callable[[np.ndarray], np.ndarray]:
        """What number keypoints have at frames of the video. first: their first one."""
        return lambda frames: first + (frames - first) * self.rate + self.lag * (frames >= (self.since or 0))


@dataclass(frozen=True)
class Flow:
    """How keypoints move beside their video. moved: root mean square of their movements, pixels of an image whose
    longer side has 480. alike: how alike those of the image are, from 1 to -1. way: the numbering that fits best. how:
    How both contradict each other, "" where that is unclear; None where they do not."""

    moved: float
    alike: float
    way: Way
    how: str | None


def pairs_of(first: int, last: int, fps: float, key_frames: Sequence[int] = ()) -> list[tuple[int, int]]:
    """The pairs of video frames to look at, in short bursts, so that few frames have to be decoded: those behind key
    frames where there are some, for a frame costs the decoding of all from its key frame on."""
    step = max(1, round(_STEP_S * fps))
    keys = np.array([key for key in key_frames if first <= key <= last - step - _BURST], dtype=int)
    bursts = _PAIRS // _BURST
    if len(keys) >= _FEWEST_KEYS:
        starts = keys[np.unique(np.linspace(0, len(keys) - 1, bursts).round().astype(int))]
    else:
        starts = np.linspace(first, max(last - step - _BURST, first), bursts).round().astype(int)
    firsts = sorted({int(start + i) for start in starts for i in range(-(-_PAIRS // len(starts)))})
    return [(start, start + step) for start in firsts if start + step <= last]


def flow_of(
    images: Mapping[int, np.ndarray],
    pairs: list[tuple[int, int]],
    keypoints: PoseSequence,
    width: int,
    lags: range = NEAR_LAGS,
) -> Flow | None:
    """images: {video frame: (H, W) uint8 grey, whose longer side has SIDE pixels}; keypoints: in pixels of a video of
    that width; lags: rows by which they are tried later. None where too few joints are seen."""
    import cv2

    pairs = [(a, b) for a, b in pairs if a in images and b in images]
    if not pairs:
        return None
    scale = images[pairs[0][0]].shape[1] / width
    search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
    still = np.zeros((*images[pairs[0][0]].shape, 2), np.float32)
    fields = np.stack([search.calc(images[a], images[b], still.copy()) for a, b in pairs])
    names = [name for name in _JOINTS if name in keypoints.layout]
    columns = keypoints.layout.indices(names)
    points = keypoints.joints[:, columns].astype(np.float64) * scale
    points[keypoints.confidence[:, columns] < _SCORE] = np.nan
    starts, ends = np.array(pairs).T
    first, last = keypoints.frame_index[[0, -1]].tolist()

    def moved(number: Callable[[np.ndarray], np.ndarray], mirrored: bool = False) -> Movements:
        """(..., P, J, 2) movements of image and keypoints that have these numbers (..., P) at the video's frames."""
        before, after = (_at(keypoints.frame_index, points, number(frames)) for frames in (starts, ends))
        if mirrored:
            before, after = ((scale * (width - 1), 0) - part * (1, -1) for part in (before, after))
        return _moved(fields, before, after)

    ways = [Way(lag) for lag in lags]
    near = lags == NEAR_LAGS  # else of a part
    if near:
        cuts = [int(start) for start in starts[1:][np.diff(starts) > 1]]
        ways += [Way(0, rate) for rate in _rates(last - first)]
        ways += [Way(lag, 1.0, cut) for lag in lags for cut in cuts if lag]
    numbered = moved(lambda frames: frames)
    better: dict[Way, float] = {}
    for some in blocks(len(ways), _AT_ONCE):
        tried = moved(lambda frames, some=some: np.array([way.numbers(first)(frames) for way in ways[some]]))
        values = _gain(tried, numbered) if near else _alike(*tried)
        better |= zip(ways[some], values.tolist(), strict=True)
    way = max(ways, key=lambda way: (better[way], way.since is None, -abs(way.lag), -abs(way.rate - 1)))
    best = moved(way.numbers(first))
    gain = better[way] if near else better[way] - float(_alike(*numbered))
    joints = int(_count(*numbered))
    if joints < _FEWEST:  # as where a part is numbered from 0, and nobody was there yet
        if near or better[way] < _OF_A_PART:
            return None
        numbered, joints = best, int(_count(*best))
    return Flow(
        float(np.sqrt((numbered[1] ** 2).sum() / joints)),
        alike := float(_alike(*numbered)),
        way,
        _how(
            alike,
            float(_alike(*best)),
            gain,
            way,
            mirrored=float(_alike(*moved(lambda frames: frames, mirrored=True))),
            backwards=float(_alike(*moved(lambda frames: first + last - frames))),
        ),
    )


def _how(alike: float, best: float, gain: float, way: Way, mirrored: float, backwards: float) -> str | None:
    """As Flow says. best: how alike movements are by that way; gain: by how much that is more, in the images that both
    have. mirrored, backwards: of keypoints that are mirrored, and of ones that run backwards."""
    if max(mirrored, backwards) > max(alike + _OTHER_WAY, _ALIKE):
        turned = "is mirrored" if mirrored >= backwards else "runs backwards"
        return f": they move as in a video that {turned}"
    lag, rate, since = way
    better = gain > _BETTER and best > (_ALIKE if lag in NEAR_LAGS else _OF_A_PART)
    if better and rate != 1:
        return f": they fit where their numbers grow {rate:.3g} times as fast as the video's"
    if better and abs(lag) > 1:
        when = "later" if lag > 0 else "earlier"
        return f": they fit {abs(lag)} frames {when}" + (f" from frame {since} on" if since else "")
    return "" if alike < _ALIKE else None


def _rates(rows: int) -> list[float]:
    """Rates that are tried of a track of so many rows: those of one video that was made into another, and those of a
    lag that grows."""
    steps = max(round(_GROWS * rows / _AT_THE_END), 1)
    return sorted({*RATES, *(1 + _GROWS * np.arange(-steps, steps + 1) / steps).tolist()} - {1.0})


def _at(numbers: np.ndarray, points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(..., J, 2) points (T, J, 2) of these numbers (T,) at wanted ones (...), between two on a line; NaN where not
    seen, and where there is no row of that number."""
    whole = np.floor(wanted + 1e-9).astype(int)
    share = np.maximum(wanted - whole, 0.0)[..., None, None]

    def numbered(number: np.ndarray) -> np.ndarray:
        rows = np.minimum(np.searchsorted(numbers, number), len(numbers) - 1)
        return np.where((numbers[rows] == number)[..., None, None], points[rows], np.nan)

    return np.where(
        share < 1e-9, numbered(whole), (1 - share) * numbered(whole) + share * numbered(whole + 1)
    )


def _moved(fields: np.ndarray, start: np.ndarray, end: np.ndarray) -> Movements:
    """(..., P, J, 2) movements of the images, by their flow (P, H, W, 2), and of keypoints from start to end
    (..., P, J, 2); both 0 where one is not known."""
    column, row = np.moveaxis(np.round(np.nan_to_num(start, nan=-1)).astype(int), -1, 0)
    inside = (
        is_finite(start) & is_finite(end)
        & (column >= 0) & (column < fields.shape[2]) & (row >= 0) & (row < fields.shape[1])
    )  # fmt: skip
    pair = np.nonzero(inside)[-2]
    image, moved = np.zeros(start.shape), np.zeros(start.shape)
    image[inside], moved[inside] = fields[pair, row[inside], column[inside]], (end - start)[inside]
    return image, moved


def _count(image: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """(...) how many movements (..., P, J, 2) are known."""
    return (image.any(axis=-1) | moved.any(axis=-1)).sum(axis=(-2, -1))


def _alike(image: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """(...) how alike movements (..., P, J, 2) are, from 1 to -1; 0 where too few are known."""
    both = (image * moved).sum(axis=_ALL)
    spread = np.sqrt((image**2).sum(axis=_ALL) * (moved**2).sum(axis=_ALL))
    known = (spread > 0) & (_count(image, moved) >= _FEWEST)
    return np.where(known, both / np.where(known, spread, 1.0), 0.0)


def _gain(tried: Movements, numbered: Movements) -> np.ndarray:
    """(...) by how much more alike movements (..., P, J, 2) are than as they are numbered (P, J, 2), in the pairs of
    images that both have; 0 where these are less than half of the pairs."""
    visible = numbered[1].any(axis=(-2, -1))
    both = np.asarray(visible & tried[1].any(axis=(-2, -1)))
    old, new = (
        _alike(*(_less_common(part * both[..., None, None], each[1]) for part in each))
        for each in (numbered, tried)
    )
    told = (both.sum(axis=-1) >= visible.sum() / 2) & (new != 0) & (old != 0)
    return np.where(told, new - old, 0.0)


def _less_common(movements: np.ndarray, keypoints: np.ndarray) -> np.ndarray:
    """Movements (..., P, J, 2) less most of what a pair's joints have in common; keypoints: tells which are known."""
    visible = keypoints.any(axis=-1, keepdims=True)
    count = np.maximum(visible.sum(axis=-2, keepdims=True), 1)
    common = (movements * visible).sum(axis=-2, keepdims=True) / count
    return (movements - _COMMON * common) * visible


def flow_notice(flow: Flow | None) -> Notice | None:
    """That keypoints and their video contradict each other, and how; None where they agree or nothing can be told."""
    if flow is None or flow.moved < _MOVES or flow.how is None:
        return None
    how = flow.how or ": they may be from another recording, or at another rate"
    return notice("keypoints-not-of-video", alike=flow.alike, how=how)
