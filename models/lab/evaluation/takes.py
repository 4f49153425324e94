"""What one gravity a take is worth, where the truth is known:  pcnet3d lab evaluate takes -o DIR

Every take is seen by one camera that stands still, and lifted. Every rectifier answers twice: frame by frame, and with
the take's one up (models/gravity/levelling.py).

p50 / mean / p95; by person: the mean over frames, in brackets 90 % of the means over people drawn anew. Tilt, degrees:
over takes, of a take's mean. Rotation of BODY, degrees, and MPJPE, mm, one scale a take: over frames. Upright: in every
frame; lying: trunk more than 60 degrees from the vertical half of the time or more. Levelled: takes that are not
refused.

Accelerations of wrists and ankles relative to the pelvis, 6 Hz zero-phase: RMSE in m/s² (horizontal: of one axis) of
the lift's signals in upright axes with one heading for the take, the truth's for every method, against the same in the
true axes, which is what the rotation alone adds; over upright takes of 2 s and more without gaps. A method that answers
frame by frame has its frames' own ups there, turned to that heading frame by frame; so only its tilt counts against it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.core.camera import Look
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import angle_deg, from_columns, geodesic_deg, rotate, transpose
from ....pipeline.plugins.protocols import Rectifier
from ...common.metrics import joint_error
from ...common.residuals import stated_spread
from ...gravity.levelling import Levelled, level_static, why_not
from ...gravity.votes import PersonFrames
from ..beds import Configuration, SeenTake, accelerations, joints_of, lifted, lifted_by, simulated_look
from ..cases import Cases, Figure, Row, figures, mean
from ..clips import subject_of

# (T, 17, 3) joints, CAMERA axes relative to the pelvis, any unit; and their spread, as of PersonFrames.
Lift = tuple[np.ndarray, np.ndarray | None]
# Of a camera taken as level: LEVEL's back, right and up in CAMERA axes for a person who faces it (design.md section 4).
_R_CAMERA_FROM_UPRIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
_LONG_S = 2.0
LONG, _SHORT, _PARTLY, _LYING = (
    "upright, 2 s and more", "upright, under 2 s", "lying now and then", "lying",
)  # fmt: skip
_PARTS = {part: H36M17.indices((f"l_{part}", f"r_{part}")) for part in ("wrist", "ankle")}
_ALONG = {"vertical": slice(2, 3), "horizontal": slice(0, 2)}


@dataclass(frozen=True, eq=False)
class Answer:
    """One method's rotations of a take.

    joints: (T, 17, 3) what it is an answer about. R_camera_from_body: (T, 3, 3). levelled: of a take-level method,
    whose axes the whole take shares; None of one that answers every frame alone.
    """

    joints: np.ndarray
    R_camera_from_body: np.ndarray
    levelled: Levelled | None = None

    def axes(self, R_camera_from_world: np.ndarray) -> np.ndarray:
        """(T, 3, 3) upright axes in the camera, with one heading for all frames, the true one: the take's axes turned
        about their up by one angle; without such axes, each frame's own up under that heading. So what is left of a
        method's error is its up, and what a frame's heading does is not held against it."""
        if self.levelled is None:
            return with_heading(self.R_camera_from_body, R_camera_from_world, per="frame")
        R = np.broadcast_to(self.levelled.R_camera_from_level, self.R_camera_from_body.shape)
        return with_heading(R, R_camera_from_world)


def answers(
    rectifiers: Sequence[Rectifier], lift: Lift, time_s: np.ndarray, look: Look, told: Lift
) -> dict[str, Answer]:
    """{"METHOD, a frame", "METHOD, a take", "METHOD, a take, with its image": Answer}. time_s: (T,). look: what an
    image of the take says about up. told: of a lift that knew this up, for the answer with the image."""
    found = {}
    for rectifier in rectifiers:
        method = rectifier.method
        found[f"{method}, a frame"] = Answer(lift[0], rectifier.rotation(lift[0])[0])
        for per, (joints, spread), said in (
            ("a take", lift, None),
            ("a take, with its image", told, look),
        ):
            person = PersonFrames(joints, *rectifier.rotation(joints), time_s, spread=spread)
            levelled = level_static(person, look=said)
            found[f"{method}, {per}"] = Answer(joints, levelled.R_camera_from_body, levelled)
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


def rows(asked: Configuration) -> Iterator[Row]:
    """("takes", "LABEL, lifted, GROUP", "takes", "frames", and "methods", method): Cases; and ("acceleration", "LABEL,
    lifted", "takes", "left out", and "lift", method, part, direction): RMSE."""
    for people in asked.sets:
        for take in lifted(asked, people):
            seen, group = take.seen, group_of(take.seen)
            look = simulated_look(seen.up, asked.seed, seen.clip)
            lift, told = (
                (joints_of(poses, seen.truth), stated_spread(poses))
                for poses in (take.lifted, lifted_by(asked.lifter, seen, look.up))
            )
            methods = answers(asked.rectifiers, lift, seen.keypoints.times, look, told)
            place = ("takes", f"{people.label}, lifted, {group}")
            yield (*place, "takes"), 1
            yield (*place, "frames"), len(lift[0])
            yield from (((*place, "methods", name), judge(seen, answer)) for name, answer in methods.items())
            if group == LONG:
                place, whole = ("acceleration", f"{people.label}, lifted"), bool(np.isfinite(lift[0]).all())
                yield (*place, "takes"), int(whole)
                yield (*place, "left out"), int(not whole)
                if whole:
                    for keys, rmse in added(methods, lift[0], seen):
                        yield (*place, "lift", *keys), rmse


def summary(values: list[Any]) -> dict[str, Any]:
    """Of what stands in one place: tilt is over takes, of a take's mean, rotation and MPJPE over frames; of take-level
    methods also the share levelled."""
    if isinstance(values[0], float):
        return {"rmse": Figure.of(np.array(values))}
    result = figures(values, ("tilt", "rotation", "mpjpe"))
    result["tilt"] = Figure.of(np.array([mean(take["tilt"]) for take in values]))
    if "levelled" in result:
        result["levelled"] = sum(take["levelled"][0] for take in values) / len(values)
    return result


def group_of(seen: SeenTake) -> str:
    """Upright in every frame (clips.lying), of 2 s and more or shorter; lying, or bent far down, in half of its
    frames or more; or in fewer."""
    lies = seen.lying.mean()
    if lies > 0:
        return _LYING if lies >= 0.5 else _PARTLY
    return LONG if len(seen.lying) / seen.keypoints.fps >= _LONG_S else _SHORT


def judge(seen: SeenTake, answer: Answer) -> Cases:
    """The answer against the truth; its joints in metres, lifted or true. Of every frame tilt and rotation (degrees)
    and MPJPE (mm), NaN without an answer; and whether a method that answers for the take levels it."""
    R, R_true = answer.R_camera_from_body, seen.R_camera_from_body
    body, truth = rotate(transpose(R), answer.joints), rotate(transpose(R_true), seen.truth)
    values = {
        "tilt": angle_deg(R[..., 2], np.broadcast_to(seen.up, R[..., 2].shape)),
        "rotation": geodesic_deg(R, R_true),
        "mpjpe": 1000 * joint_error(body, truth),
    }
    if answer.levelled is not None:
        values["levelled"] = np.full(len(R), float(not why_not(answer.levelled)))
    return Cases(subject_of(seen.clip), values)


def added(
    methods: Mapping[str, Answer], joints: np.ndarray, seen: SeenTake
) -> Iterator[tuple[tuple[str, str, str], float]]:
    """(method, part, direction), RMSE: of one lifted take, of the methods and the camera's axes. joints: (T, 17, 3)
    metres, CAMERA axes relative to the pelvis, without gaps, at the truth's scale."""
    time_s, R_true = seen.time_s, seen.R_camera_from_world
    level = np.broadcast_to(_R_CAMERA_FROM_UPRIGHT, (len(joints), 3, 3))
    axes_of = {"camera axes": with_heading(level, R_true)}
    axes_of |= {name: answer.axes(R_true) for name, answer in methods.items()}
    lift = _limbs(joints, R_true, time_s)
    for name, axes in axes_of.items():
        for part, signal in _limbs(joints, axes, time_s).items():
            for way, of in _ALONG.items():
                yield (name, part, way), float(np.sqrt(np.mean((signal - lift[part])[..., of] ** 2)))


def _limbs(joints: np.ndarray, R_camera_from_axes: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """Accelerations of each part's joints in other axes."""
    turned = rotate(transpose(R_camera_from_axes), joints)
    return {part: accelerations(turned[:, rows], time_s) for part, rows in _PARTS.items()}
