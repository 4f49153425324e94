"""Whether verdicts on poses follow their error:  pcnet3d lab evaluate verdicts -o DIR

Takes as the lifter has them, and the same made worse: depth of 0.3 to 1.0 times its size, and errors of up to 12 % of
the trunk that change from frame to frame and drift.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ....pipeline.core.notices import verdict
from ....pipeline.core.pose import PoseSequence
from ....pipeline.signals.findings import findings_of
from ...common.metrics import joint_error, relative
from .sets import Question
from .tables import Page, Table
from .take_answers import joints_of

_LIMIT_MM = 100.0
_DEPTH = (0.3, 1.0)  # times its size
_NOISE, _DRIFT = 0.12, 1 / 16  # of the trunk at most; of the noise, from each frame to the next
_VERDICTS = ("good", "suspicious", "unusable")
PAGE = Page(
    "Verdicts",
    ". Error of a take: MPJPE at its best scale. Worse: depth squeezed, noise and drift added.",
    [
        Table(
            "",
            "verdicts/*/*",
            ["lifter", "verdict"],
            {"takes": "{takes}", "over 100 mm": "{over:.0%}", "median, mm": "{median_mm:.0f}"},
        )
    ],
)


def worse(poses: PoseSequence, rng: np.random.Generator) -> PoseSequence:
    """Poses relative to the pelvis, in CAMERA axes, as a bad lifter would have them."""
    joints = poses.joints.astype(np.float64)
    trunk = np.nanmean(np.linalg.norm(poses.joint("thorax") - poses.joint("pelvis"), axis=-1))
    sd = rng.uniform(0, _NOISE) * trunk
    joints[..., 2] *= rng.uniform(*_DEPTH)
    drift = np.cumsum(rng.normal(0, _DRIFT, joints.shape), axis=0)
    return poses.with_(joints=relative(joints + sd * (drift + rng.normal(0, 1, joints.shape))))


def error_mm(poses: PoseSequence, truth: np.ndarray) -> float:
    """Mean over the frames that have all joints. truth: (T, 17, 3) metres, relative to the pelvis."""
    return float(1000 * np.nanmean(joint_error(joints_of(poses, truth), truth)))


def tables(question: Question) -> dict[str, Any]:
    """{"verdicts": {lifter: {verdict: {"takes", "over": the share whose joints err by over 100 mm, "median_mm"}}}}.
    InputError where the data is not."""
    rng = np.random.default_rng(question.seed)
    found: dict[str, dict[str, list[float]]] = {"as it is": {}, "worse": {}}
    for of in question.sets:
        for take in question.takes(of):
            for lifter, poses in (("as it is", take.lifted), ("worse", worse(take.lifted, rng))):
                said = verdict(findings_of(poses))
                found[lifter].setdefault(said, []).append(error_mm(poses, take.seen.truth))
    return {
        **question.heading(),
        "verdicts": {
            lifter: {said: _row(np.array(errors[said])) for said in _VERDICTS if said in errors}
            for lifter, errors in found.items()
        },
    }


def _row(errors_mm: np.ndarray) -> dict[str, Any]:
    over = float((errors_mm > _LIMIT_MM).mean())
    return {"takes": len(errors_mm), "over": over, "median_mm": float(np.median(errors_mm))}
