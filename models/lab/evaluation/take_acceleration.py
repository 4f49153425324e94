"""What a rotation does to accelerations of wrists and ankles, against motion capture; motion.py judges smoothers.

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

from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.signals.filters import CUTOFF_HZ
from ...common.metrics import Figure
from .acceleration import NO_MOTION, PARTS, accelerations, agreement
from .tables import Table
from .take_answers import TRUE_AXES, Answer

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
            {
                f"{part}, {direction}": f"{{{part}[{direction}][rmse]:.2f}}; {{{part}[{direction}][r].p50:.2f}}"
                for part in PARTS
                for direction in ("vertical", "horizontal")
            },
            note,
        )
        for axes, note in _TITLES.items()
    ),
]


def compare(signal: np.ndarray, truth: np.ndarray) -> dict[str, tuple[float, float]]:
    """{"vertical", "horizontal": (RMSE, r)} of accelerations (N, J, 3), z up. Horizontal is both axes in one: root
    mean square of an axis, and one correlation."""
    parts = {"vertical": slice(2, 3), "horizontal": slice(0, 2)}
    return {name: agreement(signal[..., axes], truth[..., axes]) for name, axes in parts.items()}


def take_scores(
    answers: dict[str, Answer],
    joints: np.ndarray,
    truth: np.ndarray,
    R_camera_from_world: np.ndarray,
    time_s: np.ndarray,
) -> dict[str, dict[str, dict[str, dict[str, tuple[float, float]]]]]:
    """One take: {"level", "lift": {method: {part: {direction: (RMSE, r)}}}}; "lift" of a lift only.

    joints, truth: (T, 17, 3) metres, CAMERA axes relative to the pelvis, without gaps. R_camera_from_world: (3, 3), the
    truth. "level" also has the row of who says that nothing moves.
    """
    world, lift = (_limbs(each, R_camera_from_world, time_s) for each in (truth, joints))
    lifted = not np.array_equal(joints, truth)
    scores: dict[str, dict[str, dict[str, dict[str, tuple[float, float]]]]] = {
        "level": {NO_MOTION: {part: compare(np.zeros_like(world[part]), world[part]) for part in PARTS}},
        **({"lift": {}} if lifted else {}),
    }
    for name, answer in answers.items():
        own = joints if answer.joints is None else answer.joints
        axes = answer.axes(R_camera_from_world)
        signal = _limbs(own, axes, time_s)
        scores["level"][name] = {part: compare(signal[part], world[part]) for part in PARTS}
        if lifted and name != TRUE_AXES:
            same = signal if own is joints else _limbs(joints, axes, time_s)
            scores["lift"][name] = {part: compare(same[part], lift[part]) for part in PARTS}
    return scores


def over_takes(scores: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """take_scores of many takes as {axes: {method: {part: {direction: {"rmse", "r": Figure}}}}}, over takes."""

    def join(nodes: Sequence[Any]) -> Any:
        if isinstance(nodes[0], dict):
            return {key: join([node[key] for node in nodes]) for key in nodes[0]}
        rmse, r = np.array(nodes).T
        return {"rmse": Figure.of(rmse), "r": Figure.of(r)}

    return join(scores) if scores else {}


def _limbs(joints: np.ndarray, R_camera_from_axes: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """Accelerations of each part's joints in other axes."""
    turned = rotate(transpose(R_camera_from_axes), joints)
    return {part: accelerations(turned[:, rows], time_s) for part, rows in PARTS.items()}
