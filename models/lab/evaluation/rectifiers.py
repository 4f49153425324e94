"""Rectifiers against the truth of motion capture: the paper's figures, tilt, and how well each knows its own error.

Sets: clean joints of people that no network saw, from the paper's views and from cameras that are really pitched and
rolled; and lifted takes. Lying frames in rows of their own. Every rectifier gets the same frames: p50 / mean / p95,
degrees and mm; by person: the mean over frames, in brackets 90 % of the means over people drawn anew. frobenius: what
the paper's published code calls degrees; expected: the stated error; spearman: how it sorts frames.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from ....pipeline.core.rotations import angle_deg, geodesic_deg, is_finite, rotate, transpose
from ....pipeline.plugins.protocols import Rectifier
from ...common.metrics import joint_error
from ..beds import Configuration, EvaluationSet, lifted
from ..cases import Cases, Row, column, figures, procrustes_error, scaled, sorting
from ..clips import Clip, lying, subject_of
from ..synthetic import Targets, View, seen, views


@dataclass(frozen=True, eq=False)
class Take:
    """One take to be rectified. joints: (T, 17, 3), CAMERA axes relative to the pelvis. truth: the same without the
    lifter's errors, metres. R: (T, 3, 3) true R_camera_from_body. lying: (T,). person: as a split calls them."""

    joints: np.ndarray
    truth: np.ndarray
    R: np.ndarray
    lying: np.ndarray
    person: str = ""

    def some(self, rows: np.ndarray) -> Take:
        """The take with the frames of a mask (T,) alone."""
        return Take(self.joints[rows], self.truth[rows], self.R[rows], self.lying[rows], self.person)


def judge(rectifier: Rectifier, takes: Iterable[Take]) -> list[Cases]:
    """Run a rectifier take by take."""
    judged = []
    for take in takes:
        R, expected = rectifier.rotation(take.joints)
        judged.append(compare(take, R, expected, rotate(transpose(R), take.joints.astype(np.float64))))
    return judged


def compare(take: Take, R: np.ndarray, expected: np.ndarray, canonical: np.ndarray) -> Cases:
    """One take's answers against the truth, the errors of every frame, NaN where there is no answer: R_camera_from_body
    (T, 3, 3), error_deg (T,) and the pose in BODY (T, 17, 3), which is R^T x unless something corrected it.

    rotation, tilt: degrees. mpjpe, pa_mpjpe: mm, canonical joints against the true ones, the scale of a lift brought
    to the truth's frame by frame; unscaled: as they come, which means something of joints in metres only. frobenius:
    |R - R'| x 180 / pi, which the paper's published code calls degrees. expected: error_deg.
    """
    truth = rotate(transpose(take.R), take.truth)
    fitted = scaled(canonical, truth)
    answered = np.isfinite(R).all(axis=(1, 2))
    pa = np.full(len(R), np.nan)
    pa[answered] = procrustes_error(canonical[answered], truth[answered])
    errors = {
        "rotation": geodesic_deg(R, take.R),
        "tilt": angle_deg(R[..., 2], take.R[..., 2]),
        "mpjpe": 1000 * joint_error(fitted, truth),
        "unscaled": 1000 * joint_error(canonical, truth),
        "pa_mpjpe": 1000 * pa,
        "frobenius": np.degrees(np.linalg.norm(R - take.R, axis=(1, 2))),
        "expected": expected,
    }
    return Cases(take.person, errors)


def summary(takes: Sequence[Cases]) -> dict[str, Any]:
    """Figures over the frames of takes as `compare` gives them."""
    rotation = column(takes, "rotation")
    return {
        "frames": len(rotation),
        "no answer": int(np.isnan(rotation).sum()),
        **figures(takes, ("rotation", "mpjpe")),
        "spearman": sorting(column(takes, "expected"), rotation),
    }


def clean_takes(clips: Iterable[Clip], view: View, seed: int = 0, targets: Targets = "body") -> list[Take]:
    """Every frame of the clips from its own random view; deterministic in the seed and the clip's name."""
    takes = []
    for clip in clips:
        rng = np.random.default_rng([seed, zlib.crc32(clip.name.encode())])
        R = views(view, rng, len(clip))
        joints, fine = seen(clip.joints, R, targets)
        if fine.any():
            takes.append(Take(joints, joints, R, lying(clip.joints), subject_of(clip.name)).some(fine))
    return takes


def rows(asked: Configuration) -> Iterator[Row]:
    """("rectifiers", method, "rows", set): `compare` of the frames of people that the shipped networks never saw,
    lifted and clean, upright and lying."""
    for people in asked.sets:
        takes_of = {
            "lifted": lifted_takes(asked, people),
            "clean, paper's views": clean_takes(people.clips(), "paper", asked.seed),
            "clean, wide views": clean_takes(people.clips(), "wide", asked.seed),
        }
        for (label, takes), rectifier in product(takes_of.items(), asked.rectifiers):
            for take, errors in zip(takes, judge(rectifier, takes), strict=True):
                for pose, lies in (("upright", False), ("lying", True)):
                    place = ("rectifiers", rectifier.method, "rows", f"{people.label}, {label}, {pose}")
                    yield place, errors.where(take.lying == lies)


def lifted_takes(asked: Configuration, of: EvaluationSet) -> list[Take]:
    """The test bed's takes, frames without a lift or a heading left out."""
    takes = []
    for take in lifted(asked, of):
        truth, joints = take.seen, take.lifted.joints
        whole = Take(joints, truth.truth, truth.R_camera_from_body, truth.lying, subject_of(truth.clip))
        fine = np.asarray(is_finite(joints).all(axis=1) & is_finite(whole.R).all(axis=1))
        if fine.any():
            takes.append(whole.some(fine))
    return takes
