"""How well the pelvis's path before the camera is known, where the truth is:  pcnet3d evaluate place -o DIR

Every take is seen by one camera that stands still and lifted; the body is scaled as `--stature` would scale it, or, to
tell the error of that scale from the rest, to its true size. Then the man of the real take (real_take.py), by each of
its cameras and the keypoints that OpenPose found; his pelvis is taken for the middle of his hips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Camera
from ....pipeline.core.frames import scaled_covariance
from ....pipeline.core.intrinsics import Intrinsics, undistorted
from ....pipeline.core.layouts import H36M17, remap
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import is_finite, unit
from ....pipeline.files.video_frames import shown_size
from ....pipeline.reading.take import read_video
from ...common.metrics import SD_90, Figure, scaled
from ...place.path import PelvisPath, pelvis_path
from .real_data import LIMBS, openpose_keypoints, read_moving
from .sets import Question
from .tables import Page, Table
from .testbed import LiftedTake, SeenTake

_SPAN_S = 1.0  # over which walking speed is taken
KNOWN, SIZED, ASSUMED = _CASES = ("focal known", "focal known, body of its true size", "focal assumed")

PAGE = Page(
    "Places",
    "; one camera per take, standing still.",
    [
        Table(
            "",
            "places/*/*",
            ["set", "case"],
            {
                "takes (not placed)": "{takes} ({not placed})",
                "frames (not placed)": "{frames:,} ({frames not placed:,})",
                **{name: f"{{{name}:.3f}}" for name in ("path", "still", "along", "across")},
                "inside": "{inside_along:.1%}, {inside_across:.1%}",
                "walks": "{walks}",
                "speed, %": "{speed_percent:.1f}",
                "speed, m/s": "{speed_mps:.3f}",
            },
            "Cells of three are p50 / mean / p95 over takes. Path: root mean square error in m; still: after the "
            "take's mean error is taken off; along and across the ray to the person. Inside: frames within the stated "
            "90 % band, along and across. Speed over the floor in spans of a second of walking.",
        ),
        Table(
            "",
            "real/*/*",
            ["camera", "case"],
            {"path": "{path:.2f}", "still": "{still:.2f}", "inside": "{inside_along:.0%}"},
            "The real take, keypoints by OpenPose: path and still in m, inside along the ray.",
        ),
    ],
)


@dataclass(frozen=True, eq=False)
class Judged:
    """One take. error: (T, 3) metres along the ray to the pelvis and, twice, across it; sd: (T, 3) what is stated.
    path: (T,) metres, and `still`: the same after the mean error is taken off. speed: found and true mean speed over
    the floor in m/s where the person walks, or None."""

    error: np.ndarray
    sd: np.ndarray
    path: np.ndarray
    still: np.ndarray
    speed: tuple[float, float] | None


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says, as nested dicts with Figures."""
    results: dict[str, Any] = {**question.heading(), "places": {}}
    for one in question.sets:
        judged: dict[str, list[Judged | None]] = {case: [] for case in _CASES}
        for take in question.takes(one, focal_known=True):
            for case in _CASES:
                judged[case].append(_judged(question, take, case))
        results["places"][one.label] = {case: figures(takes) for case, takes in judged.items()}
    results["real"] = real_places(question)
    return results


def real_places(question: Question) -> dict[str, dict[str, Any]]:
    """{camera: {case: figures}} of the real take: root mean square error in m, `still` after its mean is taken off, and
    the share of frames whose error along the ray lies within 1.645 stated standard deviations."""
    cameras, truth = read_moving()
    joints = np.full((len(truth.limbs), len(H36M17), 3), np.nan)
    joints[:, H36M17.indices(LIMBS)] = truth.limbs
    rows: dict[str, dict[str, Any]] = {}
    for name, camera in cameras.items():
        video = read_video(camera.video)
        size, times = shown_size(video), video.time_s[: len(joints)]
        (fx, fy), (cx, cy) = camera.focal_px.tolist(), camera.principal_point_px.tolist()
        lens = Intrinsics((fx, fy), (cx, cy), tuple(camera.distortion.tolist()), image_size=size)
        keypoints = openpose_keypoints(truth.openpose[name], times)
        guess = PRIOR_FOCAL * max(size)
        views = {
            KNOWN: Camera(size, lens.pinhole_focal_px, 0.0, "told", intrinsics=lens),
            ASSUMED: Camera(size, guess, guess * PRIOR_FOCAL_SPREAD, "prior"),
        }
        true = _hips(camera.to_camera(joints))
        rows[name] = {
            case: _real(question, remap(keypoints), view, implied_stature(joints), true)
            for case, view in views.items()
        }
    return rows


def _real(
    question: Question, found: PoseSequence, view: Camera, stature: float, true: np.ndarray
) -> dict[str, float]:
    """found: keypoints. true: (T, 3) the middle of the hips before the camera, metres."""
    pixels = found.joints if view.intrinsics is None else undistorted(found.joints, view.intrinsics)
    lifted = question.lift(found.with_(joints=pixels), view.image_size, view.focal_px)
    lifted = lifted.with_(joints=lifted.joints * (stature / implied_stature(lifted.joints)))
    path = pelvis_path(lifted, found, view)
    if path is None:
        return {}
    error, along = path.root + _hips(lifted.joints) - true, unit(true)
    off, sd = (
        (error * along).sum(axis=1),
        np.sqrt(np.einsum("ti,tij,tj->t", along, path.covariance, along)),
    )
    there = is_finite(error)
    return {
        "path": _rms(np.linalg.norm(error, axis=1)),
        "still": _rms(np.linalg.norm(error - np.nanmean(error, axis=0), axis=1)),
        "inside_along": float((np.abs(off[there]) <= SD_90 * sd[there]).mean()),
    }


