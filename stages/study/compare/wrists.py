"""Both wrists by every method beside motion capture: the 3DPCNet paper's wrist figure, with its numbers.

All in BODY (back, right, up), from the pelvis, unfiltered, at motion capture's size by one factor a take and method,
and over that size: the root mean square distance of the twelve limb joints from the pelvis, about half a metre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from ....models import load_rectifier
from ....pipeline.core.canonical import R_world_from_body
from ....pipeline.core.layouts import H36M17, LIMBS
from ....pipeline.core.rotations import is_finite, rotate, transpose
from ....pipeline.core.take import Take
from ....pipeline.plugins.protocols import Rectifier
from ...drawing.charts import Curve, busiest, over_time
from ...drawing.page import charts, figure
from ...drawing.words import spoken
from ..methods import each_frame, method_name, methods
from .figures import match
from .side import TRUTH, Side

WRISTS = ("r_wrist", "l_wrist")
AXES = ("back", "right", "up")
FLAT = "raw 2D"
_SHOWN_S = 12.0  # of a long take, where the wrist travels farthest
_MOVING = 0.02  # of the person's size, about a centimetre: standard deviation of a wrist that moves
_COLOURS = ("#9aa3ad", "#e69f00", "#56b4e9", "#009e73", "#d55e00", "#cc79a7")


@dataclass(frozen=True, eq=False)
class Wrists:
    """paths: by method and wrist (T, 3) at time_s (T,) of the run, NaN where unknown (of 2D all of back); motion
    capture is the first. size_m: what they were divided by. agreement: by method, wrist and axis
    "r", "rmse" and "rmse_mm"."""

    time_s: np.ndarray
    paths: dict[str, dict[str, np.ndarray]]
    size_m: float
    agreement: dict[str, dict[str, dict[str, dict[str, float]]]]


def wrists(side: Side, truth: np.ndarray, rectifiers: Sequence[Rectifier] = ()) -> Wrists:
    """side: a run. truth: (T, 17, 3) motion capture at its rows, relative to the pelvis, +z up. rectifiers: further
    ones to compare, as methods.each_frame has them."""
    assert side.run is not None
    body = rotate(transpose(R_world_from_body(truth)), truth)
    limbs = H36M17.indices(LIMBS)
    ways = {name: (joints[:, limbs], joints) for name, joints in _ways(side.run, rectifiers).items()}
    size = _size(body[:, limbs], body[:, limbs], (0, 1, 2))[0]
    paths = {TRUTH: {wrist: body[:, H36M17.index(wrist)] / size for wrist in WRISTS}}
    if (keypoints := limbs_of(side.run)) is not None:
        hips = [LIMBS.index("r_hip"), LIMBS.index("l_hip")]
        flat = keypoints - keypoints[:, hips].mean(axis=1, keepdims=True)
        # A camera taken as level, in front of a person who faces it: the image's left is the person's right.
        upright = np.stack([np.full(flat.shape[:2], np.nan), -flat[..., 0], -flat[..., 1]], axis=-1)
        # Of the height alone: how wide a person is seen depends on the view.
        tall = _size(upright, body[:, limbs], (2,))
        paths[FLAT] = {w: upright[:, LIMBS.index(w)] * (tall[1] / tall[0] / size) for w in WRISTS}
    for name, (of_limbs, joints) in ways.items():
        own, its = _size(of_limbs, body[:, limbs], (0, 1, 2))
        paths[name] = {wrist: joints[:, H36M17.index(wrist)] * (its / own / size) for wrist in WRISTS}
    agreement = {
        name: {wrist: _agreement(path, paths[TRUTH][wrist], size) for wrist, path in of.items()}
        for name, of in paths.items()
        if name != TRUTH
    }
    return Wrists(side.time_s, paths, size, agreement)


def has_wrists(truth: np.ndarray) -> bool:
    """Whether any frame of motion capture (T, 17, 3) has both wrists, and the shoulders, by which BODY is turned."""
    needed = H36M17.indices((*WRISTS, "r_shoulder", "l_shoulder"))
    return bool(np.isfinite(truth[:, needed]).all(axis=(1, 2)).any())


def _ways(run: Take, rectifiers: Sequence[Rectifier]) -> dict[str, np.ndarray]:
    """Joints (T, 17, 3) in BODY by method: the lifter's own axes, each rectifier per frame, and the take's one up."""
    poses, rectified = run.need("poses"), run.need("rectified")
    body, others = rectified.body.joints.astype(np.float64), each_frame(run, rectifiers)
    if rectified.in_world:
        return {"the source's own up": body}
    source, own = poses.joints.astype(np.float64), method_name(rectified)
    result = {"camera axes": methods(run)["camera axes"]}
    for name in ("geometric", own):
        if name in ("geometric", "pcnet"):
            chosen = load_rectifier(name)
            if name == "geometric" or chosen.method == rectified.method:
                R_camera_from_body, _ = chosen.rotation(source)
                result[f"{name} per frame"] = rotate(transpose(R_camera_from_body), source)
    return {**result, **others, f"{own}, take": body}


def _size(points: np.ndarray, others: np.ndarray, axes: tuple[int, ...]) -> tuple[float, float]:
    """Root mean square distances of points and others (T, N, 3) along these axes, where both are known."""
    both = is_finite(points[..., axes]) & is_finite(others[..., axes])
    return tuple(float(np.sqrt((x[..., axes][both] ** 2).sum(axis=-1).mean())) for x in (points, others))  # type: ignore[return-value]


def _agreement(path: np.ndarray, truth: np.ndarray, size: float) -> dict[str, dict[str, float]]:
    axes = {axis: match(path[:, i], truth[:, i], _MOVING) for i, axis in enumerate(AXES)}
    return {
        axis: {"r": of["r"], "rmse": of["rmse"], "rmse_mm": 1000 * size * of["rmse"]}
        for axis, of in axes.items()
        if of is not None
    }


def limbs_of(run: Take) -> np.ndarray | None:
    """(T, 12, 2) pixels of the run's 2D keypoints in the video frames of its poses; None where it has none of them."""
    keypoints = run.keypoints
    if keypoints is None or not set(LIMBS) <= set(keypoints.layout.joints):
        return None
    wanted = run.need("poses").frame_index
    rows = np.clip(np.searchsorted(keypoints.frame_index, wanted), 0, len(keypoints) - 1)
    limbs = keypoints.joints[rows][:, keypoints.layout.indices(LIMBS)].astype(np.float64)
    return np.where((keypoints.frame_index[rows] == wanted)[:, None, None], limbs, np.nan)


def wrist_charts(found: Wrists, wrist: str, times: np.ndarray) -> Markup:
    """HTML of one wrist: back, right and up over times (T,), motion capture and every method."""
    moved = np.linalg.norm(np.diff(found.paths[TRUTH][wrist], axis=0, prepend=np.nan), axis=-1)
    rows = busiest(moved, found.time_s, _SHOWN_S)
    shown = []
    for i, axis in enumerate(AXES):
        curves = [
            Curve(name, of[wrist][rows, i], **_look(found, name))
            for name, of in found.paths.items()
            if np.isfinite(of[wrist][rows, i]).any()
        ]
        title = f"{spoken(wrist).capitalize()}: {'xyz'[i]}, {axis}"
        shown.append(figure([over_time(curves, times[rows], f"{title} over time")], title))
    return charts(shown)


def _look(found: Wrists, name: str) -> dict[str, Any]:
    """Colour and width of a method's curve."""
    names = list(found.paths)
    if name == TRUTH:
        return {"width": 2.4}
    return {
        "colour": _COLOURS[(names.index(name) - 1) % len(_COLOURS)],
        "width": 1.6 if name == names[-1] else 1.0,
    }
