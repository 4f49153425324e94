"""From a rectifier's frames to a take: one `up` for a camera that stands still, a smooth one for a camera that moves.

Given up, each frame keeps only its heading, smoothed in time; LEVEL is one upright frame for the take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from ...pipeline.camera import Look
from ...pipeline.canonical import LYING_DEG, trunk_lean_deg
from ...pipeline.rotations import angle_deg, from_columns, known, unit
from .floor import floor_plane
from .fusion import fused_up
from .moving import with_looks
from .votes import LEAN_DEG, RAYLEIGH_90, TILT_SHARE, UNKNOWN_DEG, Evidence, TakeUp, level_feet, take_up

Camera = Literal["static", "moving"]

HEADING_S = (
    0.07  # standard deviation of the Gaussian that smooths headings on the circle (val: longer lags on turns)
)
WINDOW_S = 2.0  # of a moving camera: standard deviation of the Gaussian in which frames vote on up
HEADING_SHARE = 0.57  # of a frame's expected rotation error, what is heading (lifted takes of val subjects)
# Mean over root mean square of a direction's error in two dimensions.
_MEAN_OF_RMS = float(np.sqrt(np.pi) / 2)
_TURNING = 0.5  # mean resultant of the headings below which a take has no middle heading (design.md)
_OUTLIER_DEG = 10.0  # of a moving camera: votes this far from their neighbours' mean count half
_DRIFT_DEG = 12.0  # two parts of a take whose ups differ by more than this, and by three of their errors,
_DRIFT_ERRORS = 3.0  # were not seen by a camera that stood still
_FEWEST_FRAMES = 10
_FROM_PICTURE_DEG = 60.0  # a take's up further from the picture's up than this is not believed
_SCATTER_DEG = 35.0  # median deviation of the frames' up from the take's up beyond which no up is stated
_WIDEST_BOUND_DEG = 30.0  # 90 % bound of up beyond which no take is called level


@dataclass(frozen=True)
class Levelled:
    """A take's rotations, in the camera's axes.

    R_camera_from_body: (T, 3, 3), NaN where a frame has no heading. R_camera_from_level: (3, 3), or (T, 3, 3) for a
    moving camera. error_deg: (T,) expected rotation error of BODY. up_error_deg, up_bound_deg: (T,) root mean square
    and 90 % bound of up's error. votes: (T, 3) the frames' own ups. shares, pulls, own: of gravity.TakeUp. heading: how
    LEVEL's was chosen, "median", "first second" or "camera". warnings: about sources of up that contradict each other,
    in words. drift_deg: how far the ups of two parts of the take are apart,
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
    pulls: dict[str, float] = field(default_factory=dict)
    own: dict[str, tuple[np.ndarray, float]] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


def level_static(
    joints: np.ndarray,
    R_camera_from_body: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    seams: Sequence[int] = (),
    others: Sequence[Evidence] = (),
    root: np.ndarray | None = None,
    shared: TakeUp | None = None,
    look: Look | None = None,
) -> Levelled:
    """One gravity for the whole take.

    joints: (T, 17, 3), CAMERA axes relative to the pelvis, any unit. R_camera_from_body (T, 3, 3) and error_deg (T,):
    a rectifier's answer. others: what the user tells; look: what the image says; the feet are added here, on the
    floor that they stood on where the pelvis's own path root (T, 3), in the same axes and unit, is known, else
    against each other. seams: rows no smoothing crosses. shared: the up of all people before the camera
    (models/gravity/people.py); then LEVEL's heading is the camera's."""
    votes = R_camera_from_body[:, :, 2]
    up, warnings = (
        (shared, ())
        if shared
        else static_up(joints, R_camera_from_body, error_deg, time_s, others, root, look)
    )
    everywhere = np.broadcast_to(up.up, votes.shape)
    R = upright(R_camera_from_body, everywhere, error_deg, time_s, seams)
    R_camera_from_level, heading = level_frame(R, up.up, time_s)
    if shared:
        R_camera_from_level, heading = camera_frame(up.up), "camera"
    drift_deg, drift_at = drift(votes, error_deg, time_s)
    return Levelled(
        R_camera_from_body=R,
        R_camera_from_level=R_camera_from_level,
        error_deg=rotation_error_deg(R, R_camera_from_body, error_deg, up.error_deg),
        up_error_deg=np.full(len(votes), up.error_deg),
        up_bound_deg=np.full(len(votes), up.bound_deg),
        votes=votes,
        shares=up.shares,
        heading=heading,
        drift_deg=drift_deg,
        drift_at=drift_at,
        pulls=up.pulls,
        own=up.own,
        warnings=warnings,
    )


