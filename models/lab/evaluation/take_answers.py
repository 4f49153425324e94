"""What there is to compare on one take: every rectifier frame by frame and with one gravity for the take, and the
camera's own axes beside them; all brought to one heading."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....pipeline.core.camera import Look
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import from_columns, transpose, unit
from ....pipeline.plugins.protocols import Rectifier
from ...common.metrics import scaled
from ...gravity import Levelled, Seen, level_static
from ...gravity.lines import tangent

CAMERA_AXES, TRUE_AXES = "camera axes", "true axes"
LOOK_DEG = np.array([1.2, 0.6])  # pitch and roll of up by an image: what photographs give


@dataclass(frozen=True, eq=False)
class Answer:
    """One method's rotations of a take.

    R_camera_from_body: (T, 3, 3). R_camera_from_level: (3, 3), axes that the whole take shares, or None of a method
    that answers every frame alone. levelled: of a take-level method. joints: (T, 17, 3) what it is an answer about,
    where that is another lift than the other methods'.
    """

    R_camera_from_body: np.ndarray
    R_camera_from_level: np.ndarray | None = None
    levelled: Levelled | None = None
    joints: np.ndarray | None = None

    def axes(self, R_camera_from_world: np.ndarray) -> np.ndarray:
        """(T, 3, 3) upright axes in the camera, with one heading for all frames, the true one: the take's axes turned
        about their up by one angle; without such axes, each frame's own up under that heading. So what is left of a
        method's error is its up, and what a frame's heading does is not held against it."""
        if self.R_camera_from_level is None:
            return with_heading(self.R_camera_from_body, R_camera_from_world, per="frame")
        R = np.broadcast_to(self.R_camera_from_level, self.R_camera_from_body.shape)
        return with_heading(R, R_camera_from_world)


def answers(
    rectifiers: Sequence[Rectifier],
    joints: np.ndarray,
    time_s: np.ndarray,
    look: Look | None = None,
    spread: np.ndarray | None = None,
    again: tuple[np.ndarray, np.ndarray] | None = None,
) -> dict[str, dict[str, Answer]]:
    """{method: {"a frame", "a take": Answer}}. joints: (T, 17, 3), CAMERA axes relative to the pelvis, any unit. look:
    what an image of the take says about up; with it also "a take, with its image". spread: of models.gravity.seen.Seen.
    again: joints and spread of a lift that knew the image's up, for that answer."""
    both = {}
    for rectifier in rectifiers:
        R, error_deg = rectifier.rotation(joints)
        seen = Seen(joints, R, error_deg, time_s, spread=spread)
        both[rectifier.method] = {"a frame": Answer(R), "a take": _of_take(level_static(seen))}
        if look is not None:
            if again is not None:
                seen = Seen(again[0], *rectifier.rotation(again[0]), time_s, spread=again[1])
            both[rectifier.method]["a take, with its image"] = _of_take(
                level_static(seen, look=look), seen.joints
            )
    return both


def _of_take(levelled: Levelled, joints: np.ndarray | None = None) -> Answer:
    return Answer(levelled.R_camera_from_body, levelled.R_camera_from_level, levelled, joints)


def simulated_look(up: np.ndarray, seed: int, clip: str) -> Look:
    """What an image says about a true up (3,), as well as images of rooms and streets do (docs/up.md); the same for
    the same seed and clip."""
    rng = np.random.default_rng([seed, zlib.crc32(clip.encode()), 1])
    plane = tangent(up)
    said = unit(up + plane @ (np.radians(LOOK_DEG) * rng.standard_normal(2)))
    plane = tangent(said)
    return Look(0, said, plane @ np.diag(np.radians(LOOK_DEG) ** 2) @ plane.T, failure=0.01)


def named(both: dict[str, dict[str, Answer]]) -> dict[str, Answer]:
    """The same in one dict, "geometric, a frame" and so on."""
    return {f"{method}, {per}": answer for method, pair in both.items() for per, answer in pair.items()}


def constant(R_camera_from_level: np.ndarray, frames: int) -> Answer:
    """Axes (3, 3) that are given, the same in every frame."""
    R = np.broadcast_to(R_camera_from_level, (frames, 3, 3))
    return Answer(R, R_camera_from_level)


def with_heading(R: np.ndarray, R_true: np.ndarray, per: str = "take") -> np.ndarray:
    """R (T, 3, 3) turned about its own up, its third column, towards R_true (T, 3, 3) or (3, 3): by the one angle that
    brings the take closest (least squares), or per "frame" by an angle each."""
    D = transpose(R) @ R_true
    sine, cosine = D[..., 1, 0] - D[..., 0, 1], D[..., 0, 0] + D[..., 1, 1]
    if per == "take":
        sine, cosine = np.nansum(sine, keepdims=True), np.nansum(cosine, keepdims=True)
    angle = np.arctan2(sine, cosine)
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    c, s = np.cos(angle), np.sin(angle)
    return R @ from_columns(*(np.stack(v, -1) for v in ((c, s, zero), (-s, c, zero), (zero, zero, one))))


def joints_of(poses: PoseSequence, truth: np.ndarray) -> np.ndarray:
    """(T, 17, 3) a lift at the truth's scale, one factor for the take."""
    return scaled(poses.joints.astype(np.float64), truth, "take")
