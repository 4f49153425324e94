"""How wrong a lifter's joints are, and what that does to angles: stated standard deviations of
models/angle_error/take_angles.py.

The noise is a Gaussian over 14 joints at once (nose, head and spine enter no angle), in camera axes, so that depth may
be worse than what the image shows, and neighbouring joints err together; what turns or moves the whole body is no
part of it. It is kept as its largest modes, each one standard deviation long. A frame's noise is a multiple of it: by
the rectifier's own error there, by how much the limbs' lengths differ from the take's (a limb that is lifted too
short or too long lies wrong in depth), and by what the lifter itself states, where it does. 2D confidences say no more
than that and do not enter.

That is not all: in every frame a lifter also turns the whole body a little, and draws angles towards those that it saw
most, which no frame's spread tells. Each angle therefore has a part of its own that goes with the angle that was found
(`more`), added as squares. And the error of up has a factor of its own (`tilts`): an up that rests on the bodies leans
as they do, so that little of its error reaches an angle between body and up, while one that the image knows hides
nothing of what the lifter leans.

Nor does it tell all of what a lifter errs more in postures that its training had few of, and in fast motion: each angle
has a part for the lean of the trunk, a low pelvis, raised arms and speed (`postures`, posture.py), added as squares.

joint_noise.json: the modes and multiples were learned once, by the lab at commit dafbf430, on the shipped lifter's
takes of the 34 train subjects and the 9 validation subjects. Each angle's factor and `more`, which make nine in ten
errors lie within 1.645 standard deviations in every configuration of a run, are fitted by
models/lab/evaluation/errors.py on lifted validation subjects (models/rectifier/card.md has the split), also for another
lifter.

And how wrong each joint's place is, as an ellipsoid that holds. A lifter's own covariance is right about what differs
from frame to frame, and knows nothing of two turns that all its frames share. A person beside the camera's axis is seen
along a ray that only the focal length tells: its error as a share, times the tangent of the angle off the axis, turns
body and ray together. And bodies are lifted as if the camera looked more level than it does, by a share of its pitch.
Both turn about axes across the ray, so that joints in front of the pelvis and behind it move across, and those beside
it in depth.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.blocks import blocks
from ...pipeline.core.camera import pitch_roll_deg
from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.measures import SD_90
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite, known_median, rotate, transpose, unit
from ...pipeline.core.take import Take
from ...pipeline.signals.angles import ANGLES, angles, near

NOISE_FILE = Path(__file__).with_name("joint_noise.json")
JOINTS = tuple(name for name in H36M17.joints if name not in ("spine", "nose", "head"))
_LIMBS = tuple(bone for bone in H36M17.bones if bone[1].endswith(("knee", "ankle", "elbow", "wrist")))
_LEAST_SPREAD = 0.02  # of limb lengths, added so that a perfect frame is not believed without end
_MEAN_OF_STD = float(np.sqrt(2 / np.pi))  # mean size over standard deviation of a Gaussian
_MODEL_ALONE = (1.0, 0.0, 0.0, 0.0)  # rates of an angle that nothing was fitted to
_MEAN_OF_RMS = float(np.sqrt(np.pi) / 2)  # mean over root mean square of a direction's error, two dimensions
FOCAL_HEADING = 0.77  # mean error of a body's heading over Turns.heading, by takes of val subjects


@dataclass(frozen=True, eq=False)
class JointNoise:
    """modes: (K, 14, 3) joints of JOINTS in shares of stature, camera axes x right, y down, z away. usual: heading
    error in degrees, limb spread and stated spread of a frame whose noise is these modes; powers: how the noise grows
    with each. factors, tilts: by angle, on the propagated standard deviations of joints and heading, and of up. more:
    by angle, (found degrees, standard deviations in degrees) of the part that goes with the found angle, their squares
    on straight lines between. postures: by angle, the standard deviations in degrees that one of
    each column of posture.growth adds. rates: by angle, of its angular velocity: a share of what the smoother's model
    says, one of the rate, a least one in degrees a second, and what one of posture.growth's speed adds; their squares
    add. turn: of `joint_covariance`. lifter: whose poses these are the errors of, as
    PoseSequence.made_by names it."""

    modes: np.ndarray
    usual: tuple[float, float, float] = (5.0, 0.06, 0.016)
    powers: tuple[float, float, float] = (0.0, 0.0, 0.0)
    factors: dict[str, float] = field(default_factory=dict)
    tilts: dict[str, float] = field(default_factory=dict)
    more: dict[str, tuple[list[float], list[float]]] = field(default_factory=dict)
    postures: dict[str, list[float]] = field(default_factory=dict)
    rates: dict[str, tuple[float, float, float, float]] = field(default_factory=dict)
    turn: tuple[float, float, float] = (1.0, 1.0, 0.0)
    lifter: str = ""

    def whole(
        self,
        name: str,
        noise_deg: np.ndarray,
        tilt_deg: np.ndarray,
        found_deg: np.ndarray,
        growth: np.ndarray | None = None,
    ) -> np.ndarray:
        """(T,) an angle's standard deviation, of those that the joints' noise and up's error make, the angle itself
        (T,), degrees, and the posture (T, 4), as of posture.growth; None counts as standing."""
        square = noise_deg**2 + tilt_deg**2
        if growth is not None and name in self.postures:
            square = square + growth**2 @ np.square(self.postures[name])
        if name in self.more:
            at, more = self.more[name]
            square = square + np.interp(found_deg, at, np.square(more))
        return np.sqrt(square)

    def of_model(
        self, name: str, whole_degps: np.ndarray, rate_degps: np.ndarray, speed: np.ndarray | float = 0.0
    ) -> np.ndarray:
        """(T,) the model's part of `of_rate`, before its share."""
        rest = self.of_rate(name, np.zeros(len(rate_degps)), rate_degps, speed)
        return np.sqrt(np.maximum(whole_degps**2 - rest**2, 0.0)) / self.rates.get(name, _MODEL_ALONE)[0]

    def of_rate(
        self, name: str, sd_degps: np.ndarray, rate_degps: np.ndarray, speed: np.ndarray | float = 0.0
    ) -> np.ndarray:
        """(T,) an angular velocity's standard deviation, of that of the smoother's model sd_degps (T,), the rate itself
        (T,) and the body's speed (T,) as posture.growth has it: errors are larger in fast motion than any model of even
        noise says."""
        share, of_rate, least, of_speed = self.rates.get(name, _MODEL_ALONE)
        squares = (share * sd_degps) ** 2 + (of_rate * rate_degps) ** 2 + least**2
        return np.sqrt(squares + (of_speed * speed) ** 2)

    def scale(self, heading_deg: np.ndarray, limbs: np.ndarray, stated: np.ndarray) -> np.ndarray:
        """(T,) multiple of the modes in each frame; an unknown heading error or spread counts as the usual one."""
        ratios = np.stack([heading_deg, limbs, stated], axis=-1) / self.usual
        return np.prod(np.where(np.isfinite(ratios), ratios, 1.0) ** self.powers, axis=-1)

    def as_json(self) -> str:
        """As joint_noise.json holds it."""
        rounded = {
            "usual": [round(each, 5) for each in self.usual],
            "powers": [round(power, 3) for power in self.powers],
            "more": {name: {"found_deg": at, "sd_deg": more} for name, (at, more) in self.more.items()},
            "modes": [[round(float(v), 6) for v in mode.ravel()] for mode in self.modes],
        }
        return json.dumps(vars(self) | rounded) + "\n"


