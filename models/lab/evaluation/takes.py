"""What one gravity a take is worth, where the truth is known:  pcnet3d lab evaluate takes -o DIR

Every take is seen by one camera that stands still, and lifted. Every rectifier answers twice: frame by frame, and with
the take's one up (models/gravity/levelling.py). Errors, and what its rotation alone adds to
accelerations of wrists and ankles relative to the pelvis, both sides low-passed at 6 Hz without delay, vertical and
horizontal apart: the lift's signals in upright axes with one heading for the take, the truth's for every method,
against the same in the true axes. A method that answers frame by frame has its frames' own ups there, turned to that
heading frame by frame; so only its tilt counts against it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.core.camera import Look
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import angle_deg, from_columns, geodesic_deg, rotate, transpose
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.signals.filters import CUTOFF_HZ
from ...common.metrics import joint_error
from ...common.spread import stated_spread
from ...gravity.levelling import Levelled, level_static, why_not
from ...gravity.person import PersonFrames
from ..common.metrics import Figure, OfTake, figures, mean
from ..mocap.clips import subject_of
from .runs import Question
from .testbed import LiftedTake, SeenTake, accelerations, joints_of, lifted_by, simulated_look

# (T, 17, 3) joints, CAMERA axes relative to the pelvis, any unit; and their spread, as of PersonFrames.
Lift = tuple[np.ndarray, np.ndarray | None]
# Of a camera taken as level: LEVEL's back, right and up in CAMERA axes for a person who faces it (design.md section 4).
_R_CAMERA_FROM_UPRIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
_LONG_S = 2.0
LONG, _SHORT, _PARTLY, _LYING = _GROUPS = (
    "upright, 2 s and more", "upright, under 2 s", "lying now and then", "lying",
)  # fmt: skip
_ERRORS = ("tilt", "rotation", "mpjpe")
_PARTS = {part: H36M17.indices((f"l_{part}", f"r_{part}")) for part in ("wrist", "ankle")}
_ALONG = {"vertical": slice(2, 3), "horizontal": slice(0, 2)}
ABOUT = (
    "One camera a take, standing still. p50 / mean / p95; by person: the mean over frames, in brackets 90 % of the "
    "means over people drawn anew. Tilt, degrees: over takes, of a take's mean. Rotation of BODY, degrees, and MPJPE,"
    " mm, one scale a take: over frames. Upright: in every frame; lying: trunk more than 60 degrees from the vertical"
    " half of the time or more. Levelled: takes that are not refused. Accelerations relative to the pelvis, "
    f"{CUTOFF_HZ:g} Hz zero-phase: RMSE in m/s² (horizontal: of one axis) against the first lift's in the true axes, "
    "what the rotation alone adds, over upright takes of 2 s and more without gaps."
)


@dataclass(frozen=True, eq=False)
class Answer:
    """One method's rotations of a take.

    R_camera_from_body: (T, 3, 3). R_camera_from_level: (3, 3), axes that the whole take shares, or None of a method
    that answers every frame alone. levelled: of a take-level method. joints: (T, 17, 3) what it is an answer about,
    where that is another lift than the other methods'.
    """

    R_camera_from_body: np.ndarray
    R_camera_from_level: np.ndarray | None = None
    levelled: Levelled | None = None
    joints: np.ndarray | None = None

    def axes(self, R_camera_from_world: np.ndarray) -> np.ndarray:
        """(T, 3, 3) upright axes in the camera, with one heading for all frames, the true one: the take's axes turned
        about their up by one angle; without such axes, each frame's own up under that heading. So what is left of a
        method's error is its up, and what a frame's heading does is not held against it."""
        if self.R_camera_from_level is None:
            return with_heading(self.R_camera_from_body, R_camera_from_world, per="frame")
        R = np.broadcast_to(self.R_camera_from_level, self.R_camera_from_body.shape)
        return with_heading(R, R_camera_from_world)


def answers(
    rectifiers: Sequence[Rectifier], lift: Lift, time_s: np.ndarray, look: Look, told: Lift
) -> dict[str, Answer]:
    """{"METHOD, a frame", "METHOD, a take", "METHOD, a take, with its image": Answer}. lift: (T, 17, 3) joints and
    their spread. time_s: (T,). look: what an image of the take says about up. told: of a lift that knew this up, for
    the answer with the image."""
    found = {}
    for rectifier in rectifiers:
        R, error_deg = rectifier.rotation(lift[0])
        alone = level_static(PersonFrames(lift[0], R, error_deg, time_s, spread=lift[1]))
        with_image = PersonFrames(told[0], *rectifier.rotation(told[0]), time_s, spread=told[1])
        with_image = level_static(with_image, look=look)
        found[f"{rectifier.method}, a frame"] = Answer(R)
        for per, levelled, joints in (
            ("a take", alone, None),
            ("a take, with its image", with_image, told[0]),
        ):
            found[f"{rectifier.method}, {per}"] = Answer(
                levelled.R_camera_from_body, levelled.R_camera_from_level, levelled, joints
            )
    return found


def with_heading(R: np.ndarray, R_true: np.ndarray, per: str = "take") -> np.ndarray:
    """R (T, 3, 3) turned about its own up, its third column, towards R_true (T, 3, 3) or (3, 3): by the one angle that
    brings the take closest (least squares), or per "frame" by an angle each."""
    D = transpose(R) @ R_true
    sine, cosine = D[..., 1, 0] - D[..., 0, 1], D[..., 0, 0] + D[..., 1, 1]
    if per == "take":
        sine, cosine = np.nansum(sine, keepdims=True), np.nansum(cosine, keepdims=True)
    angle = np.arctan2(sine, cosine)
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    c, s = np.cos(angle), np.sin(angle)
    return R @ from_columns(*(np.stack(v, -1) for v in ((c, s, zero), (-s, c, zero), (zero, zero, one))))


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says, as nested dicts with Figures."""
    results: dict[str, Any] = question.heading()
    results |= {"rectifiers": [r.method for r in question.rectifiers], "takes": {}, "acceleration": {}}
    for people in question.sets:
        rows, accelerated = one_set(question, people.label, question.takes(people))
        results["takes"] |= rows
        results["acceleration"][f"{people.label}, lifted"] = accelerated
    return results


