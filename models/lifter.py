"""2D keypoints become a 3D skeleton: the run time of the lifter, numpy and onnxruntime only.

The network is convolutional in time, so a long take is lifted in chunks that overlap by the network's reach on each
side; the result equals the one-pass result and has no seam.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.errors import InputError
from ..pipeline.frames import CAMERA, IMAGE, require
from ..pipeline.layouts import H36M17
from ..pipeline.pose import PoseSequence
from ..pipeline.rotations import known, rotate
from .lifter_features import ASSUMED_FOCAL, features, flipped

CHUNK = 1024  # frames answered at a time
_GAP_FRAMES = 15  # without any joint for longer than this, frames are missing in 3D too
_JUMP = 0.8  # of the body's longer side from one frame to the next: no person moves like that
_MIN_JUMPS = 4  # scene cuts may explain fewer
_MIN_JOINTS = 4  # seen in both frames, to call it the whole body
_MAX_OUTSIDE = 0.5  # of the joints: detectors guess a few beyond the border, never most
_NORMALISED = 4.0  # no picture is this few pixels wide


def lift(
    keypoints: PoseSequence,
    image_size: tuple[int, int] | None,
    focal_px: float | None = None,
    flip: bool = False,
    model: str | Path = "pcnet3d",
) -> PoseSequence:
    """Lift one person's 2D keypoints to 3D.

    keypoints: H36M17 (remap first) in IMAGE, pixels; missing joints NaN. image_size: width and height in pixels.
    focal_px: focal length in pixels; unknown, it is taken for the longer image side. flip: average with the lift
    of the mirrored person, twice the time and a little better. model: "pcnet3d", the shipped one, or a file.
    -> joints (T, 17, 3) in CAMERA axes relative to the pelvis, unit arbitrary, about the metres of a person 1.7 m
    tall. The confidence is the keypoints'. Frames in a run of more than 15 without any joint are NaN; the history
    counts them. Single missing joints are filled in from the others. Trained on 20 to 60 frames per second.
    Raises InputError for another layout or frame, normalised coordinates, an unusable image size, or keypoints
    that jump between two people.
    """
    size = _checked(keypoints, image_size, focal_px)
    focal = float(focal_px) if focal_px is not None else ASSUMED_FOCAL * size.max()
    pixels, confidence, rows = _on_grid(keypoints)
    _refuse_two_people(pixels)
    x, R_camera_from_ray = features(pixels, confidence, size, np.asarray(focal))
    joints = run(x, model)
    if flip:
        mirrored = run(flipped(x), model)[:, H36M17.mirror] * np.array([-1, 1, 1], dtype=np.float32)
        joints = (joints + mirrored) / 2
    joints = rotate(R_camera_from_ray, joints.astype(np.float64))
    unseen = _long_gaps(np.any(known(pixels), axis=1))
    joints = np.where(unseen[:, None, None], np.nan, joints)[rows]
    return keypoints.with_(joints=joints, frame=CAMERA.with_(origin="pelvis", unit="arbitrary")).noted(
        "lift",
        model=f"{Path(model).name}@{network(model).digest}",
        focal_px=round(focal, 1),
        focal_known=focal_px is not None,
        flip=flip,
        frames_without_joints=int(unseen[rows].sum()),
    )


def run(x: np.ndarray, model: str | Path = "pcnet3d", chunk: int = CHUNK) -> np.ndarray:
    """The network's answer (T, 17, 3) in the ray frame to features x (T, CHANNELS), in overlapping chunks."""
    opened = network(model)
    parts = []
    for start in range(0, len(x), chunk):
        first, last = max(start - opened.reach, 0), min(start + chunk + opened.reach, len(x))
        (answer,) = opened.session.run(["joints"], {"features": x[None, first:last]})
        parts.append(answer[0, start - first : start - first + min(chunk, len(x) - start)])
    return np.concatenate(parts)


@dataclass(frozen=True)
class Network:
    """A lifter's file, opened. digest: the first 12 digits of its SHA-256. reach: frames on each side that a
    frame's answer depends on. trained_on: mocap.Subjects."""

    session: Any
    digest: str
    reach: int
    trained_on: str


def network(model: str | Path = "pcnet3d") -> Network:
    """The built-in lifter or that of a file; InputError when there is none, or it is something else."""
    return _open(str(model))


