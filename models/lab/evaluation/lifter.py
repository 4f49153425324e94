"""How well a lifter does where the truth is known:  pcnet3d evaluate lifter -o DIR

Virtual takes of people that it never saw, its focal length known and not, over frames and over takes.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.frames import IMAGE
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import geodesic_deg, kabsch
from ...common.metrics import Figure, joint_error, procrustes_error, scaled
from ...lifter.builtin import lift
from ..mocap.clips import subject_of
from .motion_class import CLASSES
from .people import mean, pooled
from .sets import Question
from .tables import Page, Table
from .testbed import BEDS, Bed, LiftedTake, SeenTake

_POSTURES = ("upright", "lying")
_ERRORS = ("MPJPE", "PA-MPJPE", "depth", "lateral", "vertical", "hidden rotation")
PAGE = Page(
    "Lifter",
    "; {frames_per_s:,.0f} frames/s. Cells are p50 / mean / p95; mm of each person's own size, degrees; by person: "
    "the mean over frames, in brackets 90 % of the means over people drawn anew.",
    [
        Table(
            f"A {per}",
            "beds/*/*/*/lifter",
            ["views", "focal length", "set"],
            {
                f"{per}s": f"{{counts[{per}s]:,}}",
                **{name: f"{{{per}[{name}]}}" for name in _ERRORS},
                **({"MPJPE by person": "{by person[MPJPE][said]}"} if per == "frame" else {}),
            },
            f"Scale aligned per {per}, over {per}s.",
        )
        for per in ("frame", "take")
    ],
)


def tables(question: Question, beds: Bed | None = None) -> dict[str, Any]:
    """{"beds": {bed: {"focal assumed", "focal known": {"SET GROUP": {"lifter": lifter_figures}}}}, "frames_per_s"}, the
    group a posture or a motion that has frames. beds: the one bed to judge before; every one without."""
    results = {**replace(question, people=None).heading(), "seed": question.seed, "beds": {}}
    for bed in BEDS if beds is None else (beds,):
        before = replace(question, bed=bed)
        rows: dict[str, dict[str, Any]] = {"focal assumed": {}, "focal known": {}}
        for focal, table in rows.items():
            for one in before.sets:
                takes = list(before.takes(one, focal_known=focal == "focal known"))
                table |= {f"{one.label} {name}": {"lifter": row} for name, row in groups(takes).items()}
        results["beds"][bed] = rows
    results["frames_per_s"] = speed(question.lifter)
    return results


def groups(takes: Sequence[LiftedTake]) -> dict[str, dict[str, Any]]:
    """{group: lifter_figures} of the groups that have frames."""
    rows = {group: lifter_figures(takes, group) for group in (*_POSTURES, *CLASSES)}
    return {group: row for group, row in rows.items() if row["counts"]["frames"]}


def in_group(seen: SeenTake, group: str) -> np.ndarray:
    """(T,) the frames that are "upright" or "lying", or upright and of a motion (motion_class)."""
    if group == "lying":
        return seen.lying
    return ~seen.lying if group == "upright" else ~seen.lying & seen.motion[group]


def lifter_figures(takes: Iterable[LiftedTake], group: str) -> dict[str, dict[str, Any]]:
    """Errors in mm (angles in degrees) of the frames of a group.

    "frame": the lift is scaled to the truth frame by frame (as for a lifter without a scale; N-MPJPE, Rhodin et
    al. 2018), and figures run over frames. "take": one scale for a whole take, and figures run over takes.
    Both are in mm of each person's own size. depth, lateral, vertical: mean absolute error along the ray to the
    body, across it and level, and up. hidden rotation: the rigid rotation that would bring the lift closest.
    """
    parts: dict[str, dict[str, list[np.ndarray]]] = {"frame": {}, "take": {}}
    people: list[str] = []
    for take in takes:
        use = in_group(take.seen, group)
        if not use.any():
            continue
        people += [subject_of(take.seen.clip)] * int(use.sum())
        truth, lifted = take.seen.truth, take.lifted.joints.astype(np.float64)
        for per, rows in parts.items():
            fitted = scaled(lifted, truth, per)
            errors = {
                "MPJPE": 1000 * joint_error(fitted, truth),
                "PA-MPJPE": 1000 * procrustes_error(lifted, truth),
                **_along(fitted - truth, take),
                "hidden rotation": geodesic_deg(kabsch(truth, lifted), np.eye(3)),
            }
            for name, values in errors.items():
                rows.setdefault(name, []).append(values[use])
    frames = np.concatenate(parts["frame"].get("MPJPE", [np.zeros(0)]))
    return {
        "frame": {name: Figure.of(np.concatenate(values)) for name, values in parts["frame"].items()},
        "take": {name: Figure.of(np.array([*map(mean, values)])) for name, values in parts["take"].items()},
        "by person": {
            name: pooled(np.concatenate(values), people)
            for name, values in parts["frame"].items()
            if name.endswith("MPJPE")
        },
        "counts": {
            "frames": len(frames),
            "not lifted": int(np.isnan(frames).sum()),
            "takes": len(parts["take"].get("MPJPE", [])),
        },
    }


def speed(lifter: str | Path) -> float:
    """Frames lifted per second of wall time on this machine, features included."""
    rng, frames = np.random.default_rng(0), 6000
    walk = np.cumsum(rng.normal(0, 0.3, (frames, 17, 2)), axis=0) + rng.uniform(300, 700, (17, 2))
    keypoints = PoseSequence(walk, H36M17, IMAGE)
    lift(keypoints, (1920, 1080), model=lifter)
    start = time.perf_counter()
    lift(keypoints, (1920, 1080), model=lifter)
    return frames / (time.perf_counter() - start)


def _along(error: np.ndarray, take: LiftedTake) -> dict[str, np.ndarray]:
    """(T,) mean absolute error in mm along the ray to the body, along up made square to it, and across both."""
    depth = take.seen.R_camera_from_ray[..., 2]
    up = take.seen.up - (take.seen.up * depth).sum(-1, keepdims=True) * depth
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    axes = {"depth": depth, "lateral": np.cross(depth, up), "vertical": up}
    return {name: 1000 * np.abs(np.einsum("tji,ti->tj", error, axis)).mean(-1) for name, axis in axes.items()}
