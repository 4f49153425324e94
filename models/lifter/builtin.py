"""2D keypoints become a 3D skeleton, of a whole take or while the camera runs: the run time of the lifter, numpy and
onnxruntime only.

The network is convolutional in time, so a long take is lifted in chunks that overlap by the network's reach on each
side; the result equals the one-pass result and has no seam.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...pipeline.core.blocks import overlapping
from ...pipeline.core.conversions import remap
from ...pipeline.core.device import Placement, placement
from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import CAMERA, IMAGE
from ...pipeline.core.layouts import H36M17, Layout
from ...pipeline.core.lifted import Lifted, ToLift
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite, rotate, unit
from ..common.onnx import OnnxFile, open_onnx
from . import SHIPPED
from .features import ASSUMED_FOCAL, HALF_WINDOW, features
from .keypoints import (
    averaged,
    checked_size,
    clock_of,
    lacking,
    long_gaps,
    on_grid,
    rate_of,
    refuse_two_people,
)

KIND = "pcnet3d"
CHUNK = 1024  # frames answered at a time; half as many take half the memory, and a tenth longer
_ROWS = 8192  # that are made ready at a time
_SETTLED = 10  # rows that tell the usual interval of a live camera; a stream may begin with a burst


def lifted(asked: ToLift, model: str | Path = "pcnet3d") -> Lifted:
    """One person's 2D keypoints lifted to 3D. model: "pcnet3d", the shipped one, or a file.

    asked: keypoints in IMAGE, pixels, in any layout; missing joints NaN. An unknown focal length is taken for the
    longer image side. up: where that is known within a few degrees: then a lean away from the camera is told from a
    camera that looks down. The lift jumps between frames in which it is NaN and others.
    -> joints (T, 17, 3) in CAMERA axes relative to the pelvis, unit arbitrary, about the metres of a person 1.7 m
    tall. The confidence is the keypoints', the covariance the one that the network states. Frames in a run of more than
    half a second without any joint are NaN. Joints that are missing for a moment are put on a line between where they
    were seen, others are filled in from the rest of the body. Takes of other frame rates than 20 to 60 per second are
    lifted at one that the network knows (keypoints.clock_of); without time stamps they count as 30.
    Raises InputError for another frame, normalised coordinates, an unusable image size, or keypoints that jump between
    two people.
    """
    keypoints, up = remap(asked.keypoints, H36M17), asked.up
    size = checked_size(replace(asked, keypoints=keypoints))
    focal = float(asked.focal_px) if asked.focal_px is not None else ASSUMED_FOCAL * float(size.max())
    pixels, confidence, rows = on_grid(keypoints)
    rate = rate_of(keypoints, rows)
    refuse_two_people(pixels, rate)
    visible = is_finite(pixels)
    unseen = long_gaps(np.any(visible, axis=1), rate)[rows]
    clock = clock_of(rate, rows)
    pixels, confidence = clock.rows(pixels, confidence)
    places = rows * clock.finer
    ups = _ups_at(up, places, len(pixels))
    margin = reach(model) + HALF_WINDOW  # the features' averages, beyond what an answer rests on
    answers = []
    for phases in clock.phases:
        joints, covariance = np.empty((*pixels.shape[:2], 3)), np.empty((*pixels.shape[:2], 3, 3), np.float32)
        for phase in range(min(phases, len(pixels))):
            part = slice(phase, None, phases)
            rows_of_phase = pixels[part], confidence[part], ups[part]
            for kept, around, inside in overlapping(len(rows_of_phase[0]), _ROWS, margin):
                pixels_around, trust, up_around = (each[around] for each in rows_of_phase)
                x, R_camera_from_ray = features(pixels_around, trust, size, np.asarray(focal), up_around)
                R_camera_from_ray = R_camera_from_ray[inside]
                answer, sd = (each[inside] for each in run(x, model))
                joints[part][kept] = rotate(R_camera_from_ray, answer.astype(np.float64))
                covariance[part][kept] = _covariance(sd, R_camera_from_ray)
        both = [averaged(each, phases) for each in (joints, covariance)]
        answers.append(both if len(places) == len(pixels) else [each[places] for each in both])
        del joints, covariance, both
    joints, covariance = (
        each[0] if len(each) == 1 else np.mean(each, axis=0) for each in zip(*answers, strict=True)
    )
    del answers
    joints[unseen], covariance[unseen] = np.nan, np.nan
    covariance.setflags(write=False)  # or it would be copied
    on_a_line = is_finite(pixels)[places] & ~visible[rows] & ~unseen[:, None]
    frame = CAMERA.with_(origin="pelvis", unit="arbitrary")
    return Lifted(
        keypoints.with_(joints=joints, covariance=covariance, frame=frame),
        model=OwnLifter(str(model)).method,
        kind=KIND,
        focal_px=focal,
        focal_known=asked.focal_known,
        up_known=up is not None,
        frames_without_joints=int(unseen.sum()),
        joints_on_a_line=int(on_a_line.sum()),
    )


def _ups_at(up: np.ndarray | None, places: np.ndarray, count: int) -> np.ndarray:
    """(count, 3) the up (3,), or (T, 3) at these places (T,), NaN where it is not known; between two places at which it
    is, what lies between them."""
    ups = np.full((count, 3), np.nan)
    if up is not None:
        up = np.broadcast_to(up, (len(places), 3))
        between = np.stack([np.interp(np.arange(count), places, axis) for axis in up.T], axis=-1)
        ups = unit(between)
        ups[places] = up
    return ups


def run(x: np.ndarray, model: str | Path = "pcnet3d", chunk: int = CHUNK) -> tuple[np.ndarray, np.ndarray]:
    """The network's answer to features x (T, CHANNELS), in overlapping chunks: joints (T, 17, 3) in the ray frame, and
    their standard deviations (T, 17, 2) across the ray (of one axis) and along it, in the same unit."""
    opened = network(model)
    parts = []
    for _, around, inside in overlapping(len(x), chunk, reach(model)):
        answer = opened.session.run(["joints", "sd"], {"features": x[None, around]})
        parts.append([each[0, inside] for each in answer])
    joints, sd = (np.concatenate(each) for each in zip(*parts, strict=True))
    return joints, sd


def _covariance(sd: np.ndarray, R_camera_from_ray: np.ndarray) -> np.ndarray:
    """(T, 17, 3, 3) in CAMERA axes of standard deviations (T, 17, 2) across and along the ray."""
    along = R_camera_from_ray[:, None, :, 2, None] * R_camera_from_ray[:, None, None, :, 2]
    across, depth = np.moveaxis(sd.astype(np.float64) ** 2, -1, 0)[..., None, None]
    covariance = (across * np.eye(3) + (depth - across) * along).astype(np.float32)
    covariance[:, H36M17.index("pelvis")] = 0  # what the joints are counted from
    return covariance


def network(model: str | Path = "pcnet3d") -> OnnxFile:
    """The built-in lifter or that of a file; InputError when there is none, or it is something else."""
    return _open(str(model), placement())


def reach(model: str | Path = "pcnet3d") -> int:
    """Frames on each side that a frame's answer depends on."""
    return int(network(model).stated["reach"])


