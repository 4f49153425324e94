"""2D keypoints before any lifter gets them: checked, on an even grid of frames, without guesses of what nobody saw; and
of any frame rate, and with holes, as rows that the network was trained on.

It saw 20 to 60 frames per second, most often 30, and hardly a joint that is missing for a frame or two. So rows that
are further apart get others between them. Rows that are nearer together are lifted as several takes, each of every
second row, or every third, ...: once at about 60 a second and once at about 30, and all answers are averaged. A joint
that is missing for a moment lies on a line from where it was seen to where it is seen again. docs/research.md, "Frame
rates and holes", has what each of these is worth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...pipeline.core.blocks import blocks
from ...pipeline.core.conversions import remap
from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import IMAGE, require
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.lifted import ToLift
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.reading.bounds import grid_rows, image_size_doubts
from ...pipeline.signals.filters import on_lines, stretches
from ...pipeline.signals.visibility import unseen

USUAL_HZ = 30.0  # of takes whose rate is unknown
_APART_S = 5.0  # the built-in lifter's network sees 4.7 s on each side at 20 frames a second
_HOLE = 1.5  # usual intervals beyond what frame numbers say, from which on a recording lacks images
_GAP_S = 0.5  # without any joint for longer than this, frames are missing in 3D too
_JUMP = 0.8  # of the body's longer side from one frame to the next: no person moves like that ...
_JUMP_HZ = 10.0  # ... at this many frames a second, nor this far in less time
_MIN_JUMPS = 4  # scene cuts may explain fewer
_MIN_JOINTS = 4  # seen in both frames, to call it the whole body
_NORMALISED = 4.0  # no image is this few pixels wide
_FASTEST_HZ = 60.0
_LINE_S = 0.3  # a joint that is missing for longer is left to the network


def checked_size(asked: ToLift) -> np.ndarray:
    """(2,) width and height in pixels. InputError when keypoints, image size and focal length cannot be right."""
    keypoints, image_size, focal_px = asked.keypoints, asked.image_size, asked.focal_px
    require(keypoints.frame, IMAGE, "The lifter")
    if keypoints.frame.unit != "px":
        raise InputError(
            "wrong-axes", f"The lifter needs keypoints in pixels, got them in {keypoints.frame}."
        )
    if image_size is None:
        raise InputError(
            "needs-input",
            "The lifter needs the image's width and height in pixels; give the video or --set "
            "read.image_size=WIDTHxHEIGHT.",
        )
    size = np.asarray(image_size, dtype=float)
    if size.shape != (2,) or not (np.isfinite(size) & (size >= 2)).all():
        raise InputError(
            "bad-value",
            f"Expected an image size of two numbers of pixels, width and height; got {image_size}.",
        )
    if focal_px is not None and not 0.1 * size.max() < focal_px < 20 * size.max():
        raise InputError(
            "bad-value",
            f"Expected a focal length in pixels, near the image's longer side of {size.max():.0f}; got {focal_px:g}.",
        )
    coordinates = keypoints.joints[np.isfinite(keypoints.joints)]
    if len(coordinates) == 0:
        raise InputError(
            "nothing-usable", "Expected keypoints to lift, but every joint of every frame is missing."
        )
    if np.abs(coordinates).max() <= _NORMALISED:
        raise InputError(
            "wrong-axes",
            f"Expected keypoints in pixels, but none exceeds {np.abs(coordinates).max():.2f}: they look normalised; "
            "multiply them back to pixels first.",
        )
    if asked.intrinsics is None:  # without the lens's distortion they may be outside
        image_size_doubts(keypoints, (int(size[0]), int(size[1])))
    return size


def long_gaps(visible: np.ndarray, rate: float | None) -> np.ndarray:
    """(T,) True in runs of more than half a second of frames that are not visible (T,). rate: of rate_of."""
    longest = round(_GAP_S * (rate or USUAL_HZ))
    gaps = np.zeros(len(visible), dtype=bool)
    for start, end in stretches(~visible):
        gaps[start:end] = end - start > longest
    return gaps


def on_grid(keypoints: PoseSequence) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints (N, J, 2) and confidence (N, J) of evenly spaced frames, NaN for those that are no row; and the rows'
    places among them. A detector's file often leaves out the frames in which it found nobody, and a recording may lack
    images, which its time stamps tell alone: of these there are frames for 5 s at most. InputError for frame numbers
    that cannot be of one recording."""
    frame = keypoints.frame_index - keypoints.frame_index[0]
    step = max(int(np.gcd.reduce(frame)), 1)
    count, rows = grid_rows(keypoints, step), frame // step
    if keypoints.time_s is not None and len(rows) > 1:
        more = lacking(keypoints.time_s, rows)
        count, rows = count + int(more.sum()), rows + np.concatenate([[0], np.cumsum(more)])
    joints = np.full((count, *keypoints.joints.shape[1:]), np.nan)
    confidence = np.full(joints.shape[:2], np.nan)
    joints[rows] = keypoints.joints
    confidence[rows] = keypoints.confidence
    return joints, confidence, rows


