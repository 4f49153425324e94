"""Joint angles where the truth is known:  pcnet3d evaluate angles -o DIR

Lifted takes of people nobody was trained on, one gravity a take, both sides through the same 6 Hz low-pass: errors of
every angle and whether the stated errors hold, over upright frames.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.signals.angles import ANGLES, FINE, REASONS, near, of_both
from ....pipeline.signals.filters import CUTOFF_HZ
from ...angle_error.rates import angle_rates
from ...angle_error.take_angles import AngleSeries, smoothed, take_angles
from ...common.metrics import SD_90, Figure
from ...common.spread import stated_spread
from ...gravity import Seen, level_static, why_not
from .people import mean
from .sets import Question
from .tables import Page, Table
from .testbed import LiftedTake

# What clinics film most, in rows of their own, and the angles that they ask about.
MOTIONS = ("walking", "squatting", "sitting")
MOTION_ANGLES = (
    "knee_flexion", "hip_flexion", "elbow_flexion", "trunk_lean_sagittal", "trunk_lean_frontal",
)  # fmt: skip
_FEWEST = 10  # frames of a take whose rates are judged
# What others report, with their own angle definitions, motions and references; not the same takes.
_PUBLISHED = """Published, with other definitions, motions and references:

| what | degrees | source |
| --- | --- | --- |
| MotionAGFormer, VIDIMU's 13 daily activities against IMU | RMSE 9.3, MAE 7.9 | arXiv 2510.02264 |
| MotionBERT, AthletePose3D, ISB angles | 25.2 | CVBW 2026, paper 12 (Wang, Baek, Kupperman) |
| OpenCap Monocular, walk, squat, sit-to-stand, against markers | MAE 4.8 | arXiv 2603.24733 |
| WHAM in the same study | MAE 9.3 | arXiv 2603.24733 |"""


PAGE = Page(
    "Angles",
    f"; one camera a take, standing still; one gravity a take; lift and motion capture low-passed at {CUTOFF_HZ:g} Hz. "
    "Degrees, over upright frames, both sides together. Surer half: frames with the smaller stated errors. |error|: "
    "p50 / mean / p95. Inside: share of errors within 1.645 stated standard deviations, which should be 90 %. Refused: "
    "frames without a value, by reason code (pipeline/signals/angles.py).",
    [
        Table("Takes", "sets/*/levelled/*", ["set", "rectifier"], {"takes levelled": "{value}"}),
        Table(
            "Angles",
            "sets/*/methods/*/*",
            ["set", "rectifier", "angle"],
            {
                "RMSE": "{rmse:.1f}", "RMSE, surer half": "{rmse_half:.1f}", "bias": "{bias:+.1f}",
                "\\|error\\|": "{error}", "inside": "{inside:.0%}", "stated sd, p50": "{sd:.1f}",
                "frames": "{frames:,}", "refused": "{refused:.1%}",
            },
        ),
        Table(
            "Rates, degrees a second",
            "sets/*/rates/*/*",
            ["set", "rectifier", "angle"],
            {
                "derivative": "{derived:.0f}", "smoothed": "{smoothed:.0f}", "better": "{better:.0%}",
                "inside": "{inside:.0%}",
            },
            "RMSE over a take's upright frames, p50 / mean / p95 over takes and sides: of the filtered angle's "
            "derivative, and smoothed by the angle's stated error. Better: takes in which the second is. Inside: as "
            "above, of the second.",
        ),
        Table(
            "By motion, upright frames: RMSE / MAE, degrees",
            "sets/*/motions/*/*",
            ["set", "rectifier", "motion"],
            {"frames": "{frames:,}", **{a: f"{{{a}[rmse]:.1f}} / {{{a}[mae]:.1f}}" for a in MOTION_ANGLES}},
            where=lambda row: bool(row["frames"]),
        ),
        _PUBLISHED,
    ],
)  # fmt: skip


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says: {"sets": {set: one_set's}}."""
    return {
        **question.heading(),
        "sets": {one.label: one_set(question.rectifiers, question.takes(one)) for one in question.sets},
    }