@lru_cache(maxsize=8)
def _open(model: str, where: Placement) -> OnnxFile:
    opened = open_onnx(SHIPPED if model == "pcnet3d" else model, "a lifter")
    if not {"reach", "trained_on"} <= opened.stated.keys():
        raise InputError(
            "wrong-network",
            f"Expected a lifter that was trained with pcnet3d, got {opened.path}; lift with that network's own program "
            "and give its poses with --poses, or give a function in Python (docs/python.md).",
        )
    return opened


def close_networks() -> None:
    """Give back what open ones take, some 100 MB; who asks again opens them again, in a fifth of a second."""
    _open.cache_clear()


@dataclass(frozen=True)
class OwnLifter:
    """The built-in lifter, or a file of one trained here, as a pipeline.plugins.protocols.Lifter."""

    model: str = "pcnet3d"

    unit = "arbitrary"
    takes = ("gaps", "up", "guessed focal")

    @property
    def method(self) -> str:
        return f"{Path(self.model).name}@{network(self.model).digest}"

    def lift(self, asked: ToLift) -> Lifted:
        """As the protocol says."""
        return lifted(asked, self.model)


class LiveLifter:
    """Lifts the newest frame from it and the frames before; it waits for none.

    The answer is the one that `lifted` gives for the last frame of all so far, at up to 45 frames a second. In a
    finished take it is better, because the frames after it are used too.
    """

    def __init__(
        self,
        layout: Layout,
        image_size: tuple[int, int],
        focal_px: float | None = None,
        up: np.ndarray | None = None,
    ) -> None:
        """layout: of the keypoints that will come. image_size: width and height in pixels. focal_px, up: as in
        ToLift."""
        self._layout, self._up = layout, up
        self._size = np.asarray(image_size, dtype=float)
        self._focal = np.asarray(ASSUMED_FOCAL * self._size.max() if focal_px is None else focal_px)
        self._reach = reach()
        window = self._reach + HALF_WINDOW + 1  # at up to 45 frames a second no answer rests on more
        self._pixels = np.full((window, len(H36M17), 2), np.nan)
        self._confidence = np.full((window, len(H36M17)), np.nan)
        self._time_s = np.full(window, np.nan)
        self._count = 0

    def update(self, xy: np.ndarray, score: np.ndarray, time_s: float | None = None) -> np.ndarray:
        """xy: (J, 2) pixels, NaN where missing. score: (J,) in [0, 1]. time_s: of the frame, later than that before;
        without it frames count as coming 30 times a second.

        -> (17, 3), H36M17 in CAMERA axes relative to the pelvis, unit arbitrary; NaN for a frame without a joint.
        """
        keypoints = remap(PoseSequence(xy[None], self._layout, IMAGE, confidence=score[None]), H36M17)
        if time_s is not None:
            self._push_lacking(time_s)
        self._push(keypoints.joints[0], keypoints.confidence[0], np.nan if time_s is None else time_s)
        if not is_finite(keypoints.joints).any():
            return np.full((len(H36M17), 3), np.nan)
        clock = clock_of(self._rate())
        last = slice(-min(self._count, len(self._pixels) // clock.finer + 1), None)
        pixels, confidence = clock.rows(self._pixels[last], self._confidence[last])
        # Of several phases the newest frame's own: the means over the others' ends would be of the past.
        answers = [
            self._answer(pixels[::-phases][::-1], confidence[::-phases][::-1]) for phases in clock.phases
        ]
        return np.mean(answers, axis=0)

    def _answer(self, pixels: np.ndarray, confidence: np.ndarray) -> np.ndarray:
        up = None if self._up is None else np.broadcast_to(self._up, (len(pixels), 3))
        x, R_camera_from_ray = features(pixels, confidence, self._size, self._focal, up)
        # Rows further back serve the averages of the features alone. Nothing is kept from frame to frame: each new
        # frame changes these averages, and with them the network's input in the last HALF_WINDOW rows.
        answer = run(x[-self._reach - 1 :])[0][-1]
        return rotate(R_camera_from_ray[-1], answer.astype(np.float64))

    def _push(self, xy: np.ndarray | float, score: np.ndarray | float, time_s: float) -> None:
        for kept, new in (self._pixels, xy), (self._confidence, score), (self._time_s, time_s):
            kept[:-1] = kept[1:].copy()
            kept[-1] = new
        self._count = min(self._count + 1, len(self._pixels))

    def _push_lacking(self, time_s: float) -> None:
        """Rows without a joint for images that the camera lost before this time."""
        times = np.append(self._times(), time_s)
        if len(times) > _SETTLED:
            lost = int(lacking(times, np.arange(len(times)))[-1])
            # No further apart than others are, for a pause has fewer rows than it took images.
            apart_s = min(float(np.median(np.diff(times))), (time_s - times[-2]) / (lost + 1))
            for row in range(lost, 0, -1):
                self._push(np.nan, np.nan, time_s - row * apart_s)

    def _rate(self) -> float | None:
        """Rows a second, None where that is unknown."""
        steps = np.diff(self._times())
        usual = float(np.median(steps)) if len(steps) else 0.0
        return 1 / usual if usual > 0 else None

    def _times(self) -> np.ndarray:
        """(N,) of the rows so far."""
        return self._time_s[len(self._time_s) - self._count :]