def lacking(time_s: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(T - 1,) images that a recording lacks between its rows, 5 s of them at most, by their times (T,) and by their
    places (T,) among evenly spaced frames."""
    took, apart = np.diff(time_s), np.diff(rows)
    usual = float(np.median(took / apart))
    if not usual > 0:
        return np.zeros(len(took), dtype=int)
    more = np.minimum(np.rint(took / usual) - apart, max(_APART_S // usual, 1))
    return np.where(took > (apart + _HOLE) * usual, more, 0).astype(int)


def rate_of(keypoints: PoseSequence, rows: np.ndarray) -> float | None:
    """Evenly spaced frames a second, of keypoints with these places (T,) among them (on_grid); None where unknown."""
    if keypoints.time_s is None or len(rows) < 2:
        return None
    step_s = np.diff(keypoints.time_s) / np.diff(rows)
    return 1 / float(step_s[step_s <= _HOLE * np.median(step_s)].mean())


def refuse_two_people(joints: np.ndarray, rate: float | None) -> None:
    """InputError when the whole body lands somewhere else from one frame to the next, again and again.
    joints: (T, J, 2) pixels. rate: of rate_of."""
    jumps = sum(_jumps(joints[rows.start : rows.stop + 1], rate) for rows in blocks(len(joints)))
    if jumps >= _MIN_JUMPS:
        raise InputError(
            "people-mixed",
            f"Expected the keypoints of one person, but the whole body jumps to another place {jumps} times: two "
            "people look mixed; choose one (--person), or lift each on their own.",
        )


def _jumps(joints: np.ndarray, rate: float | None) -> int:
    """How often the whole body lands somewhere else."""
    visible = is_finite(joints)
    low, high = (np.where(visible[..., None], joints, fill) for fill in (np.inf, -np.inf))
    side = (high.max(axis=1) - low.min(axis=1)).max(axis=-1)
    both = visible[1:] & visible[:-1]
    usable = np.flatnonzero(both.sum(axis=1) >= _MIN_JOINTS)
    step = np.where(both[..., None], np.diff(joints, axis=0), np.nan)[usable]
    moved = np.linalg.norm(np.nanmedian(step, axis=1), axis=-1) if len(usable) else np.zeros(0)
    farthest = _JUMP * max(1.0, _JUMP_HZ / rate if rate else 1.0)
    return int((moved > farthest * np.maximum(side[usable + 1], side[usable])).sum())


def visible_only(keypoints: PoseSequence, image_size: tuple[int, int] | None) -> PoseSequence:
    """The keypoints in H36M17 without those that `unseen` names: these are missing, with a confidence of 0. A lifter
    that knows what is missing does better without a detector's guesses at the border of the image."""
    points = remap(keypoints, H36M17)
    hidden, _ = unseen(keypoints, image_size, points.frame_index, points.times)
    return points.without(hidden)


@dataclass(frozen=True)
class Clock:
    """finer: rows of the network's clock to a row of the take. phases: as how many takes the rows are lifted, once for
    each. longest: rows of the clock that a line bridges."""

    finer: int
    phases: tuple[int, ...]
    longest: int

    def rows(self, pixels: np.ndarray, confidence: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Joints (T, J, 2) and confidence (T, J) of a take as rows of the clock, ((T - 1) * finer + 1, ...); a joint
        on a line has the lesser of the confidences at its ends."""
        count = (len(pixels) - 1) * self.finer + 1
        fine_pixels = np.full((count, *pixels.shape[1:]), np.nan)
        fine_confidence = np.full((count, pixels.shape[1]), np.nan)
        fine_pixels[:: self.finer], fine_confidence[:: self.finer] = pixels, confidence
        row, visible = np.arange(count), is_finite(fine_pixels)
        for joint in np.flatnonzero(visible.any(axis=0)):
            rows = np.flatnonzero(visible[:, joint])
            after = np.searchsorted(rows, row)
            before, behind = rows[np.maximum(after - 1, 0)], rows[np.minimum(after, len(rows) - 1)]
            gap = (before < row) & (row < behind) & (behind - before <= self.longest + 1)
            fine_pixels[gap, joint] = on_lines(fine_pixels[:, joint], row)[gap]
            ends = fine_confidence[before[gap], joint], fine_confidence[behind[gap], joint]
            fine_confidence[gap, joint] = np.minimum(*ends)
        return fine_pixels, fine_confidence


def averaged(answers: np.ndarray, phases: int) -> np.ndarray:
    """Answers (T, ...) of all phases, each row the mean over the phases about it; where there is but one, as they
    are."""
    if phases == 1:
        return answers
    # Every phase has the same weight, and the row is in the middle.
    weight = np.convolve(np.full(phases, 1 / phases), [0.5, 0.5] if phases % 2 == 0 else [1.0])
    half = len(weight) // 2
    padded = np.concatenate(
        [np.repeat(answers[:1], half, axis=0), answers, np.repeat(answers[-1:], half, axis=0)]
    )
    total = np.zeros_like(answers)
    for first, part in enumerate(weight):
        total += part * padded[first : first + len(answers)]
    return total


def clock_of(rate: float | None, rows: np.ndarray | None = None) -> Clock:
    """The clock of a take with so many rows a second, gaps counted; None where that is unknown, which counts as the
    usual one. rows: (T,) places of those that are there, where some may be missing."""
    rate = USUAL_HZ if rate is None else rate
    finer, phases = (
        max(round(USUAL_HZ / rate), 1),
        {max(round(rate / each), 1) for each in (_FASTEST_HZ, USUAL_HZ)},
    )
    step = 1 if rows is None or len(rows) < 2 else int(np.median(np.diff(rows)))
    return Clock(finer, tuple(sorted(phases)), max(round(_LINE_S * rate * finer), step * finer - 1))
