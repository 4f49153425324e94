"""Rectifiers on real lifters' output: consistency, not error, since nobody knows the truth.

Two lifters of one video should show one body, and a camera that stands still has one `up`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..pipeline.frames import CAMERA
from ..pipeline.layouts import BLAZEPOSE33, H36M17, Layout, remap
from ..pipeline.pose import PoseSequence
from ..pipeline.rotations import angle_deg, geodesic_deg, kabsch, rotate, transpose, unit
from ..pipeline.sockets import Rectifier
from .metrics import Figure, relative
from .mocap import data_folder

# clip, array in its file, the lifter's name and layout; the cameras stand still
_LIFTED: tuple[tuple[str, str, str, Layout], ...] = (
    ("boxing", "motionbert", "MotionBERT", H36M17),
    ("boxing", "blazepose_world", "BlazePose", BLAZEPOSE33),
    ("walk_crop", "blazepose_world", "BlazePose", BLAZEPOSE33),
    ("demo_man", "blazepose_world", "BlazePose", BLAZEPOSE33),
    ("mhformer_skating", "run_a", "MHFormer", H36M17),
)


def real_poses() -> Iterator[tuple[str, str, np.ndarray]]:
    """(clip, lifter, joints (T, 17, 3) in CAMERA axes relative to the pelvis, the lifter's unit)."""
    for clip, array, lifter, layout in _LIFTED:
        with np.load(data_folder() / "lifter" / f"{clip}.npz", allow_pickle=False) as file:
            poses = remap(PoseSequence(file[array], layout, CAMERA.with_(unit="arbitrary")))
        yield clip.removeprefix("mhformer_"), lifter, relative(poses.joints.astype(np.float64))


def consistency(rectifiers: Sequence[Rectifier]) -> dict[str, Any]:
    """{"apart": {axes: Figure}, "up": {"clip, lifter": {method: Figure}}}, degrees over frames.

    apart: MotionBERT's body against BlazePose's on boxing, before ("camera axes") and after each rectifier; the
        rotation that brings one closest to the other. up: between a frame's up and the take's mean of them.
    """
    takes = {(clip, lifter): joints for clip, lifter, joints in real_poses()}
    pair = [takes["boxing", lifter] for lifter in ("MotionBERT", "BlazePose")]
    apart = {"camera axes": Figure.of(_apart(*pair))}
    up: dict[str, dict[str, Figure]] = {}
    for rectifier in rectifiers:
        R = {key: rectifier.rotation(joints)[0] for key, joints in takes.items()}
        bodies = [
            rotate(transpose(R["boxing", lifter]), takes["boxing", lifter])
            for lifter in ("MotionBERT", "BlazePose")
        ]
        apart[rectifier.method] = Figure.of(_apart(*bodies))
        for (clip, lifter), rotations in R.items():
            up.setdefault(f"{clip}, {lifter}", {})[rectifier.method] = Figure.of(
                spread_deg(rotations[..., 2])
            )
    return {"apart": apart, "up": up}


def spread_deg(up: np.ndarray) -> np.ndarray:
    """(T,) degrees between each unit vector of up (T, 3) and their mean; NaN frames stay NaN."""
    return angle_deg(up, np.broadcast_to(unit(np.nanmean(up, axis=0)), up.shape))


def as_markdown(results: dict[str, Any]) -> str:
    lines = ["## Real clips: how far rectified bodies are apart, and how steady up is", ""]
    lines += [
        "Degrees over frames, p50 / mean / p95.",
        "",
        "| MotionBERT against BlazePose on boxing | apart |",
    ]
    lines += ["| --- | --- |", *(f"| {axes} | {figure} |" for axes, figure in results["apart"].items()), ""]
    methods = list(next(iter(results["up"].values())))
    lines += [
        f"| up against the take's mean up | {' | '.join(methods)} |",
        "| --- |" + " --- |" * len(methods),
    ]
    lines += [
        f"| {name} | {' | '.join(str(f) for f in row.values())} |" for name, row in results["up"].items()
    ]
    return "\n".join(lines) + "\n"


def _apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(T,) degrees between two skeletons of the same frames; NaN where a joint of either is missing."""
    seen = np.isfinite(a).all(axis=(1, 2)) & np.isfinite(b).all(axis=(1, 2))
    out = np.full(len(a), np.nan)
    out[seen] = geodesic_deg(kabsch(a[seen], b[seen]), np.eye(3))
    return out
