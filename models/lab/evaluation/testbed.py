"""Takes whose truth is known: motion capture through a virtual camera, a noisy detector and a lifter, and real videos
(docs/training.md).

What everything after the lifter is judged on. A virtual take depends on the seed and its clip's name only, so a subset
of the clips gives the same takes.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import torch

from ....pipeline.core.camera import Look
from ....pipeline.core.errors import InputError, readable
from ....pipeline.core.frames import IMAGE
from ....pipeline.core.layouts import H36M17, LIMBS
from ....pipeline.core.lifted import ToLift
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import is_finite, rotate, transpose, unit
from ....pipeline.core.take import Video
from ....pipeline.files.arrays import load_all
from ....pipeline.reading.choose import choose_person
from ....pipeline.reading.load import read_video
from ....pipeline.running.progress import each
from ....pipeline.signals.filters import derivative
from ...angle_error.take_angles import smoothed
from ...common.canonical import R_world_from_body
from ...common.metrics import relative
from ...detector.load import load_detector
from ...detector.video import detect as detect_in
from ...gravity.images import tangent
from ...lifter.load import load_lifter
from ..common.metrics import scaled
from ..mocap.clips import Clip, data_folder, lying
from ..synthetic.bodies import BodyRange, vary
from ..synthetic.cameras import TYPICAL, WILD, Cameras, ViewRange, place
from ..synthetic.draw import NumpyDraw
from ..synthetic.keypoint_noise import Noise, detect

MIN_FRAMES = 30
LOOK_DEG = np.array([1.2, 0.6])  # pitch and roll of up by an image: what photographs give
_LAID_SD_DEG = 12.0  # of how far from level a laid body lies
_ON_THE_FLOOR = 0.05  # share of its joints below the floor

BALANCING, STANDING = "pose2sim", "pose2sim_static"  # folders of the data's README, under real/
_DETECTOR = Path("models") / "movenet_lightning_int8.onnx"

Bed = Literal["wild", "typical"]
# Degrees from where a person faces to the camera, to the right or the left.
VIEWS = {"front": (0.0, 15.0), "oblique": (30.0, 60.0), "side": (75.0, 105.0), "back": (165.0, 180.0)}
_STEADY = (
    0.9  # mean resultant of the headings, below which a person turns: a standard deviation of 26 degrees
)
BEDS: dict[Bed, ViewRange] = {"wild": WILD, "typical": TYPICAL}


@dataclass(frozen=True, eq=False)
class SeenTake:
    """One clip as a camera and a detector saw it, and what is true about it.

    keypoints: the detector's answer, IMAGE, pixels, of the frames in which it finds somebody. image_size, focal_px: the
        camera's.
    time_s: (T,) of all frames. joints_camera: (T, 17, 3) metres, the truth, origin at the camera.
    R_camera_from_world: (3, 3), or (T, 3, 3) of a camera that pans, world +Z up; its third column is `up`.
    clip, subject: where it comes from.
    """

    keypoints: PoseSequence
    image_size: tuple[int, int]
    focal_px: float
    time_s: np.ndarray
    joints_camera: np.ndarray
    R_camera_from_world: np.ndarray
    clip: str
    subject: str

    @cached_property
    def R_camera_from_body(self) -> np.ndarray:
        """(T, 3, 3), the truth by design.md section 4."""
        return self.R_camera_from_world @ R_world_from_body(self.world)

    @cached_property
    def lying(self) -> np.ndarray:
        """(T,) by trunk angle."""
        return lying(self.world)

    @property
    def up(self) -> np.ndarray:
        """(3,) or (T, 3) against gravity, in the camera."""
        return self.R_camera_from_world[..., :, 2]

    @property
    def truth(self) -> np.ndarray:
        """(T, 17, 3) metres, CAMERA axes, relative to the pelvis."""
        return relative(self.joints_camera)

    @cached_property
    def world(self) -> np.ndarray:
        """(T, 17, 3) metres, +Z up, the origin at the camera."""
        return rotate(transpose(self.R_camera_from_world), self.joints_camera)


@dataclass(frozen=True, eq=False)
class LiftedTake:
    """What a user has, and the truth behind it. lifted: CAMERA axes, relative to the pelvis, unit arbitrary."""

    lifted: PoseSequence
    seen: SeenTake


def lifted_by(model: str | Path, seen: SeenTake, up: np.ndarray | None = None) -> PoseSequence:
    """The lift by any lifter of load_lifter, which is told up (3,) only if it takes it."""
    lifter = load_lifter(model)
    told = up if "up" in lifter.takes else None
    return lifter.lift(ToLift(seen.keypoints, seen.image_size, up=told)).noted()


def laid_down(clip: Clip, seed: int, share: float) -> Clip | None:
    """The motion of a body that lies on its back, front or a side: turned about a level axis by about 90 degrees; None
    of all but such a share of the clips."""
    from scipy.spatial.transform import Rotation

    rng = _rng(clip, seed, 1)
    if rng.uniform() >= share:
        return None
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
    R_camera_from_world = cameras.R_camera_from_world[0].numpy()
    time_s = np.arange(len(clip)) / clip.fps
    width, height = (int(side) for side in cameras.image_size[0])
    return SeenTake(
        keypoints=PoseSequence(pixels, H36M17, IMAGE, confidence, time_s, np.arange(len(clip))),
        image_size=(width, height),
        focal_px=float(cameras.focal_px[0]),
        time_s=time_s,
        joints_camera=shown[0].numpy(),
        R_camera_from_world=R_camera_from_world if views.pans else R_camera_from_world[0],
        clip=clip.name,
        subject=clip.subject,
    )


def seen_from(clip: Clip, side: str, views: ViewRange) -> ViewRange | None:
    """The range with the yaws from which a camera sees that side of VIEWS, of every second clip on the person's left;
    None of a clip whose person turns."""
    back = R_world_from_body(clip.joints.astype(np.float64))[:, :2, 0]
    facing = -back[is_finite(back)].mean(axis=0)
    if not np.linalg.norm(facing) >= _STEADY:
        return None
    left = 1 if zlib.crc32(clip.name.encode()) % 2 else -1
    at = np.degrees(np.arctan2(facing[1], facing[0])) + 180 + left * np.array(VIEWS[side])
    return replace(views, yaw_deg=(float(at.min()), float(at.max())))


def simulated_look(up: np.ndarray, seed: int, clip: str) -> Look:
    """What an image says about a true up (3,), as well as images of rooms and streets do (docs/up.md); the same for
    the same seed and clip."""
    rng = np.random.default_rng([seed, zlib.crc32(clip.encode()), 1])
    plane = tangent(up)
    said = unit(up + plane @ (np.radians(LOOK_DEG) * rng.standard_normal(2)))
    plane = tangent(said)
    return Look(0, said, plane @ np.diag(np.radians(LOOK_DEG) ** 2) @ plane.T, failure=0.01)


def joints_of(poses: PoseSequence, truth: np.ndarray) -> np.ndarray:
    """(T, 17, 3) a lift at the truth's scale, one factor for the take."""
    return scaled(poses.joints.astype(np.float64), truth, "take")


