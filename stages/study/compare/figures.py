"""Figures of agreement between two series of one quantity."""

from __future__ import annotations

import numpy as np

from ....pipeline.core.measures import SD_90
from ....pipeline.signals.angles import near

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


def correlation(a: np.ndarray, b: np.ndarray, least: float) -> float:
    """Pearson's r of (T,) and (T,); NaN when the standard deviation of one is below `least`: of what hardly changes, r
    compares the errors."""
    if min(a.std(), b.std()) < least:
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])