def shipped_noise() -> JointNoise:
    """What joint_noise.json holds, of the built-in lifter."""
    return read_noise(NOISE_FILE)


def made_by_the_built_in(poses: PoseSequence) -> bool:
    """Whether the errors of the built-in lifter are those of these poses."""
    return poses.lifted and poses.made_by.by == shipped_noise().lifter


@cache
def read_noise(path: Path) -> JointNoise:
    """InputError for a file that is no such file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return JointNoise(
            modes=np.array(content["modes"], dtype=np.float64).reshape(-1, len(JOINTS), 3),
            usual=tuple(content["usual"]),
            powers=tuple(content["powers"]),
            factors=dict(content["factors"]),
            tilts=dict(content["tilts"]),
            more={name: (more["found_deg"], more["sd_deg"]) for name, more in content["more"].items()},
            postures={name: list(map(float, each)) for name, each in content["postures"].items()},
            rates={name: tuple(each) for name, each in content["rates"].items()},
            turn=tuple(content["turn"]),
            lifter=str(content["lifter"]),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            "format-unknown",
            f"Expected {path} to hold the errors of a lifter's angles, as pcnet3d lab evaluate errors --fit writes "
            f"them; got {error or type(error).__name__}.",
        ) from error


def limb_spread(joints: np.ndarray) -> np.ndarray:
    """(T,) root mean square deviation of limb lengths from the take's medians, as a share; joints (T, 17, 3)."""
    ends = np.array([H36M17.indices(bone) for bone in _LIMBS])
    length = np.linalg.norm(joints[:, ends[:, 0]] - joints[:, ends[:, 1]], axis=-1)
    median = np.array([known_median(bone) for bone in length.T], length.dtype)
    square = (length / median - 1) ** 2
    count, square = np.isfinite(square).sum(axis=1), np.nansum(square, axis=1)
    return np.where(count > 0, _LEAST_SPREAD + np.sqrt(square / np.maximum(count, 1)), np.nan)