def static_up(
    joints: np.ndarray,
    R_camera_from_body: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    others: Sequence[Evidence] = (),
    root: np.ndarray | None = None,
    look: Look | None = None,
) -> tuple[TakeUp, tuple[str, ...]]:
    """What the frames, the feet, the image and the user say about a static camera's up, and warnings where they
    contradict each other. Arguments of level_static: joints (T, 17, 3), R_camera_from_body (T, 3, 3)."""
    votes = R_camera_from_body[:, :, 2]
    first, warnings = fused_up(votes, error_deg, time_s, (), look, others)
    feet = None
    if known(first.up):
        feet = floor_plane(joints + root[:, None], first.up, time_s) if root is not None else None
        feet = feet or level_feet(joints, first.up, time_s)
    return fused_up(votes, error_deg, time_s, [feet], look, others) if feet else (first, warnings)


def level_moving(
    R_camera_from_body: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    seams: Sequence[int] = (),
    window_s: float = WINDOW_S,
    looks: Sequence[tuple[float, Look]] = (),
) -> Levelled:
    """A smooth gravity for a camera that pans or is carried: every frame hears its neighbours, Gaussian in time.

    LEVEL's heading is the camera's: -X against its viewing direction, made horizontal. How the camera turned about
    the vertical cannot be seen from the body alone. Arguments of level_static: R_camera_from_body (T, 3, 3), error_deg
    (T,). window_s: that Gaussian's reach. looks: what images say, each with its time in seconds.
    """
    votes = R_camera_from_body[:, :, 2]
    up, up_error_deg = sliding_up(votes, error_deg, time_s, seams, window_s)
    shares, warnings = {"frames": 1.0}, ()
    if looks:
        up, up_error_deg, shares, warnings = with_looks(up, up_error_deg, time_s, seams, looks)
    R = upright(R_camera_from_body, up, error_deg, time_s, seams)
    return Levelled(
        R_camera_from_body=R,
        R_camera_from_level=camera_frame(up),
        error_deg=rotation_error_deg(R, R_camera_from_body, error_deg, up_error_deg),
        up_error_deg=up_error_deg,
        up_bound_deg=RAYLEIGH_90 * up_error_deg,
        votes=votes,
        shares=shares,
        heading="camera",
        drift_deg=float("nan"),
        drift_at=None,
        warnings=warnings,
    )


def camera_frame(up: np.ndarray) -> np.ndarray:
    """R_camera_from_level (..., 3, 3) of the given up (..., 3) whose -X is the camera's horizontal viewing direction
    reversed, so that a person who faces the camera faces -X as in BODY (design.md section 4)."""
    view = np.broadcast_to(np.array([0.0, 0.0, 1.0]), up.shape)
    picture_up = np.array([0.0, -1.0, 0.0])
    # A camera that looks straight down has no horizontal direction of view; then the picture's top is ahead.
    steep = np.abs((up * view).sum(-1, keepdims=True)) > 0.98
    ahead = np.where(steep, picture_up, view)
    back = unit(ahead - (ahead * up).sum(-1, keepdims=True) * up)
    return from_columns(back, np.cross(up, back), up)


