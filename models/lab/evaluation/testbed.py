"""Lifted takes with truth: motion capture through a virtual camera, a noisy detector and the lifter:

pcnet3d lab testbed test -o takes.npz

What everything after the lifter is judged on. A take depends on the seed and its clip's name only, so a subset of
the clips gives the same takes. The command writes them as files for training.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import torch
from typer import Argument, Option

from ....pipeline.core.camera import Look
from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import IMAGE
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.lifted import ToLift
from ....pipeline.core.messages import how_many
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import is_finite, rotate, unit
from ....pipeline.files.arrays import write_arrays
from ....pipeline.files.atomic import refuse_unwritable
from ....pipeline.reading.settings import OnDevice
from ....pipeline.signals.filters import derivative, lowpass
from ...common.canonical import R_world_from_body
from ...common.metrics import relative
from ...common.spread import stated_spread
from ...gravity.lines import tangent
from ...lifter.builtin import OwnLifter, network
from ...lifter.features import body_rays
from ...lifter.load import load_lifter
from ..common.metrics import scaled
from ..mocap.clips import Clip, Subjects, lying, read_clips
from ..synthetic.bodies import BodyRange, vary
from ..synthetic.cameras import TYPICAL, WILD, Cameras, ViewRange, place
from ..synthetic.draw import NumpyDraw
from ..synthetic.keypoint_noise import Noise, detect

MIN_FRAMES = 30
LOOK_DEG = np.array([1.2, 0.6])  # pitch and roll of up by an image: what photographs give
_LAID_SD_DEG = 12.0  # of how far from level a laid body lies
_POSED_S = 3.0  # of a clip that is posed: who is posed once stays so, and more seconds tell little more
_ON_THE_FLOOR = 0.05  # share of its joints below the floor

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

    @property
    def world(self) -> np.ndarray:
        """(T, 17, 3) metres, +Z up, the origin at the camera."""
        return rotate(np.swapaxes(self.R_camera_from_world, -1, -2), self.joints_camera)


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
    bodies: BodyRange | None = None,
    views: ViewRange = WILD,
    only: Callable[[Clip], bool] | None = None,
    trained_on: bool = False,
    laid: float = 0.0,
) -> Iterator[LiftedTake]:
    """Every clip of at least MIN_FRAMES frames, seen by one static camera and lifted.

    model: never one that saw the subjects, which is refused unless trained_on says that they are not judged by. laid:
    of so large a share of the clips only, whose bodies are laid down, none where it is 0. bodies: draw other
    proportions (for training); None keeps the captured ones. views: what the cameras are drawn from. only: which of the
    clips; None takes all.
    """
    lifter = load_lifter(model)
    saw = network(lifter.model).trained_on if isinstance(lifter, OwnLifter) else ""
    if not trained_on and saw == subjects:
        raise InputError(
            "files-apart",
            f"Expected a lifter that never saw the subjects '{subjects}', but {model} was trained on them; say "
            "--trained-on where nobody is judged by these takes.",
        )
    for clip in read_clips(subjects):
        rng = _rng(clip, seed, 1)
        if len(clip) >= MIN_FRAMES and (only is None or only(clip)) and (not laid or rng.uniform() < laid):
            clip = lay_down(clip, rng) if laid else clip
            take = see(clip, seed, bodies=bodies, views=views)
            yield LiftedTake(lifted_by(model, take), take)


def lifted_by(model: str | Path, seen: SeenTake, up: np.ndarray | None = None) -> PoseSequence:
    """The lift by any lifter of load_lifter, which is told up (3,) only if it takes it."""
    lifter = load_lifter(model)
    told = up if "up" in lifter.takes else None
    return lifter.lift(ToLift(seen.keypoints, seen.image_size, up=told)).noted()


def lay_down(clip: Clip, rng: np.random.Generator) -> Clip:
    """The motion of a body that lies on its back, front or a side: turned about a level axis by about 90 degrees."""
    from scipy.spatial.transform import Rotation

    towards, angle = rng.uniform(0, 2 * np.pi), np.radians(90 + _LAID_SD_DEG * rng.standard_normal())
    R = Rotation.from_rotvec(angle * np.array([np.cos(towards), np.sin(towards), 0.0])).as_matrix()
    pelvis = clip.joints[:, [H36M17.index("pelvis")]]
    joints = pelvis + rotate(R, clip.joints - pelvis)
    joints[..., 2] -= np.quantile(joints[..., 2], _ON_THE_FLOOR)
    return replace(clip, joints=joints.astype(np.float32))


def raise_arms(clip: Clip, rng: np.random.Generator) -> Clip:
    """The motion with one arm or both turned upwards about the shoulders' axis, so far that an arm which hangs points
    straight up, and one that points forward stays; elbows bend as they did."""
    from scipy.spatial.transform import Rotation

    joints = clip.joints.astype(np.float64)
    pelvis, thorax, left, right = H36M17.indices(("pelvis", "thorax", "l_shoulder", "r_shoulder"))
    up, across = unit(joints[:, thorax] - joints[:, pelvis]), joints[:, left] - joints[:, right]
    across = unit(across - (across * up).sum(axis=1, keepdims=True) * up)
    front = np.cross(across, up)
    for side in ("r", "l", "rl")[rng.integers(3)]:
        shoulder, *arm = H36M17.indices([f"{side}_{part}" for part in ("shoulder", "elbow", "wrist")])
        limb = joints[:, arm] - joints[:, [shoulder]]
        forward = np.arctan2((limb[:, 0] * front).sum(axis=1), -(limb[:, 0] * up).sum(axis=1))
        R = Rotation.from_rotvec(-(np.pi - 2 * forward)[:, None] * across).as_matrix()
        joints[:, arm] = joints[:, [shoulder]] + rotate(R, limb)
    return replace(clip, joints=joints.astype(np.float32))


# How a clip's body is posed, by name.
POSES: dict[str, Callable[[Clip, np.random.Generator], Clip]] = {"arms raised": raise_arms}


def posed(clip: Clip, pose: str, seed: int) -> Clip:
    """The clip's beginning in one of POSES, the same for the same seed and clip; the clip as it is for ""."""
    if not pose:
        return clip
    return POSES[pose](replace(clip, joints=clip.joints[: round(_POSED_S * clip.fps)]), _rng(clip, seed, 1))


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


