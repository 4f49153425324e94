"""Figures of agreement between two series of one angle, between several runs, and between joints."""

from __future__ import annotations

import numpy as np

from ....models.common.metrics import SD_90, person_size
from ....pipeline.core.layouts import H36M17
from ....pipeline.signals.angles import near

JointAgreement = dict[str, dict[str, float | int]]

FEWEST = 10  # frames
_MOVING_DEG = 0.5


def agreement(
    values: np.ndarray, reference: np.ndarray, sd: np.ndarray | None = None
) -> dict[str, float | int] | None:
    """Of an angle (T,) against a reference (T,), degrees; None when fewer than ten frames have both.

    bias_deg, sd_deg: mean and standard deviation of values less reference; frames of one take are no independent cases.
    rom_deg: 5th to 95th percentile. r: NaN for an angle that hardly changes. within_band: share of frames whose
    difference lies inside the 90 % band of the standard error sd (T,).
    """
    both = np.isfinite(values) & np.isfinite(reference)
    if both.sum() < FEWEST:
        return None
    off = near(values - reference, 0.0)[both]
    roms = [float(np.subtract(*np.percentile(part[both], [95, 5]))) for part in (values, reference)]
    result: dict[str, float | int] = {
        "frames": int(both.sum()),
        "bias_deg": float(off.mean()),
        "sd_deg": float(np.std(off, ddof=1)),
        "rmse_deg": float(np.sqrt((off**2).mean())),
        "r": correlation(values[both], reference[both], _MOVING_DEG),
        "rom_deg": roms[0],
        "rom_reference_deg": roms[1],
    }
    stated = np.full(1, np.nan) if sd is None else sd[both]
    if np.isfinite(stated).any():
        result["within_band"] = float((np.abs(off) <= SD_90 * stated)[np.isfinite(stated)].mean())
        result["stated_sd_deg"] = float(np.nanmedian(stated))
    return result


def view_spread(series: list[np.ndarray]) -> float | None:
    """Root mean square over frames of the standard deviation between takes of an angle (T,) each, in degrees; None
    when fewer than ten frames have all. 0 when every camera gives the same angle."""
    values = np.stack(series)
    all_known = np.isfinite(values).all(axis=0)
    if all_known.sum() < FEWEST:
        return None
    values = near(values[:, all_known] - values[0, all_known], 0.0)
    return float(np.sqrt(np.var(values, axis=0, ddof=1).mean()))


def correlation(a: np.ndarray, b: np.ndarray, least: float) -> float:
    """Pearson's r of (T,) and (T,); NaN when the standard deviation of one is below `least`: of what hardly changes, r
    compares the errors."""
    if min(a.std(), b.std()) < least:
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])


def joint_agreement(joints: np.ndarray, reference: np.ndarray, metric: bool) -> JointAgreement:
    """By joint the distance of joints (T, 17, 3) from others (T, 17, 3), both about the pelvis in one LEVEL, of one
    size: its median, root mean square and 95th percentile in per cent of the reference's size (the root mean square
    distance of its joints from the pelvis), and, of metres, the root mean square in mm. Joints that fewer than ten
    frames have are left out, and the pelvis.
    """
    size = person_size(reference)
    apart = np.linalg.norm(joints - reference, axis=-1)
    result: JointAgreement = {}
    for row, joint in enumerate(H36M17.joints):
        off = apart[np.isfinite(apart[:, row]), row]
        if joint == "pelvis" or len(off) < FEWEST:
            continue
        rms = float(np.sqrt((off**2).mean()))
        result[joint] = {
            "frames": len(off),
            "p50_percent": 100 * float(np.median(off)) / size,
            "rms_percent": 100 * rms / size,
            "p95_percent": 100 * float(np.quantile(off, 0.95)) / size,
            **({"rms_mm": 1000 * rms} if metric else {}),
        }
    return result
