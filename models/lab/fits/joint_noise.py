"""Learns how a lifter's joints err together, on lifted takes with truth (of pcnet3d lab testbed); a step of refit.

Train subjects give the modes; validation subjects, lifted by the shipped lifter and levelled by the shipped rectifier,
give what a frame's noise grows with. What each angle's error is then comes from `pcnet3d lab evaluate errors --fit`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import is_finite, kabsch, rotate
from ....pipeline.files.arrays import keys
from ....pipeline.files.atomic import write_text
from ....pipeline.plugins.protocols import Rectifier
from ...angle_error.joint_noise import (
    JOINTS,
    JointNoise,
    heading_error,
    limb_spread,
    shipped_noise,
)
from ...angle_error.take_angles import smoothed
from ...common.metrics import scaled
from ...gravity import Levelled, Seen, level_static, why_not
from ...lifter.load import load_lifter
from ...rectifier.load import load_rectifier
from ..synthetic.views import read_testbed

_MODES = 24  # of 42: 95 % of the variance; the angles' factors hold the rest
_FPS = 30.0  # of the testbed's takes


@dataclass(frozen=True, eq=False)
class Pair:
    """One take through the filter. lifted, truth: (T, 17, 3) metres, CAMERA axes; raw: before the filter;
    R_camera_from_body: (T, 3, 3), true; upright: (T,); stated: (T,) the lifter's own error, NaN where unknown."""

    raw: np.ndarray
    lifted: np.ndarray
    truth: np.ndarray
    R_camera_from_body: np.ndarray
    upright: np.ndarray
    stated: np.ndarray

    @property
    def time_s(self) -> np.ndarray:
        return np.arange(len(self.raw)) / _FPS

    def residual(self) -> np.ndarray:
        """(T, 14, 3) what is left of the lift's error, in shares of stature, when each frame is brought closest to the
        truth by a rotation and a shift."""
        rows = H36M17.indices(JOINTS)
        lifted, truth = (
            x[:, rows] - x[:, rows].mean(axis=1, keepdims=True) for x in (self.lifted, self.truth)
        )
        return (rotate(kabsch(truth, lifted), lifted) - truth) / implied_stature(self.truth)


def read_pairs(paths: Sequence[Path]) -> Iterator[Pair]:
    """The takes of pcnet3d lab testbed's files; InputError for other files."""
    for path in paths:
        held = read_testbed(path, "lifted", "truth", "R_camera_from_body", "lying")
        lifted, truth, R = (held[name] for name in ("lifted", "truth", "R_camera_from_body"))
        lying, stated = held["lying"].astype(bool), np.full(len(lifted), np.nan)
        if "spread" in keys(path):
            stated = read_testbed(path, "spread")["spread"]
        for begin, end in pairwise(held["take_start"]):
            true = truth[begin:end].astype(np.float64)
            raw = scaled(lifted[begin:end].astype(np.float64), true, "take")
            time_s = np.arange(len(raw)) / _FPS
            yield Pair(
                raw,
                smoothed(raw, time_s),
                smoothed(true, time_s),
                R[begin:end],
                ~lying[begin:end],
                stated[begin:end],
            )


def modes_of(pairs: Iterator[Pair]) -> np.ndarray:
    """(K, 14, 3) the largest principal axes of the residuals, one root mean square long."""
    errors = [pair.residual()[pair.upright] for pair in pairs]
    flat = np.concatenate(errors).reshape(-1, 3 * len(JOINTS))
    flat = flat[is_finite(flat)]
    variance, axes = np.linalg.eigh(flat.T @ flat / len(flat))
    largest = np.argsort(variance)[::-1][:_MODES]
    return (axes[:, largest] * np.sqrt(variance[largest])).T.reshape(_MODES, len(JOINTS), 3)


def with_multiples(noise: JointNoise, pairs: Sequence[Pair], levels: Sequence[Levelled]) -> JointNoise:
    """The same with what a frame's noise grows with, a least-squares fit of the logarithms."""
    rows = []
    for pair, level in zip(pairs, levels, strict=True):
        size = np.sqrt((pair.residual() ** 2).sum(axis=(1, 2)))
        heading = heading_error(level.error_deg, level.up_error_deg)
        row = np.log(np.stack([heading, limb_spread(pair.lifted), pair.stated, size], axis=-1))
        rows.append(row[pair.upright & is_finite(row)])
    x = np.concatenate(rows)
    centre = x.mean(axis=0)
    powers = np.linalg.lstsq(x[:, :-1] - centre[:-1], x[:, -1] - centre[-1], rcond=None)[0]
    size = np.sqrt(np.mean(np.exp(2 * (x[:, -1] - (x[:, :-1] - centre[:-1]) @ powers))))
    return replace(
        noise,
        modes=noise.modes * size / np.sqrt((noise.modes**2).sum()),
        usual=tuple(np.exp(centre[:-1]).tolist()),
        powers=tuple(powers.tolist()),
    )


def fit(train: Sequence[Path], val: Sequence[Path], rectifier: Rectifier) -> JointNoise:
    """The modes of the lifter's errors in the train files, and their sizes by the val files; each angle's own parts
    stay the shipped ones. InputError when no val take can be levelled."""
    pairs, levels = [], []
    for pair in read_pairs(val):
        level = level_static(Seen(pair.raw, *rectifier.rotation(pair.raw), pair.time_s, spread=pair.stated))
        if not why_not(level):
            pairs.append(pair)
            levels.append(level)
    if not pairs:
        raise InputError("nothing-usable", "Expected validation takes that can be levelled, got none.")
    noise = replace(shipped_noise(), lifter=load_lifter().method, modes=modes_of(read_pairs(train)))
    return with_multiples(noise, pairs, levels)


def learn(train: Sequence[Path], val: Sequence[Path], output: Path) -> None:
    """Write the noise that was learned. train: lifted by lifters that never saw these people."""
    noise = fit(train, val, load_rectifier("pcnet"))
    write_text(output, noise.as_json())
    print(f"{output}: usual {noise.usual}, powers {noise.powers}")