@dataclass(frozen=True, eq=False)
class LiftErrors:
    """Of lifted joints in CAMERA axes, whose noise is known in depth and across. error_deg, up_error_deg: (T,) of the
    rectification. noise: of the lifter. stated: (T,) the lifter's own error (`stated_spread`), None or NaN where it
    states none. growth: {of posture.arms_of: (T, 4) of posture.growth}, None where it does not count."""

    error_deg: np.ndarray
    up_error_deg: np.ndarray
    noise: JointNoise
    stated: np.ndarray | None = None
    growth: Mapping[str, np.ndarray] | None = None

    @property
    def heading_deg(self) -> np.ndarray:
        """(T,) the mean error of the heading, the part that is not up's (models/gravity/levelling.py)."""
        return np.sqrt(np.maximum(self.error_deg**2 - (_MEAN_OF_RMS * self.up_error_deg) ** 2, 0.0))

    def size(self, joints: np.ndarray) -> np.ndarray:
        """(T,) how long the modes of the joints' noise are in each frame of a take, in the unit of its joints (T, 17,
        3), in any axes."""
        stated = np.full(len(joints), np.nan) if self.stated is None else self.stated
        return self.noise.scale(self.heading_deg, limb_spread(joints), stated) * implied_stature(joints)

    def parts(
        self, body: np.ndarray, R_camera_from_body: np.ndarray, size: np.ndarray
    ) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """{angle: (T,) standard deviations in degrees of what the noise of joints and heading makes of it, and the
        error of up}, NaN where the angle is; what is stated is JointNoise.whole of them.

        body: (T, 17, 3) in BODY; R_camera_from_body (T, 3, 3), NaN where unknown, and then only angles without gravity
        can be had from joints in camera axes. size: (T,) of `size` of the whole take.

        Every mode of the joints' noise moves the body one standard deviation either way, as do a tilt to the front and
        to the side and a turn of the heading; half the difference of the two angles is that mode's part, and the
        squares add.
        """
        noise, heading = self.noise, self.heading_deg
        turned = np.asarray(is_finite(R_camera_from_body).all(axis=1))
        R_body_from_camera = np.where(turned[:, None, None], transpose(R_camera_from_body), np.eye(3))
        heading = np.where(np.isfinite(heading), heading, noise.usual[0]) / _MEAN_OF_STD
        tilt = np.where(np.isfinite(self.up_error_deg), self.up_error_deg, 0.0) / np.sqrt(2)
        parts = [
            _squares(body[rows], R_body_from_camera[rows], size[rows], tilt[rows], heading[rows], noise.modes)
            for rows in blocks(len(body))  # which stay within the cache
        ]
        out = {}
        for name in ANGLES:
            squares = (np.concatenate([part[i].pop(name) for part in parts]) for i in (0, 1))
            joints, up = (np.sqrt(square.astype(np.float32)) for square in squares)
            out[name] = noise.factors.get(name, 1.0) * joints, noise.tilts.get(name, 1.0) * up
        return out


def _squares(
    body: np.ndarray,
    R_body_from_camera: np.ndarray,
    size: np.ndarray,
    tilt_deg: np.ndarray,
    heading_deg: np.ndarray,
    modes: np.ndarray,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """{angle: (T,) variance in square degrees} of joints and heading, and of up."""
    # Joints and their axes first, (17, 3, T), as `angles` works: moving the axes of every step would take longer.
    points = np.ascontiguousarray(np.moveaxis(body, 0, -1))
    scaled = np.ascontiguousarray(np.moveaxis(size[:, None, None] * R_body_from_camera, 0, -1))
    of_all = np.zeros((len(modes), len(points), 3))
    of_all[:, H36M17.indices(JOINTS)] = modes
    noise, up = ({name: np.zeros(len(body)) for name in ANGLES} for _ in range(2))

    def add(plus: np.ndarray, minus: np.ndarray, to: dict[str, np.ndarray]) -> None:
        above, below = (angles(np.moveaxis(stepped, -1, 0)) for stepped in (plus, minus))
        for name in ANGLES:
            to[name] += (near(above[name] - below[name], 0.0) / 2) ** 2

    for mode in of_all:
        step = np.einsum("bct,jc->jbt", scaled, mode)
        add(points + step, points - step, noise)
    for axis, deg, to in ((0, tilt_deg, up), (1, tilt_deg, up), (2, heading_deg, noise)):
        add(_turned(points, axis, deg), _turned(points, axis, -deg), to)
    return noise, up


def _turned(points: np.ndarray, axis: int, angle_deg: np.ndarray) -> np.ndarray:
    """points (17, 3, T) of BODY turned about one of its axes by (T,) degrees."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    out = points.copy()
    out[:, a] = cosine * points[:, a] - sine * points[:, b]
    out[:, b] = sine * points[:, a] + cosine * points[:, b]
    return out


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
