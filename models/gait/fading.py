"""Steps that go on before and behind a walk where they cannot be seen: those of somebody who comes towards the camera,
or goes away from it, are depth, and shrink in the image. The knees keep their rhythm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...pipeline.core.frames import Frame
from ...pipeline.signals.filters import peaks, runs
from .events import Step

_OTHER = {"r": "l", "l": "r"}
# Of the line of sight, within which a person faces the camera or turns the back to it: a step there shows at most
# sin 40 = 64 % of its length.
_SIGHT_DEG = 40.0
_OFF = 0.3  # of a step's time, by which a swing may come too early or too late
# Of the usual swing of a walk: by so much a knee bends at least, and at most, in one that goes on; less is a step to a
# stop. By so much it is bent more than the other one: who crouches bends both.
_SWINGS, _MORE = (0.65, 1.5), 0.3
_LEAST_DEG = 3.0  # of a peak: a lifted knee's noise from frame to frame


def along_sight(R_source_from_body: np.ndarray, source: Frame) -> np.ndarray:
    """(T,) in which frames a person faces the camera or turns the back to it; none where the source is no camera.
    R_source_from_body: (T, 3, 3)."""
    if source.family != "camera":
        return np.zeros(len(R_source_from_body), dtype=bool)
    ahead = -R_source_from_body[:, :, 0] @ source.basis[:, 2]  # BODY's x is back, CAMERA's z is away
    return np.nan_to_num(np.abs(ahead)) > np.cos(np.radians(_SIGHT_DEG))


def faded_steps(
    walk: Sequence[Step],
    knees: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    hidden: np.ndarray,
    seams: Sequence[int] = (),
) -> tuple[list[Step], list[Step]]:
    """Steps before a walk and behind it, in order, by the swings of the knees, which keep the walk's rhythm.

    knees: {"r", "l": (T,)} degrees of flexion at time_s (T,), NaN where not known. hidden: (T,) in which frames steps
    cannot be seen, along the line of sight or without the ankles. Of 71 landings that this adds to 103 lifted walks of
    validation people, were all their frames hidden, 65 are within 0.25 s of one of that foot, and most within 0.05 s.
    """
    swings = {side: _swings(x, time_s, seams) for side, x in knees.items()}
    step_s = float(np.median([step.stop_s - step.start_s for step in walk]))
    knee_peaks = []  # how long before the foot lands its knee is bent most in each step, and by how much
    for step in walk:
        inside = [swing for swing in swings[step.side] if step.start_s < swing[0] < step.stop_s]
        if inside:
            at_s, height = max(inside, key=lambda swing: swing[1])
            knee_peaks.append((step.stop_s - at_s, height))
    if not knee_peaks:
        return [], []
    lag_s, usual = np.median(knee_peaks, axis=0)

    def lands(side: str, near_s: float) -> float | None:
        """When the foot of a side lands about then, after its knee has swung where steps cannot be seen."""
        for at_s, height in sorted(swings[side], key=lambda of: abs(of[0] + lag_s - near_s)):
            rows = np.searchsorted(time_s, [at_s, at_s + lag_s])
            if abs(at_s + lag_s - near_s) > _OFF * step_s or rows[1] >= len(time_s):
                return None
            bent, other = knees[side][rows[0]], knees[_OTHER[side]][rows[0]]
            alone = not bent - other < _MORE * usual  # or the other is not known
            fits = alone and _SWINGS[0] * usual <= height <= _SWINGS[1] * usual
            if fits and hidden[rows[0]]:
                return at_s + lag_s
        return None

    behind, before = [walk[-1]], [walk[0]]
    while (at_s := lands(_OTHER[behind[-1].side], behind[-1].stop_s + step_s)) is not None:
        behind.append(Step(_OTHER[behind[-1].side], behind[-1].stop_s, at_s))
    while (at_s := lands(before[0].side, before[0].start_s - step_s)) is not None:
        before.insert(0, Step(_OTHER[before[0].side], at_s, before[0].start_s))
    return before[:-1], behind[1:]


def _swings(x: np.ndarray, time_s: np.ndarray, seams: Sequence[int]) -> list[tuple[float, float]]:
    """(when, how far) a knee's flexion x (T,) is largest, each time, in order."""
    swings = []
    for piece in runs(np.isfinite(x), time_s, seams):
        tops = peaks(x[piece], _LEAST_DEG)
        swings += zip(time_s[piece][tops].tolist(), x[piece][tops].tolist(), strict=True)
    return swings
