"""How wrong a gait figure may be: standard deviations that were fitted on lifted walks with truth.

The error of a mean over N steps or strides is made of a part that all of them share, one that each has for itself, and
what the pelvis path's own error adds where lengths are read from that. gait_error.json was learned by
models/evaluation/gait_errors.py on validation subjects, so that nine in ten errors lie within 1.645 standard
deviations.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from .events import Step

ERROR_FILE = Path(__file__).with_name("gait_error.json")
OF_LENGTH = ("walking_speed", "step_length", "stride_length", "step_width")


@cache
def shipped_errors() -> dict[str, dict[str, dict[str, float]]]:
    """What gait_error.json holds: {"walking", "running": {figure: {"shared", "each", "root"}}}."""
    content: dict[str, dict[str, dict[str, float]]] = json.loads(ERROR_FILE.read_text(encoding="utf-8"))[
        "figures"
    ]
    return content


def mean_error(gait: str, figure: str, count: int, root_sd: float = 0.0) -> float:
    """Standard deviation of the mean of `count` values of a figure (gait.time_values, gait.length_values), in its unit,
    lengths and speeds in lengths of a leg. gait: "walking" or "running". root_sd: of the pelvis path in lengths of a
    leg."""
    own = shipped_errors()[gait][figure]
    parts = (own["shared"], own["each"] / np.sqrt(count), own["root"] * root_sd / np.sqrt(count))
    return float(np.sqrt(np.sum(np.square(parts))))


def path_error(
    root: np.ndarray,
    covariance: np.ndarray,
    axis: np.ndarray,
    scale_sd: float,
    focal_sd: float,
    time_s: np.ndarray,
    walks: Sequence[Sequence[Step]],
) -> tuple[float, float]:
    """Of an estimated pelvis path (models/place/path.py): standard deviation of a place along the horizontal axis where
    it is worst, in the path's unit; and the share of lengths and speeds that may be wrong in all strides alike, by the
    body's size and, as far as the person walks along the camera's axis, by the focal length. 0, 0 without a place.

    root: (T, 3) from the camera in LEVEL, and covariance: (T, 3, 3) of its whole error. axis: (3,) the camera's, in
    LEVEL. scale_sd, focal_sd: standard deviations of the body's size and of the focal length as shares of them. time_s:
    (T,).
    """
    own = own_covariance(root, covariance, axis, scale_sd, focal_sd)[:, :2, :2]
    own = own[np.isfinite(own).all(axis=(1, 2))]
    if not len(own) or not walks:
        return 0.0, 0.0
    root_sd = float(np.sqrt(np.median(np.maximum(np.linalg.eigvalsh(own)[:, -1], 0.0))))
    inside = np.any([(time_s >= walk[0].start_s) & (time_s <= walk[-1].stop_s) for walk in walks], axis=0)
    velocity = np.gradient(root, time_s, axis=0)[inside]
    velocity = velocity[np.isfinite(velocity).all(axis=1)]
    along = ((velocity @ axis) ** 2).sum() / max((velocity**2).sum(), 1e-12)
    return root_sd, float(np.hypot(scale_sd, focal_sd * along))


def own_covariance(
    root: np.ndarray, covariance: np.ndarray, axis: np.ndarray, scale_sd: float, focal_sd: float
) -> np.ndarray:
    """(T, 3, 3) of the error that each frame of an estimated path has for itself: the whole one less what the body's
    size and the focal length make wrong in all alike. As those of `path_error`."""
    depth = (root @ axis)[:, None] * axis
    alike = sum(sd**2 * at[:, :, None] * at[:, None, :] for sd, at in ((scale_sd, root), (focal_sd, depth)))
    return covariance - alike
