"""What several outputs need of a take: an angle's band, its up, a mean of what is known."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.measures import SD_90
from ...pipeline.core.pose import Rectified
from ...pipeline.core.take import Take
from ...pipeline.signals.angles import sides_of


def angle_bands(take: Take, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """(T, N) an angle by its name without a side, right before left, and how far its 90 % band reaches to each side of
    it, NaN where either is not known; None where the take has no value."""
    columns, nothing = take.kinematics or {}, np.full(len(take.need("poses")), np.nan)
    values, sds = (
        np.stack([columns.get(f"{part}_{ending}", nothing) for part in sides_of(name)], axis=1)
        for ending in ("deg", "sd_deg")
    )
    return (values, SD_90 * sds) if np.isfinite(values).any() else None


def shared_up(rectified: Rectified) -> np.ndarray:
    """(T, 3) the up that BODY and LEVEL share, in the source's axes."""
    return np.broadcast_to(rectified.R_source_from_level[..., :, 2], rectified.up_votes.shape)


def mean(values: np.ndarray) -> float:
    """Of those that are known of (T,); NaN where none is."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
