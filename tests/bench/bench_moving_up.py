"""What a lift gains from the up that the images of a moving camera tell:

    python tests/bench/bench_moving_up.py [val|test|hdm05|tennis] [seed]

Upright takes of 2 s and more before wild cameras that follow the person and are held by hand: pitch and roll sway by
4 and 3 degrees (standard deviation) within about a second. An image in every tenth frame tells up with the error of
rendered rooms, four in five of them, over the whole take or over its first half, quarter. Lifted without and with
known_moving_up; rectified with the images in both cases. Means over frames: tilt and rotation in degrees, MPJPE in mm
in LEVEL with one scale a take, frame-to-frame jitter of its error (second difference, mm); knee and sagittal lean RMSE.
"""

from __future__ import annotations

import sys
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from pcnet3d.models import load_rectifier
from pcnet3d.models.angle_error.take_angles import smoothed
from pcnet3d.models.common.metrics import joint_error, relative
from pcnet3d.models.common.spread import stated_spread
from pcnet3d.models.gravity import Seen, known_moving_up, level_moving
from pcnet3d.models.gravity.levelling import camera_frame
from pcnet3d.models.gravity.moving import timed
from pcnet3d.models.lab.evaluation.take_answers import joints_of, simulated_look
from pcnet3d.models.lab.mocap.clips import lying, read_clips
from pcnet3d.models.lab.synthetic.cameras import WILD, Cameras, place
from pcnet3d.models.lab.synthetic.keypoint_noise import detect
from pcnet3d.models.lifter.builtin import lift
from pcnet3d.pipeline import H36M17, IMAGE, InputError, PoseSequence
from pcnet3d.pipeline.core.camera import Look
from pcnet3d.pipeline.core.canonical import R_world_from_body
from pcnet3d.pipeline.core.rotations import angle_deg, geodesic_deg, rotate, transpose
from pcnet3d.pipeline.reading.mocap.clip import Clip
from pcnet3d.pipeline.signals.angles import angles

SWAY_DEG, SWAY_S = (4.0, 3.0), 1.0
COVERED = {"all": 1.0, "first half": 0.5, "first quarter": 0.25}
PCNET = load_rectifier("pcnet")


@dataclass(frozen=True, eq=False)
class Moving:
    """A clip before a camera that moves. truth: (T, 17, 3) CAMERA axes, relative to the pelvis; R_camera_from_world,
    R_camera_from_body: (T, 3, 3)."""

    clip: Clip
    keypoints: PoseSequence
    image_size: tuple[int, int]
    truth: np.ndarray
    R_camera_from_world: np.ndarray
    R_camera_from_body: np.ndarray


def seen(clip: Clip, seed: int) -> Moving:
    rng = np.random.default_rng([seed, zlib.crc32(clip.name.encode())])
    world, frames = clip.joints[None].astype(np.float64), len(clip)
    following = place(world, rng, replace(WILD, pans=1.0))
    sway = gaussian_filter1d(rng.standard_normal((frames + 400, 2)), SWAY_S * clip.fps, axis=0)[200:-200]
    sway *= np.array(SWAY_DEG) * np.sqrt(2 * SWAY_S * clip.fps * np.sqrt(np.pi))  # to that standard deviation
    R = Rotation.from_euler("xz", sway, degrees=True).as_matrix() @ following.R_camera_from_world[0]
    cameras = Cameras(R[None], following.position, following.focal_px, following.image_size)
    joints = cameras.to_camera(world)
    pixels, confidence = detect(cameras.project(joints), joints, rng, None, clip.fps)
    time_s = np.arange(frames) / clip.fps
    keypoints = PoseSequence(pixels[0], H36M17, IMAGE, confidence[0], time_s, np.arange(frames))
    width, height = (int(side) for side in cameras.image_size[0])
    return Moving(clip, keypoints, (width, height), relative(joints[0]), R, R @ R_world_from_body(world[0]))


def looks_of(take: Moving, seed: int, share: float) -> list[Look]:
    """Of the first share of the take."""
    name, frames = take.clip.name, len(take.truth)
    answered = np.random.default_rng([seed, zlib.crc32(name.encode()), 2]).uniform(size=frames) < 0.8
    up = take.R_camera_from_world[:, :, 2]
    return [
        replace(simulated_look(up[frame], seed, f"{name} {frame}"), frame=frame)
        for frame in range(0, round(share * frames), 10)
        if answered[frame]
    ]


def judged(take: Moving, poses: PoseSequence, looks: list[Look]) -> dict[str, np.ndarray]:
    joints = joints_of(poses, take.truth)
    R, error_deg = PCNET.rotation(joints)
    frames = Seen(joints, R, error_deg, poses.times, spread=stated_spread(poses))
    level = level_moving(frames, timed(looks, poses))
    up = take.R_camera_from_world[:, :, 2]
    found, truth = (
        rotate(transpose(level.R_camera_from_level), joints),
        rotate(transpose(camera_frame(up)), take.truth),
    )
    bodies = [
        angles(rotate(transpose(R), smoothed(each, poses.times)))
        for R, each in ((level.R_camera_from_body, joints), (take.R_camera_from_body, take.truth))
    ]
    off = {name: bodies[0][name] - bodies[1][name] for name in bodies[0]}
    return {
        "tilt": angle_deg(level.R_camera_from_level[:, :, 2], up),
        "rotation": geodesic_deg(level.R_camera_from_body, take.R_camera_from_body),
        "LEVEL": 1000 * joint_error(found, truth),
        "jitter": 1000 * np.linalg.norm(np.diff(found - truth, n=2, axis=0), axis=-1).mean(axis=-1),
        "knee": np.concatenate([off[f"{side}_knee_flexion"] for side in "lr"]) ** 2,
        "lean": off["trunk_lean_sagittal"] ** 2,
    }


def takes_of(subjects: str, seed: int) -> Iterator[Moving]:
    for clip in read_clips(subjects):  # type: ignore[arg-type]
        if len(clip) / clip.fps >= 2 and not lying(clip.joints.astype(np.float64)).any():
            yield seen(clip, seed)


def main(subjects: str = "val", seed: int = 0) -> None:
    rows: dict[tuple[str, str], list[dict[str, np.ndarray]]] = {}
    count = left = 0
    for take in takes_of(subjects, seed):
        try:
            first = lift(take.keypoints, take.image_size)
        except InputError:  # swayed out of the image
            left += 1
            continue
        count += 1
        for covered, share in COVERED.items():
            looks = looks_of(take, seed, share)
            up = known_moving_up(first, PCNET, looks)
            told = first if up is None else lift(take.keypoints, take.image_size, up=up)
            for name, poses in (("not told", first), ("told", told)):
                rows.setdefault((covered, name), []).append(judged(take, poses, looks))
    print(f"{subjects}, seed {seed}: {count} takes; {left} left out, outside the image")
    for (covered, name), takes in rows.items():
        figures = {key: np.nanmean(np.concatenate([take[key] for take in takes])) for key in takes[0]}
        words = [
            f"{key} {np.sqrt(value) if key in ('knee', 'lean') else value:.2f}"
            for key, value in figures.items()
        ]
        print(f"{covered}, {name}: {', '.join(words)}")


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:3]))
