"""Accelerations by smoother, where the truth is known:  pcnet3d lab evaluate motion -o DIR

Wrists and ankles of lifted takes relative to the pelvis, in the true upright axes, at the truth's scale (one factor per
take), against motion capture; both sides low-passed at 6 Hz without delay. What a wrong up adds is judged by takes.py.
Upright takes of 2 s and more without gaps; root mean square over a take's frames and both sides, of one axis.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ....pipeline.core.frames import turned_covariance
from ....pipeline.core.rotations import rotate
from ....pipeline.signals.filters import CUTOFF_HZ
from ...smoother import known_noise
from .acceleration import (
    COLUMNS,
    NO_MOTION,
    PARTS,
    accelerations,
    compare,
    filtered,
    over_takes,
    velocities,
)
from .sets import Question
from .tables import Page, Table
from .take_answers import joints_of
from .takes import LONG, group_of
from .testbed import LiftedTake

STATED, ESTIMATED = "known noise, stated", "known noise, estimated"
_SIX = f"Butterworth {CUTOFF_HZ:g} Hz"
FIXED = (_SIX, "Butterworth 3 Hz")
_QUARTERS = ("slowest quarter", "second", "third", "fastest quarter")
PAGE = Page(
    "Accelerations by smoother",
    f". Wrists and ankles relative to the pelvis, true upright axes, {CUTOFF_HZ:g} Hz on both sides, against motion "
    "capture, upright takes of 2 s and more.",
    [
        Table("Takes", "sets/*", ["set"], {"takes": "{takes}"}),
        Table(
            "Errors",
            "sets/*/errors/*",
            ["set", "smoother"],
            COLUMNS,
            "RMSE in m/s^2, p50 / mean / p95 over takes; r, p50.",
        ),
        Table(
            "",
            "sets/*/quarters/*/*/*",
            ["set", "part", "by the take's true speed", "smoother"],
            {"RMSE": "{rmse:.2f}", "r": "{r:.2f}"},
            "Medians over takes, vertical and horizontal.",
        ),
    ],
)


@dataclass(frozen=True, eq=False)
class Scores:
    """One take. errors: {method: {part: {direction: (RMSE, r)}}} of accelerations in m/s^2. speed: {part: the true root
    mean square, m/s}."""

    errors: dict[str, dict[str, dict[str, tuple[float, float]]]]
    speed: dict[str, float]


_SMOOTHERS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    _SIX: lambda path, time_s: path,  # as both sides are filtered so
    FIXED[1]: partial(filtered, cutoff_hz=3.0),
}


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says: {"sets": {label: {"takes", "errors", "quarters"}}}."""
    sets = {one.label: one_set(judged(question.takes(one))) for one in question.sets}
    return {**question.heading(), "sets": sets}


def judged(takes: Iterable[LiftedTake]) -> list[Scores]:
    """The scores of upright takes of 2 s and more without gaps."""
    scores = []
    for take in takes:
        if group_of(take) == LONG:
            joints = joints_of(take.lifted, take.seen.truth)
            if np.isfinite(joints).all():
                scores.append(take_scores(take, joints))
    return scores


def take_scores(take: LiftedTake, joints: np.ndarray) -> Scores:
    """joints: (T, 17, 3), the lift in CAMERA at the truth's scale."""
    seen, time_s = take.seen, take.lifted.times
    away = seen.R_camera_from_ray[..., 2].mean(axis=0)
    away = away - (away @ seen.up) * seen.up
    away /= np.linalg.norm(away)
    axes = np.stack([np.cross(away, seen.up), away, seen.up])  # lateral, depth, vertical
    truth, lifted = rotate(axes, seen.truth), rotate(axes, joints)
    scale = np.nanmedian(np.linalg.norm(joints, axis=-1)) / np.nanmedian(
        np.linalg.norm(take.lifted.joints.astype(np.float64), axis=-1)
    )
    covariance = take.lifted.covariance
    stated = None if covariance is None else turned_covariance(covariance, axes, scale)
    rows = sorted(row for part in PARTS.values() for row in part)
    motions = {ESTIMATED: known_noise(lifted[:, rows], time_s, lifted=True)}
    if stated is not None:
        motions[STATED] = known_noise(lifted[:, rows], time_s, stated[:, rows], lifted=True)
    paths = {name: smooth(lifted[:, rows], time_s) for name, smooth in _SMOOTHERS.items()}
    paths |= {name: motion.values[0] for name, motion in motions.items()}
    true = accelerations(truth[:, rows], time_s)
    found = {NO_MOTION: np.zeros_like(true)} | {n: accelerations(path, time_s) for n, path in paths.items()}
    parts = {name: [rows.index(row) for row in part] for name, part in PARTS.items()}
    velocity = velocities(truth[:, rows], time_s)
    return Scores(
        errors={
            name: {part: compare(signal[:, at], true[:, at]) for part, at in parts.items()}
            for name, signal in found.items()
        },
        speed={p: float(np.sqrt((velocity[:, at] ** 2).sum(axis=-1).mean())) for p, at in parts.items()},
    )


def one_set(scores: Sequence[Scores]) -> dict[str, Any]:
    """Figures of many takes. "errors": {method: {PART: {DIRECTION: {"rmse", "r": Figure}}}}; "quarters": {PART: {the
    quarter of the takes by true speed: {method: {"rmse", "r": medians over takes, vertical and horizontal}}}}."""
    errors = over_takes([take.errors for take in scores])
    table: dict[str, Any] = {"takes": len(scores), "errors": errors, "quarters": {}}
    if not scores:
        return table
    ours = STATED if STATED in errors else ESTIMATED
    for part in PARTS:
        speed = np.array([take.speed[part] for take in scores])
        quarter = np.minimum(4 * speed.argsort().argsort() // len(speed), 3)
        table["quarters"][part] = {
            words: {
                name: dict(
                    zip(
                        ("rmse", "r"),
                        np.median(
                            [both for t, q in zip(scores, quarter, strict=True) if q == i
                             for both in t.errors[name][part].values()], axis=0,
                        ).tolist(),
                        strict=True,
                    )
                )
                for name in (NO_MOTION, *FIXED, ours)
            }
            for i, words in enumerate(_QUARTERS)
            if (quarter == i).any()
        }  # fmt: skip
    return table
