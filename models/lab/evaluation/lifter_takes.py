"""The validation takes that lifters are chosen by, under three conditions, and a lift's errors on one of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import is_finite, rotate, transpose
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.signals.angles import angles, near, sides_of
from ...angle_error.take_angles import smoothed
from ...common.metrics import procrustes_error, scaled
from ..synthetic.keypoint_noise import EXACT_KEYPOINTS
from .people import mean
from .sets import evaluation_sets
from .testbed import BEDS, MIN_FRAMES, Bed, SeenTake, see

CONDITIONS = PUBLISHED, FOCAL_KNOWN, EXACT = (
    "noisy keypoints, focal unknown", "noisy keypoints, focal known", "exact keypoints, focal known",
)  # fmt: skip
POSTURES = ("upright", "lying")
FIGURES = {  # of a take, with their units; all but the last are errors
    "MPJPE": "mm", "PA-MPJPE": "mm", "along the ray": "mm", "across the ray": "mm", "velocity": "mm/s",
    "knee_flexion": "deg", "elbow_flexion": "deg", "lifted": "%",
}  # fmt: skip
_ANGLES = ("knee_flexion", "elbow_flexion")


@dataclass(frozen=True, eq=False)
class JudgedTake:
    """A take to lift. inputs: by condition, keypoints in IMAGE and the focal length in pixels, None where it is not
    told. seen: it with noisy keypoints, and its truth."""

    inputs: Mapping[str, tuple[PoseSequence, float | None]]
    seen: SeenTake


@dataclass(frozen=True, eq=False)
class Material:
    """Takes that are judged together. part: the set's name in tables. views: the cameras' name."""

    part: str
    views: Bed
    seed: int
    clips: Sequence[Clip]

    def takes(self) -> Iterator[JudgedTake]:
        """The clips before virtual cameras, the same ones for noisy and for exact keypoints."""
        for clip in self.clips:
            noisy, exact = (
                see(clip, self.seed, noise=noise, views=BEDS[self.views]) for noise in (None, EXACT_KEYPOINTS)
            )
            inputs = {
                PUBLISHED: (noisy.keypoints, None),
                FOCAL_KNOWN: (noisy.keypoints, noisy.focal_px),
                EXACT: (exact.keypoints, exact.focal_px),
            }
            yield JudgedTake(inputs, noisy)


def materials(seeds: int, only: Sequence[str] = ()) -> list[Material]:
    """Everything to lift: each part before each kind of camera with each seed. only: labels of parts; all without any.
    InputError for a part that there is not, and where the data is not."""
    sets = {one.label: one for one in evaluation_sets("val")}
    if unknown := [label for label in only if label not in sets]:
        raise InputError(
            "name-unknown",
            f"There is no part '{unknown[0]}' of the validation; expected {', '.join(sets)}.",
        )
    found = []
    for label in (label for label in sets if label in only or not only):
        clips = [clip for clip in sets[label].clips() if len(clip) >= MIN_FRAMES]
        found += [Material(label, bed, seed, clips) for bed in BEDS for seed in range(seeds)]
    return found


def judge(seen: SeenTake, poses: PoseSequence) -> dict[str, list[float]]:
    """{posture: figures} of those that have frames."""
    frames = poses.frame_index
    lying = seen.lying[frames]
    lifted, truth = poses.joints.astype(np.float64), seen.truth[frames]
    return {
        posture: take_figures(lifted, truth, seen.R_camera_from_ray[frames], use, poses.times)
        for posture, use in zip(POSTURES, (~lying, lying), strict=True)
        if use.any()
    }


def take_figures(
    lifted: np.ndarray,
    truth: np.ndarray,
    R_camera_from_ray: np.ndarray,
    use: np.ndarray,
    time_s: np.ndarray,
) -> list[float]:
    """FIGURES of the frames (T,) in use of lifted and true joints (T, 17, 3), CAMERA axes, metres and any unit.

    MPJPE and what lies along and across the ray: one scale a frame. velocity: mean distance of velocities between
    neighbouring frames, one scale a take. Angles: root mean square, both sides, after the low-pass that runs have.
    """
    there = use & np.asarray(is_finite(lifted).all(axis=1))
    lifted_share = 100 * there.sum() / use.sum()
    if not there.any():
        return [*[np.nan] * (len(FIGURES) - 1), float(lifted_share)]
    one, other = lifted[there], truth[there]
    off = scaled(one, other) - other
    in_ray = np.abs(rotate(transpose(R_camera_from_ray[there]), off))
    of_a_take = scaled(one, other, "take")
    next_to = np.diff(np.flatnonzero(there)) == 1
    step_s = np.diff(time_s[there])[next_to]
    speed = np.diff(of_a_take - other, axis=0)[next_to] / step_s[:, None, None]
    bent, true = (angles(smoothed(joints, time_s)) for joints in (lifted, truth))
    figures = [
        1000 * np.linalg.norm(off, axis=-1).mean(),
        1000 * procrustes_error(one, other).mean(),
        1000 * in_ray[..., 2].mean(),
        1000 * np.linalg.norm(in_ray[..., :2], axis=-1).mean(),
        1000 * mean(np.linalg.norm(speed, axis=-1)),
    ]
    for name in _ANGLES:
        error = np.stack([near(bent[side] - true[side], 0.0)[there] for side in sides_of(name)])
        figures.append(mean(error**2) ** 0.5)
    return [*map(float, figures), float(lifted_share)]
