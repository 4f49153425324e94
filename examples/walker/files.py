"""The files that a user would have of the walker's take: a video, AlphaPose's 2D keypoints, MotionBERT's 3D poses."""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.files.atomic import whole_file, write_text
from .camera import Camera, camera_poses
from .image import images
from .landmarks import halpe26
from .walk import Walk

UNDETECTED = (41, 42, 130, 197)  # video frames in which the example's detector finds nobody
_CLIP = 243  # frames MotionBERT lifts at a time
_SMOOTH_S = 0.1  # how long an estimator's error lasts


@dataclass(frozen=True)
class ExampleFiles:
    video: Path
    keypoints: Path
    poses: Path

    @classmethod
    def of(cls, folder: Path) -> ExampleFiles:
        """Where they are in that folder."""
        return cls(folder / "walker.mp4", folder / "alphapose-results.json", folder / "X3D.npy")


def write_files(folder: Path, walk: Walk, camera: Camera) -> ExampleFiles:
    """Write walker.mp4, alphapose-results.json and X3D.npy into a folder, which is made if need be. Each coordinate
    has an error with a standard deviation of 1 pixel in the 2D file and 8 mm in the 3D file."""
    folder.mkdir(parents=True, exist_ok=True)
    files = ExampleFiles.of(folder)
    rng = np.random.default_rng(0)
    rows = np.setdiff1d(np.arange(len(walk)), UNDETECTED)
    write_video(files.video, walk, camera)
    write_keypoints(files.keypoints, walk, camera, rows, 1.0, rng)
    write_poses(files.poses, walk, camera, rows, 0.008, rng)
    return files


def write_keypoints(
    path: Path, walk: Walk, camera: Camera, rows: np.ndarray, noise_px: float, rng: np.random.Generator
) -> None:
    """AlphaPose's result list in the Halpe-26 layout for the video frames `rows` (formats.md section 5)."""
    points = camera.project(halpe26(walk))
    points = (points + _errors(points.shape, noise_px, walk.fps, rng))[rows]
    scores = np.clip(rng.normal(0.90, 0.04, points.shape[:2]), 0.3, 1.0)
    low, size = points.min(axis=1), np.ptp(points, axis=1)
    boxes = np.concatenate([low - 0.1 * size, 1.2 * size], axis=1)
    detections = [
        {
            "image_id": f"{row}.jpg",
            "category_id": 1,
            "keypoints": np.column_stack([joints, score]).ravel().round(3).tolist(),
            "score": round(float(3.3 * score.mean()), 4),  # of AlphaPose's own kind: it exceeds 1
            "box": box.round(2).tolist(),
            "idx": 1,
        }
        for row, joints, score, box in zip(rows, points, scores, boxes, strict=True)
    ]
    write_text(path, json.dumps(detections))


def write_poses(
    path: Path, walk: Walk, camera: Camera, rows: np.ndarray, noise_m: float, rng: np.random.Generator
) -> None:
    """MotionBERT's X3D.npy (formats.md 2), one row for each of the detected video frames `rows`.

    The unit is half the larger side of the box that holds all 2D joints of the take, and the person grows in it
    when coming nearer. The pelvis moves with the person in the image; its depth begins at 0 in every clip.
    """
    image = camera.project(walk.world)[rows]
    low, high = image.min(axis=(0, 1)), image.max(axis=(0, 1))
    unit_px = (high - low).max() / 2
    body = camera_poses(walk, camera).joints.astype(np.float64)
    body = (body + _errors(body.shape, noise_m, walk.fps, rng))[rows]
    depth_m = camera.points(walk.root[rows][:, None])[..., 2:]
    units_per_metre = camera.focal_px / depth_m / unit_px  # (T, 1, 1)
    pelvis = (image[:, [H36M17.index("pelvis")]] - (low + high) / 2) / unit_px
    starts = np.arange(len(rows)) // _CLIP * _CLIP  # of each row's clip
    depth = (depth_m - depth_m[starts]) * units_per_metre[starts]
    joints = body * units_per_metre + np.concatenate([pelvis, depth], axis=-1)
    joints[starts, H36M17.index("pelvis"), 2] = 0  # exactly, as the script sets it
    with whole_file(path) as partial, open(partial, "wb") as file:
        np.save(file, joints.astype(np.float32))


def write_video(path: Path, walk: Walk, camera: Camera) -> None:
    """An H.264 video of the take, without B-frames, so that frames are stored in the order they are shown in."""
    import av

    with whole_file(path) as partial, av.open(str(partial), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(walk.fps).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = camera.width, camera.height, "yuv420p"
        stream.options = {"crf": "21", "preset": "fast", "bf": "0"}
        for image in images(walk, camera):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode())


def _errors(shape: tuple[int, ...], sigma: float, fps: float, rng: np.random.Generator) -> np.ndarray:
    """(T, ...) errors of an estimator that sees several frames: mostly smooth in time, a third of it jitter."""
    from scipy.ndimage import gaussian_filter1d

    reach = _SMOOTH_S * fps
    smooth = gaussian_filter1d(rng.standard_normal(shape), reach, axis=0, mode="wrap")
    smooth *= np.sqrt(2 * np.sqrt(np.pi) * reach)  # back to unit variance
    return sigma * (np.sqrt(8 / 9) * smooth + np.sqrt(1 / 9) * rng.standard_normal(shape))
