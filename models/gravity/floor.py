"""Feet that stand as evidence on up.

A foot that stands does not move, so the places where feet stood over a take lie on the floor, and the normal of a level
floor is up. That needs the root's true path: in poses relative to the pelvis feet that stand do move. Without it two
feet that stand at the same time are level with each other.
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import is_finite, unit
from ...pipeline.signals.filters import gaussian, rate, runs
from .evidence import FEET, FLOOR, Evidence
from .votes import PersonFrames, effective_number

_STANDS_SPEED = 0.15  # statures per second below which an ankle stands
_STANCE_S = 0.1  # the least that a stance lasts
_BELOW = 0.3  # statures that a foot is below the pelvis when it carries the body
_HEIGHT = 0.015  # statures, scatter of ankles' heights above the floor from stance to stance, at least
_SPREAD = 3.0  # times that scatter must feet have stood apart in a direction before they say how it rises
_STEEP_DEG = 15.0  # what rises by more against the first idea of up is a flight of stairs
_UNEVEN_DEG = 2.0  # a floor's slope, and a calibration's error, along either direction

_FEET_DEG = 12.0  # scatter of the line between lifted ankles about the level, one independent stance,
_FEET_LEAN_DEG = 7.0  # and what all stances of a take share: the lifter's error in depth, uneven ground
_STANCE_SPEED = 0.12  # statures per second that the ankles may move against each other in double support
_STANCE_APART = 0.12  # statures that they must be apart, and
_STANCE_LEVEL = 0.10  # that one may be higher than the other,
_UNDER = -0.35  # and both well below the pelvis


def of_feet(person: PersonFrames, up: np.ndarray) -> Evidence | None:
    """Of the floor that feet stood on where the root's path is known, else of feet against each other; None where
    neither tells. up: (3,) a first idea."""
    if not is_finite(up):
        return None
    world = None if person.root is None else person.joints + person.root[:, None]
    floor = None if world is None else floor_plane(world, up, person.time_s)
    return floor or level_feet(person.joints, up, person.time_s)


def floor_plane(joints: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> Evidence | None:
    """The two directions along the floor, each across up. None when feet stood in too few places to tell, or on stairs.

    joints: (T, 17, 3) in the camera's axes with the camera or another fixed point for the origin, any unit; up: (3,) a
    first idea, to tell a floor from stairs; time_s: (T,).

    A walk along a straight line tells one direction only, that of the walk: up is then level across it for all that
    the floor knows, and the evidence says nothing about it. Each direction's error comes from how far apart feet stood
    along it, and how far from one plane (stairs, a ladder) they were.
    """
    stature = implied_stature(joints)
    if not np.isfinite(stature):
        return None
    places = stances(joints.astype(np.float64) / stature, up, time_s)
    count = len(places)
    if count < 3:
        return None
    # Along the floor, the widest direction first; the last is across it.
    values, axes = np.linalg.eigh(np.cov(places.T, bias=True))
    widths, axes = values[::-1], axes[:, ::-1].T
    off = widths[2] * count / (count - 3) if count > 3 else 0.0
    height = max(_HEIGHT, float(np.sqrt(max(off, 0.0))))
    information = np.zeros((3, 3))
    for width, axis in zip(widths[:2], axes[:2], strict=True):
        if width > (_SPREAD * height) ** 2:
            if abs(axis @ up) > np.sin(np.radians(_STEEP_DEG)):
                return None
            error = height**2 / (count * width) + np.radians(_UNEVEN_DEG) ** 2
            information += np.outer(axis, axis) / error
    return Evidence(FLOOR, information, np.zeros(3)) if information.any() else None


def stances(joints: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(N, 3) where ankles stood: the mean of each unbroken piece of at least 0.1 s in which one did not move.

    joints: (T, 17, 3) in statures, at rest where the floor is; up: (3,)."""
    if len(joints) < 3:
        return np.zeros((0, 3))
    fps = rate(time_s)
    places = []
    for side in "rl":
        ankle = joints[:, H36M17.index(f"{side}_ankle")]
        below = (ankle - joints[:, H36M17.index("pelvis")]) @ up < -_BELOW
        speed = np.full(len(ankle), np.inf)
        for piece in runs(is_finite(ankle), time_s):
            if piece.stop - piece.start > 2:
                smooth = gaussian(ankle[piece], 0.05 * fps)
                speed[piece] = np.linalg.norm(np.gradient(smooth, time_s[piece], axis=0), axis=-1)
        for piece in runs(below & (speed < _STANDS_SPEED), time_s):
            if piece.stop - piece.start >= max(_STANCE_S * fps, 2):
                places.append(ankle[piece].mean(axis=0))
    return np.array(places).reshape(-1, 3)


def level_feet(joints: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> Evidence | None:
    """In double support the line between the ankles is level: (right - left) . up = 0. None without such frames.

    joints: (T, 17, 3) relative to the pelvis, any unit; up: (3,) a first idea, to tell stance from a kick;
    time_s: (T,). Needs no path of the root: two feet on the ground do not move against each other.
    """
    stature = implied_stature(joints)
    if not stature > 0:  # nor when it is NaN
        return None
    right, left = (joints[:, H36M17.index(f"{side}_ankle")].astype(np.float64) / stature for side in "rl")
    across = right - left
    fine = is_finite(across)
    if fine.sum() < 5:
        return None
    speed = np.full(len(joints), np.inf)
    speed[fine] = np.linalg.norm(np.gradient(gaussian(across[fine], 1.5), time_s[fine], axis=0), axis=-1)
    under = np.maximum(right @ up, left @ up) < _UNDER
    apart, rise = np.linalg.norm(across, axis=-1), np.abs(across @ up)
    use = fine & under & (speed < _STANCE_SPEED) & (apart > _STANCE_APART) & (rise < _STANCE_LEVEL)
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
    return Evidence(FEET, information, np.zeros(3))
