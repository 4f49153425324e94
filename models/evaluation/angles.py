"""Joint angles where the truth is known:  pcnet3d evaluate --angles -o DIR

Lifted takes of people nobody was trained on, one gravity a take, both sides through the same 6 Hz low-pass: errors of
every angle and whether the stated errors hold, over upright frames.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.motion.angles import ANGLES, FINE, REASONS, near, of_both
from ...pipeline.motion.signals import CUTOFF_HZ
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.running.progress import each
from ..angle_error.rates import angle_rates
from ..angle_error.take_angles import AngleSeries, smoothed, take_angles
from ..common.metrics import SD_90, Figure
from ..common.spread import stated_spread
from ..gravity import Seen, level_static, why_not
from .sets import EvaluationSet, evaluation_sets, heading
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
    lines = [
        "# Angles",
        "",
        f"pcnet3d {results['pcnet3d']}, lifter {results['lifter']}, seed {results['seed']}, flip "
        f"{'on' if results['flip'] else 'off'}; one camera a take, standing still, {results['bed']} views; "
        f"one gravity a take; lift and motion capture low-passed at {CUTOFF_HZ:g} Hz. Degrees, over upright frames, "
        "both sides together. Surer half: frames with the smaller stated errors. |error|: p50 / mean / p95. Inside: "
        "share of errors within 1.645 stated standard deviations, which should be 90 %. Refused: frames without a "
        "value, by reason code "
        "(pipeline/motion/angles.py).",
    ]
    for label, values in results["sets"].items():
        for method, rows in values["methods"].items():
            lines += [
                "",
                f"## {label}, {method}, {values['levelled'][method]} takes levelled, {values['frames']:,} frames",
                "",
                "| angle | RMSE | RMSE, surer half | bias | \\|error\\| | inside, % | stated sd, p50 | refused, % |",
                "| --- | --- | --- | --- | --- | --- | --- | --- |",
            ]
            for name, figures in rows.items():
                refused = ", ".join(
                    f"{100 * share:.1f} ({code})" for code, share in figures["refused"].items()
                )
                cells = [
                    name, f"{figures['rmse']:.1f}", f"{figures['rmse_half']:.1f}", f"{figures['bias']:+.1f}",
                    str(figures["error"]), f"{100 * figures['inside']:.0f}", f"{figures['sd']:.1f}", refused,
                ]  # fmt: skip
                lines.append(f"| {' | '.join(cells)} |")
    lines += [
        "",
        "## Rates, degrees a second",
        "",
        "RMSE over a take's upright frames, p50 / mean / p95 over takes and sides: of the filtered angle's "
        "derivative, and smoothed by the angle's stated error. Better: takes in which the second is. Inside: as above, "
        "of the second.",
        "",
        "| set | rectifier | angle | derivative | smoothed | better, % | inside, % |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for label, values in results["sets"].items():
        for method, rows in values["rates"].items():
            for name, rates in rows.items():
                cells = [label, method, name, f"{rates['derived']:.0f}", f"{rates['smoothed']:.0f}"]
                cells += [f"{100 * rates[what]:.0f}" for what in ("better", "inside")]
                lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "## By motion, upright frames: RMSE / MAE, degrees", ""]
    lines += [f"| set | motion | frames | rectifier | {' | '.join(MOTION_ANGLES)} |"]
    lines += ["| --- |" + " --- |" * (3 + len(MOTION_ANGLES))]
    for label, values in results["sets"].items():
        for method, motions in values["motions"].items():
            for motion, figures in motions.items():
                if figures["frames"]:
                    cells = [label, motion, f"{figures['frames']:,}", method]
                    cells += [f"{figures[a]['rmse']:.1f} / {figures[a]['mae']:.1f}" for a in MOTION_ANGLES]
                    lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "Published, with other definitions, motions and references:", ""]
    lines += ["| what | degrees | source |", "| --- | --- | --- |"]
    lines += [f"| {' | '.join(row)} |" for row in PUBLISHED]
    return "\n".join(lines) + "\n"
