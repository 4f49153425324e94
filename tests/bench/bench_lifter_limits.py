"""What stands between the lifter and the truth: unseen people, the keypoints' errors, the unknown focal length.

    python tests/bench/bench_lifter_limits.py [seed]

Upright frames of wild views: all validation takes, and every sixth take that the lifter was trained on. MPJPE in mm
with one scale a frame, and its parts along the ray and across it (means over joints).
"""

from __future__ import annotations

import sys
import zlib

import numpy as np

from pcnet3d.models.common.metrics import scaled
from pcnet3d.models.lab.evaluation.testbed import lifted_takes
from pcnet3d.models.lab.mocap.clips import Subjects
from pcnet3d.models.lab.synthetic.keypoint_noise import EXACT_KEYPOINTS, Noise
from pcnet3d.pipeline.core.rotations import rotate, transpose
from pcnet3d.pipeline.reading.mocap.clip import Clip

HALF = Noise(std=Noise().std / 2)
KEYPOINTS = {"as detectors see them": None, "half the error": HALF, "exact": EXACT_KEYPOINTS}


def one_in_six(clip: Clip) -> bool:
    return zlib.crc32(clip.name.encode()) % 6 == 0


def errors(subjects: Subjects, seed: int, noise: Noise | None, focal_known: bool) -> np.ndarray:
    """(3,) mm: MPJPE, along the ray, across it."""
    train = subjects == "train"
    frames = []
    for take in lifted_takes(
        subjects,
        seed,
        noise=noise,
        focal_known=focal_known,
        trained_on=train,
        only=one_in_six if train else None,
    ):
        lifted, truth = take.lifted.joints.astype(np.float64), take.seen.truth
        judged = np.isfinite(lifted).all((1, 2)) & ~take.seen.lying
        off = scaled(lifted[judged], truth[judged]) - truth[judged]
        along = rotate(transpose(take.seen.R_camera_from_ray[judged]), off)
        parts = [np.linalg.norm(off, axis=-1), np.abs(along[..., 2]), np.linalg.norm(along[..., :2], axis=-1)]
        frames.append(np.stack([part.mean(-1) for part in parts], axis=-1))
    return 1000 * np.concatenate(frames).mean(0)


def main() -> None:
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    print("people, keypoints, focal length: MPJPE (along the ray, across it), mm")
    parts: tuple[Subjects, ...] = ("val", "train")
    for subjects in parts:
        for words, noise in KEYPOINTS.items():
            for known in (False, True):
                whole, along, across = errors(subjects, seed, noise, known)
                focal = "known" if known else "unknown"
                print(f"{subjects}, {words}, {focal}: {whole:.1f} ({along:.1f}, {across:.1f})", flush=True)


if __name__ == "__main__":
    main()
