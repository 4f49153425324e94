"""How far and how fast a walk goes over the floor, where the person's place in the room is known.

As instrumented walkways define it (Hollman, McDade & Petersen, Gait & Posture 34(1), 2011): a stride's length is
between two landings of the same foot, a step's from the other foot's landing to this one's along the direction of
walking, and speed is way by time. A foot's place is its ankle's; the direction of a step is that of the pelvis's way
meanwhile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..rotations import unit
from .cycles import Step, strides
from .signals import resample

_OTHER = {"r": "l", "l": "r"}


@dataclass(frozen=True, eq=False)
class Lengths:
    """stride: (N,) of both feet's strides. step: (N,) by side, of the steps that end when that foot lands. speed: the
    pelvis's way over all strides by the time that they take; speed_error: its standard error by the strides' own
    speeds, NaN for fewer than three. In the unit of the places; NaN where one is missing."""

    stride: np.ndarray
    step: dict[str, np.ndarray]
    speed: float
    speed_error: float


def lengths(
    root: np.ndarray,
    ankles: dict[str, np.ndarray],
    time_s: np.ndarray,
    walks: Sequence[Sequence[Step]],
    seams: Sequence[int] = (),
) -> Lengths:
    """Of walks (cycles.steps). root: (T, 2) the pelvis on the floor. ankles: (T, 2) by side "r" and "l", alike."""

    def between(path: np.ndarray, start_s: np.ndarray, stop_s: np.ndarray) -> np.ndarray:
        return resample(path, time_s, stop_s, seams) - resample(path, time_s, start_s, seams)

    spans = {side: strides(walks, side).T for side in _OTHER}
    stride = [np.linalg.norm(between(ankles[side], *spans[side]), axis=-1) for side in _OTHER]
    way = np.concatenate([np.linalg.norm(between(root, *span), axis=-1) for span in spans.values()])
    duration = np.concatenate([stop_s - start_s for start_s, stop_s in spans.values()])
    seen = np.isfinite(way)
    step = {}
    for side, other in _OTHER.items():
        own = [(one.start_s, one.stop_s) for walk in walks for one in walk if one.side == side]
        start_s, stop_s = np.array(own, dtype=np.float64).reshape(-1, 2).T
        landed = resample(ankles[side], time_s, stop_s, seams)
        from_other = landed - resample(ankles[other], time_s, start_s, seams)
        step[side] = (from_other * unit(between(root, start_s, stop_s))).sum(axis=-1)
    speed = float(way[seen].sum() / duration[seen].sum()) if seen.any() else float("nan")
    each = way[seen] / duration[seen]
    # Strides of both feet overlap: half of them are independent.
    error = float(each.std(ddof=1) / np.sqrt(len(each) / 2)) if len(each) >= 3 else float("nan")
    return Lengths(np.concatenate(stride), step, speed, error)
