"""What a finished run knows of the joints, by every method that is compared with an IMU."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...models import load_rectifier
from ...models.gravity import Seen, level_moving, level_static
from ...pipeline.core.errors import InputError
from ...pipeline.core.rotations import is_finite, rotate, transpose
from ...pipeline.files.arrays import load_all
from ...pipeline.files.atomic import SUMMARY

# A camera taken as level: LEVEL's back, right and up in CAMERA axes for a person who faces it (design.md section 4).
_R_CAMERA_FROM_UPRIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])


@dataclass(frozen=True, eq=False)
class Run:
    """What a comparison needs of a run's folder.

    source, level: (T, 17, 3) relative to the pelvis. root: (T, 3) the pelvis in LEVEL, NaN where the source does not
    know its place.
    R_source_from_level: (3, 3) or (T, 3, 3). up_votes: (T, 3).
    time_s, frame_index: (T,). seams: rows no derivative crosses. camera, level_heading: as of Rectified.
    """

    name: str
    source: np.ndarray
    level: np.ndarray
    root: np.ndarray
    R_source_from_level: np.ndarray
    up_votes: np.ndarray
    error_deg: np.ndarray
    time_s: np.ndarray
    frame_index: np.ndarray
    seams: tuple[int, ...]
    method: str
    camera: str
    level_heading: str
    metric: bool
    level_ok: bool


def load_run(folder: Path) -> Run:
    """The run in a folder; InputError when there is none that finished."""
    try:
        summary: dict[str, Any] = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
        arrays = load_all(folder / "poses.npz")
        rectification = summary["rectification"]
        step = np.diff(arrays["frame_index"])
        jumps = np.flatnonzero(step > np.median(step)) + 1 if len(step) else []
        return Run(
            name=str(summary["take"]),
            source=arrays["source"].astype(np.float64),
            level=arrays["level"].astype(np.float64),
            root=np.where(np.isfinite(arrays["root_sd"]), np.nan, arrays["root"].astype(np.float64)),
            R_source_from_level=arrays["R_source_from_level"],
            up_votes=arrays["up_votes"],
            error_deg=arrays["error_deg"],
            time_s=arrays["time_s"],
            frame_index=arrays["frame_index"],
            seams=tuple(sorted({*summary["poses"]["seams"], *map(int, jumps)})),
            method=str(rectification["method"]).partition("@")[0],
            camera=str(rectification["camera"]),
            level_heading=str(rectification["level_heading"]),
            metric=str(arrays["unit"]) == "m",
            level_ok=bool(rectification["level_ok"]),
        )
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        raise InputError(
            f"Expected the folder of a finished `pcnet3d run` (poses.npz and {SUMMARY} of this version) at {folder}; "
            "run it again."
        ) from None


def methods(run: Run) -> dict[str, np.ndarray]:
    """Joints (T, 17, 3) by method, relative to the pelvis, each with its own idea of up as +z.

    "camera axes": as if the camera were level. "geometric" and the run's own method: rotated as a take; with "per
    frame", each frame upright by its own vote on up, as without the take. Its heading stays the take's, so that only
    tilt tells them apart. The run's own comes last.
    """
    if run.camera == "gravity":
        return {"source's own up": run.level}
    R_geometric, unknown = load_rectifier("geometric").rotation(run.source)
    seen = Seen(run.source, R_geometric, unknown, run.time_s, run.seams)
    levelled = level_moving(seen) if run.camera == "moving" else level_static(seen)
    ways = {
        "geometric": (levelled.R_camera_from_level, R_geometric[..., 2]),
        run.method: (run.R_source_from_level, run.up_votes),
    }
    result = {"camera axes": rotate(transpose(_R_CAMERA_FROM_UPRIGHT), run.source)}
    for name, (R_source_from_level, votes) in ways.items():
        level = rotate(transpose(R_source_from_level), run.source)
        own_up = rotate(transpose(R_source_from_level), votes[:, None])[:, 0]
        result |= {f"{name} per frame": rotate(_upright(own_up), level), name: level}
    return result


def _upright(up: np.ndarray) -> np.ndarray:
    """(T, 3, 3) the least rotations that turn directions up (T, 3) to +z; NaN for NaN."""
    from scipy.spatial.transform import Rotation

    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    angle = np.arctan2(sine, up[:, 2:])
    rows = is_finite(up)
    R = np.full((len(up), 3, 3), np.nan)
    R[rows] = Rotation.from_rotvec((axis * angle / np.maximum(sine, 1e-12))[rows]).as_matrix()
    return R
