"""From a rectifier's frames to a take: one `up` for a camera that stands still, a smooth one for a camera that moves.

Given up, each frame keeps only its heading, smoothed in time; LEVEL is one upright frame for the take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from ..pipeline.rotations import angle_deg, from_columns, known, unit
from .gravity import RAYLEIGH_90, TILT_SHARE, Evidence, level_feet, take_up

Camera = Literal["static", "moving"]

HEADING_S = 0.13  # standard deviation of the Gaussian that smooths headings on the circle
WINDOW_S = 2.0  # of a moving camera: standard deviation of the Gaussian in which frames vote on up
_HEADING_SHARE = 0.57  # of a frame's expected rotation error, what is heading (lifted takes of val subjects)
_MEAN_OF_RMS = float(
    np.sqrt(np.pi) / 2
)  # mean over root mean square of a direction's error in two dimensions
_TURNING = 0.5  # mean resultant of the headings below which a take has no middle heading (design.md)
_OUTLIER_DEG = 10.0  # of a moving camera: votes this far from their neighbours' mean count half
_DRIFT_DEG = 12.0  # two parts of a take whose ups differ by more than this, and by three of their errors,
_DRIFT_ERRORS = 3.0  # were not seen by a camera that stood still


@dataclass(frozen=True)
class Levelled:
    """A take's rotations, in the camera's axes.

    R_camera_from_body: (T, 3, 3), NaN where a frame has no heading. R_camera_from_level: (3, 3), or (T, 3, 3) for a
    moving camera. error_deg: (T,) expected rotation error of BODY. up_error_deg, up_bound_deg: (T,) root mean square
    and 90 % bound of up's error. votes: (T, 3) the frames' own ups. shares: of gravity.TakeUp. heading: how LEVEL's
    was chosen, "median", "first second" or "camera". drift_deg: how far the ups of two parts of the take are apart,
    and drift_at the row where they part, if that is more than their errors explain; else NaN and None.
    """

    R_camera_from_body: np.ndarray
    R_camera_from_level: np.ndarray
    error_deg: np.ndarray
    up_error_deg: np.ndarray
    up_bound_deg: np.ndarray
    votes: np.ndarray
    shares: dict[str, float]
    heading: str
    drift_deg: float
    drift_at: int | None


def level_static(
    joints: np.ndarray,
    R_camera_from_body: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    seams: Sequence[int] = (),
    others: Sequence[Evidence] = (),
) -> Levelled:
    """One gravity for the whole take.

    joints: (T, 17, 3), CAMERA axes relative to the pelvis, any unit. R_camera_from_body (T, 3, 3) and error_deg (T,):
    a rectifier's answer. others: what else knows up; the feet are added here. seams: rows no smoothing crosses.
    """
    votes = R_camera_from_body[:, :, 2]
    first = take_up(votes, error_deg, time_s, others)
    feet = level_feet(joints, first.up, time_s) if known(first.up) else None
    up = take_up(votes, error_deg, time_s, [*others, feet]) if feet else first
    everywhere = np.broadcast_to(up.up, votes.shape)
    R = upright(R_camera_from_body, everywhere, error_deg, time_s, seams)
    R_camera_from_level, heading = level_frame(R, up.up, time_s)
    drift_deg, drift_at = drift(votes, error_deg, time_s)
    return Levelled(
        R_camera_from_body=R,
        R_camera_from_level=R_camera_from_level,
        error_deg=_expected(R, error_deg, np.full(len(votes), up.error_deg)),
        up_error_deg=np.full(len(votes), up.error_deg),
        up_bound_deg=np.full(len(votes), up.bound_deg),
        votes=votes,
        shares=up.shares,
        heading=heading,
        drift_deg=drift_deg,
        drift_at=drift_at,
    )


def level_moving(
    R_camera_from_body: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    seams: Sequence[int] = (),
    window_s: float = WINDOW_S,
) -> Levelled:
    """A smooth gravity for a camera that pans or is carried: every frame hears its neighbours, Gaussian in time.

    LEVEL's heading is the camera's: -X against its viewing direction, made horizontal. How the camera turned about
    the vertical cannot be seen from the body alone.
    """
    votes = R_camera_from_body[:, :, 2]
    up, up_error_deg = sliding_up(votes, error_deg, time_s, seams, window_s)
    R = upright(R_camera_from_body, up, error_deg, time_s, seams)
    view = np.broadcast_to(np.array([0.0, 0.0, 1.0]), up.shape)
    picture_up = np.array([0.0, -1.0, 0.0])
    # A camera that looks straight down has no horizontal direction of view; then the picture's top is ahead.
    steep = np.abs((up * view).sum(-1, keepdims=True)) > 0.98
    ahead = np.where(steep, picture_up, view)
    back = unit(ahead - (ahead * up).sum(-1, keepdims=True) * up)
    return Levelled(
        R_camera_from_body=R,
        R_camera_from_level=from_columns(back, np.cross(up, back), up),
        error_deg=_expected(R, error_deg, up_error_deg),
        up_error_deg=up_error_deg,
        up_bound_deg=RAYLEIGH_90 * up_error_deg,
        votes=votes,
        shares={"frames": 1.0},
        heading="camera",
        drift_deg=float("nan"),
        drift_at=None,
    )


def upright(
    R_camera_from_body: np.ndarray,
    up: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    seams: Sequence[int] = (),
) -> np.ndarray:
    """(T, 3, 3) rotations with the given up (T, 3) and the frames' own headings, smoothed on the circle by a Gaussian
    of HEADING_S, weighted by 1 / error^2, never across a seam. NaN stays NaN."""
    left = -R_camera_from_body[:, :, 1]
    left = unit(left - (left * up).sum(-1, keepdims=True) * up)
    fine = known(left) & known(up)
    weights = np.where(fine, _trust(error_deg), 0.0)
    smooth = smoothed(np.where(fine[:, None], left, 0.0), weights, time_s, HEADING_S, seams)
    left = unit(smooth - (smooth * up).sum(-1, keepdims=True) * up)
    R = from_columns(-np.cross(left, up), -left, up)
    return np.where((fine & known(left))[:, None, None], R, np.nan)


def level_frame(R_camera_from_body: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, str]:
    """R_camera_from_level (3, 3): up (3,), and the circular median of the frames' headings, or of the first second's
    for a person who turns around (design.md section 4); and which. NaN without a heading."""
    fine = known(R_camera_from_body).all(axis=1)
    if not fine.any() or not known(up):
        return np.full((3, 3), np.nan), "none"
    side = unit(np.cross(up, np.eye(3)[np.argmin(np.abs(up))]))
    facing = -R_camera_from_body[fine, :, 0]
    heading = facing @ side + 1j * (facing @ np.cross(up, side))
    heading = heading / np.maximum(np.abs(heading), 1e-12)
    how = "median"
    if np.abs(heading.mean()) < _TURNING:
        how = "first second"
        heading = heading[time_s[fine] - time_s[fine][0] <= 1.0]
    centre = np.angle(heading.mean())
    angle = centre + np.median(np.angle(heading * np.exp(-1j * centre)))
    back = -(np.cos(angle) * side + np.sin(angle) * np.cross(up, side))
    return from_columns(back, np.cross(up, back), up), how


def sliding_up(
    votes: np.ndarray, error_deg: np.ndarray, time_s: np.ndarray, seams: Sequence[int], window_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3) up and (T,) its root mean square error in degrees, from each frame's neighbours in time; two passes, the
    second with less weight for votes that are far from the first's answer."""
    fine = known(votes)
    votes_ = np.where(fine[:, None], votes, 0.0)
    weights = np.where(fine, _trust(error_deg), 0.0)
    up = unit(smoothed(votes_, weights, time_s, window_s, seams))
    apart = np.where(fine, np.nan_to_num(angle_deg(votes_, up)), 0.0)
    weights = weights / (1 + (apart / _OUTLIER_DEG) ** 2)
    up = unit(smoothed(votes_, weights, time_s, window_s, seams))
    expected = np.where(np.isfinite(error_deg), error_deg, 12.0)
    square = np.stack([np.where(fine, expected**2, 0.0), apart**2], axis=-1)
    mean, scatter = np.moveaxis(smoothed(square, weights, time_s, window_s, seams), -1, 0)
    shared = np.maximum(TILT_SHARE**2 * mean - scatter, 3.8**2)
    return up, np.sqrt(shared + scatter / (1 + window_s))


