"""Rectifiers against the truth of motion capture: the paper's figures, tilt, and how well each knows its own error.

Sets: clean joints of people that no network saw, from the paper's views and from cameras that are really pitched and
rolled; and lifted takes. Lying frames in rows of their own. Every rectifier gets the same frames.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.messages import how_many
from ....pipeline.core.pose import package_version
from ....pipeline.core.rotations import angle_deg, geodesic_deg, rotate, transpose
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.reading.mocap import Clip, read_mocap
from ...common.metrics import Figure, joint_error, procrustes_error, scaled, sorting
from ..mocap.clips import lying, read_parts, subject_of
from ..synthetic.views import Targets, View, seen, views
from .people import pooled
from .sets import EvaluationSet, Question
from .tables import Page, Table

PAGE = Page(
    "Rectifiers",
    "{about}. Cells of three numbers are p50 / mean / p95; brackets hold 90 % of the means over people drawn anew.",
    [
        Table(
            "",
            "rectifiers/*/rows/*",
            ["rectifier", "set"],
            {
                "frames": "{frames:,}", "rotation, deg": "{rotation}", "tilt, deg": "{tilt}", "MPJPE, mm": "{mpjpe}",
                "mean rotation by person": "{by person[rotation][said]}", "mean MPJPE": "{by person[mpjpe][said]}",
                "PA-MPJPE, mm": "{pa_mpjpe.mean:.1f}", "Frobenius 'deg'": "{frobenius.mean:.1f}",
                "expected, mean": "{expected.mean:.1f}", "Spearman": "{spearman:.2f}",
            },
        )
    ],
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Take:
    """One take to be rectified. joints: (T, 17, 3), CAMERA axes relative to the pelvis. truth: the same without the
    lifter's errors, metres. R: (T, 3, 3) true R_camera_from_body. lying: (T,). person: as a split calls them."""

    joints: np.ndarray
    truth: np.ndarray
    R: np.ndarray
    lying: np.ndarray
    person: str = ""

    def some(self, rows: np.ndarray | slice) -> Take:
        """The take with some of its frames: a mask (T,), or a slice."""
        return Take(self.joints[rows], self.truth[rows], self.R[rows], self.lying[rows], self.person)


@dataclass(frozen=True, eq=False)
class Judged:
    """What a rectifier did to the frames of a set; arrays (N,), NaN where it gave no answer.

    rotation, tilt: degrees. mpjpe, pa_mpjpe: mm, canonical joints against the true ones, the scale of a lift brought
    to the truth's frame by frame; unscaled: as they come, which means something of joints in metres only. frobenius:
    |R - R'| x 180 / pi, which the paper's published code calls degrees. expected: error_deg. person: whose the frame
    is.
    """

    rotation: np.ndarray
    tilt: np.ndarray
    mpjpe: np.ndarray
    unscaled: np.ndarray
    pa_mpjpe: np.ndarray
    frobenius: np.ndarray
    expected: np.ndarray
    person: np.ndarray

    def row(self, use: np.ndarray) -> dict[str, Any]:
        """Figures over the frames of a mask (N,)."""
        figures: dict[str, Any] = {
            "frames": int(use.sum()),
            "no answer": int(np.isnan(self.rotation[use]).sum()),
        }
        for name in ("rotation", "tilt", "mpjpe", "unscaled", "pa_mpjpe", "frobenius", "expected"):
            figures[name] = Figure.of(getattr(self, name)[use])
        figures["by person"] = {
            name: pooled(getattr(self, name)[use], self.person[use]) for name in ("rotation", "mpjpe")
        }
        figures["spearman"] = sorting(self.expected[use], self.rotation[use])
        return figures


def judge(rectifier: Rectifier, takes: Iterable[Take]) -> Judged:
    """Run a rectifier take by take."""
    parts = []
    for take in takes:
        R, expected = rectifier.rotation(take.joints)
        parts.append(compare(take, R, expected, rotate(transpose(R), take.joints.astype(np.float64))))
    return together(parts)


