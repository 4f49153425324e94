"""The noise of noise2d beside that of real detectors:  pcnet3d noise

Prints the Markdown table that docs/lifter.md shows. Nobody knows the truth of the real clips, so what is compared
is what can be measured without it: jitter, how far two detectors are apart, confidences, and gaps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...pipeline.layouts import COCO17, H36M17, HALPE26
from ..mocap.clips import data_folder, read_clips
from ..synthetic.cameras import place
from ..synthetic.keypoint_noise import detect
from .real_clips import image_poses

CLASSES = {
    "hips, shoulders": ("l_hip", "r_hip", "l_shoulder", "r_shoulder"),
    "knees, elbows": ("l_knee", "r_knee", "l_elbow", "r_elbow"),
    "wrists, ankles": ("l_wrist", "r_wrist", "l_ankle", "r_ankle"),
}


@dataclass(frozen=True, eq=False)
class Statistics:
    """Shares of the box's longer side, in percent, by joint class; and confidences' 10, 50 and 90 % points.

    jitter: 1.48 x median |x(t-1) - 2 x(t) + x(t+1)| per coordinate, so motion and outliers hardly count.
    """

    jitter: tuple[float, ...]
    confidence: tuple[float, ...]


def statistics(keypoints: np.ndarray, confidence: np.ndarray) -> Statistics:
    """Of keypoints (T, 17, 2) pixels, H36M17, and confidence (T, 17)."""
    size = _box(keypoints)[1:-1, None, None]
    second = np.abs(np.diff(keypoints, 2, axis=0)) / size
    rows = [H36M17.indices(joints) for joints in CLASSES.values()]
    jitter = tuple(148 * float(np.nanmedian(second[:, row])) for row in rows)
    limbs = confidence[:, np.concatenate(rows)]
    limbs = limbs[np.isfinite(limbs) & (limbs > 0)]
    return Statistics(jitter, tuple(np.quantile(limbs, (0.1, 0.5, 0.9))) if len(limbs) else (np.nan,) * 3)


def disagreement(a: np.ndarray, b: np.ndarray) -> tuple[float, ...]:
    """Root mean square per coordinate of a - b (T, 17, 2) in percent of the box, by class, the worst 5 % left out."""
    apart = (a - b) / _box(a)[:, None, None]
    values = []
    for joints in CLASSES.values():
        part = apart[:, H36M17.indices(joints)]
        part = part - np.nanmedian(part, axis=0)  # two definitions of a joint are no noise
        squares = np.sort(part[np.isfinite(part)] ** 2)
        values.append(100 * float(np.sqrt(squares[: int(0.95 * len(squares))].mean())))
    return tuple(values)


def noise() -> None:
    """Compare the 2D noise with the real detectors' outputs in the data folder."""
    print(report())


def report() -> str:
    """A Markdown table, a line a detector and clip; two independent draws of our noise are its disagreement."""
    lines = [
        f"| keypoints | jitter %: {' / '.join(CLASSES)} | apart %: the same | confidence 10 / 50 / 90 % |",
        "| --- | --- | --- | --- |",
    ]
    real = dict(_real())
    ours, again = _ours(0), _ours(1)
    for name, (keypoints, confidence) in real.items():
        other = real["boxing MoveNet"][0] if name == "boxing AlphaPose" else None
        lines.append(_line(name, [(keypoints, confidence, other)]))
    lines.append(
        _line("this noise, CMU val", [(k, c, o) for (k, c), (o, _) in zip(ours, again, strict=True)])
    )
    lines.append(_line("exact projections, CMU val", [(k, c, None) for k, c in _ours(0, exact=True)]))
    return "\n".join(lines)


def _line(name: str, takes: list[tuple[np.ndarray, np.ndarray, np.ndarray | None]]) -> str:
    figures = [statistics(keypoints, confidence) for keypoints, confidence, _ in takes]
    jitter = np.mean([f.jitter for f in figures], axis=0)
    confidence = np.mean([f.confidence for f in figures], axis=0)
    apart = [disagreement(keypoints, other) for keypoints, _, other in takes if other is not None]
    return (
        f"| {name} | {' / '.join(f'{v:.2f}' for v in jitter)} | "
        f"{' / '.join(f'{v:.1f}' for v in np.mean(apart, axis=0)) if apart else ''} | "
        f"{' / '.join(f'{v:.2f}' for v in confidence) if np.isfinite(confidence).all() else 'none given'} |"
    )


def _real() -> Iterator[tuple[str, tuple[np.ndarray, np.ndarray]]]:
    folder = data_folder() / "lifter"
    for clip, array, detector, layout in (
        ("boxing", "alphapose_kp2d", "AlphaPose", HALPE26),
        ("boxing", "movenet_kp2d", "MoveNet", COCO17),
        ("walk_crop", "movenet_kp2d", "MoveNet", COCO17),
        ("demo_man", "movenet_kp2d", "MoveNet", COCO17),
        ("mhformer_skating", "run_a_kp2d", "HRNet", H36M17),
    ):
        with np.load(folder / f"{clip}.npz", allow_pickle=False) as file:
            poses = image_poses(file[array], layout)
        yield f"{clip.removeprefix('mhformer_')} {detector}", (poses.joints, poses.confidence)


def _ours(seed: int, exact: bool = False) -> list[tuple[np.ndarray, np.ndarray]]:
    """Keypoints of the val clips; the same cameras for every seed."""
    takes = []
    for number, clip in enumerate(read_clips("val")):
        world = clip.joints[None].astype(np.float64)
        cameras = place(world, np.random.default_rng([2, number]))
        joints = cameras.to_camera(world)
        pixels = cameras.project(joints)
        if exact:
            takes.append((pixels[0], np.full(pixels.shape[1:3], np.nan)))
        else:
            keypoints, confidence = detect(pixels, joints, np.random.default_rng([seed, number]))
            takes.append((keypoints[0], confidence[0]))
    return takes


def _box(keypoints: np.ndarray) -> np.ndarray:
    """(T,) the longer side of the box around the joints that are there; NaN in a frame without any."""
    low, high = (np.where(np.isnan(keypoints), fill, keypoints) for fill in (np.inf, -np.inf))
    side = (high.max(axis=1) - low.min(axis=1)).max(axis=-1)
    return np.where(side > 0, side, np.nan)
