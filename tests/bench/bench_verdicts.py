"""Whether verdicts on poses follow their error:

    python tests/bench/bench_verdicts.py [takes]

Takes of validation subjects as the built-in lifter has them, and the same made worse: depth of 0.3 to 1.0 times its
size, and errors of up to 12 % of the trunk that change from frame to frame and drift. Of each verdict: how many takes,
and the share whose joints err by over 100 mm (mean of the take, at the scale that fits best).
"""

from __future__ import annotations

import sys
from itertools import islice

import numpy as np

from pcnet3d.models.lab.evaluation.testbed import lifted_takes
from pcnet3d.pipeline import PoseSequence
from pcnet3d.pipeline.core.notices import verdict
from pcnet3d.pipeline.signals.findings import findings_of

_LIMIT_MM = 100.0


def worse(poses: PoseSequence, rng: np.random.Generator) -> PoseSequence:
    """As a bad lifter would have them."""
    joints = poses.joints.astype(np.float64)
    trunk = np.nanmean(np.linalg.norm(poses.joint("thorax") - poses.joint("pelvis"), axis=-1))
    sd = rng.uniform(0, 0.12) * trunk
    joints[..., 2] *= rng.uniform(0.3, 1.0)
    joints += sd * (np.cumsum(rng.normal(0, 1 / 16, joints.shape), axis=0) + rng.normal(0, 1, joints.shape))
    return poses.with_(joints=joints - joints[:, :1])


def error_mm(poses: PoseSequence, truth: np.ndarray) -> float:
    """Mean over joints and frames at the best scale. truth: (T, 17, 3) metres."""
    known = np.isfinite(poses.joints).all(axis=-1) & np.isfinite(truth).all(axis=-1)
    a, b = poses.joints[known].astype(np.float64), truth[known]
    return float(1000 * np.linalg.norm((a * b).sum() / (a * a).sum() * a - b, axis=-1).mean())


if __name__ == "__main__":
    rng = np.random.default_rng(0)
    found: list[tuple[str, str, float]] = []
    for take in islice(lifted_takes("val"), int(sys.argv[1]) if len(sys.argv) > 1 else None):
        for lifter, poses in (("built-in", take.lifted), ("worse", worse(take.lifted, rng))):
            found.append((lifter, verdict(findings_of(poses)), error_mm(poses, take.seen.truth)))
    print("lifter    verdict     takes  over 100 mm")
    for lifter in ("built-in", "worse"):
        for word in ("good", "suspicious", "unusable"):
            errors = np.array([mm for who, said, mm in found if (who, said) == (lifter, word)])
            share = f"{100 * np.mean(errors > _LIMIT_MM):.0f} %" if len(errors) else "-"
            print(f"{lifter:9} {word:11} {len(errors):5}  {share}")