def together(parts: Sequence[Judged]) -> Judged:
    """All frames of several takes as those of one."""
    return Judged(
        **{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Judged)}
    )


def compare(take: Take, R: np.ndarray, expected: np.ndarray, canonical: np.ndarray) -> Judged:
    """One take's answers against the truth: R_camera_from_body (T, 3, 3), error_deg (T,) and the pose in BODY
    (T, 17, 3), which is R^T x unless something corrected it."""
    truth = rotate(transpose(take.R), take.truth)
    fitted = scaled(canonical, truth)
    answered = np.isfinite(R).all(axis=(1, 2))
    pa = np.full(len(R), np.nan)
    pa[answered] = procrustes_error(canonical[answered], truth[answered])
    return Judged(
        rotation=geodesic_deg(R, take.R),
        tilt=angle_deg(R[..., 2], take.R[..., 2]),
        mpjpe=1000 * joint_error(fitted, truth),
        unscaled=1000 * joint_error(canonical, truth),
        pa_mpjpe=1000 * pa,
        frobenius=np.degrees(np.linalg.norm(R - take.R, axis=(1, 2))),
        expected=expected,
        person=np.full(len(R), take.person),
    )


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


def lifted(question: Question, of: EvaluationSet) -> list[Take]:
    """The test bed's takes, frames without a lift or a heading left out."""
    takes = []
    for take in question.takes(of):
        seen_, joints = take.seen, take.lifted.joints
        finite = np.isfinite(np.concatenate([joints, seen_.R_camera_from_body], axis=1))
        fine = np.asarray(finite.all(axis=(1, 2)))
        if fine.any():
            whole = Take(joints, seen_.truth, seen_.R_camera_from_body, seen_.lying, subject_of(seen_.clip))
            takes.append(whole.some(fine))
    return takes


def tables(
    question: Question, data: Path | None = None, split: Path | None = None, targets: Targets = "body"
) -> dict[str, Any]:
    """{"rectifiers": {method: {"rows": {set: Judged.row's figures}}}} of the people that the shipped networks never
    saw, lifted and clean; or of the test people of a file of clips, of everybody without a split, clean alone."""
    kinds: dict[str, dict[str, Callable[[], list[Take]]]]
    if data is None:
        kinds = {
            one.label: {
                "lifted": partial(lifted, question, one),
                **_clean(one.clips(), question.seed, targets),
            }
            for one in question.sets
        }
        return {**question.heading(), "rectifiers": _judged(question.rectifiers, kinds)}
    clips = read_parts(data, split, ["test"]).clips["test"] if split else read_mocap(data)
    subjects = sorted({clip.subject for clip in clips})
    about = f"pcnet3d {package_version()}, {data}, {how_many(len(subjects), 'subject')}, targets {targets}"
    kinds = {f"{data.name}, {'test' if split else 'everybody'}": _clean(clips, question.seed, targets)}
    return {"about": about, "subjects": subjects, "rectifiers": _judged(question.rectifiers, kinds)}


def _clean(clips: Sequence[Clip], seed: int, targets: Targets) -> dict[str, Callable[[], list[Take]]]:
    kinds: dict[str, View] = {"clean, paper's views": "paper", "clean, wide views": "wide"}
    return {kind: partial(clean_takes, clips, view, seed, targets) for kind, view in kinds.items()}


def _judged(
    rectifiers: Sequence[Rectifier], sets: dict[str, dict[str, Callable[[], list[Take]]]]
) -> dict[str, Any]:
    """{method: {"rows": {set: Judged.row's figures}}}."""
    results: dict[str, Any] = {rectifier.method: {"rows": {}} for rectifier in rectifiers}
    for label, kinds in sets.items():
        for kind, make in kinds.items():
            takes = make()
            lies = np.concatenate([take.lying for take in takes])
            for rectifier in rectifiers:
                judged = judge(rectifier, takes)
                for pose, use in (("upright", ~lies), ("lying", lies)):
                    results[rectifier.method]["rows"][f"{label}, {kind}, {pose}"] = judged.row(use)
    return results