def why_not(levelled: Levelled, joints: np.ndarray) -> str:
    """In words why a take of joints (T, 17, 3), in the camera's axes, could not be levelled, or "". Where up is known
    from elsewhere, only the heading can fail."""
    fine = known(levelled.R_camera_from_body).all(axis=1)
    if not fine.any():
        return "no frame has the torso joints that a rotation needs"
    if fine.sum() < _FEWEST_FRAMES:
        return f"only {fine.sum()} {'frame has' if fine.sum() == 1 else 'frames have'} a rotation"
    if sum(levelled.shares.get(source, 0.0) for source in ("frames", "feet", "floor")) < 0.5:
        return ""
    voted = fine & known(levelled.votes)
    ups = levelled.R_camera_from_body[:, :, 2]
    leans = float(angle_deg(unit(ups[fine].mean(axis=0)), np.array([0.0, -1.0, 0.0])))
    if leans > _FROM_PICTURE_DEG:
        return f"its up is {leans:.0f} degrees from the picture's: the person lies or hangs, or the camera is turned"
    scatter = float(np.median(angle_deg(levelled.votes[voted], ups[voted])))
    if not scatter < _SCATTER_DEG:
        return f"the frames' up directions scatter by {scatter:.0f} degrees about their mean"
    lean = trunk_lean_deg(joints[fine], ups[fine])
    if np.mean(lean > LYING_DEG) >= 0.5:
        return (
            f"the trunk is {np.nanmedian(lean):.0f} degrees from its up: the person lies, or bends far down"
        )
    bound = float(np.nanmax(levelled.up_bound_deg))
    if bound > _WIDEST_BOUND_DEG:
        return f"its up is only known to within {bound:.0f} degrees"
    return ""


def upright(
    R_camera_from_body: np.ndarray,
    up: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    seams: Sequence[int] = (),
) -> np.ndarray:
    """(T, 3, 3) rotations with the given up (T, 3) and the frames' own headings, smoothed on the circle by a Gaussian
    of HEADING_S, weighted by 1 / error^2, never across a seam. NaN stays NaN."""
    left = level_left(R_camera_from_body, up)
    fine = known(left) & known(up)
    weights = np.where(fine, trust(error_deg), 0.0)
    smooth = smoothed(np.where(fine[:, None], left, 0.0), weights, time_s, HEADING_S, seams)
    R = standing(smooth, up)
    return np.where((fine & known(R[:, :, 1]))[:, None, None], R, np.nan)


