"""The lifter and all that follows it on real videos with truth:  pcnet3d lab evaluate real-take -o DIR

A man who balances, seen by four calibrated cameras that stand still and lean: his limbs are known from all of them
together (triangulated), and so is which way is up. Every camera is judged by itself, focal length unknown, on three
kinds of 2D keypoints, without those that a run takes for not seen: found in the video, those that OpenPose found, and
the truth seen through the camera. Then the same man standing still, where only up is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....pipeline.core.camera import Look
from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17, LIMBS
from ....pipeline.core.messages import how_many
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import angle_deg, geodesic_deg, kabsch, rotate
from ....pipeline.core.take import Video
from ....pipeline.files.video_frames import shown_size
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.reading.load import read_video
from ....pipeline.signals.angles import FINE, near, of_both
from ...angle_error.take_angles import AngleSeries, TakeJoints, smoothed, take_angles
from ...common.canonical import R_world_from_body
from ...common.metrics import joint_error, procrustes_error, scaled
from ...common.spread import stated_spread
from ...gravity import Seen, known_up, level_static, why_not
from ...gravity.view import camera_of
from ...lifter.input import seen_only
from ...rectifier.load import load_rectifier
from ..mocap.clips import data_folder
from .people import mean
from .real_data import (
    STANDING,
    about_hips,
    exact_keypoints,
    found_keypoints,
    openpose_keypoints,
    read_cameras,
    read_moving,
    triangulated,
    whole_body,
)
from .runs import Question

_LIMB_ROWS = H36M17.indices(LIMBS)
_EXACT = "exact limbs"
_KEYPOINTS = ("video, skeletons alone", "OpenPose", _EXACT)
_FPS = 60.0  # of the take
_WITH_IMAGE = "video, with its image"  # its lines tell up and the focal length
_ALL = ", truth of all four cameras"
_LIFT_ANGLES = ("knee_flexion", "elbow_flexion")
_LEANS = ("trunk_lean_sagittal", "trunk_lean_frontal")
ABOUT = (
    "A man who balances, each of four cameras by itself, focal length unknown. Keypoints: found in the video alone, "
    "OpenPose's, or the true limbs as the camera sees them with OpenPose's face. truth: how far its joints (median, "
    "mm), angles and BODY's heading (root mean square, degrees) are from those that all four cameras together give; "
    "the truth left single cameras out of single joints. lift: mean distance of the 12 limb joints, mm, after the "
    "best rotation, shift and scale of every frame (pa) or, from the mid-hips, one rotation and scale for the take "
    "(rigid). level: up, degrees off and root mean square error stated, takes that are not refused, lean of the "
    "trunk. standing: the same man standing still."
)


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says. {"truth": truth_row's, "lift": {keypoints: {camera: row}}, "level": {"keypoints,
    method": {camera: row}}, "standing": {method: {camera: row}}}; the rows are lift_row's and level_row's, the last of
    each the mean over cameras. InputError where the data is not."""
    results: dict[str, Any] = {
        **question.heading(), "rectifiers": [r.method for r in question.rectifiers],
        "lift": {}, "level": {}, "standing": {},
    }  # fmt: skip
    cameras, truth = read_moving()
    of_all = triangulated(cameras, truth.openpose)
    results["truth"] = truth_row(of_all, truth.limbs, np.arange(len(of_all)) / _FPS)
    for name, camera in cameras.items():
        video = read_video(camera.video)
        if len(video.time_s) != len(truth.limbs):
            raise InputError(
                "files-apart",
                f"Expected {how_many(len(truth.limbs), 'frame')} in {camera.video}, as in truth.npz; "
                f"got {len(video.time_s)}.",
            )
        given = openpose_keypoints(truth.openpose[name], video.time_s)
        sources = (found_keypoints(video), given, exact_keypoints(camera, truth.limbs, given))
        lifts: dict[str, tuple[Look | None, PoseSequence]] = {
            kind: (None, _alone(question, video, keypoints))
            for kind, keypoints in zip(_KEYPOINTS, sources, strict=True)
        }
        lifts[_WITH_IMAGE] = _with_image(question, video, sources[0])
        for kind, (look, poses) in lifts.items():
            limbs = truth.limbs[poses.frame_index]
            results["lift"].setdefault(kind, {})[name] = lift_row(poses, limbs)
            if kind != _EXACT:
                row = lift_row(poses, of_all[poses.frame_index])
                results["lift"].setdefault(kind + _ALL, {})[name] = row
            for rectifier in question.rectifiers:
                rows = results["level"].setdefault(f"{kind}, {rectifier.method}", {})
                rows[name] = level_row(rectifier, poses, camera.up, limbs, look)
    for name, camera in read_cameras(data_folder() / "real" / STANDING).items():
        video = read_video(camera.video)
        keypoints = found_keypoints(video)
        poses = _alone(question, video, keypoints)
        look, with_image = _with_image(question, video, keypoints)
        for rectifier in question.rectifiers:
            rows = results["standing"].setdefault(rectifier.method, {})
            rows[name] = level_row(rectifier, poses, camera.up)
            rows = results["standing"].setdefault(f"{rectifier.method}, with the image", {})
            rows[name] = level_row(rectifier, with_image, camera.up, look=look)
    for table in (results["lift"], results["level"], results["standing"]):
        for rows in table.values():
            rows["mean"] = mean_row(list(rows.values()))
    return results


def _alone(question: Question, video: Video, keypoints: PoseSequence) -> PoseSequence:
    """The lift of keypoints alone, without those that a run takes for not seen."""
    return question.lift(seen_only(keypoints, shown_size(video)), shown_size(video))


