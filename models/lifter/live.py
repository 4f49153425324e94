"""The lifter while the camera runs: one frame's 2D keypoints in, that frame's skeleton out."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.conversions import remap
from ...pipeline.core.frames import IMAGE
from ...pipeline.core.layouts import H36M17, Layout
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite, rotate
from .builtin import reach, run
from .features import ASSUMED_FOCAL, HALF_WINDOW, features
from .keypoints import clock_of, lacking

_SETTLED = 10  # rows that tell the usual interval; a stream may begin with a burst


class LiveLifter:
    """Lifts the newest frame from it and the frames before; it waits for none.

    The answer is the one that builtin.lifted gives for the last frame of all so far, at up to 45 frames a second. In a
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
