"""A network that sees so many frames at once, on a take of any length, without seams."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

CHUNK = 1024  # frames answered at a time by a network that takes any number

Run = Callable[[np.ndarray], np.ndarray]  # (frames, ...) -> (answered frames, ...)


def blended(run: Run, x: np.ndarray, window: int, any_length: bool = False) -> np.ndarray:
    """Answers (T, ...) of a network that answers every frame that it sees, to x (T, ...).

    Windows overlap by half. A frame's weight in a window is its distance to the window's nearer end, so that every
    window fades in and out and no frame has an answer from a window's end but at the ends of the take.
    any_length: the network also takes fewer frames than `window`; otherwise a shorter take is continued by its last
    frame.
    """
    frames = len(x)
    if frames <= window:
        return run(x if any_length else _continued(x, window - frames))[:frames]
    starts = (*range(0, frames - window, max(window // 2, 1)), frames - window)
    place = np.arange(window)
    weight = np.minimum(place, place[::-1]) + 0.5
    answers = [run(x[start : start + window]) for start in starts]
    shape = answers[0].shape[1:]
    total, weights = np.zeros((frames, *shape)), np.zeros((frames, *[1] * len(shape)))
    weight = weight.reshape(-1, *[1] * len(shape))
    for start, answer in zip(starts, answers, strict=True):
        total[start : start + window] += weight * answer
        weights[start : start + window] += weight
    return total / weights


def slid(run: Run, x: np.ndarray, field: int, window: int | None = None) -> np.ndarray:
    """Answers (T, ...) of a network that answers only frames with the whole receptive field around them.

    field: frames that an answer rests on; a network that sees N answers N - field + 1. The take is continued at
    both ends by its first and last frame, as VideoPose3D does (formats.md section 2). window: the number of frames
    that the network takes, None for any. Exact: an answer depends on its own field only.
    """
    frames = len(x)
    answers = CHUNK if window is None else window - field + 1
    before = (field - 1) // 2
    after = field - 1 - before + (0 if window is None else -frames % answers)
    padded = np.concatenate([np.repeat(x[:1], before, axis=0), _continued(x, after)])
    parts = [run(padded[start : start + answers + field - 1]) for start in range(0, frames, answers)]
    return np.concatenate(parts)[:frames]


def _continued(x: np.ndarray, frames: int) -> np.ndarray:
    return np.concatenate([x, np.repeat(x[-1:], frames, axis=0)])
