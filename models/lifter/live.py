"""The lifter while the camera runs: one frame's 2D keypoints in, that frame's skeleton out."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...pipeline.frames import IMAGE
from ...pipeline.layouts import H36M17, Layout, remap
from ...pipeline.pose import PoseSequence
from ...pipeline.rotations import is_finite, rotate
from .builtin import network, run
from .clock import clock_of
from .features import ASSUMED_FOCAL, HALF_WINDOW, features


class LiveLifter:
    """Lifts the newest frame from what came before it; no frame is waited for.

    The answer is the one that lifter.lift gives for the last frame of all so far, at up to 90 frames a second. With
    frames on both sides, as in a finished take, it is better: of what a frame's answer rests on, the half that is still
    to come is missing.
    """

    def __init__(
        self,
        layout: Layout,
        image_size: tuple[int, int],
        focal_px: float | None = None,
        model: str | Path = "pcnet3d",
        up: np.ndarray | None = None,
    ) -> None:
        """layout: of the keypoints that will come. image_size: width and height in pixels. focal_px, model, up: as in
        lifter.lift."""
        self._layout, self._model, self._up = layout, model, up
        self._size = np.asarray(image_size, dtype=float)
        self._focal = np.asarray(ASSUMED_FOCAL * self._size.max() if focal_px is None else focal_px)
        window = network(model).reach + HALF_WINDOW + 1  # no answer rests on more
        self._pixels = np.full((window, len(H36M17), 2), np.nan)
        self._confidence = np.full((window, len(H36M17)), np.nan)
        self._time_s = np.full(window, np.nan)
        self._count = 0

    def update(self, xy: np.ndarray, score: np.ndarray, time_s: float | None = None) -> np.ndarray:
        """xy: (J, 2) pixels, NaN where missing. score: (J,) in [0, 1]. time_s: of the frame, later than that before;
        without it frames count as coming 30 times a second.

        -> (17, 3), H36M17 in CAMERA axes relative to the pelvis, unit arbitrary; NaN for a frame without a joint.
        """
        seen = remap(PoseSequence(xy[None], self._layout, IMAGE, confidence=score[None]), H36M17)
        now = np.nan if time_s is None else time_s
        newest = (self._pixels, seen.joints[0]), (self._confidence, seen.confidence[0]), (self._time_s, now)
        for kept, new in newest:
            kept[:-1] = kept[1:].copy()
            kept[-1] = new
        self._count = min(self._count + 1, len(self._pixels))
        if not is_finite(seen.joints).any():
            return np.full((len(H36M17), 3), np.nan)
        took = self._time_s[-1] - self._time_s[-self._count]
        clock = clock_of((self._count - 1) / took if took > 0 else None)
        last = slice(-min(self._count, len(self._pixels) // clock.finer + 1), None)
        pixels, confidence = clock.rows(self._pixels[last], self._confidence[last])
        # Of several phases the newest frame's own: the means over the others' ends would be of the past.
        pixels, confidence = (each[:: -clock.phases][::-1] for each in (pixels, confidence))
        up = None if self._up is None else np.broadcast_to(self._up, (len(pixels), 3))
        x, R_camera_from_ray = features(pixels, confidence, self._size, self._focal, up)
        return rotate(R_camera_from_ray[-1], run(x, self._model)[0][-1].astype(np.float64))
