"""A body drawn as tapered bones: one surface, which each bone stretches, turns and moves; of the glTF export and the
recording."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.rotations import unit

# A bone's surface: a point at each end, and rings between them at shares of its length, as wide as shares of its width.
_RINGS = np.array([(0.03, 0.5), (0.12, 0.9), (0.25, 1.0), (0.9, 0.55), (0.97, 0.35)])
_CORNERS = 8  # of a ring
_WIDTH = 0.09  # half a bone's width, in its length


def _faces() -> np.ndarray:
    """(F, 3) corners of the triangles of a bone's surface, counter-clockwise from outside."""
    rings = 1 + np.arange(len(_RINGS) * _CORNERS).reshape(-1, _CORNERS)
    beside = np.roll(rings, -1, axis=1)
    first, last = np.zeros(_CORNERS, int), np.full(_CORNERS, rings.size + 1)
    faces = [(first, beside[0], rings[0]), (last, rings[-1], beside[-1])]
    for i in range(len(rings) - 1):
        faces += [(rings[i], beside[i], beside[i + 1]), (rings[i], beside[i + 1], rings[i + 1])]
    return np.concatenate([np.stack(face, axis=1) for face in faces])


FACES = _faces()


def surface(bone: np.ndarray) -> np.ndarray:
    """(V, 3) the points of the surface of a bone from 0 to `bone` (3,), which is 1 long."""
    least = np.eye(3)[np.abs(bone).argmin()]
    across = unit(np.cross(bone, least))
    other = np.cross(bone, across)
    turn = 2 * np.pi * np.arange(_CORNERS)[:, None] / _CORNERS
    circle = _WIDTH * (np.cos(turn) * across + np.sin(turn) * other)
    rings = [along * bone + wide * circle for along, wide in _RINGS]
    return np.concatenate([np.zeros((1, 3)), *rings, bone[None]])


def normals(points: np.ndarray) -> np.ndarray:
    """(V, 3) the mean direction of the faces around each point, by their area."""
    a, b, c = np.moveaxis(points[FACES], 1, 0)
    sums = np.zeros(points.shape)
    for corner in range(3):
        np.add.at(sums, FACES[:, corner], np.cross(b - a, c - a))
    return unit(sums).astype(np.float32)


def along(bones: np.ndarray) -> np.ndarray:
    """(..., 4) x, y, z, w of rotations of the x axis to the directions of bones (..., 3), by the shortest way."""
    x, y, z = np.moveaxis(unit(bones), -1, 0)
    turns = np.stack([0 * x, -z, y, 1 + x], axis=-1)
    turns[x < 1e-6 - 1] = (0, 0, 1, 0)  # backwards every way is as short
    return unit(turns)
