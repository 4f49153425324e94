"""Lifted takes with truth: motion capture through a virtual camera, a noisy detector and the lifter.

What everything after the lifter is judged on. A take depends on the seed and its clip's name only, so a subset of
the clips gives the same takes.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import torch

from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import IMAGE
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.reading.mocap import Clip
from ...common.canonical import R_world_from_body
from ...common.metrics import relative
from ...lifter.builtin import lift, network
from ...lifter.features import body_rays
from ..mocap.clips import Subjects, lying, read_clips
from ..synthetic.bodies import BodyRange, vary
from ..synthetic.cameras import TYPICAL, WILD, Cameras, ViewRange, place
from ..synthetic.draw import NumpyDraw
from ..synthetic.keypoint_noise import Noise, detect
from .motion_class import motion_classes

MIN_FRAMES = 30
_LAID_SD_DEG = 12.0  # of how far from level a laid body lies
_ON_THE_FLOOR = 0.05  # share of its joints below the floor

Bed = Literal["wild", "typical"]
BEDS: dict[Bed, ViewRange] = {"wild": WILD, "typical": TYPICAL}


@dataclass(frozen=True, eq=False)
class SeenTake:
    """One clip as a camera and a detector saw it, and what is true about it.

    keypoints: the detector's answer, IMAGE, pixels. image_size, focal_px: the camera's.
    joints_camera: (T, 17, 3) metres, the truth, origin at the camera.
    R_camera_from_body: (T, 3, 3), the truth by design.md section 4. R_camera_from_world: (3, 3), or (T, 3, 3) of a
        camera that pans, world +Z up; its third column is `up`. R_camera_from_ray: (T, 3, 3), z along the ray to the
        body.
    lying: (T,) by trunk angle. clip, subject, source: where it comes from.
    """

    keypoints: PoseSequence
    image_size: tuple[int, int]
    focal_px: float
    joints_camera: np.ndarray
    R_camera_from_body: np.ndarray
    R_camera_from_world: np.ndarray
    R_camera_from_ray: np.ndarray
    lying: np.ndarray
    clip: str
    subject: str
    source: str

    @property
    def up(self) -> np.ndarray:
        """(3,) or (T, 3) against gravity, in the camera."""
        return self.R_camera_from_world[..., :, 2]

    @property
    def truth(self) -> np.ndarray:
        """(T, 17, 3) metres, CAMERA axes, relative to the pelvis."""
        return relative(self.joints_camera)

    @cached_property
    def motion(self) -> dict[str, np.ndarray]:
        """{class: (T,) bool} of motion_class.motion_classes."""
        world = rotate(transpose(self.R_camera_from_world), self.joints_camera)  # its origin is the camera
        return motion_classes(world, self.keypoints.fps)


@dataclass(frozen=True, eq=False)
class LiftedTake:
    """What a user has, and the truth behind it. lifted: CAMERA axes, relative to the pelvis, unit arbitrary."""

    lifted: PoseSequence
    seen: SeenTake


def lifted_takes(
    subjects: Subjects,
    seed: int = 0,
    *,
    model: str | Path = "pcnet3d",
    focal_known: bool = False,
    noise: Noise | None = None,
    bodies: BodyRange | None = None,
    views: ViewRange = WILD,
    only: Callable[[Clip], bool] | None = None,
    trained_on: bool = False,
    laid: float = 0.0,
) -> Iterator[LiftedTake]:
    """Every clip of at least MIN_FRAMES frames, seen by one static camera and lifted.

    model: never one that saw the subjects, which is refused unless trained_on says that they are not judged by; the
    shipped one saw all train subjects, so takes of "train-a" need a lifter trained on "train-b", and the other way
    round. laid: of so large a share of the clips only, whose bodies are laid down, none where it is 0. focal_known:
    tell the lifter the focal length, as a calibrated camera would. bodies: draw other proportions (for training); None
    keeps the captured ones. views: what the cameras are drawn from. only: which of the clips; None takes all.
    """
    if not trained_on:
        _refuse_known_subjects(subjects, model)
    for clip in read_clips(subjects):
        rng = _rng(clip, seed, 1)
        if len(clip) >= MIN_FRAMES and (only is None or only(clip)) and (not laid or rng.uniform() < laid):
            clip = lay_down(clip, rng) if laid else clip
            take = see(clip, seed, noise=noise, bodies=bodies, views=views)
            focal = take.focal_px if focal_known else None
            yield LiftedTake(lift(take.keypoints, take.image_size, focal, model=model), take)


def _refuse_known_subjects(subjects: Subjects, model: str | Path) -> None:
    trained_on = network(model).trained_on
    if ("train" in (subjects, trained_on) and subjects.startswith(trained_on[:5])) or subjects == trained_on:
        raise InputError(
            "files-apart",
            f"Expected a lifter that never saw the subjects '{subjects}', but {model} was trained on '{trained_on}'; "
            'train one on the other half (subjects = "train-a" or "train-b" in its config).',
        )


def lay_down(clip: Clip, rng: np.random.Generator) -> Clip:
    """The motion of a body that lies on its back, front or a side: turned about a level axis by about 90 degrees."""
    from scipy.spatial.transform import Rotation

    towards, angle = rng.uniform(0, 2 * np.pi), np.radians(90 + _LAID_SD_DEG * rng.standard_normal())
    R = Rotation.from_rotvec(angle * np.array([np.cos(towards), np.sin(towards), 0.0])).as_matrix()
    pelvis = clip.joints[:, [H36M17.index("pelvis")]]
    joints = pelvis + rotate(R, clip.joints - pelvis)
    joints[..., 2] -= np.quantile(joints[..., 2], _ON_THE_FLOOR)
    return replace(clip, joints=joints.astype(np.float32))


def see(
    clip: Clip,
    seed: int,
    *,
    noise: Noise | None = None,
    bodies: BodyRange | None = None,
    views: ViewRange = WILD,
    cameras: Cameras | None = None,
) -> SeenTake:
    """A clip before one camera and a noisy detector; deterministic in the seed and the clip's name. cameras: that one,
    of leading shape (1,), in place of one that is drawn."""
    draw = NumpyDraw(_rng(clip, seed))
    moving = torch.from_numpy(clip.joints[None].astype(np.float64))
    if bodies is not None:
        moving = vary(moving, draw, bodies)
    cameras = place(moving, draw, views) if cameras is None else cameras
    shown = cameras.to_camera(moving)
    pixels, confidence = (
        found[0].numpy() for found in detect(cameras.project(shown), shown, draw, clip.fps, noise)
    )
    world, joints = moving[0].numpy(), shown[0].numpy()
    R_camera_from_world = cameras.R_camera_from_world[0].numpy()
    if not views.pans:
        R_camera_from_world = R_camera_from_world[0]
    time_s = np.arange(len(clip)) / clip.fps
    keypoints = PoseSequence(pixels, H36M17, IMAGE, confidence, time_s, np.arange(len(clip)))
    width, height = (int(side) for side in cameras.image_size[0])
    return SeenTake(
        keypoints=keypoints,
        image_size=(width, height),
        focal_px=float(cameras.focal_px[0]),
        joints_camera=joints,
        R_camera_from_body=R_camera_from_world @ R_world_from_body(world),
        R_camera_from_world=R_camera_from_world,
        R_camera_from_ray=body_rays(joints),
        lying=lying(world),
        clip=clip.name,
        subject=clip.subject,
        source=clip.source,
    )


def file_name(clip: str, bed: Bed, seed: int) -> str:
    """Of a take's keypoints and of what a lifter answers to them, without an ending."""
    return f"{clip}-{bed}-{seed}"


def _rng(clip: Clip, *seeds: int) -> np.random.Generator:
    return np.random.default_rng([*seeds, zlib.crc32(clip.name.encode())])