def filtered(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """path (T, J, 3) without gaps through the low-pass."""
    return lowpass(path.reshape(len(path), -1), time_s).reshape(path.shape)


def accelerations(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, J, 3) m/s^2 of path (T, J, 3) metres without gaps, filtered."""
    return derivative(filtered(path, time_s), time_s, order=2)


def _rng(clip: Clip, *seeds: int) -> np.random.Generator:
    return np.random.default_rng([*seeds, zlib.crc32(clip.name.encode())])


def write_takes(
    subjects: Annotated[Subjects, Argument(help="Whose takes.")],
    output: Annotated[Path, Option("-o", "--output", help="The .npz file.")],
    seed: Annotated[int, Option(min=0, help="Random seed.")] = 0,
    lifter: Annotated[str, Option(help="A name or an .onnx file, not trained on the subjects.")] = "pcnet3d",
    bodies: Annotated[bool, Option("--bodies", help="Draw other proportions and mirror some.")] = False,
    bed: Annotated[Bed, Option(help="Cameras: from everywhere, or as people film.")] = "wild",
    trained_on: Annotated[bool, Option("--trained-on", help="Also people the lifter knows.")] = False,
    laid: Annotated[float, Option(min=0, max=1, help="Only this share, with bodies that lie.")] = 0.0,
    device: OnDevice = "auto",
) -> None:
    """Write lifted takes with ground truth for training and evaluation.

    One .npz of plain arrays, takes one after another: lifted, truth (N, 17, 3), R_camera_from_body (N, 3, 3),
    up (N, 3), lying (N,), spread (N,), the lifter's stated error (models/common/spread.py); take_start (C + 1,),
    clip, subject, source (C,); device (), where the lifter computed.
    """
    refuse_unwritable(output.parent)
    with computing_on(device) as where:
        drawn, views = BodyRange() if bodies else None, BEDS[bed]
        given: dict[str, Any] = {"model": lifter, "trained_on": trained_on, "laid": laid}
        takes = list(lifted_takes(subjects, seed, bodies=drawn, views=views, **given))
    if not takes:
        raise InputError(
            "nothing-usable", f"There is no take of {MIN_FRAMES} frames or more of the subjects '{subjects}'."
        )
    frames, seen = [len(take.lifted) for take in takes], [take.seen for take in takes]
    output.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(
        output,
        lifted=np.concatenate([take.lifted.joints for take in takes]),
        truth=np.concatenate([take.truth for take in seen]).astype(np.float32),
        R_camera_from_body=np.concatenate([take.R_camera_from_body for take in seen]),
        up=np.concatenate([np.tile(take.up, (len(take.lying), 1)) for take in seen]),
        lying=np.concatenate([take.lying for take in seen]),
        spread=np.concatenate([stated_spread(take.lifted) for take in takes]).astype(np.float32),
        take_start=np.cumsum([0, *frames]),
        **{name: np.array([getattr(take, name) for take in seen]) for name in ("clip", "subject", "source")},
        device=np.array(", ".join(sorted({*where.used.values()}))),
    )
    print(f"{output}: {how_many(len(takes), 'take')}, {sum(frames):,} frames")
