"""Rectification while the camera runs: one frame in, its rotation out, and an up of all frames so far.

For a camera that stands still, as models.gravity.levelling.level_static is for a take that is complete. Causal:
nothing that was said is taken back. After a cut, or once the camera was moved, begin a new LiveRectifier.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import CAMERA
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.notices import Notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Check
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.reading.findings import doubts, guarded
from ..rectifier.load import load_rectifier
from .evidence import Evidence, TakeUp, fuse
from .levelling import HEADING_S, heading_error_deg, level_left, rotation_error_deg, standing
from .votes import of_votes, pool, trust

LOOK_S, _LOOK_ROWS = 3.0, 20  # of the first poses that are looked at: fewer tell nothing of left and right
KEPT = 256  # votes; beyond it every second one is dropped, and from then on only every second frame votes
_NEWS = 1 / 16  # of the votes kept, that must be new before all are pooled anew


@dataclass(frozen=True, eq=False)
class LiveFrame:
    """One frame, in the camera's axes.

    R_camera_from_body: (3, 3), with the up of all frames so far and this frame's heading, which lags behind a turn by
    HEADING_S; NaN with too few torso joints. error_deg: its expected error, NaN where the rectifier does not know.
    up: (3,), unit, NaN before the first vote. up_error_deg, up_bound_deg: root mean square and 90 % bound of its error.
    """

    R_camera_from_body: np.ndarray
    error_deg: float
    up: np.ndarray
    up_error_deg: float
    up_bound_deg: float


class LiveRectifier:
    """One person before a camera that stands still.

    The votes on up are kept, thinned out evenly over the time so far to at most KEPT, and pooled
    whenever a sixteenth of them is new: an early outlier loses its weight once the others are known, and similar frames
    count as few. A frame's cost and memory do not grow. The level line between the feet (votes.level_feet) is not
    used.

    notices: what is grave of what the poses of the first 3 seconds show, once these are over.
    """

    def __init__(
        self,
        rectifier: str | Rectifier = "pcnet",
        others: Sequence[Evidence] = (),
        check: Check = "refuse",
    ) -> None:
        """rectifier: a name or a file for load_rectifier, or a rectifier. others: what else knows up, such as
        evidence.direction("sensor", up, error_deg) of a phone that feels gravity. check: "off" does not look at the
        first poses."""
        self.notices: tuple[Notice, ...] = ()
        self._first: list[tuple[float, np.ndarray]] | None = [] if check == "refuse" else None
        self._rectifier = load_rectifier(rectifier) if isinstance(rectifier, str) else rectifier
        self._others = tuple(others)
        self._votes = np.full((KEPT, 5), np.nan)  # up, its error in degrees, seconds
        self._count = 0  # votes kept,
        self._seen = 0  # of so many frames with one,
        self._every = 1  # of which every so manyth is kept,
        self._new = 0  # and so many since they were pooled
        self._left = np.zeros(3)  # of the body, weighted mean over the last moments
        self._time_s = -np.inf
        self._up = self._pooled()

    def update(self, joints: np.ndarray, time_s: float) -> LiveFrame:
        """joints: (17, 3), H36M17 in CAMERA axes, any origin and scale, NaN where missing, as is the whole frame
        without a pelvis. time_s: later than the frame before.

        InputError for another shape, infinite coordinates, a time that does not increase, and, once, when the first 3
        seconds show a body that is mirrored or upside down, as of a file.
        """
        joints = np.asarray(joints, dtype=np.float64)
        if joints.shape != (len(H36M17), 3) or np.isinf(joints).any():
            raise InputError(
                "wrong-content",
                f"Expected one frame of joints ({len(H36M17)}, 3), finite or NaN, got shape {joints.shape}"
                f"{' with infinite coordinates' if np.isinf(joints).any() else ''}.",
            )
        if not self._time_s < time_s < np.inf:
            raise InputError(
                "times-broken",
                f"Expected a time later than the last frame's, {self._time_s:g} s, got {time_s:g} s; "
                "begin a new LiveRectifier for another take.",
            )
        relative = joints - joints[H36M17.index("pelvis")]
        R_frame, error_deg = (answer[0] for answer in self._rectifier.rotation(relative[None]))
        self._vote(R_frame[:, 2], error_deg, time_s)
        R = self._standing(R_frame, error_deg, time_s)
        self._time_s = time_s
        self._look(relative, time_s)
        error = rotation_error_deg(R, R_frame, heading_error_deg(error_deg), self._up.error_deg)
        return LiveFrame(R, float(error), self._up.up, float(self._up.error_deg), float(self._up.bound_deg))

    def _look(self, relative: np.ndarray, time_s: float) -> None:
        """At the first poses, all at once: `notices`, or InputError."""
        if self._first is None or not is_finite(relative).any():
            return
        self._first.append((time_s, relative))
        times = [time for time, _ in self._first]
        if len(times) < _LOOK_ROWS or times[-1] - times[0] < LOOK_S:
            return
        joints = np.stack([pose for _, pose in self._first])
        self._first = None
        poses = PoseSequence(joints, H36M17, CAMERA.with_(unit="arbitrary"), time_s=np.array(times))
        poses = guarded(poses, "refuse", f"The first {LOOK_S:.0f} seconds")
        self.notices = (*poses.notices, *doubts(poses))

    def _vote(self, up: np.ndarray, error_deg: float, time_s: float) -> None:
        if not is_finite(up):
            return
        self._seen += 1
        if (self._seen - 1) % self._every:
            return
        if self._count == KEPT:
            self._count //= 2
            self._every *= 2
            self._votes[: self._count] = self._votes[::2].copy()
        self._votes[self._count] = *up, error_deg, time_s
        self._count += 1
        self._new += 1
        if self._new >= _NEWS * self._count:
            self._new = 0
            self._up = self._pooled()

    def _pooled(self) -> TakeUp:
        votes = self._votes[: self._count]
        return fuse([*self._others, *of_votes(pool(votes[:, :3], votes[:, 3], votes[:, 4]))])

    def _standing(self, R_frame: np.ndarray, error_deg: float, time_s: float) -> np.ndarray:
        """(3, 3) the frame upright, its heading an exponential mean over the last moments, on the circle."""
        self._left = self._left * np.exp(-(time_s - self._time_s) / HEADING_S)
        left = level_left(R_frame, self._up.up)
        if not is_finite(left):
            return np.full((3, 3), np.nan)
        self._left = self._left + trust(error_deg) * left
        return standing(self._left, self._up.up)
