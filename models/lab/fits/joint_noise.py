"""Learns how a lifter's joints err together, on the lifted takes of the test bed; a step of refit.

Train subjects give the modes; validation subjects, lifted by the shipped lifter and levelled by the shipped rectifier,
give what a frame's noise grows with. What each angle's error is then comes from `pcnet3d lab evaluate errors --fit`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import is_finite, kabsch, rotate
from ....pipeline.files.atomic import write_text
from ....pipeline.plugins.protocols import Rectifier
from ...angle_error.joint_noise import JOINTS, JointNoise, LiftErrors, limb_spread, shipped_noise
from ...angle_error.take_angles import smoothed
from ...common.residuals import stated_spread
from ...gravity.levelling import level_static, why_not
from ...gravity.votes import PersonFrames
from ...lifter.load import load_lifter
from ...rectifier.load import load_rectifier
from ..evaluation.runs import Configuration, EvaluationSet, lifted
from ..evaluation.testbed import LiftedTake, joints_of
from ..synthetic.bodies import BodyRange

_MODES = 24  # of 42: 95 % of the variance; the angles' factors hold the rest


@dataclass(frozen=True, eq=False)
class Pair:
    """One take through the filter. lifted, truth: (T, 17, 3) metres, CAMERA axes; upright: (T,)."""

    lifted: np.ndarray
    truth: np.ndarray
    upright: np.ndarray

    @classmethod
    def of(cls, take: LiftedTake) -> Pair:
        time_s, truth = take.seen.time_s, take.seen.truth
        return cls(smoothed(joints_of(take.lifted, truth), time_s), smoothed(truth, time_s), ~take.seen.lying)

    def residual(self) -> np.ndarray:
        """(T, 14, 3) what is left of the lift's error, in shares of stature, when each frame is brought closest to the
        truth by a rotation and a shift."""
        rows = H36M17.indices(JOINTS)
        lifted, truth = (
            x[:, rows] - x[:, rows].mean(axis=1, keepdims=True) for x in (self.lifted, self.truth)
        )
        return (rotate(kabsch(truth, lifted), lifted) - truth) / implied_stature(self.truth)


def modes_of(pairs: Iterable[Pair]) -> np.ndarray:
    """(K, 14, 3) the largest principal axes of the residuals, one root mean square long."""
    errors = [pair.residual()[pair.upright] for pair in pairs]
    flat = np.concatenate(errors).reshape(-1, 3 * len(JOINTS))
    flat = flat[is_finite(flat)]
    variance, axes = np.linalg.eigh(flat.T @ flat / len(flat))
    largest = np.argsort(variance)[::-1][:_MODES]
    return (axes[:, largest] * np.sqrt(variance[largest])).T.reshape(_MODES, len(JOINTS), 3)


def fit(train: Iterable[LiftedTake], val: Iterable[LiftedTake], rectifier: Rectifier) -> JointNoise:
    """The modes of the lifter's errors in the train takes; what a frame's noise grows with in the val takes, a
    least-squares fit of the logarithms; each angle's own parts stay the shipped ones. InputError when no take can be
    levelled."""
    noise = replace(shipped_noise(), lifter=load_lifter().method, modes=modes_of(map(Pair.of, train)))
    rows = []
    for take in val:
        raw, spread = joints_of(take.lifted, take.seen.truth), stated_spread(take.lifted)
        frames = PersonFrames(raw, *rectifier.rotation(raw), take.seen.keypoints.times, spread=spread)
        level = level_static(frames)
        if why_not(level):
            continue
        pair = Pair.of(take)
        size = np.sqrt((pair.residual() ** 2).sum(axis=(1, 2)))
        heading = LiftErrors(level.error_deg, level.up_error_deg, noise).heading_deg
        row = np.log(np.stack([heading, limb_spread(pair.lifted), spread, size], axis=-1))
        rows.append(row[pair.upright & is_finite(row)])
    if not rows:
        raise InputError("nothing-usable", "Expected validation takes that can be levelled, got none.")
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


def learn(output: Path) -> None:
    """Write the noise that was learned. The lifter saw the train people, whom it lifts a sixth better than others; the
    sizes are of validation people, once with proportions that are drawn."""
    train, val = EvaluationSet("train", "train", known=True), EvaluationSet("val", "val")
    judged = chain(lifted(Configuration(), val), lifted(Configuration(seed=1, bodies=BodyRange()), val))
    noise = fit(lifted(Configuration(), train), judged, load_rectifier("pcnet"))
    write_text(output, noise.as_json())
    print(f"{output}: usual {noise.usual}, powers {noise.powers}")
