"""Evidence on up: what any source says, as a Gaussian about it, and what several say together.

Each kind is made in one place: the body's by `votes.pool`, that of feet and floor by `floor.of_feet`, what the user or
a sensor tells by `told_up`; how cameras are `held` speaks before any of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...pipeline.core.camera import pitch_roll_deg, view_rotation
from ...pipeline.core.notices import Notice
from ...pipeline.core.pose import TOLD_UP
from ...pipeline.core.rotations import is_finite, unit
from ...pipeline.core.take import Told
from ..common.metrics import RAYLEIGH_90

FRAMES, FEET, FLOOR, IMAGE = "frames", "feet", "floor", "image"  # sources, beside people's and what is told
_GRAVITY, _ANGLES = TOLD_UP
_TOLD_DEG = 1.0  # error of a camera's pitch, roll or gravity vector that the user states
# Pitch about looking a little down, roll about none: middles and spreads in degrees; a few of them any way.
_USUAL_DEG = ((8.0, 14.0), (0.0, 5.0))
_ANYHOW_DEG, _ANYHOW = 35.0, 0.05
_WIDEST_DEG = 45.0  # off the image's own up, where lines are searched for one
_DOUBT = 0.5  # more likely wrong than right

# 90 % radius of a Gaussian with standard deviations 1 and 0, 0.2, ... 1, by numerical integration.
_RADII = (1.6449, 1.6573, 1.6992, 1.7915, 1.9472, 2.1460)


@dataclass(frozen=True, eq=False)
class Evidence:
    """One source's word on up: information matrix (3, 3) and vector (3,) of a Gaussian about it, per square radian."""

    name: str
    information: np.ndarray
    vector: np.ndarray


@dataclass(frozen=True, eq=False)
class TakeUp:
    """A take's up. up: (3,), unit, or (T, 3) before a camera that moves; NaN where there is no evidence. error_deg:
    expected root mean square angle to the truth, of the take or (T,) of each frame. shares: by name, each source's part
    of the information in a direction across up, its mean over all such directions. own: the up that each source would
    have by itself, and its error in degrees, of those that know one. notices: about sources that contradict each other.
    covariance: (3, 3) of the error, square radians, where up may be surer along one direction than across it; None of
    an error that is alike in all directions; (T, 3, 3) of an up of each frame."""

    up: np.ndarray
    error_deg: float | np.ndarray
    shares: dict[str, float] = field(default_factory=dict)
    own: dict[str, tuple[np.ndarray, float]] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()
    covariance: np.ndarray | None = None

    @property
    def bound_deg(self) -> float | np.ndarray:
        """The angle that nine in ten takes should stay under, as error_deg."""
        return self.error_deg * (RAYLEIGH_90 if self.covariance is None else radius_90(self.covariance))

    @property
    def by_bodies(self) -> float:
        """The share that is one person's frames', feet's and floor's."""
        return sum(self.shares.get(source, 0.0) for source in (FRAMES, FEET, FLOOR))


def about(name: str, up: np.ndarray, covariance: np.ndarray) -> Evidence:
    """A source that knows up (3,), surer of it along one direction than across. covariance: (3, 3) of its error, square
    radians."""
    information = np.linalg.pinv(covariance, hermitian=True, rcond=1e-9)
    # Along up itself nothing can be wrong; a finite number there keeps the fused direction a unit vector. It is that of
    # the direction known worst: the roll's would count as knowledge of the pitch once another source moved up there.
    information = information + np.outer(up, up) / np.linalg.eigvalsh(covariance)[-1]
    return Evidence(name, information, information @ up)


def direction(name: str, up: np.ndarray, error_deg: float) -> Evidence:
    """A source that knows up itself, as well in all directions: a gravity sensor, the camera's known pitch and roll.

    up: (3,), any length; error_deg: root mean square angle of its error."""
    up = unit(np.asarray(up, dtype=np.float64))
    per_axis = np.radians(error_deg) / np.sqrt(2)
    information = np.eye(3) / per_axis**2
    return Evidence(name, information, information @ up)


