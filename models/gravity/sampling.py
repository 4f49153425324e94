"""A rectifier's answers for a take, asked about as many frames as inform.

Neighbouring frames' ups are the same vote (votes.py), and how a body turns from one frame to the next its hips and
shoulders tell as well as the network. So of a long take the network sees a frame now and then; the frames between have
the up of their neighbours, and the heading of their own joints, moved by what the network's differs from it there.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ...pipeline.core.rotations import unit
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.signals.filters import on_lines
from ..common.canonical import body_axes
from .votes import CORRELATED_S

_ENOUGH = 600  # frames: so many are always asked


def take_rotation(
    rectifier: Rectifier, joints: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """R_camera_from_body (T, 3, 3) and error_deg (T,), as of rectifier.rotation, of one person's take.

    joints: (T, 17, 3) in CAMERA axes; time_s: (T,); seams: rows at which another clip begins. The rectifier answers
    every frame of a take of up to 1,200 frames, and of a longer one 600 of them or one every 0.3 s, whichever are more;
    besides all of those that lack a hip or a shoulder. Tilts and headings of lifted and of clean takes of validation
    subjects are as good as with every frame asked.
    """
    rows = len(joints)
    usual_s = float(np.median(np.diff(time_s))) if rows > 1 else 0.0
    every = min(rows // _ENOUGH, int(CORRELATED_S / usual_s) if usual_s > 0 else 1)
    if every < 2:
        return rectifier.rotation(joints)
    R, error_deg = np.full((rows, 3, 3), np.nan), np.full(rows, np.nan)

    def ask(asked: np.ndarray) -> None:
        R[asked], error_deg[asked] = rectifier.rotation(joints[asked])

    asked = np.asarray(~np.isfinite(body_axes(joints, np.array([0.0, -1.0, 0.0]))).all(axis=(1, 2)))
    edges = [0, *seams, rows]
    for first, end in pairwise(edges):
        asked[first:end:every] = True
        asked[end - 1] = True
    ask(asked)
    for first, end in pairwise(edges):
        clip = slice(first, end)
        R[clip], error_deg[clip] = _between(R[clip], error_deg[clip], asked[clip], joints[clip], time_s[clip])
    left = ~asked & ~np.isfinite(R).all(axis=(1, 2))
    if left.any():
        ask(left)
    return R, error_deg


def _between(
    R: np.ndarray, error_deg: np.ndarray, asked: np.ndarray, joints: np.ndarray, time_s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One clip's rotations (T, 3, 3) and errors (T,), completed where they were not asked for; NaN where nobody near
    was."""
    body = body_axes(joints, R[..., 2])  # the joints' own heading, under the rectifier's up
    use = asked & (np.isfinite(R) & np.isfinite(body)).all(axis=(1, 2))
    if not use.any():
        return R, error_deg

    up = unit(on_lines(R[..., 2], time_s, use))
    # The rectifier's left in the joints' axes: forward and left.
    turn = np.stack([(R[..., 1] * body[..., axis]).sum(-1) for axis in (0, 1)], axis=-1)
    turn = on_lines(turn, time_s, use)
    body = body_axes(joints, up)
    right = unit(turn[:, :1] * body[..., 0] + turn[:, 1:] * body[..., 1])
    filled = np.stack([np.cross(right, up), right, up], axis=-1)
    return (
        np.where(asked[:, None, None], R, filled),
        np.where(asked, error_deg, on_lines(error_deg, time_s, use)),
    )