def smoothed(
    values: np.ndarray, weights: np.ndarray, time_s: np.ndarray, std_s: float, seams: Sequence[int] = ()
) -> np.ndarray:
    """(T, D) mean of values (T, D) with weights (T,) times a Gaussian in time, within each part between seams; NaN
    where no weight is near."""
    out = np.full(values.shape, np.nan)
    edges = [0, *seams, len(values)]
    for start, end in pairwise(edges):
        part = slice(start, end)
        out[part] = _smoothed(values[part], weights[part], time_s[part], std_s)
    return out


def _smoothed(values: np.ndarray, weights: np.ndarray, time_s: np.ndarray, std_s: float) -> np.ndarray:
    total = weights[:, None] * values
    mass = weights.copy()
    for shift in range(1, len(values)):
        near = np.exp(-(((time_s[shift:] - time_s[:-shift]) / std_s) ** 2) / 2)
        if near.max() < 1e-3:
            break
        for here, there in (
            (slice(shift, None), slice(None, -shift)),
            (slice(None, -shift), slice(shift, None)),
        ):
            mass[here] += near * weights[there]
            total[here] += (near * weights[there])[:, None] * values[there]
    return total / np.where(mass > 1e-9, mass, np.nan)[:, None]


def drift(votes: np.ndarray, error_deg: np.ndarray, time_s: np.ndarray) -> tuple[float, int | None]:
    """How far apart the ups of two parts of a take are, and at which row they part, tried at every tenth; NaN and
    None when their own errors, or a change of posture, explain it."""
    rows = np.flatnonzero(known(votes))
    worst, at = 0.0, None
    for tenth in range(1, 10):
        middle = len(rows) * tenth // 10
        parts = rows[:middle], rows[middle:]
        if min(map(len, parts)) < 10:
            continue
        ups = [take_up(votes[part], error_deg[part], time_s[part]) for part in parts]
        apart = float(angle_deg(ups[0].up, ups[1].up))
        # The lean of a lifter is shared by both parts; what may differ is the scatter's share.
        own = np.sqrt(sum(up.votes.scatter_deg**2 / up.votes.effective for up in ups))
        if apart > max(_DRIFT_DEG, _DRIFT_ERRORS * own, worst):
            worst, at = apart, int(parts[1][0])
    return (worst, at) if at is not None else (float("nan"), None)


def _trust(error_deg: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(error_deg), 1 / np.maximum(error_deg, 0.5) ** 2, 1 / 12.0**2)


def _expected(R: np.ndarray, error_deg: np.ndarray, up_error_deg: np.ndarray) -> np.ndarray:
    """(T,) expected rotation error: that of up, and the heading's part of the frame's own."""
    error = np.hypot(_MEAN_OF_RMS * up_error_deg, _HEADING_SHARE * error_deg)
    return np.where(known(R).all(axis=1), error, np.nan)
