"""How well a lifter does where the truth is known:  pcnet3d lab evaluate lifter -o DIR

Virtual takes of people that it never saw, its focal length known and not.
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
from ...common.metrics import Figure, joint_error, procrustes_error, scaled
from ...lifter.builtin import lift
from ..mocap.clips import subject_of
from .motion_class import CLASSES
from .people import pooled
from .sets import Question
from .tables import Page, Table
from .testbed import BEDS, LiftedTake, SeenTake

_POSTURES = ("upright", "lying")
_ERRORS = ("MPJPE", "PA-MPJPE", "depth", "lateral", "vertical")
PAGE = Page(
    "Lifter",
    "; {frames_per_s:,.0f} frames/s. Cells are p50 / mean / p95 over frames, the scale aligned in each; mm of each "
    "person's own size; by person: the mean over frames, in brackets 90 % of the means over people drawn anew.",
    [
        Table(
            "",
            "beds/*/*/*/lifter",
            ["views", "focal length", "set"],
            {
                "frames": "{counts[frames]:,}",
                "not lifted": "{counts[not lifted]:,}",
                **{name: f"{{frame[{name}]}}" for name in _ERRORS},
                "MPJPE by person": "{by person[MPJPE][said]}",
            },
        )
    ],
)


def tables(question: Question) -> dict[str, Any]:
    """{"beds": {bed: {"focal assumed", "focal known": {"SET GROUP": {"lifter": lifter_figures}}}}, "frames_per_s"}, the
    group a posture or a motion that has frames."""
    results = {**replace(question, people=None).heading(), "seed": question.seed, "beds": {}}
    for bed in BEDS:
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
    """Errors over the frames of a group in mm of each person's own size, the lift scaled to the truth in every frame
    (as for a lifter without a scale; N-MPJPE, Rhodin et al. 2018). depth, lateral, vertical: mean absolute error along
    the ray to the body, across it and level, and up."""
    parts: dict[str, list[np.ndarray]] = {}
    people: list[str] = []
    for take in takes:
        use = in_group(take.seen, group)
        if not use.any():
            continue
        people += [subject_of(take.seen.clip)] * int(use.sum())
        truth, lifted = take.seen.truth, take.lifted.joints.astype(np.float64)
        fitted = scaled(lifted, truth)
        errors = {
            "MPJPE": 1000 * joint_error(fitted, truth),
            "PA-MPJPE": 1000 * procrustes_error(lifted, truth),
            **_along(fitted - truth, take),
        }
        for name, values in errors.items():
            parts.setdefault(name, []).append(values[use])
    of = {name: np.concatenate(values) for name, values in parts.items()}
    return {
        "frame": {name: Figure.of(values) for name, values in of.items()},
        "by person": {name: pooled(values, people) for name, values in of.items() if name.endswith("MPJPE")},
        "counts": {"frames": len(people), "not lifted": int(np.isnan(of["MPJPE"]).sum()) if of else 0},
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
