"""One person's frames: a rectifier's answer and where it comes from, and means over neighbouring frames: a Gaussian in
time, weighted by trust, within a clip."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import is_finite, unit
from .evidence import Evidence
from .votes import (
    BESIDE,
    BESIDE_SHARE,
    LIES,
    OWN_LEAN_DEG,
    RAISED_LEAN_DEG,
    VIEW,
    expected_deg,
    of_votes,
    pool,
)

_BALANCED = H36M17.indices(["pelvis", "thorax", "r_ankle", "l_ankle"])
_WRISTS, _SHOULDERS = (
    H36M17.indices([f"{side}_{joint}" for side in "rl"]) for joint in ("wrist", "shoulder")
)


@dataclass(frozen=True, eq=False)
class PersonFrames:
    """One person before a camera, as a rectifier sees them, in the camera's axes.

    joints: (T, 17, 3) relative to the pelvis, any unit. R_camera_from_body: (T, 3, 3), NaN where a frame has too few
    torso joints. error_deg: (T,) expected rotation error of each, NaN where unknown. time_s: (T,) increasing. seams:
    rows that no smoothing crosses. root: (T, 3) the pelvis's own path where it is known, in the same unit. name: how
    shares name the person among several. spread: (T,) the lifter's stated error (models/common/spread.py), NaN or None
    where it states none.
    """

    joints: np.ndarray
    R_camera_from_body: np.ndarray
    error_deg: np.ndarray
    time_s: np.ndarray
    seams: tuple[int, ...] = ()
    root: np.ndarray | None = None
    name: str = "person"
    spread: np.ndarray | None = None

    @property
    def votes(self) -> np.ndarray:
        """(T, 3) unit, each frame's own up; NaN where it has none."""
        return self.R_camera_from_body[:, :, 2]


def trust(error_deg: np.ndarray | float) -> np.ndarray:
    """(...,) a frame's weight, 1 / error^2."""
    return 1 / expected_deg(error_deg) ** 2


def of_frames(person: PersonFrames) -> list[Evidence]:
    """The one piece of evidence that a take's frames are together; none without votes."""
    votes, fine = pool(person.votes, person.error_deg, person.time_s, person.spread), is_finite(person.votes)
    return of_votes(votes, own_lean(np.mean(leaning(person, votes.up)[fine], axis=0))) if fine.any() else []


def leaning(person: PersonFrames, up: np.ndarray) -> np.ndarray:
    """(T, 13) of each frame, where the body faces or turns its back, level for up (3,) or (T, 3): the outer product of
    that direction with itself, (9,), and whether both arms are raised; and how far, and in which direction, the middle
    of the trunk is beside the feet in the image, over its height, (3,); 0 of who lies. Zeros of frames without a
    rotation."""
    facing = person.R_camera_from_body[..., 0]
    facing = np.nan_to_num(unit(facing - (facing * up).sum(-1, keepdims=True) * up))
    rise = ((person.joints[:, _WRISTS] - person.joints[:, _SHOULDERS]) * up[..., None, :]).sum(-1)
    raised = (rise > 0).all(-1, keepdims=True)
    pelvis, thorax, *ankles = np.moveaxis(person.joints[:, _BALANCED], 1, 0)
    over_feet = unit((pelvis + thorax - sum(ankles)).astype(np.float64))
    right = unit(np.cross(up, VIEW))
    share = (over_feet * right).sum(-1, keepdims=True)
    beside = np.nan_to_num(np.where(abs(share) < LIES, share, 0.0) * right)
    square = (facing[:, :, None] * facing[:, None]).reshape(-1, 9)
    return np.concatenate([square, raised, beside], axis=-1)


def own_lean(mean: np.ndarray) -> np.ndarray:
    """(..., 3, 3) square radians, what a person leans to the front or the back by itself, and by how much a body that
    is not above its feet all the time shows that up is another. mean: (..., 13) of leaning, over the frames that tell
    up."""
    lean_deg = np.hypot(OWN_LEAN_DEG, RAISED_LEAN_DEG * mean[..., 9])[..., None, None]
    own = np.radians(lean_deg) ** 2 * mean[..., :9].reshape(*mean.shape[:-1], 3, 3)
    beside = mean[..., 10:]
    far = np.linalg.norm(beside, axis=-1, keepdims=True)
    beside = beside * np.maximum(1 - BESIDE / np.maximum(far, 1e-9), 0)
    return own + BESIDE_SHARE**2 * beside[..., :, None] * beside[..., None, :]


def smoothed(values: np.ndarray, weights: np.ndarray, person: PersonFrames, std_s: float) -> np.ndarray:
    """(T, D) mean of values (T, D) of a person's frames, with weights (T,) times a Gaussian in time, within each part
    between clip boundaries; NaN where no weight is near."""
    out = np.full(values.shape, np.nan)
    for start, end in pairwise([0, *person.seams, len(values)]):
        part = slice(start, end)
        out[part] = _smoothed(values[part], weights[part], person.time_s[part], std_s)
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
