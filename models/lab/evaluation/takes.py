"""What one gravity a take is worth, where the truth is known:  pcnet3d lab evaluate takes -o DIR

Every take is seen by one camera that stands still; lifted, and with its real joints. Every rectifier answers twice:
frame by frame, and with the take's one up (models/gravity/levelling.py). Errors, and the accelerations of wrists and
ankles.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....pipeline.core.rotations import angle_deg, geodesic_deg, rotate, transpose
from ...common.metrics import Figure, joint_error
from ...common.spread import stated_spread
from ...gravity import why_not
from ..mocap.clips import subject_of
from . import acceleration
from .acceleration import over_takes
from .people import mean, pooled
from .sets import Question
from .tables import Page, Table
from .take_answers import CAMERA_AXES, TRUE_AXES, Answer, answers, constant, joints_of, named, simulated_look
from .testbed import LiftedTake

# Of a camera taken as level: LEVEL's back, right and up in CAMERA axes for a person who faces it (design.md section 4).
_R_CAMERA_FROM_UPRIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
_LONG_S = 2.0
LONG, _SHORT, _PARTLY, _LYING = _GROUPS = (
    "upright, 2 s and more", "upright, under 2 s", "lying now and then", "lying",
)  # fmt: skip
PAGE = Page(
    "Takes",
    "; one camera a take, standing still.",
    [
        Table(
            "Errors",
            "takes/*/methods/*",
            ["set", "method"],
            {
                "takes": "{takes}", "frames": "{frames:,}", "tilt": "{tilt}", "rotation": "{rotation}",
                "MPJPE": "{mpjpe}", "means by person": "{by person[tilt][said]}, {by person[rotation][said]}, "
                "{by person[mpjpe][said]}",
            },
            "p50 / mean / p95; by person: over frames, in brackets 90 % of the means over people drawn anew. "
            "Tilt, degrees: over takes, of a take's mean. Rotation of BODY, degrees, and MPJPE, mm, "
            "one scale a take: over frames. Upright: in every frame; lying: trunk more than 60 degrees from the "
            "vertical half of the time or more.",
        ),
        Table(
            "Trust",
            "takes/*/methods/*",
            ["set", "method"],
            {"levelled": "{levelled:.1%}"},
            "Levelled: takes that are not refused.",
            where=lambda row: "levelled" in row,
        ),
        *acceleration.TABLES,
    ],
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Judged:
    """One method on one take. rotation, tilt (degrees), mpjpe (mm): (T,), NaN without an answer. levelled: of a
    take-level method; else None. person: who it is."""

    rotation: np.ndarray
    tilt: np.ndarray
    mpjpe: np.ndarray
    levelled: bool | None = None
    person: str = ""


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says, as nested dicts with Figures."""
    results: dict[str, Any] = question.heading()
    results |= {"rectifiers": [r.method for r in question.rectifiers], "takes": {}, "acceleration": {}}
    for one in question.sets:
        taken, signals = one_set(question, one.label, question.takes(one))
        results["takes"] |= taken
        results["acceleration"] |= signals
    return results


def one_set(
    question: Question, label: str, takes: Iterable[LiftedTake]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """({"LABEL, lifted, GROUP": {"takes", "frames", "methods": {method: figures}}}, accelerations by set)."""
    judged: dict[str, dict[str, list[Judged]]] = {
        f"{label}, {kind}, {group}": {} for kind in ("lifted", "clean") for group in _GROUPS
    }
    scores, gaps = [], 0
    for take in takes:
        seen = take.seen
        for kind, joints in (("lifted", joints_of(take.lifted, seen.truth)), ("clean", seen.truth)):
            look = simulated_look(seen.up, question.seed, seen.clip)
            spread = again = None
            if kind == "lifted":
                told = question.lift_seen(seen, up=look.up)
                spread = stated_spread(take.lifted)
                again = joints_of(told, seen.truth), stated_spread(told)
            both = named(answers(question.rectifiers, joints, seen.keypoints.times, look, spread, again))
            for name, answer in both.items():
                rows = judged[f"{label}, {kind}, {group_of(take)}"].setdefault(name, [])
                rows.append(judge(take, joints, answer))
            if kind == "lifted" and group_of(take) == LONG:
                if np.isfinite(joints).all():
                    scores.append(signals(take, joints, both))
                else:
                    gaps += 1
    accelerated = {"takes": len(scores), "left out": gaps, **over_takes(scores)}
    rows = {name: row(methods) for name, methods in judged.items() if methods}
    return rows, {f"{label}, lifted": accelerated}


def group_of(take: LiftedTake) -> str:
    """Upright in every frame (mocap.clips.lying), of 2 s and more or shorter; lying, or bent far down, in half of its
    frames or more; or in fewer."""
    lies = take.seen.lying.mean()
    if lies > 0:
        return _LYING if lies >= 0.5 else _PARTLY
    return LONG if len(take.seen.lying) / take.seen.keypoints.fps >= _LONG_S else _SHORT


def judge(take: LiftedTake, joints: np.ndarray, answer: Answer) -> Judged:
    """joints: (T, 17, 3) metres, CAMERA axes relative to the pelvis, lifted or true."""
    joints = joints if answer.joints is None else answer.joints
    R, R_true = answer.R_camera_from_body, take.seen.R_camera_from_body
    body, truth = rotate(transpose(R), joints), rotate(transpose(R_true), take.seen.truth)
    tilt = angle_deg(R[..., 2], np.broadcast_to(take.seen.up, R[..., 2].shape))
    errors = Judged(
        geodesic_deg(R, R_true), tilt, 1000 * joint_error(body, truth), person=subject_of(take.seen.clip)
    )
    if answer.levelled is None:
        return errors
    return replace(errors, levelled=not why_not(answer.levelled))


def row(methods: dict[str, list[Judged]]) -> dict[str, Any]:
    """Figures of one set. Tilt: over takes, of a take's mean. Rotation and MPJPE: over frames. Of take-level methods
    also the share levelled."""
    first = next(iter(methods.values()))
    figures: dict[str, Any] = {
        "takes": len(first), "frames": sum(len(take.rotation) for take in first), "methods": {},
    }  # fmt: skip
    for name, takes in methods.items():
        method: dict[str, Any] = {
            "tilt": Figure.of(np.array([mean(take.tilt) for take in takes])),
            "rotation": Figure.of(np.concatenate([take.rotation for take in takes])),
            "mpjpe": Figure.of(np.concatenate([take.mpjpe for take in takes])),
        }
        people = np.repeat([take.person for take in takes], [len(take.rotation) for take in takes])
        method["by person"] = {
            name: pooled(np.concatenate([getattr(take, name) for take in takes]), people)
            for name in ("tilt", "rotation", "mpjpe")
        }
        if takes[0].levelled is not None:
            method["levelled"] = sum(bool(take.levelled) for take in takes) / len(takes)
        figures["methods"][name] = method
    return figures


def signals(take: LiftedTake, joints: np.ndarray, both: dict[str, Answer]) -> dict[str, Any]:
    """acceleration.take_scores of the lifted joints (T, 17, 3) by the methods, the camera's axes and the
    true ones."""
    seen = take.seen
    methods = {
        CAMERA_AXES: constant(_R_CAMERA_FROM_UPRIGHT, len(joints)),
        **both,
        TRUE_AXES: constant(seen.R_camera_from_world, len(joints)),
    }
    return acceleration.take_scores(
        methods, joints, seen.truth, seen.R_camera_from_world, seen.keypoints.times
    )