def _hips(joints: np.ndarray) -> np.ndarray:
    """(T, 3) the middle of the hips of (T, 17, 3)."""
    return joints[:, H36M17.indices(("l_hip", "r_hip"))].mean(axis=1)


def _judged(question: Question, take: LiftedTake, case: str) -> Judged | None:
    seen, lifted = take.seen, take.lifted
    if case == ASSUMED:
        lifted = question.lift_seen(seen, camera_of(seen, case).focal_px)
    if case == SIZED:
        lifted = lifted.with_(joints=scaled(lifted.joints.astype(np.float64), seen.truth, "take"))
    else:
        lifted = by_stature(lifted, seen.truth)
    path = pelvis_path(lifted, seen.keypoints, camera_of(seen, case))
    return None if path is None else judge(path, seen)


def camera_of(seen: SeenTake, case: str) -> Camera:
    """The take's camera as it is known: by its focal length, or, ASSUMED, by what is usual."""
    width, height = seen.image_size
    focal_px, spread = seen.focal_px, 0.0
    if case == ASSUMED:
        focal_px, spread = PRIOR_FOCAL * max(width, height), PRIOR_FOCAL_SPREAD
    return Camera((width, height), focal_px, focal_px * spread, "told")


def by_stature(lifted: PoseSequence, truth: np.ndarray) -> PoseSequence:
    """The poses in metres as `--stature` would bring them there, by the stature of the truth (T, 17, 3)."""
    factor = implied_stature(truth) / implied_stature(lifted.joints)
    covariance = scaled_covariance(lifted.covariance, factor)
    return lifted.with_(joints=lifted.joints * factor, covariance=covariance)


def judge(path: PelvisPath, seen: SeenTake) -> Judged:
    """A path in metres against the truth."""
    truth = seen.joints_camera[:, H36M17.index("pelvis")]
    error = path.root - truth
    along = unit(truth)
    right = unit(np.cross(along, [0.0, 1.0, 0.0]))
    axes = np.stack([along, right, np.cross(right, along)], axis=1)
    return Judged(
        error=np.einsum("tij,tj->ti", axes, error),
        sd=np.sqrt(np.einsum("tij,tjk,tik->ti", axes, path.covariance, axes)),
        path=np.linalg.norm(error, axis=1),
        still=np.linalg.norm(error - np.nanmean(error, axis=0), axis=1),
        speed=_speed(path.root, truth, seen),
    )


def _speed(root: np.ndarray, truth: np.ndarray, seen: SeenTake) -> tuple[float, float] | None:
    """Mean speed over the true floor, of all spans of a second in which the person walks throughout."""
    frames = round(_SPAN_S * seen.keypoints.fps)
    walks = np.convolve(seen.motion["walking"] & is_finite(root), np.ones(frames + 1), "valid") > frames + 0.5
    if not walks.any():
        return None

    def speed(place: np.ndarray) -> float:
        way = place[frames:] - place[:-frames]
        way = way - (way @ seen.up)[:, None] * seen.up
        return float(np.linalg.norm(way[walks], axis=1).mean() / _SPAN_S)

    return speed(root), speed(truth)


def figures(takes: Sequence[Judged | None]) -> dict[str, Any]:
    """Of one set. path, still, along, across: root mean square of a take in metres, over takes. inside_along,
    inside_across: share of frames whose error lies within 1.645 stated standard deviations. speed: takes with walking,
    their errors in per cent and the mean one in m/s."""
    placed = [take for take in takes if take is not None and np.isfinite(take.path).any()]
    error, sd = (np.concatenate([getattr(take, what) for take in placed]) for what in ("error", "sd"))
    there = is_finite(error)
    inside = np.abs(error[there]) <= SD_90 * sd[there]
    speeds = np.array([take.speed for take in placed if take.speed is not None]).reshape(-1, 2)
    off = np.abs(speeds[:, 0] - speeds[:, 1])
    return {
        "takes": len(takes),
        "not placed": len(takes) - len(placed),
        "frames": len(there),
        "frames not placed": int((~there).sum()),
        "path": Figure.of(np.array([_rms(take.path) for take in placed])),
        "still": Figure.of(np.array([_rms(take.still) for take in placed])),
        "along": Figure.of(np.array([_rms(take.error[:, 0]) for take in placed])),
        "across": Figure.of(np.array([_rms(take.error[:, 1:]) for take in placed])),
        "inside_along": float(inside[:, 0].mean()),
        "inside_across": float(inside[:, 1:].mean()),
        "walks": len(speeds),
        "speed_percent": Figure.of(100 * off / speeds[:, 1]),
        "speed_mps": float(off.mean()) if len(off) else float("nan"),
    }


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
