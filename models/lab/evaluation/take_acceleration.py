"""What a rotation does to accelerations of wrists and ankles, against motion capture; motion.py judges smoothers.

A lift is brought to the truth's scale, one factor a take; a method that is about another lift than the first one has
that lift's joints (Answer.joints). Two comparisons, vertical and horizontal apart:

- "level": in upright axes with one heading for the take, the truth's for every method. A method that answers frame by
  frame has its frames' own ups there, turned to that heading frame by frame; so only its tilt counts against it. It
  is the fair one: all methods and the camera's axes meet one truth.
- "lift": the first lift's signals against the same in the true axes: what the method's rotation alone adds.
"""

from __future__ import annotations

import numpy as np

from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.signals.filters import CUTOFF_HZ
from .acceleration import COLUMNS, NO_MOTION, PARTS, accelerations, compare
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
