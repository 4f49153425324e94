"""One take from eight cameras around the person: how far what they say in LEVEL is apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....pipeline.core.canonical import trunk_lean_deg
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.running.progress import each
from ...common.metrics import Figure
from ..synthetic.cameras import WILD, ViewRange
from .sets import Question
from .tables import Table
from .take_answers import CAMERA_AXES, TRUE_AXES, answers, camera_axes, constant, joints_of, named
from .testbed import SeenTake, see

CAMERAS = 8
_PITCH_DEG = (-20.0, 40.0)  # and no more than the views allow
TABLE = Table(
    "One take from eight cameras",
    "cameras/*/*",
    ["joints", "method"],
    {"joints, mm": "{joints_mm}", "lean, deg": "{lean_deg}"},
    "Takes of the first set, of 2 s and more; yaw 0 to 315 degrees, pitch of the bed's cameras between -20 and "
    "40. Root mean square over cameras to their mean, one heading for all: every joint's position in upright axes, and "
    "the trunk's lean from the vertical; p50 / mean / p95 over takes. `true axes` is what the lifts differ by. The "
    "geometric rectifier agrees with itself on clean joints by construction, and sees no lean to disagree about.",
)


def around(clip: Clip, seed: int, views: ViewRange = WILD) -> list[SeenTake]:
    """The clip from cameras at 0, 45, ... 315 degrees about the vertical, each with a pitch of the views' between -20
    and 40 degrees, no roll, and its own lens and place; deterministic in the seed and the clip's name."""
    step = 360 / CAMERAS
    low, high = (float(np.clip(angle, *_PITCH_DEG)) for angle in views.pitch_deg)
    upright = replace(views, pitch_deg=(low, high), roll_deg=(0.0, 0.0))
    return [
        see(clip, CAMERAS * seed + i, views=replace(upright, yaw_deg=(i * step, i * step)))
        for i in range(CAMERAS)
    ]


def positions(rectifiers: Sequence[Rectifier], seen: SeenTake, joints: np.ndarray) -> dict[str, np.ndarray]:
    """{method: (T, 17, 3)} one camera's joints, metres, CAMERA axes relative to the pelvis, in each method's upright
    axes under the true heading; and in the true axes."""
    methods = {
        CAMERA_AXES: camera_axes(len(joints)),
        **named(answers(rectifiers, joints, seen.keypoints.times)),
        TRUE_AXES: constant(seen.R_camera_from_world, len(joints)),
    }
    return {
        name: rotate(transpose(answer.axes(seen.R_camera_from_world)), joints)
        for name, answer in methods.items()
    }


def apart(views: np.ndarray) -> tuple[float, float]:
    """Root mean square over cameras, frames and joints of the distance to the cameras' mean, mm; and of the trunk's
    lean to the cameras' mean lean, degrees. views: (C, T, 17, 3) metres, z up; frames that a camera lacks are left
    out."""
    views = views[:, np.isfinite(views).all(axis=(0, 2, 3))]
    distance = np.linalg.norm(views - views.mean(axis=0), axis=-1)
    lean = trunk_lean_deg(views)
    return 1000 * _rms(distance), _rms(lean - lean.mean(axis=0))


def camera_tables(question: Question, clips: Sequence[Clip]) -> dict[str, Any]:
    """{"takes": count, "lifted", "clean": {method: {"joints_mm", "lean_deg": Figure}}}, figures over the clips."""
    parts: dict[str, dict[str, list[tuple[float, float]]]] = {"lifted": {}, "clean": {}}
    for clip in each(clips, f"{CAMERAS} cameras", len(clips)):
        seen_by: dict[str, dict[str, list[np.ndarray]]] = {"lifted": {}, "clean": {}}
        for seen in around(clip, question.seed, question.views):
            poses = question.lift_seen(seen)
            for kind, joints in (("lifted", joints_of(poses, seen.truth)), ("clean", seen.truth)):
                for name, points in positions(question.rectifiers, seen, joints).items():
                    seen_by[kind].setdefault(name, []).append(points)
        for kind, methods in seen_by.items():
            for name, points in methods.items():
                parts[kind].setdefault(name, []).append(apart(np.stack(points)))
    tables: dict[str, Any] = {"takes": len(clips)}
    for kind, methods in parts.items():
        tables[kind] = {
            name: dict(zip(("joints_mm", "lean_deg"), map(Figure.of, np.array(values).T), strict=True))
            for name, values in methods.items()
        }
    return tables


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