@cache
def _open(model: str) -> Network:
    import onnxruntime

    path = files("pcnet3d.models").joinpath("lifter.onnx") if model == "pcnet3d" else Path(model)
    if not path.is_file():
        raise InputError(
            f"Expected a lifter's .onnx file at {path}, found nothing there; 'pcnet3d' is built in."
        )
    try:
        content = path.read_bytes()
        session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
        stated = session.get_modelmeta().custom_metadata_map
    except Exception as error:  # onnxruntime's errors have no common class but Exception
        raise InputError(f"Expected a lifter's .onnx file at {path}: {str(error).splitlines()[0]}.") from None
    if not {"reach", "trained_on"} <= stated.keys():
        raise InputError(
            f"{path} is not a lifter of pcnet3d: it does not state its reach and training subjects."
        )
    digest = hashlib.sha256(content).hexdigest()[:12]
    return Network(session, digest, int(stated["reach"]), stated["trained_on"])


def _checked(
    keypoints: PoseSequence, image_size: tuple[int, int] | None, focal_px: float | None
) -> np.ndarray:
    if keypoints.layout.joints != H36M17.joints:
        raise InputError(
            f"Expected keypoints in {H36M17.name} to lift, got {keypoints.layout.name}; remap them first."
        )
    require(keypoints.frame, IMAGE, "The lifter")
    if keypoints.frame.unit != "px":
        raise InputError(f"The lifter needs keypoints in pixels, got them in {keypoints.frame}.")
    if image_size is None:
        raise InputError(
            "The lifter needs the picture's width and height in pixels; give the video or --image-size."
        )
    size = np.asarray(image_size, dtype=float)
    if size.shape != (2,) or not np.isfinite(size).all() or (size < 2).any():
        raise InputError(
            f"Expected an image size of two numbers of pixels, width and height; got {image_size}."
        )
    if focal_px is not None and not 0.1 * size.max() < focal_px < 20 * size.max():
        raise InputError(
            f"Expected a focal length in pixels, near the picture's longer side of {size.max():.0f}; got {focal_px:g}."
        )
    coordinates = keypoints.joints[np.isfinite(keypoints.joints)]
    if len(coordinates) == 0:
        raise InputError("Expected keypoints to lift, but every joint of every frame is missing.")
    if np.abs(coordinates).max() <= _NORMALISED:
        raise InputError(
            "Expected keypoints in pixels, but none is beyond "
            f"{np.abs(coordinates).max():.2f}: they look normalised; multiply them back to pixels first."
        )
    shown = keypoints.joints[known(keypoints.joints)]
    outside = ((shown < 0) | (shown > size)).any(axis=-1).mean()
    if outside > _MAX_OUTSIDE:
        raise InputError(
            f"Expected keypoints inside a picture of {size[0]:.0f} x {size[1]:.0f} pixels, but {100 * outside:.0f} % "
            "lie outside it; give the size of the picture that they were detected in."
        )
    return size


def _long_gaps(seen: np.ndarray) -> np.ndarray:
    """(T,) True in runs of more than _GAP_FRAMES frames that are not seen."""
    gaps = np.zeros(len(seen), dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[True], seen, [True]]).astype(int)))
    for start, end in edges.reshape(-1, 2):
        gaps[start:end] = end - start > _GAP_FRAMES
    return gaps


def _on_grid(keypoints: PoseSequence) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints (N, 17, 2) and confidence (N, 17) of evenly spaced frames, NaN for those that are no row; and the
    rows' places among them. A detector's file often leaves out the frames in which it found nobody."""
    frame = keypoints.frame_index - keypoints.frame_index[0]
    step = max(int(np.gcd.reduce(frame)), 1)
    rows = frame // step
    joints = np.full((rows[-1] + 1, len(H36M17), 2), np.nan)
    confidence = np.full(joints.shape[:2], np.nan)
    joints[rows] = keypoints.joints
    confidence[rows] = keypoints.confidence
    return joints, confidence, rows


def _refuse_two_people(joints: np.ndarray) -> None:
    """InputError when the whole body lands somewhere else from one frame to the next, again and again."""
    there = known(joints)
    low, high = (np.where(there[..., None], joints, fill) for fill in (np.inf, -np.inf))
    side = (high.max(axis=1) - low.min(axis=1)).max(axis=-1)
    both = there[1:] & there[:-1]
    usable = np.flatnonzero(both.sum(axis=1) >= _MIN_JOINTS)
    step = np.where(both[..., None], np.diff(joints, axis=0), np.nan)[usable]
    moved = np.linalg.norm(np.nanmedian(step, axis=1), axis=-1) if len(usable) else np.zeros(0)
    jumps = int((moved > _JUMP * np.maximum(side[usable + 1], side[usable])).sum())
    if jumps >= _MIN_JUMPS:
        raise InputError(
            f"Expected the keypoints of one person, but the whole body jumps to another place {jumps} times: two "
            "people look mixed; choose one (--person), or lift each on their own."
        )
