"""Training windows of the lifter: motion capture, in other poses, on another body, before a virtual camera and a
detector; made in torch on the device that trains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from .....pipeline.core.errors import InputError
from .....pipeline.core.layouts import H36M17
from .....pipeline.reading.mocap.clip import Clip
from ....common.vectors import rotate, transpose, unit
from ....lifter.features import ASSUMED_FOCAL, body_rays, features
from ...common.toml_config import Share, Size
from ...mocap.clips import lying
from ...synthetic.bodies import STANDARD_SIZE_M, BodyRange, proportions, redefined, size_m
from ...synthetic.cameras import TYPICAL, ViewRange, place_among
from ...synthetic.draw import Draw
from ...synthetic.keypoint_noise import Noise, Spoilt, detect
from ...synthetic.motion import MotionRange, varied

_FPS = (20.0, 60.0)
_CAPTURED_FPS = 30.0
_UP_DEG = (0.2, 3.0)  # error of an up that is told, a standard deviation in each direction
_FOCAL_SPREAD = 0.2  # of the logarithm of a focal length that was estimated


@dataclass(frozen=True)
class Material(MotionRange, Spoilt):
    """What windows are made of, besides the fields of MotionRange and Spoilt; shares are of the windows.

    limbs, trunk: spread of lengths, mirrored: share of mirrored bodies, of bodies.BodyRange. typical: share before
    cameras as people use them, the others before any. placed: share, of either, with the person where people are in
    real videos and as large (synthetic.places). pans: share whose camera slowly follows the person. derived: share with
    pelvis, spine, thorax and head made as for COCO keypoints. other_rates: share of batches at another frame rate than
    30, between 20 and 60. focal_known, focal_estimated: share of windows whose focal length is told, exactly or with an
    error; the others have the assumed one. up_known: share that is told which way is up, with an error (_UP_DEG).
    lying: share from clips drawn by how many of their frames show somebody who lies, crawls or bends deeply
    (mocap.clips.lying): they are few.
    """

    limbs: Size = 0.05
    trunk: Size = 0.05
    unchanged: Share = 0.3
    mirrored: Share = 0.5
    typical: Share = 0.0
    placed: Share = 0.0
    pans: Share = 0.0
    derived: Share = 0.0
    other_rates: Share = 0.3
    focal_known: Share = 0.3
    focal_estimated: Share = 0.0
    up_known: Share = 0.0
    lying: Share = 0.0


class Batch(NamedTuple):
    """x: (B, T, CHANNELS) features. joints: (B, T, 17, 3) the answer, relative to the pelvis in the ray frame, metres
    of a standard body, for how large a person is cannot be seen. velocity: (B, T, 17, 3) the same a frame."""

    x: Tensor
    joints: Tensor
    velocity: Tensor


class Windows:
    """Random windows of clips; the same draw gives the same batch."""

    def __init__(self, clips: Sequence[Clip], material: Material, device: torch.device | str = "cpu") -> None:
        """clips: at 30 frames per second. InputError for another rate."""
        if odd := sorted({clip.fps for clip in clips if abs(clip.fps - _CAPTURED_FPS) > 0.01}):
            raise InputError(
                "wrong-content",
                f"Expected motion capture at 30 frames per second to train on, got {odd[0]:g}; convert it.",
            )
        self.device, self.material = torch.device(device), material
        self.joints = torch.from_numpy(np.concatenate([clip.joints for clip in clips])).to(self.device)
        lengths = torch.tensor([len(clip) for clip in clips], dtype=torch.float32)
        self.lengths = lengths.to(self.device)
        self.starts = (lengths.cumsum(0) - lengths).to(self.device)
        lies = torch.tensor([float(lying(clip.joints).sum()) for clip in clips])
        if material.lying and not lies.any():
            raise InputError(
                "nothing-usable",
                "Expected clips in which somebody lies, for the material wants them; leave `lying` out.",
            )
        self.share = (
            1 - material.lying
        ) * lengths / lengths.sum() + material.lying * lies / lies.sum().clamp_min(1)
        self.share = self.share.to(self.device)
        self.people = proportions(clips).to(self.device)
        bodies = ("limbs", "trunk", "unchanged", "mirrored")
        self.bodies = BodyRange(**{name: getattr(material, name) for name in bodies})
        self.noise = Noise(derived=material.derived)

    @torch.no_grad()
    def batch(self, draw: Draw, count: int, frames: int) -> Batch:
        """count windows of so many frames. InputError when no clip is as long."""
        material = self.material
        other = bool(draw.share(material.other_rates, 1))
        fps = float(draw.log_uniform(_FPS, 1)) if other else _CAPTURED_FPS
        captured = partial(self._motion, draw, frames, fps)
        world = varied(captured, count, draw, material, self.bodies, self.people, fps)
        views = TYPICAL, ViewRange(pans=material.pans)
        cameras = place_among(world, draw, *views, material.typical, material.placed)
        joints = cameras.to_camera(world)
        shown = joints
        if material.redefined:
            shown = redefined(joints, draw, material.redefined_m, material.redefined)
        keypoints, confidence = detect(cameras.project(shown), shown, draw, fps, self.noise, material)
        focal_px = self._told_focal(draw, cameras.focal_px, cameras.image_size)
        up = self._told_up(draw, cameras.R_camera_from_world[..., 2])
        x, _ = features(keypoints, _other_scores(confidence, draw), cameras.image_size, focal_px, up)
        return Batch(x, *target(joints, up))

    def _told_focal(self, draw: Draw, focal_px: Tensor, image_size: Tensor) -> Tensor:
        kind = draw.uniform((0.0, 1.0), len(focal_px))
        estimated = focal_px * (_FOCAL_SPREAD * draw.normal(len(focal_px), most=2)).exp()
        known, told = self.material.focal_known, self.material.focal_known + self.material.focal_estimated
        assumed = ASSUMED_FOCAL * image_size.amax(-1)
        return torch.where(kind < known, focal_px, torch.where(kind < told, estimated, assumed))

    def _told_up(self, draw: Draw, up: Tensor) -> Tensor:
        """(B, T or 1, 3) what is told of up (B, T or 1, 3), NaN for the windows that are told nothing."""
        count = len(up)
        error = torch.deg2rad(draw.log_uniform(_UP_DEG, count))[:, None, None]
        told = unit(up + error * draw.normal(count, 1, 3))
        return torch.where(draw.share(self.material.up_known, count)[:, None, None], told, torch.nan)

    def _motion(self, draw: Draw, frames: int, fps: float, count: int) -> Tensor:
        step = _CAPTURED_FPS / fps
        room = self.lengths - 1 - (frames - 1) * step
        weights = torch.where(room >= 0, self.share, 0.0)
        if not bool((weights > 0).any()):
            raise InputError(
                "nothing-usable",
                f"Expected a clip of {frames} frames at {fps:.0f} frames per second, but the longest lasts "
                f"{float(self.lengths.max()) / _CAPTURED_FPS:.1f} s; shorten `lengths`.",
            )
        clip = draw.choice(weights, count)
        begin = draw.uniform((0.0, 1.0), count) * room[clip]
        begin = begin.floor() if step == 1.0 else begin
        # A sum of frame numbers beyond 2^24 / 2^7 would lose the fraction in float32, so the two stay apart.
        offset = begin[:, None] + step * torch.arange(frames, device=self.device)
        whole = offset.floor()
        part = (offset - whole)[..., None, None]
        before = (self.starts[clip][:, None] + whole).long()
        if step == 1.0:
            return self.joints[before]
        after = (before + 1).clamp_max(len(self.joints) - 1)
        return torch.lerp(self.joints[before], self.joints[after], part)


def _other_scores(confidence: Tensor, draw: Draw) -> Tensor:
    """Every detector means something else by its scores, and some give none."""
    gamma = draw.uniform((-0.7, 0.7), len(confidence), 1, 1).exp()
    return torch.where(draw.share(0.15, len(confidence), 1, 1), torch.nan, confidence**gamma)


def target(joints_camera: Tensor, up: Tensor) -> tuple[Tensor, Tensor]:
    """(B, T, 17, 3) what the network should answer for exact joints with the origin at the camera, told up as in
    `features`, and (B, T, 17, 3) their velocities a frame, of the joints relative to the pelvis, in the same axes and
    scale."""
    relative = joints_camera - joints_camera[..., [H36M17.index("pelvis")], :]
    relative = relative * (STANDARD_SIZE_M / size_m(relative))[:, None, None, None]
    R_ray_from_camera = transpose(body_rays(joints_camera, up))
    return rotate(R_ray_from_camera, relative), rotate(R_ray_from_camera, _velocity(relative))


def _velocity(values: Tensor) -> Tensor:
    """Central differences along time (B, T, ...), one-sided at the ends; zero for a single frame."""
    if values.shape[1] == 1:
        return torch.zeros_like(values)
    return torch.gradient(values, dim=1)[0]
