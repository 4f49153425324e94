"""What the constants of models/gravity would be for a new lifter or rectifier, on takes of validation subjects; a step
of refit, after which they are changed by hand, where they stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.rotations import angle_deg, unit
from ...common.metrics import RAYLEIGH_90
from ...gravity import LEAN_DEG, Votes, pool
from ...gravity.votes import USUAL_DEG, USUAL_SPREAD
from ...rectifier.load import load_rectifier
from .joint_noise import read_pairs

_COVERED = 0.9
_SHORTEST = 60  # frames, 2 s


@dataclass(frozen=True)
class Constants:
    """TILT_SHARE, LEAN_DEG and STATED_LEAN_DEG of models/gravity/votes.py, and HEADING_SHARE of levelling.py.

    tilt_share, heading_share: root mean squares of a frame's tilt and heading over its expected rotation error.
    lean_deg: what a lifter leans with all its frames at least, so that nine in ten takes lie inside their bound.
    stated_lean_deg: the same where the lifter states its error."""

    tilt_share: float
    heading_share: float
    lean_deg: float
    stated_lean_deg: float


def share(error_deg: np.ndarray, expected_deg: np.ndarray) -> float:
    """Root mean square of errors (N,) over that of what was expected (N,), where both are known."""
    both = np.isfinite(error_deg) & np.isfinite(expected_deg)
    return float(np.sqrt(np.mean(error_deg[both] ** 2) / np.mean(expected_deg[both] ** 2)))


def lean(tilt_deg: np.ndarray, stated_deg: np.ndarray, used_deg: float) -> float:
    """The least lean with which nine in ten takes whose up is off by tilt_deg (N,) lie inside the 90 % bound.
    stated_deg (N,): root mean square errors stated with a lean of used_deg."""
    without = np.maximum(stated_deg**2 - used_deg**2, 0)
    needed = np.sqrt(np.maximum((tilt_deg / RAYLEIGH_90) ** 2 - without, 0))
    return float(np.quantile(needed, _COVERED))


def stated_lean(
    tilt_deg: np.ndarray, expected_square: np.ndarray, spread: np.ndarray, votes: Sequence[Votes]
) -> float:
    """STATED_LEAN_DEG of greatest likelihood, tilts (N,) being Rayleigh's, as are lengths of Gaussian errors in two
    dimensions."""
    from scipy.optimize import minimize_scalar

    unit_square = (spread / USUAL_SPREAD) ** 3 * expected_square / USUAL_DEG**2
    rest = np.array([one.scatter_deg**2 / one.effective for one in votes])

    def cost(lean_deg: float) -> float:
        square = lean_deg**2 * unit_square + rest
        return float(np.mean(np.log(square) + tilt_deg**2 / square))

    return float(minimize_scalar(cost, bounds=(0.5, 20), method="bounded").x)  # type: ignore[union-attr]


def constants(paths: Sequence[Path]) -> Constants:
    """Of lifted takes, upright and of 2 s at least, in files of pcnet3d lab testbed; InputError for other files, and
    for files without such takes."""
    network = load_rectifier("pcnet")
    tilts, headings, expected, off, stated, spreads, pooled = [], [], [], [], [], [], []
    for pair in read_pairs(paths):
        if len(pair.raw) < _SHORTEST or not pair.upright.all():
            continue
        R, error_deg = network.rotation(pair.raw.astype(np.float32))
        up = pair.R_camera_from_body[..., 2]
        facing = R[..., 0] - (R[..., 0] * up).sum(axis=-1, keepdims=True) * up
        tilts.append(angle_deg(R[..., 2], up))
        headings.append(angle_deg(unit(facing), pair.R_camera_from_body[..., 0]))
        expected.append(error_deg)
        votes = pool(R[..., 2], error_deg, pair.time_s)
        off.append(float(angle_deg(votes.up, unit(up.mean(axis=0)))))
        stated.append(votes.error_deg)
        spreads.append(pair.stated)
        pooled.append(votes)
    if not tilts:
        raise InputError("nothing-usable", f"Expected upright takes of {_SHORTEST} frames or more, got none.")
    tilt, heading, said = (np.concatenate(parts) for parts in (tilts, headings, expected))
    usual = np.array([np.nanmedian(each) for each in spreads])  # frames without a person have none
    square = np.array([np.nanmean(each**2) for each in expected])
    return Constants(
        share(tilt, said),
        share(heading, said),
        lean(np.array(off), np.array(stated), LEAN_DEG),
        stated_lean(np.array(off), square, usual, pooled),
    )
