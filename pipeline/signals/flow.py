"""Whether keypoints are of this video: the image at each joint has to move as the joint's keypoint does.

The optical flow between two frames (Kroeger et al., Fast Optical Flow using Dense Inverse Search, ECCV 2016) is read at
the keypoints and held against their own movement, for the keypoints as they are numbered and for other ones: some rows
earlier or later, by another rate, backwards, mirrored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from .together import RATES

SIDE = 480  # pixels of the longer side of what is looked at
_STEP_S = 0.07  # between the two images of a pair
_PAIRS, _BURST = 32, 4  # pairs looked at, in runs of so many frames
_FEWEST_KEYS = 4  # so many moments of a video tell as much as eight
_JOINTS = tuple(
    f"{side}_{part}" for side in "lr" for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)
_SCORE = 0.3  # of a keypoint that was seen
_MOST_LAG = 10  # rows
_FEWEST = 60  # movements of a joint
_MOVES = 1.5  # pixels of SIDE: the root mean square of keypoints' movements below which nothing can be told
# Of eight real and rendered films with their own keypoints (MoveNet's; walk_crop, the demo, four cameras of Pose2Sim's
# take, the walker) movements are alike by 0.45 and more, and no shift betters that by more than 0.03 in a track of two
# seconds, 0.05 in one of 23 frames, which loses a part of its pairs by a shift; of other recordings, mirrored and
# reversed ones and those of half the rate by 0.37 at most, and a shift of three rows costs 0.04 to 0.26.
_ALIKE, _USUAL = 0.41, 0.45
_BETTER, _CLEARLY_BETTER = 0.04, 0.08  # than what is less than usual, and than any
_OTHER_WAY = 0.15


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
    images: Mapping[int, np.ndarray], pairs: list[tuple[int, int]], keypoints: PoseSequence, width: int
) -> Flow | None:
    """images: {video frame: (H, W) uint8 grey, whose longer side has SIDE pixels}; keypoints: in pixels of a video of
    that width. None where too few joints are seen."""
    import cv2

    names = [name for name in _JOINTS if name in keypoints.layout]
    track = _Track(keypoints, np.array(keypoints.layout.indices(names)))
    pairs = [(a, b) for a, b in pairs if a in images and b in images]
    if not pairs:
        return None
    scale = images[pairs[0][0]].shape[1] / width
    search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
    still = np.zeros((*images[pairs[0][0]].shape, 2), np.float32)
    fields = [search.calc(images[a], images[b], still.copy()) for a, b in pairs]

    def compared(change: str, lag: int = 0, rate: float = 1.0) -> tuple[float, int, float]:
        both = [
            _moved(
                track,
                field,
                track.row(a, change, lag, rate),
                track.row(b, change, lag, rate),
                scale,
                width,
                change,
            )
            for field, (a, b) in zip(fields, pairs, strict=True)
        ]
        seen, moved = (np.concatenate(each) for each in zip(*both, strict=True))
        together = float((seen * moved).sum())
        spread = float(np.sqrt((seen**2).sum() * (moved**2).sum()))
        rms = float(np.sqrt((moved**2).sum(-1).mean())) if len(moved) else 0.0
        return together / spread if spread > 0 else 0.0, len(moved), rms

    alike, joints, rms = compared("")
    if joints < _FEWEST:
        return None
    found = {(lag, 1.0): compared("", lag)[0] for lag in range(-_MOST_LAG, _MOST_LAG + 1)}
    found |= {(0, rate): compared("", 0, rate)[0] for rate in RATES if rate != 1}
    lag, rate = max(found, key=lambda key: (found[key], -abs(key[0]), -abs(key[1] - 1)))
    mirrored, backwards = (compared(change)[0] for change in ("mirrored", "backwards"))
    return Flow(joints, rms, alike, found[lag, rate], lag, mirrored, backwards, rate)


@dataclass(frozen=True, eq=False)
class _Track:
    keypoints: PoseSequence
    columns: np.ndarray

    def row(self, frame: int, change: str, lag: int, rate: float) -> float:
        """The number that a frame of the video has among the keypoints'."""
        first, last = self.keypoints.frame_index[[0, -1]].tolist()
        return first + last - frame if change == "backwards" else first + (frame - first) * rate + lag

    def at(self, frame: float) -> np.ndarray | None:
        """(J, 2) pixels, between two frames on a line, NaN where not seen; None where there is no such row."""
        whole = int(np.floor(frame + 1e-9))
        start, end = self._at(whole), self._at(whole + 1)
        share = max(frame - whole, 0.0)
        if share < 1e-9 or start is None or end is None:
            return start if share < 1e-9 else None
        return (1 - share) * start + share * end

    def _at(self, frame: int) -> np.ndarray | None:
        row = int(np.searchsorted(self.keypoints.frame_index, frame))
        if row >= len(self.keypoints) or self.keypoints.frame_index[row] != frame:
            return None
        points = self.keypoints.joints[row, self.columns].astype(np.float64)
        score = self.keypoints.confidence[row, self.columns]
        return np.where((score < _SCORE)[:, None], np.nan, points)


def _moved(
    track: _Track, field: np.ndarray, first: float, second: float, scale: float, width: int, change: str
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) movements of the image and of the keypoints, from one of their numbers to another."""
    start, end = track.at(first), track.at(second)
    if start is None or end is None:
        return np.zeros((0, 2)), np.zeros((0, 2))
    if change == "mirrored":
        start, end = ((width - 1, 0) - points * (1, -1) for points in (start, end))
    start, end = start * scale, end * scale
    column, row = np.round(np.nan_to_num(start, nan=-1)).astype(int).T
    inside = (
        is_finite(start) & is_finite(end)
        & (column >= 0) & (column < field.shape[1]) & (row >= 0) & (row < field.shape[0])
    )  # fmt: skip
    return field[row[inside], column[inside]].astype(np.float64), (end - start)[inside]


def flow_notice(flow: Flow | None) -> Notice:
    """What is said of keypoints and their video: that they contradict each other, and how; that they agree; or that
    nothing can be told."""
    if flow is None:
        return notice("video-not-compared", reason="too few joints are seen in it")
    alike: dict[str, Any] = {"alike": flow.alike}
    if flow.moved < _MOVES:
        return notice("video-not-compared", reason="the person hardly moves in it")
    turned = {"mirrored": flow.mirrored, "run backwards": flow.backwards}
    way = max(turned, key=turned.__getitem__)
    if turned[way] > max(flow.alike + _OTHER_WAY, _ALIKE):
        return notice(
            "keypoints-not-of-video",
            **alike,
            how=f": they move as in a video that is {way}"
            if way == "mirrored"
            else ": they move as in a video that runs backwards",
        )
    better = _BETTER if flow.alike < _USUAL else _CLEARLY_BETTER
    if flow.best > max(flow.alike + better, _ALIKE) and (abs(flow.lag) > 1 or flow.rate != 1):
        way = "later" if flow.lag > 0 else "earlier"
        how = f"{abs(flow.lag)} frames {way}"
        if flow.rate != 1:
            how = f"where their numbers grow {flow.rate:.3g} times as fast as the video's"
        return notice("keypoints-not-of-video", **alike, how=f": they fit {how}")
    if flow.alike < _ALIKE:
        return notice(
            "keypoints-not-of-video", **alike, how=": they may be from another recording, or at another rate"
        )
    return notice("keypoints-move-as-video", **alike)