def one_set(
    question: Question, label: str, takes: Iterable[LiftedTake]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """({"LABEL, lifted, GROUP": {"takes", "frames", "methods": {method: figures}}}, accelerations)."""
    rows: dict[str, dict[str, list[tuple[OfTake, bool | None]]]] = {
        f"{label}, lifted, {group}": {} for group in _GROUPS
    }
    scores, gaps = [], 0
    for take in takes:
        seen, group = take.seen, group_of(take.seen)
        lifted, look = joints_of(take.lifted, seen.truth), simulated_look(seen.up, question.seed, seen.clip)
        told = lifted_by(question.lifter, seen, look.up)
        again = joints_of(told, seen.truth), stated_spread(told)
        first = lifted, stated_spread(take.lifted)
        methods = answers(question.rectifiers, first, seen.keypoints.times, look, again)
        for name, answer in methods.items():
            rows[f"{label}, lifted, {group}"].setdefault(name, []).append(judge(seen, lifted, answer))
        if group == LONG:
            if np.isfinite(lifted).all():
                scores.append(added(methods, lifted, seen))
            else:
                gaps += 1
    accelerated = {"takes": len(scores), "left out": gaps, "lift": over_takes(scores)}
    return {name: row(methods) for name, methods in rows.items() if methods}, accelerated


def group_of(seen: SeenTake) -> str:
    """Upright in every frame (mocap.clips.lying), of 2 s and more or shorter; lying, or bent far down, in half of its
    frames or more; or in fewer."""
    lies = seen.lying.mean()
    if lies > 0:
        return _LYING if lies >= 0.5 else _PARTLY
    return LONG if len(seen.lying) / seen.keypoints.fps >= _LONG_S else _SHORT


def judge(seen: SeenTake, joints: np.ndarray, answer: Answer) -> tuple[OfTake, bool | None]:
    """Tilt and rotation (degrees) and MPJPE (mm) of every frame, NaN without an answer; and whether a method that
    answers for the take levels it. joints: (T, 17, 3) metres, CAMERA axes relative to the pelvis, lifted or true."""
    joints = joints if answer.joints is None else answer.joints
    R, R_true = answer.R_camera_from_body, seen.R_camera_from_body
    body, truth = rotate(transpose(R), joints), rotate(transpose(R_true), seen.truth)
    tilt = angle_deg(R[..., 2], np.broadcast_to(seen.up, R[..., 2].shape))
    errors = tilt, geodesic_deg(R, R_true), 1000 * joint_error(body, truth)
    levelled = None if answer.levelled is None else not why_not(answer.levelled)
    return OfTake(subject_of(seen.clip), dict(zip(_ERRORS, errors, strict=True))), levelled


def row(methods: Mapping[str, Sequence[tuple[OfTake, bool | None]]]) -> dict[str, Any]:
    """Figures of one set. Tilt: over takes, of a take's mean. Rotation and MPJPE: over frames. Of take-level methods
    also the share levelled."""
    first = next(iter(methods.values()))
    row: dict[str, Any] = {
        "takes": len(first), "frames": sum(len(take.values["tilt"]) for take, _ in first), "methods": {},
    }  # fmt: skip
    for name, judged in methods.items():
        takes, levelled = zip(*judged, strict=True)
        of_takes = Figure.of(np.array([mean(take.values["tilt"]) for take in takes]))
        row["methods"][name] = figures(takes, _ERRORS) | {"tilt": of_takes}
        if levelled[0] is not None:
            row["methods"][name]["levelled"] = sum(levelled) / len(levelled)
    return row


def added(methods: Mapping[str, Answer], joints: np.ndarray, seen: SeenTake) -> dict[str, Any]:
    """{method: {part: {direction: RMSE}}} of one lifted take, of the methods and the camera's axes. joints: (T, 17, 3)
    metres, CAMERA axes relative to the pelvis, without gaps, at the truth's scale."""
    time_s, R_true = seen.keypoints.times, seen.R_camera_from_world
    level = np.broadcast_to(_R_CAMERA_FROM_UPRIGHT, (len(joints), 3, 3))
    every = {"camera axes": Answer(level, _R_CAMERA_FROM_UPRIGHT), **methods}
    lift = _limbs(joints, R_true, time_s)
    off = {
        name: {
            part: signal - lift[part] for part, signal in _limbs(joints, answer.axes(R_true), time_s).items()
        }
        for name, answer in every.items()
    }
    return {
        name: {
            part: {way: float(np.sqrt(np.mean(error[..., axes] ** 2))) for way, axes in _ALONG.items()}
            for part, error in parts.items()
        }
        for name, parts in off.items()
    }


def _limbs(joints: np.ndarray, R_camera_from_axes: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """Accelerations of each part's joints in other axes."""
    turned = rotate(transpose(R_camera_from_axes), joints)
    return {part: accelerations(turned[:, rows], time_s) for part, rows in _PARTS.items()}


def over_takes(scores: Sequence[Any]) -> Any:
    """Nested RMSE of many takes as nested {"rmse": Figure} over takes; {} without any."""
    if not len(scores) or isinstance(scores[0], dict):
        return {key: over_takes([take[key] for take in scores]) for key in (scores[0] if len(scores) else ())}
    return {"rmse": Figure.of(np.array(scores))}