def accelerations(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, J, 3) m/s^2 of path (T, J, 3) metres without gaps, filtered."""
    return derivative(smoothed(path, time_s), time_s, order=2)


def _rng(clip: Clip, *seeds: int) -> np.random.Generator:
    return np.random.default_rng([*seeds, zlib.crc32(clip.name.encode())])


def real_takes(name: str) -> Iterator[tuple[str, SeenTake, Video]]:
    """("real take", what is true, the video) of each camera of a real take, BALANCING or STANDING. The truth has the
    limbs alone, pelvis and thorax between them; other joints are NaN, and all of a take of which only up is known.
    InputError where the data is not."""
    folder = data_folder() / "real" / name
    cameras, limbs = read_cameras(folder), read_limbs(folder)
    for camera, said in each(cameras.items(), "cameras", len(cameras)):
        video, keypoints = read_seen(folder / f"{camera}.mp4")
        if limbs is None:
            up = unit(said["up_in_camera"])
            across = tangent(up)[:, 0]
            R_camera_from_world = np.column_stack([across, np.cross(up, across), up])
            joints = np.full((len(video.time_s), len(H36M17), 3), np.nan)
        else:
            R_camera_from_world = said["R_camera_from_world"]
            joints = rotate(R_camera_from_world, whole_body(limbs)) + said["t_m"]
        lens, time_s = float(said["focal_px"].mean()), video.time_s
        truth = SeenTake(
            keypoints, video.size, lens, time_s, joints, R_camera_from_world, camera, "real take"
        )
        yield "real take", truth, video


def read_cameras(folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """{camera: what its take's cameras.json says of it}: up_in_camera (3,), against gravity, and focal_px (2,); of a
    take with truth also R_camera_from_world (3, 3), world +Z up, and t_m (3,): x_camera = R x_world + t. InputError
    when the file is missing."""
    path = folder / "cameras.json"
    with readable(path, "the cameras of a real take"):
        cameras = json.loads(path.read_text(encoding="utf-8"))["cameras"]
    return {camera: {key: np.array(of) for key, of in said.items()} for camera, said in cameras.items()}


def read_limbs(folder: Path) -> np.ndarray | None:
    """A real take's true limbs (T, 12, 3) in metres, joints LIMBS, world +Z up, row i of frame i of every video; None
    of a take that has none."""
    path = folder / "truth.npz"
    if not path.exists():
        return None
    arrays = load_all(path, "joints", "joint_names")
    names = arrays["joint_names"].tolist()
    return arrays["joints"][:, [names.index(joint) for joint in LIMBS]].astype(np.float64)


@cache
def read_seen(path: Path) -> tuple[Video, PoseSequence]:
    """A video, and in COCO17, IMAGE, whom the data's own detector sees in it for longest, looking as often as in a run;
    once in a process, for several reports on it. InputError where nobody is seen."""
    video = read_video(path)
    found = detect_in(video, load_detector(data_folder() / _DETECTOR, looks=None))
    if not len(found.person):
        raise InputError("nothing-usable", f"Expected a person in {path}, but {found.method} finds nobody.")
    return video, choose_person(found.people(), "longest", str(path))


def whole_body(limbs: np.ndarray) -> np.ndarray:
    """(T, 17, 3) of joints LIMBS (T, 12, 3), in the same axes; pelvis and thorax are the middles of hips and shoulders,
    others NaN."""
    whole = np.full((len(limbs), len(H36M17), 3), np.nan)
    whole[:, H36M17.indices(LIMBS)] = limbs
    for middle, part in (("pelvis", "hip"), ("thorax", "shoulder")):
        whole[:, H36M17.index(middle)] = whole[:, H36M17.indices((f"r_{part}", f"l_{part}"))].mean(axis=1)
    return whole