def one_set(rectifiers: Sequence[Rectifier], takes: Iterable[LiftedTake]) -> dict[str, Any]:
    """{"levelled": {method: takes}, "frames": upright ones, "methods": {method: {angle: row}}, "motions": {method:
    {motion: {"frames": upright ones, angle: {"rmse", "mae"}}}}, "rates": {method: {angle: rate_row's}}}; an angle of
    both sides is one row."""
    parts: dict[str, dict[str, list[tuple[np.ndarray, ...]]]] = {}
    moving: dict[str, dict[str, dict[str, list[np.ndarray]]]] = {}
    rates: dict[str, dict[str, list[tuple[float, float, float]]]] = {}
    counts: dict[str, int] = dict.fromkeys(MOTIONS, 0)
    frames, levelled = 0, {rectifier.method: 0 for rectifier in rectifiers}
    for take in takes:
        truth = true_angles(take)
        true_rates = angle_rates(truth, take.seen.keypoints.times)
        upright = ~take.seen.lying
        frames += int(upright.sum())
        motions = {motion: upright & take.seen.motion[motion] for motion in MOTIONS}
        for motion, use in motions.items():
            counts[motion] += int(use.sum())
        for rectifier in rectifiers:
            joints, time_s = take.lifted.joints, take.seen.keypoints.times
            level = level_static(
                Seen(joints, *rectifier.rotation(joints), time_s, spread=stated_spread(take.lifted))
            )
            fine = not why_not(level)
            levelled[rectifier.method] += fine
            found = take_angles(
                joints,
                smoothed(joints, time_s),
                level.R_camera_from_body,
                level_ok=fine,
                error_deg=level.error_deg,
                up_error_deg=level.up_error_deg,
                stated=stated_spread(take.lifted),
            )
            rows = parts.setdefault(rectifier.method, {})
            rated = rates.setdefault(rectifier.method, {})
            found_rates = {
                by_error: angle_rates(found, time_s, by_error=by_error) for by_error in (False, True)
            }
            for name in ANGLES:
                both = of_both(name)
                judged = rate_errors(
                    true_rates[name][0], found_rates[False][name][0], *found_rates[True][name], upright
                )
                if judged is not None:
                    rated.setdefault(both, []).append(judged)
                rows.setdefault(both, []).append(judge(found[name], truth[name], upright))
                if both in MOTION_ANGLES:
                    for motion, use in motions.items():
                        errors = moving.setdefault(rectifier.method, {}).setdefault(motion, {})
                        errors.setdefault(both, []).append(judge(found[name], truth[name], use)[0])
    return {
        "levelled": levelled,
        "frames": frames,
        "methods": {
            method: {
                name: row(*(np.concatenate(column) for column in zip(*pieces, strict=True)))
                for name, pieces in rows.items()
            }
            for method, rows in parts.items()
        },
        "motions": {
            method: {
                motion: {
                    "frames": counts[motion],
                    **{a: spread(np.concatenate(e)) for a, e in angles.items()},
                }
                for motion, angles in motions.items()
            }
            for method, motions in moving.items()
        },
        "rates": {
            method: {name: rate_row(takes) for name, takes in rows.items()} for method, rows in rates.items()
        },
    }


def rate_errors(
    truth: np.ndarray, derived: np.ndarray, smoothed: np.ndarray, sd: np.ndarray, use: np.ndarray
) -> tuple[float, float, float] | None:
    """RMSE of an angle's derivative and of its smoothed rate against the true rate (T,), degrees a second, and the
    share of the second within 1.645 of its stated standard deviations; None of fewer than _FEWEST frames in use."""
    use = use & np.isfinite(truth + derived + smoothed)
    if use.sum() < _FEWEST:
        return None
    error = (smoothed - truth)[use]
    derived_rmse = mean((derived - truth)[use] ** 2) ** 0.5
    return derived_rmse, mean(error**2) ** 0.5, mean(np.abs(error) <= SD_90 * sd[use])


def rate_row(takes: Sequence[tuple[float, float, float]]) -> dict[str, Any]:
    """rate_errors of many takes: Figures of both RMSE, the share of takes in which the smoothed rate is the better
    one, and the mean share inside."""
    derived, smooth, inside = np.array(takes).T
    return {
        "derived": Figure.of(derived),
        "smoothed": Figure.of(smooth),
        "better": mean(smooth < derived),
        "inside": mean(inside),
    }


def spread(error: np.ndarray) -> dict[str, float]:
    """Root mean square and mean absolute value of errors (T,) in degrees; missing ones are left out."""
    error = error[np.isfinite(error)]
    return {"rmse": mean(error**2) ** 0.5, "mae": mean(np.abs(error))}


def true_angles(take: LiftedTake) -> dict[str, AngleSeries]:
    """The angles of the motion capture, through the same filter."""
    seen = take.seen
    filtered = smoothed(seen.truth, seen.keypoints.times)
    return take_angles(seen.truth, filtered, seen.R_camera_from_body, lifted=False)


def judge(
    found: AngleSeries, truth: AngleSeries, use: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Errors in degrees, stated standard deviations and reasons of the frames (T,) in use whose truth is defined."""
    use = use & (truth.reason == FINE)
    return near(found.value_deg - truth.value_deg, 0.0)[use], found.sd_deg[use], found.reason[use]


def row(error: np.ndarray, sd: np.ndarray, reason: np.ndarray) -> dict[str, Any]:
    """Of errors and stated standard deviations (T,) in degrees: RMSE, bias, |error| of the frames with a value,
    and RMSE of the half with the smaller stated errors; the share inside 1.645 stated standard
    deviations, the median stated one; and the share of frames refused, by reason."""
    fine = np.isfinite(error)
    error, sd = error[fine], sd[fine]
    usual = float(np.median(sd)) if fine.any() else float("nan")
    return {
        "rmse": mean(error**2) ** 0.5,
        "rmse_half": mean(error[sd <= usual] ** 2) ** 0.5,
        "bias": mean(error),
        "error": Figure.of(np.abs(error)),
        "inside": mean(np.abs(error) <= SD_90 * sd),
        "sd": usual,
        "frames": len(reason),
        "refused": {
            code: float(np.mean(reason == code))
            for code in REASONS
            if code != FINE and (reason == code).any()
        },
    }