def level_left(R_camera_from_body: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(..., 3) where the left of bodies (..., 3, 3) points, made horizontal for up (..., 3), unit."""
    left = -R_camera_from_body[..., :, 1]
    return unit(left - (left * up).sum(-1, keepdims=True) * up)


def standing(left: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(..., 3, 3) R_camera_from_body with the given up (..., 3) and a left as near to left (..., 3) as it allows."""
    left = unit(left - (left * up).sum(-1, keepdims=True) * up)
    return from_columns(-np.cross(left, up), -left, up)


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
    trusted = np.where(fine, trust(error_deg), 0.0)
    up, _, _ = _local_line(votes_, trusted, time_s, seams, window_s)
    apart = np.where(fine, np.nan_to_num(angle_deg(votes_, up)), 0.0)
    weights = trusted / (1 + (apart / _OUTLIER_DEG) ** 2)
    up, looks, lag_deg = _local_line(votes_, weights, time_s, seams, window_s)
    expected = np.where(np.isfinite(error_deg), error_deg, UNKNOWN_DEG)
    square = np.stack([np.where(fine, expected**2, 0.0), apart**2], axis=-1)
    mean, scatter = np.moveaxis(smoothed(square, trusted, time_s, window_s, seams), -1, 0)
    shared = np.maximum(TILT_SHARE**2 * mean - scatter, LEAN_DEG**2)
    return up, np.sqrt(shared + scatter / looks + lag_deg**2)


def _local_line(
    votes: np.ndarray, weights: np.ndarray, time_s: np.ndarray, seams: Sequence[int], window_s: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(T, 3) unit, at each frame the straight line in time through the votes (T, 3) around it, so that a camera that
    turns evenly is followed without lag up to the take's ends; (T,) how many independent votes that is worth; and (T,)
    how far in degrees it may lag after all.

    A line through few votes that scatter swings at its ends, so its slope counts as far as it exceeds its own error
    (shrunk by Wiener's factor, signal over signal and noise); what is left out of it is the lag. The normalised line
    follows an arc to the second order of its angle.
    """
    times = time_s[:, None]
    square = (votes**2).sum(-1, keepdims=True)
    columns = np.concatenate([votes, times * votes, times, times**2, square], axis=-1)
    means = smoothed(columns, weights, time_s, window_s, seams)
    vote, vote_time, middle, time_square, square = np.split(means, (3, 6, 7, 8), axis=-1)
    spread = np.maximum(time_square - middle**2, 1e-6)  # of the window's frames in time, square seconds
    slope = (vote_time - middle * vote) / spread
    steep = (slope**2).sum(-1, keepdims=True)
    scatter = np.maximum(square - (vote**2).sum(-1, keepdims=True) - steep * spread, 0)  # about the line
    independent = 1 + np.sqrt(spread)  # votes within the window
    error = scatter / independent / spread  # of the slope, squared
    share = steep / np.maximum(steep + error, 1e-12)
    off = times - middle
    looks = independent / (1 + share**2 * off**2 / spread)
    lag_deg = np.degrees((1 - share) * np.sqrt(steep) * np.abs(off))
    return unit(vote + share * slope * off), looks[:, 0], lag_deg[:, 0]


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
    """How far apart the ups of two parts of a take are, and the row where the second begins; NaN and None when their
    own errors, or a change of posture, explain it. The parts are those whose means differ most for their lengths.
    votes (T, 3), unit vectors."""
    rows = np.flatnonzero(known(votes))
    count = len(rows)
    if count < 2 * _FEWEST_FRAMES:
        return float("nan"), None
    before = np.arange(1, count)[:, None]
    sums = np.cumsum(votes[rows], axis=0)
    means = sums[:-1] / before, (sums[-1] - sums[:-1]) / (count - before)
    between = np.linalg.norm(means[0] - means[1], axis=-1) * np.sqrt(before * (count - before))[:, 0]
    middle = _FEWEST_FRAMES + int(np.argmax(between[_FEWEST_FRAMES - 1 : count - _FEWEST_FRAMES]))
    parts = rows[:middle], rows[middle:]
    ups = [take_up(votes[part], error_deg[part], time_s[part]) for part in parts]
    apart = float(angle_deg(ups[0].up, ups[1].up))
    # The lean of a lifter is shared by both parts; what may differ is the scatter's share.
    own = np.sqrt(sum(up.votes.scatter_deg**2 / up.votes.effective for up in ups))
    return (apart, int(parts[1][0])) if apart > max(_DRIFT_DEG, _DRIFT_ERRORS * own) else (float("nan"), None)


def trust(error_deg: np.ndarray | float) -> np.ndarray:
    """(...,) a frame's weight, 1 / error^2."""
    return 1 / np.maximum(np.where(np.isfinite(error_deg), error_deg, UNKNOWN_DEG), 0.5) ** 2


def rotation_error_deg(
    R: np.ndarray, R_frame: np.ndarray, error_deg: np.ndarray, up_error_deg: np.ndarray | float
) -> np.ndarray:
    """(...,) expected error of R (..., 3, 3): that of up, and the heading's part of error_deg (...,), the frame's own.

    Where the heading is further than that from the one of R_frame (..., 3, 3), the rectifier's, that counts: the poses
    of two people in one take, or a turn quicker than the smoothing.
    """
    off = angle_deg(level_left(R_frame, R[..., :, 2]), -R[..., :, 1])
    return np.hypot(_MEAN_OF_RMS * up_error_deg, np.maximum(HEADING_SHARE * error_deg, off))
