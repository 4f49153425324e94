"""Rotations as (..., 3, 3) matrices named R_a_from_b: they map vectors of b into a (design.md section 4)."""

from __future__ import annotations

import warnings
from functools import reduce

import numpy as np

_OPPOSITE = 1e-12  # 1 + cosine


def rotate(R: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Apply R (..., D, D) to points x (..., N, D), each point as a column vector: R x."""
    return np.einsum("...ij,...kj->...ki", R, x)


def transpose(R_a_from_b: np.ndarray) -> np.ndarray:
    """R_b_from_a (..., 3, 3), the inverse of a rotation."""
    return np.swapaxes(R_a_from_b, -1, -2)


def is_finite(x: np.ndarray) -> np.ndarray:
    """(...,) True where a point x (..., D) has all its coordinates."""
    return np.asarray(reduce(np.logical_and, _coordinates(np.isfinite(x))))


def norm(v: np.ndarray) -> np.ndarray:
    """(...,) the length of v (..., D)."""
    return np.sqrt(reduce(np.add, _coordinates(v * v)))


def known_median(values: np.ndarray) -> float:
    """The median of the finite ones of (N,), NaN without any."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else float("nan")


def _coordinates(x: np.ndarray) -> list[np.ndarray]:
    """Those of x (..., D), each (...): along an axis that is so short numpy's own reductions take ten times as long."""
    return [x[..., i] for i in range(x.shape[-1])]


def unit(v: np.ndarray) -> np.ndarray:
    """v (..., D) over its length; a zero or NaN vector gives NaN."""
    length = norm(v)[..., None]
    return v / np.where(length > 1e-12, length, np.nan)


def from_columns(*columns: np.ndarray) -> np.ndarray:
    """Stack axis vectors (..., 3) as the columns of a matrix (..., 3, 3)."""
    return np.stack(columns, axis=-1)


def geodesic_deg(R_1: np.ndarray, R_2: np.ndarray) -> np.ndarray:
    """Angle in degrees of the rotation between R_1 and R_2 (..., 3, 3); exact near 0 and near 180."""
    difference = np.einsum("...ji,...jk->...ik", R_1, R_2)
    skew = difference - transpose(difference)
    sine = np.linalg.norm(np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1), axis=-1) / 2
    cosine = (np.trace(difference, axis1=-2, axis2=-1) - 1) / 2
    return np.degrees(np.arctan2(sine, cosine))


def zxy_deg(R: np.ndarray) -> np.ndarray:
    """(N, 3) degrees about z, then about its own turned x, then about its own turned y: R = R_z R_x R_y (N, 3, 3), none
    of which is missing. The second is within 90 of 0, the others within 180."""
    from scipy.spatial.transform import Rotation

    with warnings.catch_warnings():  # x at 90 degrees: one of the many triples that give it
        warnings.simplefilter("ignore", UserWarning)
        return Rotation.from_matrix(R).as_euler("ZXY", degrees=True)


def angle_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle in degrees between vectors a and b (..., 3); exact near 0 and near 180."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1)))


def kabsch(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """R_a_from_b (..., 3, 3), the rotation that brings points b (..., N, 3) closest to a, both about their means.

    Points that are NaN on either side are left out; fewer than three common points give NaN.
    """
    valid = is_finite(a) & is_finite(b)
    weight = valid[..., None].astype(float)
    count = np.maximum(weight.sum(-2, keepdims=True), 1)
    a = np.where(valid[..., None], a, 0.0)
    b = np.where(valid[..., None], b, 0.0)
    a = (a - a.sum(-2, keepdims=True) / count) * weight
    b = (b - b.sum(-2, keepdims=True) / count) * weight
    u, _, vt = np.linalg.svd(np.einsum("...ki,...kj->...ij", a, b))
    sign = np.ones(u.shape[:-1])
    sign[..., -1] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    R = np.einsum("...ij,...j,...jk->...ik", u, sign, vt)
    return np.where((valid.sum(-1) >= 3)[..., None, None], R, np.nan)


def shortest_turn(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(3, 3) the rotation by the smallest angle that brings the direction of b (3,) to that of a (3,); of opposite
    ones, which many would bring there, the identity."""
    a, b = (unit(np.asarray(direction, dtype=np.float64)) for direction in (a, b))
    x, y, z = np.cross(b, a)
    about = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + about + about @ about / max(1 + float(a @ b), _OPPOSITE)


def turn_deg(points: np.ndarray, others: np.ndarray) -> float:
    """The turn about the vertical that brings points (..., 3) nearest to others, +z up in both."""
    both = is_finite(points) & is_finite(others)
    a, b = (each[both][:, 0] + 1j * each[both][:, 1] for each in (points, others))
    return float(np.degrees(np.angle(np.vdot(a, b))))


def turned(points: np.ndarray, angle_deg: float) -> np.ndarray:
    """points (T, 3) or (T, J, 3) turned about z."""
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return rotate(np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]), points)
