"""Whether keypoints are of this video: the image at each joint has to move as the joint's keypoint does.

The optical flow between two frames (Kroeger et al., Fast Optical Flow using Dense Inverse Search, ECCV 2016) is read at
the keypoints and held against their own movement, for the keypoints as they are numbered and for other ones: some rows
earlier or later, as of a part, by another rate, backwards, mirrored.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.reading.together import RATES

SIDE = 480  # pixels of the longer side of what is looked at
_STEP_S = 0.07  # between the two images of a pair
_PAIRS, _BURST = 32, 4  # pairs looked at, in runs of so many frames
_FEWEST_KEYS = 4  # so many moments of a video tell as much as eight
_JOINTS = tuple(
    f"{side}_{part}" for side in "lr" for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)
_SCORE = 0.3  # of a keypoint that was seen
NEAR_LAGS = range(-10, 11)  # rows
_FEWEST = 60  # movements of a joint
_MOVES = 1.5  # pixels of SIDE: the root mean square of keypoints' movements below which nothing can be told
# Of eight real and rendered films with their own keypoints (MoveNet's; walk_crop, the demo, four cameras of Pose2Sim's
# take, the walker) movements are alike by 0.45 and more, and no shift betters that by more than 0.03 in a track of two
# seconds, 0.05 in one of 23 frames, which loses a part of its pairs by a shift; of other recordings, mirrored and
# reversed ones and those of half the rate by 0.37 at most, and a shift of three rows costs 0.04 to 0.26.
_ALIKE, _USUAL = 0.41, 0.45
_BETTER, _CLEARLY_BETTER = 0.04, 0.08  # than what is less than usual, and than any
_OTHER_WAY = 0.15
_OF_A_PART = 0.6  # of the best of all shifts: among so many one is alike by chance


@dataclass(frozen=True)
class Flow:
    """How alike the movements of keypoints and image are, from 1 to -1. joints: movements compared. moved: root mean
    square of the keypoints', pixels of an image whose longer side has 480. alike: as they are numbered; best: where
    their rows are `lag` later, or grow `rate` times as fast as the video's frames; mirrored: of keypoints that are
    mirrored; backwards: of ones that run backwards."""

    joints: int
    moved: float
    alike: float
    best: float
    lag: int
    mirrored: float
    backwards: float
    rate: float = 1.0

    @property
    def how(self) -> str | None:
        """How keypoints and video contradict each other, "" where that is unclear; None where they do not."""
        turned = {"mirrored": self.mirrored, "backwards": self.backwards}
        way = max(turned, key=turned.__getitem__)
        if turned[way] > max(self.alike + _OTHER_WAY, _ALIKE):
            return ": they move as in a video that " + (
                "is mirrored" if way == "mirrored" else "runs backwards"
            )
        better = _BETTER if self.alike < _USUAL else _CLEARLY_BETTER
        least = _OF_A_PART if self.lag not in NEAR_LAGS else _ALIKE
        if self.best > max(self.alike + better, least) and (abs(self.lag) > 1 or self.rate != 1):
            if self.rate != 1:
                return f": they fit where their numbers grow {self.rate:.3g} times as fast as the video's"
            return f": they fit {abs(self.lag)} frames {'later' if self.lag > 0 else 'earlier'}"
        return "" if self.alike < _ALIKE else None


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
    found = sorted({int(start + i) for start in starts for i in range(-(-_PAIRS // len(starts)))})
    return [(start, start + step) for start in found if start + step <= last]


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

    def compared(
        number: Callable[[np.ndarray], np.ndarray], mirrored: bool = False
    ) -> tuple[float, int, float]:
        """How alike, for keypoints that have these numbers at the video's frames; movements; their mean square."""
        before, after = (_at(keypoints.frame_index, points, number(frames)) for frames in (starts, ends))
        if mirrored:
            before, after = ((scale * (width - 1), 0) - part * (1, -1) for part in (before, after))
        image, moved = _moved(fields, before, after)
        if len(moved) < _FEWEST:
            return 0.0, len(moved), 0.0
        spread = float(np.sqrt((image**2).sum() * (moved**2).sum()))
        rms = float(np.sqrt((moved**2).sum(-1).mean()))
        return float((image * moved).sum()) / spread if spread > 0 else 0.0, len(moved), rms

    tried = {(lag, 1.0): compared(lambda frames, lag=lag: frames + lag) for lag in lags}
    tried |= {
        (0, rate): compared(lambda frames, rate=rate: first + (frames - first) * rate)
        for rate in RATES
        if rate != 1
    }
    lag, rate = max(tried, key=lambda key: (tried[key][0], -abs(key[0]), -abs(key[1] - 1)))
    best = tried[lag, rate]
    alike, joints, rms = compared(lambda frames: frames)
    if joints < _FEWEST:  # as where a part is numbered from 0, and nobody was there yet
        if best[0] < _OF_A_PART:
            return None
        joints, rms = best[1:]
    mirrored = compared(lambda frames: frames, mirrored=True)[0]
    backwards = compared(lambda frames: first + last - frames)[0]
    return Flow(joints, rms, alike, best[0], lag, mirrored, backwards, rate)


def _at(numbers: np.ndarray, points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(N, J, 2) points (T, J, 2) of these numbers (T,) at wanted ones (N,), between two on a line; NaN where not seen,
    and where there is no row of that number."""
    whole = np.floor(wanted + 1e-9).astype(int)
    share = np.maximum(wanted - whole, 0.0)[:, None, None]

    def of(number: np.ndarray) -> np.ndarray:
        rows = np.minimum(np.searchsorted(numbers, number), len(numbers) - 1)
        return np.where((numbers[rows] == number)[:, None, None], points[rows], np.nan)

    return np.where(share < 1e-9, of(whole), (1 - share) * of(whole) + share * of(whole + 1))


def _moved(fields: np.ndarray, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) movements of the images, by their flow (P, H, W, 2), and of keypoints from start to end (P, J, 2)."""
    column, row = np.moveaxis(np.round(np.nan_to_num(start, nan=-1)).astype(int), -1, 0)
    inside = (
        is_finite(start) & is_finite(end)
        & (column >= 0) & (column < fields.shape[2]) & (row >= 0) & (row < fields.shape[1])
    )  # fmt: skip
    pair, _ = np.nonzero(inside)
    return fields[pair, row[inside], column[inside]].astype(np.float64), (end - start)[inside]


def flow_notice(flow: Flow | None) -> Notice | None:
    """That keypoints and their video contradict each other, and how; None where they agree or nothing can be told."""
    if flow is None or flow.moved < _MOVES or flow.how is None:
        return None
    how = flow.how or ": they may be from another recording, or at another rate"
    return notice("keypoints-not-of-video", alike=flow.alike, how=how)
