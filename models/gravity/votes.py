"""One gravity per take: which way is up, voted by every frame and by whatever else knows, and how wrong that may be.

A camera that stands still has one `up`. Per-frame predictions are votes: their scatter averages out, what they share
(the lifter's lean, the posture) does not. Both enter the stated error. Everything works in one camera's axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...pipeline.anthropometry import implied_stature
from ...pipeline.layouts import H36M17
from ...pipeline.rotations import angle_deg, known, unit
from ..common.metrics import RAYLEIGH_90

# Root mean square tilt over the rotation error that is expected in a frame; and what a lifter leans with all its frames
# at least. Both fitted on lifted takes of train and validation subjects, cut to 0.5 s and longer (docs/takes.md).
TILT_SHARE = 0.85
LEAN_DEG = 3.8
UNKNOWN_DEG = 12.0  # expected error of a frame whose rectifier does not say

_OUTLIER_DEG = 5.0  # votes this far off count half
_TURNS = 30  # of the reweighting, at most; it ends when the mean moves by less than
_STILL = 1e-6
_CORRELATED_S = 0.3  # votes nearer in time than this are never independent
_FEET_DEG = 12.0  # scatter of the line between lifted ankles about the level, one independent stance,
_FEET_LEAN_DEG = 7.0  # and what all stances of a take share: the lifter's error in depth, uneven ground
_STANCE_SPEED = 0.12  # statures per second that the ankles may move against each other in double support
_STANCE_APART = 0.12  # statures that they must be apart, and
_STANCE_LEVEL = 0.10  # that one may be higher than the other


@dataclass(frozen=True)
class Evidence:
    """One source's word on up: information matrix (3, 3) and vector (3,) of a Gaussian about it, per square radian."""

    name: str
    information: np.ndarray
    vector: np.ndarray


@dataclass(frozen=True)
class Votes:
    """A robust mean of directions. up: (3,), unit, NaN without votes. error_deg: expected root mean square angle to
    the truth. weights: (T,) 0 to 1. effective: independent votes. scatter_deg: root mean square about the mean."""

    up: np.ndarray
    error_deg: float
    weights: np.ndarray
    effective: float
    scatter_deg: float


@dataclass(frozen=True)
class TakeUp:
    """up: (3,), unit, NaN when there is no evidence. error_deg: expected root mean square angle to the truth;
    bound_deg: the angle that nine in ten takes should stay under. shares: each source's part of the information,
    by name. pulls: by how many degrees each source moves up against what the others say together. own: the up that each
    source would have by itself, and its error in degrees, of those that know one. votes: the frames' own."""

    up: np.ndarray
    error_deg: float
    bound_deg: float
    shares: dict[str, float]
    votes: Votes
    pulls: dict[str, float] = field(default_factory=dict)
    own: dict[str, tuple[np.ndarray, float]] = field(default_factory=dict)


def take_up(
    up: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    others: Sequence[Evidence] = (),
) -> TakeUp:
    """Fuse the frames' votes with other evidence. up: (T, 3), NaN where a frame has none; error_deg: (T,) expected
    rotation error of each, NaN where unknown; time_s: (T,) increasing."""
    votes = pool(up, error_deg, time_s)
    sources = list(others)
    if known(votes.up):
        sources.append(direction("frames", votes.up, votes.error_deg))
    if not sources:
        return TakeUp(votes.up, float("nan"), float("nan"), {}, votes)
    information = np.sum([source.information for source in sources], axis=0)
    fused = _fused(sources)
    across = np.eye(3) - np.outer(fused, fused)
    parts = {source.name: float(np.trace(across @ source.information)) for source in sources}
    error = error_of(information, fused)
    total = sum(parts.values())
    pulls = {
        source.name: float(angle_deg(fused, _fused([other for other in sources if other is not source])))
        for source in (sources if len(sources) > 1 else ())
    }
    shares = {name: part / total for name, part in parts.items()}
    own = {
        source.name: (up, error_of(source.information, up))
        for source in sources
        if known(up := _fused([source]))
    }
    return TakeUp(fused, error, RAYLEIGH_90 * error, shares, votes, pulls, own)


def error_of(information: np.ndarray, up: np.ndarray) -> float:
    """Degrees, root mean square, of an up (3,) with an information matrix (3, 3) per square radian."""
    across = np.eye(3) - np.outer(up, up)
    return float(np.degrees(np.sqrt(np.trace(np.linalg.pinv(across @ information @ across)))))


def _fused(sources: Sequence[Evidence]) -> np.ndarray:
    """(3,) the up that all say together, NaN where none knows more than a plane."""
    vector = sum(source.vector for source in sources)
    if not np.any(vector):
        return np.full(3, np.nan)
    return unit(np.linalg.lstsq(sum(source.information for source in sources), vector, rcond=None)[0])


def pool(up: np.ndarray, error_deg: np.ndarray, time_s: np.ndarray) -> Votes:
    """Weighted robust mean on the sphere: weights 1 / error^2, votes further than a few degrees off count less
    (Cauchy's weights about the current mean). The error is what all votes share plus what is left of their scatter.

    A frame's expected tilt error has two parts: the scatter that the take shows, which averages out over its
    independent votes, and the rest, which all its frames share. The scatter's part is no less than how far the votes
    that were outvoted would move the mean: of a body that stands for one half and lies for the other, either may be
    right.

    up (T, 3), unit vectors; error_deg and time_s (T,).
    """
    fine = known(up)
    weights = np.zeros(len(up))
    if not fine.any():
        return Votes(np.full(3, np.nan), float("nan"), weights, 0.0, float("nan"))
    votes = unit(up[fine].astype(np.float64))
    expected = np.where(np.isfinite(error_deg[fine]), error_deg[fine], UNKNOWN_DEG)
    trust = (expected.min() / expected) ** 2
    centre, robust = robust_mean(votes, trust)
    weights[fine] = robust
    apart = _tangent_deg(votes, centre)
    scatter = float(np.sqrt(np.average((apart**2).sum(-1), weights=trust)))
    effective = effective_number(apart, time_s[fine], robust)
    tilt = TILT_SHARE * float(np.sqrt(np.average(expected**2, weights=trust)))
    shared = max(tilt**2 - scatter**2, LEAN_DEG**2)
    outvoted = float(np.nan_to_num(angle_deg(trust @ votes, centre), nan=90.0))
    error = float(np.sqrt(shared + max(scatter**2 / effective, outvoted**2)))
    return Votes(centre, error, weights, effective, scatter)


