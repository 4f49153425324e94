"""What is known about a take's camera: its focal length, which way is up, and from where."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .intrinsics import Intrinsics

FocalSource = Literal["told", "file", "lines", "prior"]
# Longer sides of the image, and spread of its logarithm (phones filming).
PRIOR_FOCAL, PRIOR_FOCAL_SPREAD = 0.8, 0.22
TREMBLE = 0.01  # longer sides of the image: half a degree


@dataclass(frozen=True, eq=False)
class Look:
    """What the image says at one video frame, or at several of a camera that stood still.

    frame: the first of these. up: (3,) unit, CAMERA axes. covariance: (3, 3) of up, square radians,
    across it. failure: how often such an answer is quite wrong.
    """

    frame: int
    up: np.ndarray
    covariance: np.ndarray
    failure: float

    @property
    def error_deg(self) -> float:
        """Expected root mean square angle between up and the truth."""
        return float(np.degrees(np.sqrt(np.trace(self.covariance))))


@dataclass(frozen=True)
class Background:
    """How the background of the images moves, outside people. kind: "hand-held" shakes about one place,
    "panning" goes elsewhere, "zooming" grows or shrinks. speed: longer sides of the image a second, a
    median; reach: as far as the image's middle wanders in all, in longer sides."""

    kind: Literal["still", "hand-held", "panning", "zooming"]
    speed: float = 0.0
    reach: float = 0.0

    @property
    def in_words(self) -> str:
        """What the camera does."""
        return {"still": "stands still", "hand-held": "shakes", "panning": "pans or travels",
                "zooming": "zooms or travels"}[self.kind]  # fmt: skip

    @property
    def moves(self) -> bool:
        """Whether the camera goes elsewhere: one that shakes stays about where it is."""
        return self.kind not in ("still", "hand-held")

    @property
    def shake(self) -> float:
        """Standard deviation of where a camera that shakes looks, along either side, in longer sides of the image: a
        quarter of the way from end to end; 0 of others."""
        return self.reach / 4 if self.kind == "hand-held" else 0.0


@dataclass(frozen=True, eq=False)
class Camera:
    """A take's camera. image_size: width and height in pixels as shown. focal_px, focal_sd_px: the focal length and its
    standard deviation. focal_source: where it comes from. intrinsics: those of a calibrated camera; its distortion is
    undone before anything looks at the pixels. looks: what images say about up: one for a static camera, one per image
    looked at for a moving one, in order. reason: in words, why there is no look. background: how the background moves;
    None if nobody looked at it or it cannot be told. focal_against_px: the focal length by straight lines, where these
    contradict a told one."""

    image_size: tuple[int, int]
    focal_px: float
    focal_sd_px: float
    focal_source: FocalSource
    looks: tuple[Look, ...] = ()
    reason: str = ""
    intrinsics: Intrinsics | None = None
    background: Background | None = None
    focal_against_px: float | None = None

    @property
    def shake_rad(self) -> float:
        """Standard deviation of where it looks, about either axis, of a camera that shakes; 0 of others."""
        shake = 0.0 if self.background is None else self.background.shake
        return shake * max(self.image_size) / self.focal_px


def pitch_roll_deg(up: np.ndarray) -> np.ndarray:
    """up (..., 3) in CAMERA axes as (..., 2) the camera's pitch and roll: positive when it looks down, and when the
    image's content turns counter-clockwise."""
    x, y, z = np.moveaxis(up, -1, 0)
    return np.degrees(np.stack([np.arctan2(-z, np.hypot(x, y)), np.arctan2(-x, -y)], axis=-1))


def view_rotation(yaw_deg: np.ndarray, pitch_deg: np.ndarray, roll_deg: np.ndarray) -> np.ndarray:
    """R_camera_from_world (..., 3, 3) of a camera that looks along heading yaw, world +Z up."""
    yaw, pitch, roll = (np.radians(angle) for angle in (yaw_deg, pitch_deg, roll_deg))
    zero = np.zeros_like(yaw)
    away = np.stack([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)], axis=-1)
    right = np.stack([np.sin(yaw), -np.cos(yaw), zero], axis=-1)
    down = np.cross(away, right)
    c, s = np.cos(roll)[..., None], np.sin(roll)[..., None]
    return np.stack([c * right + s * down, c * down - s * right, away], axis=-2)