def _with_image(
    question: Question, video: Video, keypoints: PoseSequence
) -> tuple[Look | None, PoseSequence]:
    """What the video's images say about up, and the lift with the focal length and the up that they tell, as a run does
    it."""
    camera = camera_of(video, keypoints, (int(keypoints.frame_index[0]), int(keypoints.frame_index[-1])))
    look = camera.looks[0] if camera.looks else None
    given = seen_only(keypoints, shown_size(video)), shown_size(video), camera.focal_px
    poses = question.lift(*given)
    up = known_up(poses, load_rectifier("pcnet"), look=look)
    return look, poses if up is None else question.lift(*given, up)


def lift_row(poses: PoseSequence, limbs: np.ndarray) -> dict[str, Any]:
    """A lift against true limbs (T, 12, 3), whichever way is up. pa_mm: mean distance of the 12 joints after the best
    rotation, shift and scale of every frame. rigid_mm: both relative to the mid-hips, after the best rotation and scale
    for the take. Then RMSE and MAE in degrees of _LIFT_ANGLES."""
    lifted = poses.joints[:, _LIMB_ROWS].astype(np.float64)
    one, other = about_hips(lifted), about_hips(limbs)
    R_world_from_camera = kabsch(other.reshape(-1, 3), one.reshape(-1, 3))
    fitted = scaled(rotate(R_world_from_camera, one), other, "take")
    found, true = (limb_angles(joints, None, poses.times) for joints in (lifted, limbs))
    return {
        "frames": len(limbs),
        "pa_mm": mean(1000 * procrustes_error(lifted, limbs)),
        "rigid_mm": mean(1000 * joint_error(fitted, other)),
        **angle_errors(found, true, _LIFT_ANGLES),
    }


def truth_row(limbs: np.ndarray, others: np.ndarray, time_s: np.ndarray) -> dict[str, float]:
    """How far two truths (T, 12, 3), world +Z up, are apart: each of LIMBS in mm, the median, and BODY's heading and
    every angle in degrees, root mean square, left and right together."""
    apart = 1000 * np.nanmedian(np.linalg.norm(limbs - others, axis=-1), axis=0)
    R, R_other = (R_world_from_body(whole_body(each)) for each in (limbs, others))
    found, true = (limb_angles(each, None, time_s) for each in (limbs, others))
    names = dict.fromkeys(of_both(name) for name in found)
    return {
        **dict(zip(LIMBS, apart.tolist(), strict=True)),
        "BODY's heading": mean(geodesic_deg(R, R_other) ** 2) ** 0.5,
        **{name: row["rmse"] for name, row in angle_errors(found, true, [*names]).items()},
    }


def level_row(
    rectifier: Rectifier,
    poses: PoseSequence,
    up: np.ndarray,
    limbs: np.ndarray | None = None,
    look: Look | None = None,
) -> dict[str, Any]:
    """One gravity for the take against the true up (3,), and the trunk's lean against true limbs (T, 12, 3) where they
    are known. look: what the image says about up.

    levelled: 1 unless the take is refused. up_deg: how far its up is off; stated_deg: root mean square error that was
    stated. Then RMSE and MAE in degrees of _LEANS, of a refused take too.
    """
    joints = poses.joints.astype(np.float64)
    level = level_static(
        Seen(joints, *rectifier.rotation(poses.joints), poses.times, spread=stated_spread(poses)), look=look
    )
    ups = level.R_camera_from_body[..., 2]
    row: dict[str, Any] = {
        "frames": len(poses),
        "levelled": float(not why_not(level)),
        "up_deg": mean(angle_deg(ups, np.broadcast_to(up, ups.shape))),
        "stated_deg": mean(level.up_error_deg),
    }
    if limbs is None:
        return row
    found = limb_angles(joints[:, _LIMB_ROWS], level.R_camera_from_body, poses.times)
    return {**row, **angle_errors(found, limb_angles(limbs, None, poses.times), _LEANS)}


def limb_angles(
    limbs: np.ndarray, R_source_from_body: np.ndarray | None, time_s: np.ndarray
) -> dict[str, AngleSeries]:
    """pipeline.signals.angles of joints LIMBS (T, 12, 3) alone, low-passed as in every other evaluation: pelvis and
    thorax are the middles of hips and shoulders, so that both sides of a comparison mean the same by them. Without
    rotations (T, 3, 3) the joints' own +Z is taken for up."""
    whole = whole_body(limbs)
    R = R_world_from_body(whole) if R_source_from_body is None else R_source_from_body
    return take_angles(TakeJoints(whole, smoothed(whole, time_s), R))


def angle_errors(
    found: dict[str, AngleSeries], true: dict[str, AngleSeries], names: Sequence[str]
) -> dict[str, dict[str, float]]:
    """{angle: {"rmse", "mae"}} in degrees over frames in which both sides are defined, left and right together."""
    errors = {}
    for name in names:
        keys = [key for key in (name, f"r_{name}", f"l_{name}") if key in found]
        off = [near(found[key].value_deg - true[key].value_deg, 0.0) for key in keys]
        fine = [(found[key].reason == FINE) & (true[key].reason == FINE) for key in keys]
        error = np.concatenate(off)[np.concatenate(fine)]
        errors[name] = {"rmse": mean(error**2) ** 0.5, "mae": mean(np.abs(error))}
    return errors


def mean_row(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Rows with the same keys as one, the mean of each number."""
    return {
        key: mean_row([row[key] for row in rows])
        if isinstance(value, dict)
        else mean(np.array([row[key] for row in rows], dtype=np.float64))
        for key, value in rows[0].items()
    }
