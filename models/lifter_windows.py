"""Training windows made on the fly: motion capture, on another body, through a virtual camera and a noisy detector."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..pipeline.layouts import H36M17
from ..pipeline.rotations import rotate, transpose
from .bodies import STANDARD_SIZE_M, BodyRange, combine, size_m, vary
from .cameras import ViewRange, place
from .lifter_features import ASSUMED_FOCAL, body_rays, features
from .mocap import Clip
from .noise2d import Noise, detect

_FPS = (20.0, 60.0)


class Windows:
    """Random windows of clips as (features, target) batches; the same generator gives the same batches."""

    def __init__(
        self,
        clips: Sequence[Clip],
        *,
        bodies: BodyRange | None = None,
        views: ViewRange | None = None,
        noise: Noise | None = None,
        other_rates: float = 0.3,
        combined: float = 0.0,
    ) -> None:
        """other_rates: share of batches played at another frame rate between 20 and 60 fps instead of 30.
        combined: share of windows whose upper body comes from another motion."""
        self.joints = np.concatenate([clip.joints for clip in clips])
        self.lengths = np.array([len(clip) for clip in clips])
        self.starts = np.cumsum(self.lengths) - self.lengths
        self.bodies, self.views, self.noise = bodies, views, noise
        self.other_rates, self.combined = other_rates, combined

    def batch(self, rng: np.random.Generator, count: int, frames: int) -> tuple[np.ndarray, np.ndarray]:
        """features (count, frames, CHANNELS) and target (count, frames, 17, 3), both float32.

        The target is relative to the pelvis, in the ray frame, scaled to a standard body: how large a person is
        cannot be seen.
        """
        fps = float(np.exp(rng.uniform(*np.log(_FPS)))) if rng.uniform() < self.other_rates else 30.0
        motion = self._motion(rng, count, frames, fps)
        mixed = round(self.combined * count)
        if mixed:
            motion[:mixed] = combine(motion[:mixed], self._motion(rng, mixed, frames, fps))
        world = vary(motion, rng, self.bodies)
        cameras = place(world, rng, self.views)
        joints = cameras.to_camera(world)
        keypoints, confidence = detect(cameras.project(joints), joints, rng, self.noise, fps)
        # Nobody knows the focal length of a stranger's video: the lifter is trained on the assumed one.
        assumed = ASSUMED_FOCAL * cameras.image_size.max(axis=-1)
        informed = rng.uniform(size=count) < 0.3
        focal_px = np.where(informed, cameras.focal_px, assumed)
        x, _ = features(keypoints, _other_scores(confidence, rng), cameras.image_size, focal_px)
        return x, target(joints)

    def _motion(self, rng: np.random.Generator, count: int, frames: int, fps: float) -> np.ndarray:
        step = 30.0 / fps
        span = (frames - 1) * step
        room = self.lengths - 1 - span
        usable = np.flatnonzero(room >= 0)
        if len(usable) == 0:
            raise ValueError(f"no clip is as long as {frames} frames at {fps:.0f} fps")
        weight = self.lengths[usable] / self.lengths[usable].sum()
        clip = rng.choice(usable, size=count, p=weight)
        begin = rng.uniform(0, 1, count) * room[clip]
        if step == 1.0:
            begin = np.floor(begin)
        at = self.starts[clip][:, None] + begin[:, None] + step * np.arange(frames)
        before = np.floor(at).astype(int)
        part = (at - before)[..., None, None].astype(np.float32)
        after = np.minimum(before + 1, len(self.joints) - 1)
        return (
            self.joints[before]
            if step == 1.0
            else self.joints[before] * (1 - part) + self.joints[after] * part
        )


def _other_scores(confidence: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Every detector means something else by its scores, and some give none."""
    lead = (len(confidence), 1, 1)
    gamma = np.exp(rng.uniform(-0.7, 0.7, lead))
    return np.where(rng.uniform(size=lead) < 0.15, np.nan, confidence**gamma)


def target(joints_camera: np.ndarray) -> np.ndarray:
    """(..., T, 17, 3) what the network should answer for exact joints with the origin at the camera."""
    relative = joints_camera - joints_camera[..., [H36M17.index("pelvis")], :]
    scale = STANDARD_SIZE_M / size_m(relative)
    turned = rotate(transpose(body_rays(joints_camera)), relative)
    return (turned * scale[..., None, None, None]).astype(np.float32)
