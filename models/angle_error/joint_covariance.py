"""How wrong each joint's place is, as an ellipsoid that holds: what the lifter states of a frame, and what turns the
whole body about the pelvis, which no frame tells.

A lifter's own covariance is right about what differs from frame to frame, and knows nothing of two turns that all its
frames share. A person beside the camera's axis is seen along a ray that only the focal length tells: its error as a
share, times the tangent of the angle off the axis, turns body and ray together. And bodies are lifted as if the camera
looked more level than it does, by a share of its pitch. Both turn about axes across the ray, so that joints in front of
the pelvis and behind it move across, and those beside it in depth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...pipeline.core.camera import pitch_roll_deg
from ...pipeline.core.measures import SD_90
from ...pipeline.core.rotations import is_finite, rotate, transpose, unit
from ...pipeline.core.take import Take
from .joint_noise import JointNoise

FOCAL_HEADING = 0.77  # mean error of a body's heading over Turns.heading, by takes of val subjects


@dataclass(frozen=True, eq=False)
class Turns:
    """What turns bodies. ray: (T, 3) unit, from the camera to the person, LEVEL axes. focal: (T,) radians, by the error
    of the focal length; heading: (T,) radians, what of it is about the vertical; pitch: (T,) radians, of the camera, as
    it was found."""

    ray: np.ndarray
    focal: np.ndarray
    heading: np.ndarray
    pitch: np.ndarray

    def sd(self, noise: JointNoise) -> np.ndarray:
        """(T,) standard deviation of the body's turn about either axis across the ray, radians."""
        _, focal, pitch = noise.turn
        return np.hypot(focal * self.focal, pitch * self.pitch)


def turns_of(take: Take) -> Turns | None:
    """Of a take that is rectified; None where nothing tells where its people are in the image. Where keypoints miss a
    frame the person is taken to be where it is in the middle of the take."""
    poses, keypoints, camera = take.need("poses"), take.keypoints, take.camera
    if keypoints is None or camera is None or poses.frame.family != "camera":
        return None
    rows, pixels = poses.frame_index, keypoints.joints.astype(np.float64)
    middle = (np.fmin.reduce(pixels, axis=1) + np.fmax.reduce(pixels, axis=1)) / 2
    off = (middle - np.array(camera.image_size) / 2) / camera.focal_px
    at = np.minimum(np.searchsorted(keypoints.frame_index, rows), len(off) - 1)
    has_row = (keypoints.frame_index[at] == rows) & is_finite(off[at])
    finite = off[is_finite(off)]
    usual = np.median(finite, axis=0) if len(finite) else np.zeros(2)
    off = np.where(has_row[:, None], off[at], usual)
    ray = unit(np.concatenate([off, np.ones((len(off), 1))], axis=1))
    R = np.broadcast_to(take.need("rectified").R_source_from_level, (len(rows), 3, 3))
    # A longer lens brings the ray nearer to the axis, and never past it.
    share = camera.focal_sd_px / camera.focal_px
    share /= 1 + SD_90 * share
    # The ray's cross product with the axis.
    about = np.stack([off[:, 1], -off[:, 0], np.zeros(len(off))], axis=1)
    return Turns(
        rotate(transpose(R), ray[:, None])[:, 0],
        share * np.linalg.norm(off, axis=1),
        share * np.abs((about * R[..., :, 2]).sum(axis=1)),
        np.radians(pitch_roll_deg(R[..., :, 2])[:, 0]),
    )


def joint_covariance(own: np.ndarray, joints: np.ndarray, turning: Turns, noise: JointNoise) -> np.ndarray:
    """(T, J, 3, 3) float32 of the whole error of joints (T, J, 3) relative to the pelvis, in LEVEL but for the error of
    up, in their unit squared. own: (T, J, 3, 3) as the lifter states it, in the same axes."""
    square = (turning.sd(noise) ** 2)[:, None, None, None].astype(np.float32)
    return noise.turn[0] ** 2 * own + square * levers(joints, turning.ray)


def levers(joints: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """(T, J, 3, 3) float32, the covariance of joints (T, J, 3) that are turned by one radian about either axis across
    ray (T, 3)."""
    p, r = joints.astype(np.float32), ray.astype(np.float32)[:, None]
    about = np.cross(r, p)  # how a turn about the ray itself would move them
    square = (p**2).sum(axis=-1)[..., None, None] * np.eye(3, dtype=np.float32)
    return square - p[..., None] * p[..., None, :] - about[..., None] * about[..., None, :]