def robust_mean(votes: np.ndarray, trust: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3,) mean of unit vectors (N, 3), and the weights (N,) that it came to: trust times Cauchy's."""
    weights = trust
    centre = unit(weights @ votes)
    for _ in range(_TURNS):
        if not np.isfinite(centre).all():  # votes that cancel
            centre = votes[np.argmax(weights)]
        chord = 2 - 2 * votes @ centre  # squared; near the squared angle, and cheaper
        weights = trust / (1 + chord / np.radians(_OUTLIER_DEG) ** 2)
        before, centre = centre, unit(weights @ votes)
        if np.abs(centre - before).max() < _STILL:
            break
    return centre, weights


def effective_number(apart: np.ndarray, time_s: np.ndarray, weights: np.ndarray) -> float:
    """Independent votes among N correlated ones: Kish's number for the weights, divided by the integrated
    autocorrelation time of apart (N, D), summed while positive (Geyer 1992), and at most one every 0.3 s."""
    kish = float(weights.sum() ** 2 / (weights**2).sum())
    count = len(apart)
    if count < 3:
        return 1.0
    centred = (apart - np.average(apart, axis=0, weights=weights)) * np.sqrt(weights / weights.max())[:, None]
    size = 2 ** int(np.ceil(np.log2(2 * count)))
    spectrum = np.fft.rfft(centred, size, axis=0)
    covariance = np.fft.irfft((np.abs(spectrum) ** 2).sum(axis=1), size)[:count]
    if covariance[0] <= 1e-12:
        return 1.0  # identical frames are one vote
    correlation = covariance / covariance[0]
    negative = np.flatnonzero(correlation <= 0)
    until = negative[0] if len(negative) else count
    inflation = 1 + 2 * float(correlation[1:until].sum())
    seconds = float(time_s[-1] - time_s[0])
    return float(max(min(kish / inflation, 1 + seconds / _CORRELATED_S), 1.0))


def direction(name: str, up: np.ndarray, error_deg: float) -> Evidence:
    """A source that knows up itself: a gravity sensor, the camera's known pitch and roll, the frames' votes.

    up: (3,), any length; error_deg: root mean square angle of its error."""
    up = unit(np.asarray(up, dtype=np.float64))
    per_axis = np.radians(error_deg) / np.sqrt(2)
    information = np.eye(3) / per_axis**2
    return Evidence(name, information, information @ up)


def level_feet(joints: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> Evidence | None:
    """In double support the line between the ankles is level: (right - left) . up = 0. None without such frames.

    joints: (T, 17, 3) relative to the pelvis, any unit; up: (3,) a first idea, to tell stance from a kick;
    time_s: (T,). Needs no path of the root: two feet on the ground do not move against each other.
    """
    across, use = stance(joints, up, time_s)
    if use.sum() < 5:
        return None
    lines = unit(across[use])
    stances = 1 + np.count_nonzero(np.diff(np.flatnonzero(use)) > 1)
    seconds = use.sum() * float(np.median(np.diff(time_s)))
    # Another stance, or another second, is another look, unless it shows the same.
    rise = np.degrees(lines @ up)[:, None]
    count = min(stances + seconds, effective_number(rise, time_s[use], np.ones(len(lines))))
    error = np.radians(np.sqrt(_FEET_LEAN_DEG**2 + _FEET_DEG**2 / count))
    information = lines.T @ lines / use.sum() / error**2
    return Evidence("feet", information, np.zeros(3))


def stance(joints: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3) right minus left ankle in statures, and (T,) whether both feet seem to stand apart on the ground."""
    from scipy.ndimage import gaussian_filter1d

    stature = implied_stature(joints)
    right, left = (joints[:, H36M17.index(f"{side}_ankle")].astype(np.float64) / stature for side in "rl")
    across = right - left
    fine = known(across)
    if fine.sum() < 5 or not np.isfinite(stature):
        return across, np.zeros(len(joints), dtype=bool)
    smooth = across.copy()
    smooth[fine] = gaussian_filter1d(across[fine], 1.5, axis=0)
    speed = np.full(len(joints), np.inf)
    speed[fine] = np.linalg.norm(np.gradient(smooth[fine], time_s[fine], axis=0), axis=-1)
    under = np.maximum(right @ up, left @ up) < -0.35  # both feet well below the pelvis
    rise = np.abs(across @ up)
    apart = np.linalg.norm(across, axis=-1)
    return across, fine & (speed < _STANCE_SPEED) & (apart > _STANCE_APART) & (rise < _STANCE_LEVEL) & under


def _tangent_deg(votes: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """(N, 2) where votes (N, 3) lie about the centre, degrees along two directions across it."""
    plane = votes @ np.linalg.svd(centre[None])[2][1:].T
    sine = np.linalg.norm(plane, axis=-1)
    return plane * (np.degrees(np.arctan2(sine, votes @ centre)) / np.maximum(sine, 1e-12))[:, None]