def told_up(told: Told) -> list[Evidence]:
    """What is told of gravity, or of the camera's pitch and roll, as evidence on up; none where nothing is."""
    if told.gravity is not None:
        return [direction(_GRAVITY, -np.array(told.gravity, dtype=np.float64), _TOLD_DEG)]
    if told.pitch_deg is None or told.roll_deg is None:
        return []
    angles = (np.array(angle, dtype=np.float64) for angle in (0.0, told.pitch_deg, told.roll_deg))
    return [direction(_ANGLES, view_rotation(*angles)[:, 2], _TOLD_DEG)]


def held(up: np.ndarray) -> np.ndarray:
    """(...) how usual a camera of that up (..., 3) is: a density in pitch and roll over that of the most usual one."""
    usual = anyhow = 1.0
    angles = np.moveaxis(pitch_roll_deg(np.asarray(up, dtype=np.float64)), -1, 0)
    for angle, (middle, spread) in zip(angles, _USUAL_DEG, strict=True):
        usual = usual * np.exp(-0.5 * ((angle - middle) / spread) ** 2)
        anyhow = anyhow * np.exp(-0.5 * ((angle - middle) / _ANYHOW_DEG) ** 2) * spread / _ANYHOW_DEG
    return np.asarray((1 - _ANYHOW) * usual + _ANYHOW * anyhow)


def doubtful(up: np.ndarray, failure: float) -> bool:
    """Of an image's up (3,) in which nobody's body can be seen, and which is quite wrong so often (failure), whether
    the pitch that it says is one that cameras have so seldom that it is likely to be wrong: what is quite wrong says
    any pitch."""
    pitch = pitch_roll_deg(np.asarray(up, dtype=np.float64))[0]
    level = view_rotation(np.array(0.0), np.asarray(pitch), np.array(0.0))[:, 2]
    # About its integral over pitch.
    right = (1 - failure) * held(level) / (np.sqrt(2 * np.pi) * _USUAL_DEG[0][1])
    wrong = failure / (2 * _WIDEST_DEG)
    return bool(wrong / (wrong + right) > _DOUBT)


def fuse(sources: Sequence[Evidence]) -> TakeUp:
    """The up of all sources together, NaN without any that knows more than a plane (feet on the ground do not)."""
    up = _up_of(sources)
    if not is_finite(up):
        return TakeUp(up, float("nan"))
    # How far up moves with each source's: who is very sure of the roll alone has no share in the pitch.
    across, covariance = _across(sources, up)
    parts = {source.name: np.trace(covariance @ across @ source.information @ across.T) for source in sources}
    own = {
        source.name: (alone, _error_of([source], alone))
        for source in sources
        if is_finite(alone := _up_of([source]))
    }
    shares = {name: float(part / sum(parts.values())) for name, part in parts.items()}
    return TakeUp(up, _error_of(sources, up), shares, own, covariance=across.T @ covariance @ across)


def radius_90(covariance: np.ndarray) -> np.ndarray:
    """(...,) of the circle that holds 90 % of a Gaussian error across up, of covariance (..., 3, 3), over its root mean
    square length; NaN where that is NaN."""
    fine = np.isfinite(covariance.sum(axis=(-2, -1)))
    variances = np.linalg.eigvalsh(np.where(fine[..., None, None], covariance, np.eye(3)))
    least, most = np.moveaxis(np.sqrt(np.maximum(variances[..., 1:], 0.0)), -1, 0)
    radius = np.interp(least / most, np.linspace(0, 1, len(_RADII)), _RADII) * most / np.hypot(least, most)
    return np.where(fine, radius, np.nan)


def _up_of(sources: Sequence[Evidence]) -> np.ndarray:
    """(3,), NaN where none knows more than a plane."""
    vector = sum(source.vector for source in sources)
    if not np.any(vector):
        return np.full(3, np.nan)
    return unit(np.linalg.lstsq(sum(source.information for source in sources), vector, rcond=None)[0])


def _error_of(sources: Sequence[Evidence], up: np.ndarray) -> float:
    """Degrees, root mean square, of their up (3,)."""
    return float(np.degrees(np.sqrt(np.trace(_across(sources, up)[1]))))


def _across(sources: Sequence[Evidence], up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(2, 3) two directions across up (3,), and (2, 2) the covariance of the sources' up along them, square radians."""
    across = np.linalg.svd(up[None])[2][1:]
    information = np.sum([source.information for source in sources], axis=0)
    return across, np.linalg.pinv(across @ information @ across.T, hermitian=True)
