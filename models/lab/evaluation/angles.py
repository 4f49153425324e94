"""Joint angles where the truth is known:  pcnet3d evaluate angles -o DIR

Lifted takes of people nobody was trained on, one gravity a take, both sides through the same 6 Hz low-pass: errors of
every angle and whether the stated errors hold, over upright frames.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.running.progress import each
from ....pipeline.signals.angles import ANGLES, FINE, REASONS, near, of_both
from ....pipeline.signals.filters import CUTOFF_HZ
from ...angle_error.rates import angle_rates
from ...angle_error.take_angles import AngleSeries, smoothed, take_angles
from ...common.metrics import SD_90, Figure
from ...common.spread import stated_spread
from ...gravity import Seen, level_static, why_not
from .sets import EvaluationSet, evaluation_sets, heading
from .tables import Table, page, settings
from .testbed import LiftedTake

# What clinics film most, in rows of their own, and the angles that they ask about.
MOTIONS = ("walking", "squatting", "sitting")
MOTION_ANGLES = (
    "knee_flexion", "hip_flexion", "elbow_flexion", "trunk_lean_sagittal", "trunk_lean_frontal",
)  # fmt: skip
_FEWEST = 10  # frames of a take whose rates are judged
# What others report, with their own angle definitions, motions and references; not the same takes.
PUBLISHED = (
    ("MotionAGFormer, VIDIMU's 13 daily activities against IMU", "RMSE 9.3, MAE 7.9", "arXiv 2510.02264"),
    ("MotionBERT, AthletePose3D, ISB angles", "25.2", "CVBW 2026, paper 12 (Wang, Baek, Kupperman)"),
    ("OpenCap Monocular, walk, squat, sit-to-stand, against markers", "MAE 4.8", "arXiv 2603.24733"),
    ("WHAM in the same study", "MAE 9.3", "arXiv 2603.24733"),
)


def angle_tables(
    rectifiers: Sequence[Rectifier],
    lifter: str | Path = "pcnet3d",
    seed: int = 0,
    flip: bool = False,
    sets: Sequence[EvaluationSet] | None = None,
) -> dict[str, Any]:
    """Everything the report says: {"sets": {set: one_set's}}."""
    sets = sets or evaluation_sets()
    results: dict[str, Any] = {**heading(lifter, seed, flip, sets), "sets": {}}
    for one in sets:
        takes = one.takes(seed, lifter, flip)
        results["sets"][one.label] = one_set(rectifiers, one.label, takes, len(one.clips()))
    return results


def one_set(
    rectifiers: Sequence[Rectifier], label: str, takes: Iterable[LiftedTake], total: int
) -> dict[str, Any]:
    """{"levelled": {method: takes}, "frames": upright ones, "methods": {method: {angle: row}}, "motions": {method:
    {motion: {"frames": upright ones, angle: {"rmse", "mae"}}}}, "rates": {method: {angle: rate_row's}}}; an angle of
    both sides is one row."""
    parts: dict[str, dict[str, list[tuple[np.ndarray, ...]]]] = {}
    moving: dict[str, dict[str, dict[str, list[np.ndarray]]]] = {}
    rates: dict[str, dict[str, list[tuple[float, float, float]]]] = {}
    counts: dict[str, int] = dict.fromkeys(MOTIONS, 0)
    frames, levelled = 0, {rectifier.method: 0 for rectifier in rectifiers}
    for take in each(takes, f"{label} takes", total):
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
    derived_rmse = _mean((derived - truth)[use] ** 2) ** 0.5
    return derived_rmse, _mean(error**2) ** 0.5, _mean(np.abs(error) <= SD_90 * sd[use])


def rate_row(takes: Sequence[tuple[float, float, float]]) -> dict[str, Any]:
    """rate_errors of many takes: Figures of both RMSE, the share of takes in which the smoothed rate is the better
    one, and the mean share inside."""
    derived, smooth, inside = np.array(takes).T
    return {
        "derived": Figure.of(derived),
        "smoothed": Figure.of(smooth),
        "better": _mean(smooth < derived),
        "inside": _mean(inside),
    }


def spread(error: np.ndarray) -> dict[str, float]:
    """Root mean square and mean absolute value of errors (T,) in degrees; missing ones are left out."""
    error = error[np.isfinite(error)]
    return {"rmse": _mean(error**2) ** 0.5, "mae": _mean(np.abs(error))}


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
        "rmse": _mean(error**2) ** 0.5,
        "rmse_half": _mean(error[sd <= usual] ** 2) ** 0.5,
        "bias": _mean(error),
        "error": Figure.of(np.abs(error)),
        "inside": _mean(np.abs(error) <= SD_90 * sd),
        "sd": usual,
        "frames": len(reason),
        "refused": {
            code: float(np.mean(reason == code))
            for code in REASONS
            if code != FINE and (reason == code).any()
        },
    }


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else float("nan")


def as_markdown(results: dict[str, Any]) -> str:
    """The report as a page of tables."""
    head = [
        "angle",
        "RMSE",
        "RMSE, surer half",
        "bias",
        "\\|error\\|",
        "inside, %",
        "stated sd, p50",
        "refused, %",
    ]
    tables: list[Table | str] = [
        Table(
            f"{label}, {method}, {values['levelled'][method]} takes levelled, {values['frames']:,} frames",
            head,
            [
                f"{name} | {row['rmse']:.1f} | {row['rmse_half']:.1f} | {row['bias']:+.1f} | {row['error']} | "
                f"{100 * row['inside']:.0f} | {row['sd']:.1f} | "
                + ", ".join(f"{100 * share:.1f} ({code})" for code, share in row["refused"].items())
                for name, row in rows.items()
            ],
        )
        for label, values in results["sets"].items()
        for method, rows in values["methods"].items()
    ]
    rates = [
        f"{label} | {method} | {name} | {row['derived']:.0f} | {row['smoothed']:.0f} | {100 * row['better']:.0f} | "
        f"{100 * row['inside']:.0f}"
        for label, values in results["sets"].items()
        for method, rows in values["rates"].items()
        for name, row in rows.items()
    ]
    motions = [
        [label, motion, f"{row['frames']:,}", method]
        + [f"{row[a]['rmse']:.1f} / {row[a]['mae']:.1f}" for a in MOTION_ANGLES]
        for label, values in results["sets"].items()
        for method, by_motion in values["motions"].items()
        for motion, row in by_motion.items()
        if row["frames"]
    ]
    tables += [
        Table(
            "Rates, degrees a second",
            ["set", "rectifier", "angle", "derivative", "smoothed", "better, %", "inside, %"],
            rates,
            "RMSE over a take's upright frames, p50 / mean / p95 over takes and sides: of the filtered angle's "
            "derivative, and smoothed by the angle's stated error. Better: takes in which the second is. Inside: as "
            "above, of the second.",
        ),
        Table(
            "By motion, upright frames: RMSE / MAE, degrees",
            ["set", "motion", "frames", "rectifier", *MOTION_ANGLES],
            motions,
        ),
        Table(
            "",
            ["what", "degrees", "source"],
            PUBLISHED,
            "Published, with other definitions, motions and references:",
        ),
    ]
    return page(
        "Angles",
        f"{settings(results)}; one camera a take, standing still; one gravity a take; lift and motion capture low-"
        f"passed at {CUTOFF_HZ:g} Hz. Degrees, over upright frames, both sides together. Surer half: frames with the "
        "smaller stated errors. |error|: p50 / mean / p95. Inside: share of errors within 1.645 stated standard "
        "deviations, which should be 90 %. Refused: frames without a value, by reason code "
        "(pipeline/signals/angles.py).",
        tables,
    )
