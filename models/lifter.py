"""2D keypoints become a 3D skeleton: the run time of the lifter, numpy and onnxruntime only.

The network is convolutional in time, so a long take is lifted in chunks that overlap by more than the network's
reach; the result equals the one-pass result and has no seam.
"""

from __future__ import annotations

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
MARGIN = 128  # frames looked at on each side of them; at least the network's reach, which its file states
_REACH = "reach"  # key of the network file's metadata
_GAP_FRAMES = 15  # without any joint for longer than this, frames are missing in 3D too
_JUMP = 0.8  # of the body's longer side from one frame to the next: no person moves like that
_MIN_JUMPS = 4  # scene cuts may explain fewer
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
    tall. The confidence is the keypoints'. Frames in the middle of more than half a second without any joint are
    NaN; the history counts them. Single missing joints are filled in from the others.
    Raises InputError for another layout or frame, normalised coordinates, or an unusable image size.
    """
    size = _checked(keypoints, image_size, focal_px)
    focal = float(focal_px) if focal_px is not None else ASSUMED_FOCAL * size.max()
    x, R_camera_from_ray = features(
        keypoints.joints.astype(np.float64), keypoints.confidence, size, np.asarray(focal)
    )
    joints = run(x, model)
    if flip:
        mirrored = run(flipped(x), model)[:, H36M17.mirror] * np.array([-1, 1, 1], dtype=np.float32)
        joints = (joints + mirrored) / 2
    joints = rotate(R_camera_from_ray, joints.astype(np.float64))
    unseen = _long_gaps(known(keypoints.joints).any(axis=1))
    joints[unseen] = np.nan
    return keypoints.with_(joints=joints, frame=CAMERA.with_(origin="pelvis", unit="arbitrary")).noted(
        "lift",
        model=str(model),
        focal_px=round(focal, 1),
        focal_known=focal_px is not None,
        flip=flip,
        frames_without_joints=int(unseen.sum()),
    )


def run(x: np.ndarray, model: str | Path = "pcnet3d", chunk: int = CHUNK) -> np.ndarray:
    """The network's answer (T, 17, 3) in the ray frame to features x (T, CHANNELS), in overlapping chunks."""
    session = _session(str(model))
    parts = []
    for start in range(0, len(x), chunk):
        first, last = max(start - MARGIN, 0), min(start + chunk + MARGIN, len(x))
        (answer,) = session.run(["joints"], {"features": x[None, first:last]})
        parts.append(answer[0, start - first : start - first + min(chunk, len(x) - start)])
    return np.concatenate(parts)


@cache
def _session(model: str) -> Any:
    import onnxruntime

    path = files("pcnet3d.models").joinpath("lifter.onnx") if model == "pcnet3d" else Path(model)
    if not path.is_file():
        raise InputError(f"Expected a lifter's .onnx file at {path}, found nothing there; 'pcnet3d' is built in.")
    try:
        session = onnxruntime.InferenceSession(path.read_bytes(), providers=["CPUExecutionProvider"])
        reach = int(session.get_modelmeta().custom_metadata_map[_REACH])
    except KeyError:
        raise InputError(f"{path} is not a lifter of pcnet3d: it does not state its reach.") from None
    except Exception as error:  # onnxruntime's errors have no common class but Exception
        raise InputError(f"Expected a lifter's .onnx file at {path}: {str(error).splitlines()[0]}.") from None
    if reach > MARGIN:
        raise InputError(f"{path} looks {reach} frames to each side; at most {MARGIN} are supported.")
    return session


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
        raise InputError("The lifter needs the picture's width and height in pixels; give the video or --image-size.")
    size = np.asarray(image_size, dtype=float)
    if size.shape != (2,) or not np.isfinite(size).all() or (size < 2).any():
        raise InputError(f"Expected an image size of two numbers of pixels, width and height; got {image_size}.")
    if focal_px is not None and not 0.1 * size.max() < focal_px < 20 * size.max():
        raise InputError(
            f"Expected a focal length in pixels, near the picture's longer side of {size.max():.0f}; got {focal_px:g}."
        )
    jumps = _jumps(keypoints)
    if jumps >= _MIN_JUMPS:
        raise InputError(
            f"Expected the keypoints of one person, but the whole body jumps to another place {jumps} times: two "
            "people look mixed; choose one (--person), or lift each on their own."
        )
    coordinates = keypoints.joints[np.isfinite(keypoints.joints)]
    if len(coordinates) == 0:
        raise InputError("Expected keypoints to lift, but every joint of every frame is missing.")
    if np.abs(coordinates).max() <= _NORMALISED:
        raise InputError(
            "Expected keypoints in pixels, but none is beyond "
            f"{np.abs(coordinates).max():.2f}: they look normalised; multiply them back to pixels first."
        )
    return size


def _long_gaps(seen: np.ndarray) -> np.ndarray:
    """(T,) True in runs of more than _GAP_FRAMES frames that are not seen."""
    gaps = np.zeros(len(seen), dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[True], seen, [True]]).astype(int)))
    for start, end in edges.reshape(-1, 2):
        gaps[start:end] = end - start > _GAP_FRAMES
    return gaps


def _jumps(keypoints: PoseSequence) -> int:
    """How often the whole body lands somewhere else from one video frame to the next."""
    joints = keypoints.joints.astype(np.float64)
    seen = known(joints).sum(axis=1) >= 4
    next_to = (np.diff(keypoints.frame_index) == 1) & seen[1:] & seen[:-1]
    if not next_to.any():
        return 0
    low, high = (np.where(known(joints)[..., None], joints, fill) for fill in (np.inf, -np.inf))
    side = np.where(seen, (high.max(axis=1) - low.min(axis=1)).max(axis=-1), np.nan)
    step = np.diff(np.nan_to_num(joints, nan=0.0), axis=0)[next_to]
    both = (known(joints)[1:] & known(joints)[:-1])[next_to]
    moved = np.linalg.norm(np.nanmedian(np.where(both[..., None], step, np.nan), axis=1), axis=-1)
    return int((moved > _JUMP * np.fmax(side[1:], side[:-1])[next_to]).sum())
