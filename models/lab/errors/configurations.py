"""The configurations that a run can have, as takes of the test bed: what is told, seen and assumed."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ....pipeline.core.camera import Look
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate
from ....pipeline.plugins.protocols import Rectifier
from ...common.spread import stated_spread
from ...gravity import Levelled, Seen, level_moving, level_static
from ...gravity.evidence import direction
from ...lifter.builtin import lift
from ..evaluation.sets import EvaluationSet
from ..evaluation.take_answers import simulated_look
from ..evaluation.testbed import BEDS, Bed, SeenTake, see

_TOLD_DEG = 1.0  # error of an up that is told (models/gravity/told.py)
_PAN_DEG, _TILT_DEG, _PERIOD_S = 15.0, 4.0, 6.0  # of a camera that moves: how far and how slowly it turns
_IN_THE_IMAGE = 0.99  # of the keypoints
_LOOK_EVERY_S = 1.0  # of a camera that moves


@dataclass(frozen=True)
class Configuration:
    """image: whether an image tells up, as rooms do. told: whether the user does. moving: whether the camera turns,
    and that is told. bed: the cameras."""

    name: str
    bed: Bed = "wild"
    image: bool = False
    told: bool = False
    moving: bool = False


CONFIGURATIONS = (
    Configuration("wild, bodies alone"),
    Configuration("wild, image", image=True),
    Configuration("wild, up told", told=True),
    Configuration("wild, moving", moving=True),
    Configuration("wild, moving, image", moving=True, image=True),
    Configuration("typical, bodies alone", bed="typical"),
    Configuration("typical, image", bed="typical", image=True),
)


@dataclass(frozen=True, eq=False)
class Finished:
    """A take as a run leaves it, and its truth. lifted: CAMERA, relative to the pelvis. seen: with the truth in the
    axes of each frame's camera; R_camera_from_world: (T, 3, 3)."""

    lifted: PoseSequence
    level: Levelled
    seen: SeenTake
    R_camera_from_world: np.ndarray


def finished(
    configuration: Configuration,
    of: EvaluationSet,
    rectifier: Rectifier,
    seed: int = 0,
    lifter: str | Path = "pcnet3d",
) -> Iterator[Finished]:
    """Every take of a set in a configuration."""
    for clip in of.long_clips():
        seen = see(clip, seed, views=BEDS[configuration.bed])
        R = np.broadcast_to(seen.R_camera_from_world, (len(clip), 3, 3))
        if configuration.moving:
            seen, R = turned(seen, seed)
        yield _run(configuration, seen, R, rectifier, seed, lifter)


def _run(
    configuration: Configuration,
    seen: SeenTake,
    R_camera_from_world: np.ndarray,
    rectifier: Rectifier,
    seed: int,
    lifter: str | Path,
) -> Finished:
    ups = R_camera_from_world[:, :, 2]
    time_s = seen.keypoints.times
    told = (
        [direction("gravity", _off(ups[0], seed, seen.clip, _TOLD_DEG), _TOLD_DEG)]
        if configuration.told
        else []
    )
    looks: list[tuple[float, Look]] = []
    if configuration.image:
        step = max(round(_LOOK_EVERY_S * seen.keypoints.fps), 1) if configuration.moving else len(ups)
        looks = [
            (float(time_s[row]), simulated_look(ups[row], seed + row, seen.clip))
            for row in range(0, len(ups), step)
        ]
    known = None
    if told:
        known = -np.asarray(told[0].vector) / -np.linalg.norm(told[0].vector)
    elif looks and not configuration.moving:
        known = looks[0][1].up
    elif looks:
        known = np.stack(
            [np.interp(time_s, [at for at, _ in looks], [look.up[i] for _, look in looks]) for i in range(3)],
            -1,
        )
    lifted = lift(seen.keypoints, seen.image_size, None, False, lifter, known)
    joints = lifted.joints.astype(np.float64)
    took = Seen(joints, *rectifier.rotation(joints), time_s, spread=stated_spread(lifted))
    if configuration.moving:
        level = level_moving(took, looks)
    else:
        level = level_static(took, told, looks[0][1] if looks else None)
    return Finished(lifted, level, seen, R_camera_from_world)


def turned(seen: SeenTake, seed: int) -> tuple[SeenTake, np.ndarray]:
    """The same take by a camera that pans and tilts slowly where it stands, as far as the person stays in the image,
    and its R_camera_from_world (T, 3, 3): the detector's points are moved as that turns the image."""
    for share in (1.0, 0.5, 0.25, 0.1, 0.0):
        R = _rotations(share * _swing(seen, seed))
        rays = np.concatenate(
            [
                (seen.keypoints.joints - np.array(seen.image_size) / 2) / seen.focal_px,
                np.ones((*seen.keypoints.joints.shape[:2], 1)),
            ],
            axis=-1,
        )
        rays = rotate(R, rays)
        pixels = np.array(seen.image_size) / 2 + seen.focal_px * rays[..., :2] / rays[..., 2:]
        within = np.isnan(pixels) | ((pixels >= 0) & (pixels <= np.array(seen.image_size)))
        if within.mean() > _IN_THE_IMAGE:
            break
    moved = replace(
        seen,
        keypoints=seen.keypoints.with_(joints=pixels),
        joints_camera=rotate(R, seen.joints_camera),
        R_camera_from_body=R @ seen.R_camera_from_body,
    )
    return moved, R @ seen.R_camera_from_world


def _swing(seen: SeenTake, seed: int) -> np.ndarray:
    """(T, 2) pan and tilt in radians, 0 at first."""
    rng = np.random.default_rng([seed, zlib.crc32(seen.clip.encode()), 2])
    turn = 2 * np.pi * seen.keypoints.times / _PERIOD_S
    return np.stack(
        [
            np.radians(size) * (np.sin(pace * turn + phase) - np.sin(phase))
            for size, pace, phase in zip(
                (_PAN_DEG, _TILT_DEG), (1.0, 0.7), rng.uniform(0, 2 * np.pi, 2), strict=True
            )
        ],
        axis=-1,
    )


def _rotations(pan_tilt: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("yx", pan_tilt).as_matrix()


def _off(up: np.ndarray, seed: int, clip: str, error_deg: float) -> np.ndarray:
    rng = np.random.default_rng([seed, zlib.crc32(clip.encode()), 3])
    moved = up + np.radians(error_deg) / np.sqrt(2) * rng.standard_normal(3)
    return moved / np.linalg.norm(moved)
