"""Accelerations of wrists and ankles relative to the pelvis: how far two signals agree, and what a rotation does to
them, against motion capture. Both sides are low-passed at 6 Hz without delay (pipeline/signals/filters.py).

A lift is brought to the truth's scale, one factor a take; a method that is about another lift than the first one has
that lift's joints (Answer.joints). Two comparisons, vertical and horizontal apart:

- "level": in upright axes with one heading for the take, the truth's for every method. A method that answers frame by
  frame has its frames' own ups there, turned to that heading frame by frame; so only its tilt counts against it. It
  is the fair one: all methods and the camera's axes meet one truth.
- "lift": the first lift's signals against the same in the true axes: what the method's rotation alone adds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.signals.filters import CUTOFF_HZ, derivative, lowpass
from ...common.metrics import Figure
from .tables import Table
from .take_answers import TRUE_AXES, Answer

NO_MOTION = "no motion"
PARTS = {part: H36M17.indices((f"l_{part}", f"r_{part}")) for part in ("wrist", "ankle")}
ALONG = {"vertical": slice(2, 3), "horizontal": slice(0, 2)}
# Of tables: p50 / mean / p95 of RMSE, and p50 of r.
COLUMNS = {
    f"{part}, {direction}": f"{{{part}[{direction}][rmse]:.2f}}; {{{part}[{direction}][r].p50:.2f}}"
    for part in PARTS
    for direction in ALONG
}


def filtered(path: np.ndarray, time_s: np.ndarray, cutoff_hz: float = CUTOFF_HZ) -> np.ndarray:
    """path (T, J, 3) through the low-pass."""
    return lowpass(path.reshape(len(path), -1), time_s, cutoff_hz).reshape(path.shape)


def velocities(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, J, 3) m/s of path (T, J, 3) metres without gaps, filtered."""
    return derivative(filtered(path, time_s), time_s)


def accelerations(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, J, 3) m/s^2 of path (T, J, 3) metres without gaps, filtered."""
    return derivative(filtered(path, time_s), time_s, order=2)


def agreement(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Root mean square of a - b, each (...), and their correlation; NaN where one of them does not vary."""
    a, b = a.ravel(), b.ravel()
    rmse = float(np.sqrt(np.mean((a - b) ** 2)))
    moving = min(a.std(), b.std()) > 1e-9
    return rmse, float(np.corrcoef(a, b)[0, 1]) if moving else float("nan")


def compare(signal: np.ndarray, truth: np.ndarray) -> dict[str, tuple[float, float]]:
    """{"vertical", "horizontal": (RMSE, r)} of accelerations (N, J, 3), z up. Horizontal is both axes in one: root
    mean square of an axis, and one correlation."""
    return {name: agreement(signal[..., axes], truth[..., axes]) for name, axes in ALONG.items()}


def over_takes(scores: Sequence[Any]) -> Any:
    """Nested (RMSE, r) of many takes as nested {"rmse", "r": Figure} over takes; {} without any."""
    if not len(scores) or isinstance(scores[0], dict):
        return {key: over_takes([take[key] for take in scores]) for key in (scores[0] if len(scores) else ())}
    rmse, r = np.array(scores).T
    return {"rmse": Figure.of(rmse), "r": Figure.of(r)}


_TITLES = {
    "level": "In upright axes, one heading for the take, the same for every method; frame by frame: each frame's own "
    "up under it. `true axes` is what is left when the rotation is right.",
    "lift": "The first lift's against the same in the true axes: what the rotation alone adds.",
}
TABLES: list[Table | str] = [
    "## Acceleration of wrists and ankles\n\n"
    f"Relative to the pelvis, {CUTOFF_HZ:g} Hz zero-phase, against motion capture; RMSE in m/s^2 (horizontal: of one "
    "axis), p50 / mean / p95 over takes, and r, p50. Upright takes of 2 s and more without gaps.",
    Table("", "acceleration/*", ["set"], {"takes": "{takes}", "left out, with gaps": "{left out}"}),
    *(
        Table(
            "",
            f"acceleration/*/{axes}/*",
            ["set", "method"],
            COLUMNS,
            note,
        )
        for axes, note in _TITLES.items()
    ),
]


def take_scores(
    answers: dict[str, Answer],
    joints: np.ndarray,
    truth: np.ndarray,
    R_camera_from_world: np.ndarray,
    time_s: np.ndarray,
) -> dict[str, dict[str, dict[str, dict[str, tuple[float, float]]]]]:
    """One lifted take: {"level", "lift": {method: {part: {direction: (RMSE, r)}}}}.

    joints, truth: (T, 17, 3) metres, CAMERA axes relative to the pelvis, without gaps. R_camera_from_world: (3, 3), the
    truth. "level" also has the row of who says that nothing moves.
    """
    world, lift = (_limbs(each, R_camera_from_world, time_s) for each in (truth, joints))
    still = {part: compare(np.zeros_like(world[part]), world[part]) for part in PARTS}
    scores: dict[str, dict[str, dict[str, dict[str, tuple[float, float]]]]] = {
        "level": {NO_MOTION: still},
        "lift": {},
    }
    for name, answer in answers.items():
        own = joints if answer.joints is None else answer.joints
        axes = answer.axes(R_camera_from_world)
        signal = _limbs(own, axes, time_s)
        scores["level"][name] = {part: compare(signal[part], world[part]) for part in PARTS}
        if name != TRUE_AXES:
            same = signal if own is joints else _limbs(joints, axes, time_s)
            scores["lift"][name] = {part: compare(same[part], lift[part]) for part in PARTS}
    return scores


def _limbs(joints: np.ndarray, R_camera_from_axes: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """Accelerations of each part's joints in other axes."""
    turned = rotate(transpose(R_camera_from_axes), joints)
    return {part: accelerations(turned[:, rows], time_s) for part, rows in PARTS.items()}
