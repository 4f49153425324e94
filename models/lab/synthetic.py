"""Synthetic views of motion capture, made in torch: other poses and bodies, virtual cameras, keypoints as detectors see
them, and the views of the paper. For trainings on the device that trains, and for test beds.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import torch
from pydantic import Field
from scipy.spatial.transform import Rotation
from torch import Tensor

from ...pipeline.core.camera import view_rotation
from ...pipeline.core.frames import CAMERA, PC_CAMERA
from ...pipeline.core.layouts import H36M17, LIMBS
from ...pipeline.core.rotations import is_finite
from ..common.canonical import R_world_from_body
from ..common.metrics import relative
from ..common.vectors import Array, across, dot, length, picked, rotate, transpose, unit
from .cases import by_person
from .clips import OWN_SKELETON, Clip, person

Share = Annotated[float, Field(ge=0, le=1)]
Size = Annotated[float, Field(ge=0, allow_inf_nan=False)]  # such as a standard deviation


class Draw:
    """The same seed and step give the same numbers on the same kind of device, whatever came before. rng: numpy's."""

    dtype = torch.float32

    def __init__(self, seed: int, step: int, device: torch.device | str = "cpu") -> None:
        self.device = torch.device(device)
        self.rng = np.random.default_rng([seed, step])
        self._generator = torch.Generator(self.device)
        self._generator.manual_seed((seed * 1_000_003 + step) % 2**63)

    def rand(self, *shape: int) -> Tensor:
        """Numbers between 0 and 1."""
        return torch.rand(*shape, generator=self._generator, device=self.device)

    def randn(self, *shape: int) -> Tensor:
        """Standard normal numbers."""
        return torch.randn(*shape, generator=self._generator, device=self.device)

    def integers(self, below: int, *shape: int) -> Tensor:
        return torch.randint(below, shape, generator=self._generator, device=self.device)

    def choice(self, weights: Tensor, count: int) -> Tensor:
        """(count,) places among the weights, as often as they weigh."""
        return torch.multinomial(weights, count, replacement=True, generator=self._generator)

    def runs(self, rate: Tensor, mean_length: float) -> Tensor:
        """Booleans of rate's shape (..., T): runs that start with that probability a frame and last geometrically
        long."""
        start = self.share(rate, *rate.shape)
        stays = min(max(1 - 1 / mean_length, 1e-6), 1 - 1e-6)
        length = (self.uniform((1e-7, 1.0), *rate.shape).log() / np.log(stays)).ceil()
        return _lasting(start, length)

    def ar1(self, coefficient: float, *shape: int) -> Tensor:
        """Stationary AR(1) noise of unit variance along the time axis of (B, T, J, 2)."""
        white = self.randn(*shape)
        frame = torch.arange(shape[1], device=self.device)
        lag = frame[:, None] - frame
        weights = torch.where(lag >= 0, coefficient ** lag.clamp_min(0).float(), 0.0)
        weights[:, 1:] *= (1 - coefficient**2) ** 0.5
        return torch.einsum("ts,bsjk->btjk", weights, white)

    def uniform(self, between: tuple[float, float], *shape: int) -> Tensor:
        low, high = between
        return low + (high - low) * self.rand(*shape)

    def log_uniform(self, between: tuple[float, float], *shape: int) -> Tensor:
        low, high = between
        return low * (high / low) ** self.rand(*shape)

    def normal(self, *shape: int, most: float | None = None) -> Tensor:
        """Standard normal numbers; those beyond `most` become it."""
        values = self.randn(*shape)
        return values if most is None else values.clamp(-most, most)

    def share(self, probability: float | Tensor, *shape: int) -> Tensor:
        """Booleans, True with that probability."""
        return self.rand(*shape) < probability


class NumpyDraw(Draw):
    """The same of a numpy generator, in double precision on the CPU: for test beds."""

    dtype = torch.float64

    def __init__(self, rng: np.random.Generator) -> None:
        self.device, self.rng = torch.device("cpu"), rng

    def rand(self, *shape: int) -> Tensor:
        return torch.from_numpy(self.rng.random(shape))

    def randn(self, *shape: int) -> Tensor:
        return torch.from_numpy(self.rng.standard_normal(shape))

    def integers(self, below: int, *shape: int) -> Tensor:
        return torch.from_numpy(self.rng.integers(below, size=shape))

    def runs(self, rate: Tensor, mean_length: float) -> Tensor:
        start = self.share(rate, *rate.shape)
        return _lasting(start, torch.from_numpy(self.rng.geometric(1 / mean_length, rate.shape)))

    def ar1(self, coefficient: float, *shape: int) -> Tensor:
        from scipy.signal import lfilter

        white = self.rng.standard_normal(shape, dtype=np.float32)
        white[:, 1:] *= np.sqrt(1 - coefficient**2)
        return torch.from_numpy(np.asarray(lfilter([1.0], [1.0, -coefficient], white, axis=1)))


def _lasting(start: Tensor, length: Tensor) -> Tensor:
    """(..., T) True from every start on for so many frames."""
    frame = torch.arange(start.shape[-1], device=start.device)
    return torch.where(start, frame + length, 0).cummax(dim=-1).values > frame


# Child by parent, each parent before its children. "nose" and "head" hang on the thorax and the nose.
_TREE = {
    "r_hip": "pelvis", "r_knee": "r_hip", "r_ankle": "r_knee",
    "l_hip": "pelvis", "l_knee": "l_hip", "l_ankle": "l_knee",
    "spine": "pelvis", "thorax": "spine", "nose": "thorax", "head": "nose",
    "l_shoulder": "thorax", "l_elbow": "l_shoulder", "l_wrist": "l_elbow",
    "r_shoulder": "thorax", "r_elbow": "r_shoulder", "r_wrist": "r_elbow",
}  # fmt: skip
# Rows of each bone's ends in H36M17, parents before their children.
CHILDREN = H36M17.indices(list(_TREE))
PARENTS = H36M17.indices(list(_TREE.values()))
_LEGS = [bone for bone, joint in enumerate(_TREE) if joint[2:] in ("knee", "ankle")]
_PARENT_OF = H36M17.indices([_TREE.get(joint, joint) for joint in H36M17.joints])  # the pelvis's is itself
# Of each joint the same one on the left, or itself.
_LEFT = H36M17.indices([f"l_{joint[2:]}" if joint[:2] == "r_" else joint for joint in H36M17.joints])
_UPPER = [not joint.endswith(("pelvis", "hip", "knee", "ankle")) for joint in H36M17.joints]
STANDARD_SIZE_M = 3.9  # sum of the 16 bones of a person about 1.7 m tall


# Widths over the sum of all bones, uniform: 2D detectors put hips and shoulders wider than optical capture does.
_WIDTHS = {"hip": (0.033, 0.075), "shoulder": (0.055, 0.105)}


@dataclass(frozen=True)
class BodyRange:
    """What proportions are drawn from, for captures of one laboratory share few skeletons."""

    limbs: Size = 0.05  # standard deviation of the logarithm of a factor on the bones' lengths
    trunk: Size = 0.05  # the same
    unchanged: Share = 0.3  # share of windows that keep the captured body
    mirrored: Share = 0.5  # share that is mirrored left to right


def size_m(joints: Array) -> Array:
    """(...,) a person's size: the sum of the 16 bone lengths, averaged over time; joints (..., T, 17, 3) metres."""
    return _summed(picked(joints, CHILDREN) - picked(joints, PARENTS))


def resize(joints: Array, factors: Array) -> Array:
    """joints (..., T, 17, 3) with every bone's length multiplied; factors (..., 17) by the bone's child joint.

    Bone directions stay exactly. The root's path is multiplied by the change of leg length, so that the feet
    stay near the floor (z = 0 in a world frame) and a step stays a step.
    """
    bones = picked(joints, CHILDREN) - picked(joints, PARENTS)
    scaled = bones * factors[..., None, CHILDREN, None]
    before, after = (_summed(picked(part, _LEGS)) for part in (bones, scaled))
    out: Any = joints * (after / before)[..., None, None, None]  # of which the pelvis stays
    for bone, (child, parent) in enumerate(zip(CHILDREN, PARENTS, strict=True)):
        out[..., child, :] = out[..., parent, :] + scaled[..., bone, :]
    return out


def vector(joints: Array, start: str, end: str) -> Array:
    """(..., 3) from one joint to another of joints (..., 17, 3)."""
    return joints[..., H36M17.index(end), :] - joints[..., H36M17.index(start), :]


def body_frame(leftward: Tensor, upward: Tensor) -> Tensor:
    """R_world_from_body (..., 3, 3) of vectors (..., 3) that point about there: columns front, left, up."""
    left = unit(leftward)
    up = across(upward, left)
    return torch.stack([torch.cross(left, up, dim=-1), left, up], dim=-1)


def _summed(bones: Any) -> Any:
    """(...,) the lengths of bones (..., T, B, 3) together, averaged over time."""
    return length(bones).sum(-1).mean(-1)


def mirror(joints: Array) -> Array:
    """The mirror image of joints (..., 17, 3) in the plane x = 0, with left and right exchanged."""
    out: Any = picked(joints, H36M17.mirror.tolist())
    out[..., 0] *= -1
    return out


def drawn_factors(joints: Tensor, draw: Draw, bodies: BodyRange) -> Tensor:
    """(B, 17) factors on the bone that ends in each joint of joints (B, T, 17, 3); left and right alike."""
    count = len(joints)

    def spread(std: float) -> Tensor:
        return (std * draw.normal(count, most=2)).exp()

    legs, arms = spread(bodies.limbs / 2), spread(bodies.limbs / 2)
    limbs = (("knee", legs), ("ankle", legs), ("elbow", arms), ("wrist", arms))
    of = {part: limb * spread(bodies.limbs) for part, limb in limbs}
    for joint, std in (("spine", bodies.trunk), ("thorax", bodies.trunk), ("nose", 0.15), ("head", 0.15)):
        of[joint] = spread(std)
    size = size_m(joints)
    for part, between in _WIDTHS.items():
        width = length(vector(joints, f"r_{part}", f"l_{part}")).mean(-1)
        of[part] = draw.uniform(between, count) * size / width.clamp_min(1e-3)
    of["pelvis"] = torch.ones_like(size)
    return torch.stack([of[joint.removeprefix("l_").removeprefix("r_")] for joint in H36M17.joints], -1)


def bone_lengths(joints: Tensor) -> Tensor:
    """(..., T, 17) length of the bone that ends in each joint of (..., T, 17, 3); 0 at the pelvis."""
    return length(joints - picked(joints, _PARENT_OF))


def combine(lower: Tensor, upper: Tensor) -> Tensor:
    """The legs and the path of one motion under the trunk, head and arms of another; both (..., T, 17, 3), +Z up.

    The upper body is turned about the vertical in every frame until both motions' hips point the same way. A motion
    whose hip axis is ever steeper than 60 degrees keeps its own upper body: it has no such direction.
    """
    hips = [vector(motion, "r_hip", "l_hip") for motion in (lower, upper)]
    level = [length(axis[..., :2]) / length(axis).clamp_min(1e-9) for axis in hips]
    turn = torch.atan2(hips[0][..., 1], hips[0][..., 0]) - torch.atan2(hips[1][..., 1], hips[1][..., 0])
    c, s = turn.cos()[..., None], turn.sin()[..., None]
    pelvis = [H36M17.index("pelvis")]
    x, y, z = (upper - upper[..., pelvis, :]).unbind(-1)
    turned = torch.stack([c * x - s * y, s * x + c * y, z], dim=-1) + lower[..., pelvis, :]
    fits = (torch.minimum(*level) > 0.5).all(dim=-1)[..., None, None, None]
    return torch.where(fits & torch.tensor(_UPPER, device=lower.device)[:, None], turned, lower)


def proportions(clips: Sequence[Clip]) -> Tensor:
    """(people, 17) mean bone lengths in metres of the clips' people who come with their own skeleton; may be empty."""
    rows = by_person(
        (person(clip) or clip.subject, bone_lengths(torch.from_numpy(clip.joints)).mean(0).numpy())
        for clip in clips
        if clip.source in OWN_SKELETON
    )
    return torch.from_numpy(np.array([*rows.values()], dtype=np.float32).reshape(-1, len(H36M17)))


def vary(
    joints: Tensor, draw: Draw, bodies: BodyRange, people: Tensor | None = None, real: float = 0.0
) -> Tensor:
    """joints (B, T, 17, 3), +Z up, on other bodies, some mirrored. people: of `proportions`; real: share of windows
    whose lengths are one of theirs (left and right alike, every limb a few per cent off) instead of drawn."""
    count = len(joints)
    factors = drawn_factors(joints, draw, bodies)
    if real and people is not None and len(people):
        now = bone_lengths(joints).mean(1)
        wanted = people[draw.integers(len(people), count)]
        spread = (0.03 * draw.normal(count, len(H36M17), most=2)).exp()[:, _LEFT]
        wanted = (wanted + wanted[:, H36M17.mirror.tolist()]) / 2 * spread
        theirs = torch.where(now > 1e-3, wanted / now.clamp_min(1e-3), 1.0)
        factors = torch.where(draw.share(real, count, 1), theirs, factors)
    factors = torch.where(draw.share(bodies.unchanged, count, 1), 1.0, factors)
    out = resize(joints, factors)
    return torch.where(draw.share(bodies.mirrored, count)[:, None, None, None], mirror(out), out)


_REDEFINED_M = 0.02  # standard deviation of where sources put a joint


def redefined(joints: Tensor, draw: Draw, share: float) -> Tensor:
    """joints (B, T, 17, 3) as another source defines them, for a share of the windows: spine, thorax, nose and head
    moved in the sagittal plane, hips and shoulders across and along the trunk; the same in every frame of a window."""
    count = len(joints)
    leftward = vector(joints, "r_shoulder", "l_shoulder") + vector(joints, "r_hip", "l_hip")
    axes = body_frame(leftward, vector(joints, "pelvis", "thorax"))
    std = _REDEFINED_M * draw.share(share, count, 1, 1)
    offsets = joints.new_zeros(count, len(H36M17), 3)
    middle = H36M17.indices(("spine", "thorax", "nose", "head"))
    offsets[:, middle] = draw.normal(count, len(middle), 3, most=2) * joints.new_tensor([1.0, 0.0, 1.0])
    for part in ("hip", "shoulder"):
        moved = 0.6 * draw.normal(count, 3, most=2)
        for side, sign in (("l", 1.0), ("r", -1.0)):
            offsets[:, H36M17.index(f"{side}_{part}")] = moved * joints.new_tensor([1.0, sign, 1.0])
    return joints + torch.einsum("btij,bkj->btki", axes, std * offsets)


# Motion that the capture does not show. Limbs are directions of their two bones in the frame of the trunk's end that
# they hang on (front, left, up): a ball joint by swing and twist, then a hinge. Ranges are about those of healthy
# adults (Boone and Azen 1979, rounded up).
_LIMBS = {
    (side, kind): tuple(f"{side}_{part}" for part in parts)
    for side in "lr"
    for kind, parts in (("leg", ("hip", "knee", "ankle")), ("arm", ("shoulder", "elbow", "wrist")))
}
_ABOVE_SPINE = ("thorax", "nose", "head", *(f"{s}_{p}" for s in "lr" for p in ("shoulder", "elbow", "wrist")))
# Joint that others are turned about, these, and the standard deviation in degrees.
_TRUNK_SWUNG = (("spine", _ABOVE_SPINE, 15.0), ("thorax", ("nose", "head"), 15.0))
_LIMBS_SWUNG = tuple(
    (about, moved, {"leg": 10.0, "arm": 20.0}[kind]) for (_, kind), (about, *moved) in _LIMBS.items()
)


@dataclass(frozen=True)
class PoseRange:
    """What a window's poses are drawn from, as shares of the windows."""

    exchanged: Share = 0.0  # some limbs are those of another motion
    sampled: Share = 0.0  # some limbs move within anatomical limits
    swung: Share = 0.0  # trunk above the spine and head turn further, by about 15 degrees
    # Arms turn further about the shoulders and legs about the hips, by about 20 and 10 degrees; knees and elbows keep
    # their angles.
    limbs_swung: Share = 0.0
    # The whole body is turned about any axis by about 57 degrees, some of them on and on: leans, falls, lying.
    turned: Share = 0.0
    leaning: Share = 0.0  # the whole body leans about a horizontal axis by about 12 degrees
    # It lies, on the back, the front or a side: turned about a horizontal axis by about 90 degrees.
    laid: Share = 0.0


def _trunk_frames(joints: Tensor) -> dict[str, Tensor]:
    """{"leg", "arm": R_world_from_trunk (..., 3, 3)}: columns front, left, up of the end that such a limb hangs on."""
    return {
        "leg": body_frame(vector(joints, "r_hip", "l_hip"), vector(joints, "pelvis", "spine")),
        "arm": body_frame(vector(joints, "r_shoulder", "l_shoulder"), vector(joints, "spine", "thorax")),
    }


def _other_limbs(joints: Tensor, other: Tensor, draw: Draw, poses: PoseRange, fps: float) -> Tensor:
    count, frames = joints.shape[:2]
    out, own, theirs = joints.clone(), _trunk_frames(joints), _trunk_frames(other)
    exchanged, sampled = draw.share(poses.exchanged, count), draw.share(poses.sampled, count)
    for (side, kind), names in _LIMBS.items():
        rows = H36M17.indices(names)
        bones, others = (picked(x, rows[1:]) - picked(x, rows[:-1]) for x in (joints, other))
        captured = unit(bones)
        moved = rotate(transpose(theirs[kind]), unit(others))
        bent = (_leg if kind == "leg" else _arm)(draw, count, frames, fps, 1.0 if side == "l" else -1.0)
        new = torch.where(
            (exchanged & draw.share(0.5, count))[:, None, None, None], rotate(own[kind], moved), captured
        )
        use = (sampled & draw.share(0.6, count))[:, None, None, None]
        new = torch.where(use, rotate(own[kind], bent), new)
        new = length(bones)[..., None] * new
        out[..., rows[1], :] = out[..., rows[0], :] + new[..., 0, :]
        out[..., rows[2], :] = out[..., rows[1], :] + new[..., 1, :]
    return out


def _leg(draw: Draw, count: int, frames: int, fps: float, side: float) -> Tensor:
    """(B, T, 2, 3) directions of thigh and shank in the pelvis's frame: front, left, up."""
    flexion = _moving(draw, (-20, 120), count, frames, fps)
    aside = _moving(draw, (-20, 40), count, frames, fps)
    twist = _moving(draw, (-35, 35), count, frames, fps)
    knee = _moving(draw, (0, 140), count, frames, fps)
    zero = torch.zeros_like(flexion)
    thigh = torch.stack(
        [flexion.sin() * aside.cos(), side * aside.sin(), -flexion.cos() * aside.cos()], dim=-1
    )
    back = across(torch.stack([-flexion.cos(), zero, -flexion.sin()], dim=-1), thigh)
    return torch.stack([thigh, _hinged(thigh, back, twist, knee)], dim=-2)


def _arm(draw: Draw, count: int, frames: int, fps: float, side: float) -> Tensor:
    """(B, T, 2, 3) directions of upper arm and forearm in the thorax's frame: front, left, up."""
    raised = _moving(draw, (0, 170), count, frames, fps)
    plane = _moving(draw, (-40, 120), count, frames, fps)  # 0 to the side, 90 to the front
    raised = torch.where(plane < -0.2, raised.clamp_max(1.2), raised)
    twist = _moving(draw, (-80, 80), count, frames, fps)
    elbow = _moving(draw, (0, 145), count, frames, fps)
    upper = torch.stack(
        [raised.sin() * plane.sin(), side * raised.sin() * plane.cos(), -raised.cos()], dim=-1
    )
    front = across(torch.tensor([0.8, 0.0, 0.6], device=draw.device).expand_as(upper), upper)
    return torch.stack([upper, _hinged(upper, front, twist, elbow)], dim=-2)


def _hinged(bone: Tensor, bends_to: Tensor, twist: Tensor, angle: Tensor) -> Tensor:
    """The next bone after a hinge; the side it bends to is turned about the first bone by twist. Angles in radians."""
    aside = torch.cross(bone, bends_to, dim=-1)
    towards = twist.cos()[..., None] * bends_to + twist.sin()[..., None] * aside
    return angle.cos()[..., None] * bone + angle.sin()[..., None] * towards


def _moving(draw: Draw, between_deg: tuple[float, float], count: int, frames: int, fps: float) -> Tensor:
    """(B, T) radians within the range: a resting value with a slow swing about it."""
    low, high = between_deg
    swing = draw.uniform((0.0, 0.25), count, 1) * (high - low)
    phase = draw.uniform((0.0, 6.2832), count, 1)
    turns = draw.log_uniform((0.1, 1.5), count, 1) * torch.arange(frames, device=draw.device) / fps
    rest = draw.uniform(between_deg, count, 1)
    return (rest + swing * (6.2832 * turns + phase).sin()).clamp(low, high).deg2rad()


def _swung(
    joints: Tensor, draw: Draw, share: float, parts: Iterable[tuple[str, Sequence[str], float]]
) -> Tensor:
    out, use = joints.clone(), draw.share(share, len(joints))[:, None, None]
    for about, moved, std_deg in parts:
        R = from_vector((std_deg * draw.normal(len(joints), 1, 3, most=2) * use).deg2rad())
        rows, centre = H36M17.indices(moved), out[..., [H36M17.index(about)], :]
        out[..., rows, :] = centre + rotate(R, picked(out, rows) - centre)
    return out


def _turned(joints: Tensor, draw: Draw, poses: PoseRange, fps: float) -> Tensor:
    count, frames = joints.shape[:2]
    axis = unit(draw.normal(count, 3))
    turned, leaning = draw.share(poses.turned, count), draw.share(poses.leaning, count)
    axis = torch.where(turned[:, None], axis, unit(axis * axis.new_tensor([1.0, 1.0, 0.0])))
    angle = torch.where(turned, 57.0 * draw.normal(count), 12.0 * draw.normal(count) * leaning)
    rate = 40.0 * draw.normal(count) * (turned & draw.share(0.4, count))  # degrees a second
    laid = draw.share(poses.laid, count) & ~turned
    angle = torch.where(laid, 90.0 + 12.0 * draw.normal(count), angle)
    times = (torch.arange(frames, device=draw.device) - frames / 2) / fps
    vector = axis[:, None] * (angle[:, None] + rate[:, None] * times).deg2rad()[..., None]
    pelvis = joints[..., [H36M17.index("pelvis")], :]
    return pelvis + rotate(from_vector(vector), joints - pelvis)


def from_vector(v: Tensor) -> Tensor:
    """R (..., 3, 3) of rotation vectors (..., 3), radians (Rodrigues)."""
    angle = length(v)[..., None, None]
    x, y, z = unit(v).unbind(-1)
    zero = torch.zeros_like(x)
    K = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1).unflatten(-1, (3, 3))
    return torch.eye(3, device=v.device) + angle.sin() * K + (1 - angle.cos()) * (K @ K)


@dataclass(frozen=True)
class MotionRange:
    """How far motion is from the capture; the defaults change nothing. Shares are of a batch."""

    combined: Share = 0.0  # the upper body comes from another motion
    poses: PoseRange = field(default_factory=PoseRange)
    unchanged: Share = 1.0  # on the captured body
    real: Share = 0.0  # with the bone lengths of one of the captured people (bodies.proportions)
    redefined: Share = 0.0  # joints as another source defines them (bodies.redefined)


def varied(
    captured: Callable[[int], Tensor],
    count: int,
    draw: Draw,
    of: MotionRange,
    bodies: BodyRange,
    people: Tensor,
    fps: float,
) -> Tensor:
    """(count, T, 17, 3) metres in the world: joints of captured(number) (number, T, 17, 3), changed by these shares.

    bodies: what bodies are drawn from. people: (N, ...) of bodies.proportions. fps: of the motion.
    """
    motion, poses = captured(count), of.poses
    mixed = round(of.combined * count)
    if mixed:
        motion = torch.cat([combine(motion[:mixed], captured(mixed)), motion[mixed:]])
    other = motion.roll(1, 0)  # another order of the same motions: poses to take limbs from
    if poses.swung:
        motion = _swung(motion, draw, poses.swung, _TRUNK_SWUNG)
    if poses.limbs_swung:
        motion = _swung(motion, draw, poses.limbs_swung, _LIMBS_SWUNG)
    if poses.exchanged or poses.sampled:
        motion = _other_limbs(motion, other, draw, poses, fps)
    if poses.turned or poses.leaning or poses.laid:
        motion = _turned(motion, draw, poses, fps)
    return vary(motion, draw, bodies, people, of.real)


# Virtual pinhole cameras, one a window. Yaw is the heading of the view about the vertical, pitch is positive when the
# camera looks down, roll is positive when the image's content turns counter-clockwise.
IMAGE_SIZES = ((1920, 1080), (1280, 720), (1080, 1920), (1440, 1080), (1000, 1000))
_AIM_FRAMES = 8  # of a window, about: so many tell its place and size
_AIMS = 4  # rounds; each leaves about a tenth of what was off
_PAN_FRAMES = 61  # over which a camera that pans averages where the person is

TRUNK = [row for row, joint in enumerate(LIMBS) if joint.endswith(("hip", "shoulder"))]  # of LIMBS

# (N, 4): where people are in the images of real videos, and how large; places.json says what a row is.
PLACES = [
    row
    for video in json.loads(Path(__file__).with_name("places.json").read_text(encoding="utf-8"))["videos"]
    for row in video["rows"]
]
PLACE_SPREAD = 0.02  # standard deviations of what is drawn about a row: of x and y,
SIZE_SPREAD = 0.1  # and of the size's logarithm


@dataclass(frozen=True)
class ViewRange:
    """What views are drawn from: angles uniformly, focal length and distance log-uniformly."""

    yaw_deg: tuple[float, float] = (0.0, 360.0)  # the convention above
    pitch_deg: tuple[float, float] = (-30.0, 45.0)
    roll_deg: tuple[float, float] = (-10.0, 10.0)
    # Over the longer image side: phones film with 0.65 to 0.85, a 35 to 70 mm lens on full frame has 1 to 2.
    focal: tuple[float, float] = (0.65, 2.0)
    distance: tuple[float, float] = (1.05, 2.5)  # over the smallest one at which everything is in the image
    # In its place: metres along the viewing axis to the middle of the points, but never nearer than that smallest one.
    distance_m: tuple[float, float] | None = None
    nearest_m: float = 1.0  # of any joint
    margin: float = 0.04  # share of the half image that stays empty at its border
    pans: float = 0.0  # share of views whose camera slowly follows the person


# Anything a video may come from: steep and tilted views, long lenses.
WILD = ViewRange()
# Cameras as people use them: a phone or a camera at chest height or above on a levelled tripod, across a room.
TYPICAL = ViewRange(pitch_deg=(-5.0, 25.0), roll_deg=(-5.0, 5.0), focal=(0.67, 0.95), distance_m=(2.0, 6.0))


@dataclass(frozen=True, eq=False)
class Cameras:
    """Pinhole cameras (B,), without lens distortion, principal point in the image's centre.

    R_camera_from_world: (B, 1, 3, 3), or (B, T, 3, 3) where one pans. position: (B, 3) metres, world.
    focal_px: (B,). image_size: (B, 2) width and height in pixels.
    """

    R_camera_from_world: Tensor
    position: Tensor
    focal_px: Tensor
    image_size: Tensor

    def to_camera(self, joints_world: Tensor) -> Tensor:
        """(B, T, J, 3) world -> camera, metres, origin at the camera."""
        return rotate(self.R_camera_from_world, joints_world - self.position[:, None, None])

    def project(self, joints_camera: Tensor) -> Tensor:
        """(B, T, J, 3) camera -> (B, T, J, 2) pixels."""
        rays = joints_camera[..., :2] / joints_camera[..., 2:]
        return rays * self.focal_px[:, None, None, None] + self.image_size[:, None, None] / 2


def place(joints_world: Tensor, draw: Draw, views: ViewRange = WILD, placed: float = 0.0) -> Cameras:
    """One camera a window, somewhere from which every joint of every frame is inside the image.

    joints_world: (B, T, 17, 3) metres, +Z up. The distance and then the sideways shift are drawn from the exact
    intervals that keep everything inside, so the person may be anywhere in the image. placed: share with the person
    where people are in real videos, and as large (PLACES), or as near to that as everything is inside; they do not
    pan.
    """
    count = len(joints_world)
    sizes = torch.tensor(IMAGE_SIZES, dtype=draw.dtype, device=draw.device)
    size = sizes[draw.integers(len(sizes), count)]
    there, spot = torch.zeros(count, dtype=torch.bool, device=draw.device), None
    if placed:
        there, spot = draw.share(placed, count), _spots(draw, count)
        tall = torch.stack([spot[:, 3], 1 / spot[:, 3]], dim=-1).clamp_max(1) * max(IMAGE_SIZES[0])
        size = torch.where(there[:, None], tall, size)
    focal = draw.log_uniform(views.focal, count)
    focal_px = focal * size.amax(-1)
    angles_deg = [draw.uniform(of, count) for of in (views.yaw_deg, views.pitch_deg, views.roll_deg)]
    R = torch.from_numpy(view_rotation(*(each.cpu().numpy() for each in angles_deg))).to(sizes)
    points = joints_world.flatten(1, 2)
    centre = (points.amin(1) + points.amax(1)) / 2
    q = rotate(R, points - centre[:, None])
    depth = q[..., 2]
    half = size / 2 / focal_px[:, None] * (1 - views.margin)  # tangent of the half view, (B, 2)
    needed = q[..., :2].abs() / half[:, None] - depth[..., None]
    least = torch.maximum(needed.amax(dim=(1, 2)), views.nearest_m - depth.amin(1))
    if views.distance_m is None:
        distance = least * draw.log_uniform(views.distance, count)
    else:
        distance = torch.maximum(least, draw.log_uniform(views.distance_m, count))
    aimed = None
    if spot is not None:
        near, aimed = _aimed(q, focal, spot, least)
        distance = torch.where(there, near, distance)
    room = (distance[:, None] + depth)[..., None] * half[:, None]
    low, high = (-room - q[..., :2]).amax(1), (room - q[..., :2]).amin(1)
    shift = low + draw.rand(count, 2) * (high - low)
    if aimed is not None:
        shift = torch.where(there[:, None], torch.minimum(torch.maximum(aimed, low), high), shift)
    offset = torch.cat([shift, distance[:, None]], dim=-1)
    position = centre - rotate(transpose(R), offset[:, None])[:, 0]
    cameras = Cameras(R[:, None], position, focal_px, size)
    return _panned(cameras, joints_world, draw, views.pans * ~there) if views.pans else cameras


def place_among(
    joints_world: Tensor, draw: Draw, usual: ViewRange, other: ViewRange, share: float, placed: float
) -> Cameras:
    """The same, a share of the windows before cameras of the one range, the rest of the other."""
    use = draw.share(share, len(joints_world))
    both = [place(joints_world, draw, views, placed) for views in (usual, other)]
    parts = ([getattr(cameras, field.name) for cameras in both] for field in fields(Cameras))
    return Cameras(*(torch.where(use[(..., *[None] * (a.ndim - 1))], a, b) for a, b in parts))


def place_and_size(points: Tensor) -> tuple[Tensor, Tensor]:
    """What a row of PLACES says, of joints LIMBS (B, T, 12, 2) from the image's middle in longer image sides:
    (B, 2) and (B,), means over the frames."""
    middle = picked(points, TRUNK).mean(-2)
    off = points - middle[..., None, :]
    return middle.mean(1), dot(off, off).mean(-1).sqrt().mean(-1)


def _spots(draw: Draw, count: int) -> Tensor:
    """(B, 4) rows of PLACES and what lies about them; as many to the left as to the right."""
    rows = torch.tensor(PLACES, dtype=draw.dtype, device=draw.device)[draw.integers(len(PLACES), count)]
    side = torch.where(draw.share(0.5, count), 1.0, -1.0)
    x, y = rows[:, :2].unbind(-1)
    place = torch.stack([side * x, y], dim=-1) + PLACE_SPREAD * draw.normal(count, 2, most=2)
    size = rows[:, 2] * (SIZE_SPREAD * draw.normal(count, most=2)).exp()
    return torch.cat([place, size[:, None], rows[:, 3:]], dim=-1)


def _aimed(q: Tensor, focal: Tensor, spot: Tensor, least: Tensor) -> tuple[Tensor, Tensor]:
    """Distance (B,), not below `least`, and shift (B, 2) across the view, metres, that show points q (B, T * 17, 3) of
    the camera's axes at place and size of spot (B, 4). focal: (B,) longer image sides."""
    q = q.unflatten(1, (-1, len(H36M17)))
    q = picked(q[:, :: max(1, q.shape[1] // _AIM_FRAMES)], H36M17.indices(LIMBS))
    aside, depth = focal[:, None, None, None] * q[..., :2], q[..., 2:]
    shift, distance = torch.zeros_like(spot[:, :2]), least
    for _ in range(_AIMS):
        shown = aside + (focal[:, None] * shift)[:, None, None]
        place, size = place_and_size(shown / (depth + distance[:, None, None, None]))
        nearer = torch.maximum(distance * size / spot[:, 2], least)
        shift = shift + (spot[:, :2] * nearer[:, None] - place * distance[:, None]) / focal[:, None]
        distance = nearer
    return distance, shift


def _panned(cameras: Cameras, joints_world: Tensor, draw: Draw, share: Tensor) -> Cameras:
    """Some of the cameras turn about their own vertical axis and bring the person slowly towards the middle; share (B,)
    says how likely each does."""
    pelvis = cameras.to_camera(joints_world)[..., H36M17.index("pelvis"), :]
    count, frames = pelvis.shape[:2]
    window = min(_PAN_FRAMES, frames)
    bearing = torch.atan2(pelvis[..., 0], pelvis[..., 2])[:, None]
    bearing = torch.nn.functional.pad(bearing, (window // 2, (window - 1) // 2), mode="replicate")
    bearing = torch.nn.functional.avg_pool1d(bearing, window, stride=1)[:, 0]
    angle = (draw.uniform((0.3, 1.0), count) * draw.share(share, count))[:, None] * bearing
    c, s, zero, one = angle.cos(), angle.sin(), torch.zeros_like(angle), torch.ones_like(angle)
    turn = torch.stack([c, zero, -s, zero, one, zero, s, zero, c], -1).unflatten(-1, (3, 3))
    return replace(cameras, R_camera_from_world=turn @ cameras.R_camera_from_world)


# 2D keypoints as detectors see them: exact projections in, noisy keypoints with confidences out. The formula, for a
# person whose box has a longer side of s pixels (the height of a standing person's box):
# - position: Gaussian with a standard deviation of 1.5 % of s on x and on y, times 1.5 at wrists and ankles, times 2
#   while the joint is hidden behind the body; an AR(1) process in time with coefficient 0.8 at 30 fps;
# - outliers: 0.3 % of the joints of a frame lie another 10 to 30 % of s away;
# - left and right: in profile, legs or arms are exchanged for runs of frames;
# - missing: single joints for runs of frames, hidden ones three times as often; rarely the whole person;
# - confidence: falls with the joint's error and when hidden; 0 and NaN coordinates when missing.
FAR_JOINTS = ("l_wrist", "r_wrist", "l_ankle", "r_ankle")
HIDDEN_MISSING = 3.0  # times as often missing when hidden
# What hides joints: thick lines between joints, with their radius in trunk lengths.
SOLIDS = (
    ("pelvis", "thorax", 0.28), ("thorax", "head", 0.18),
    ("l_hip", "l_knee", 0.14), ("r_hip", "r_knee", 0.14), ("l_knee", "l_ankle", 0.10), ("r_knee", "r_ankle", 0.10),
)  # fmt: skip
HEAD_HEIGHT = (0.4, 1.0)  # from the middle of the ears to the top, over nose to top

# Orders of joints, with the legs exchanged and with the arms.
EXCHANGED_LIMBS = [
    [int(H36M17.mirror[row]) if joint[2:] in limb else row for row, joint in enumerate(H36M17.joints)]
    for limb in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
]


@dataclass(frozen=True)
class Noise:
    """Constants of the formula above. Lengths are shares of the box's longer side; rates are
    per frame at 30 fps; runs are mean lengths in frames at 30 fps."""

    std: float = 0.015
    correlation: float = 0.8
    far_joints: float = 1.5
    hidden: float = 2.0
    outliers: float = 0.003
    outlier_size: tuple[float, float] = (0.10, 0.30)
    swap_rate: float = 0.02
    swap_run: float = 8.0
    profile_cosine: float = 0.85
    missing_rate: float = 0.001
    missing_run: float = 10.0
    absent_rate: float = 0.0003
    absent_run: float = 8.0


# As good detectors have it: OpenPose's keypoints of a real take lie 1.0 to 1.7 % from the truth at wrists and ankles as
# at other joints, where its cameras are known best (docs/research.md).
GOOD = Noise(
    std=0.012, far_joints=1.0, outliers=0.001, swap_rate=0.005, missing_rate=0.0003, absent_rate=0.0001
)


def hidden_joints(joints_camera: Array) -> Array:
    """(..., J) True where the trunk, the head or a leg is between the camera and the joint.

    joints_camera: (..., 17, 3) metres, origin at the camera. Trunk, head and legs are thick lines; a joint at an
    end of a line is not hidden by it.
    """
    depth = 1 * joints_camera[..., 2]  # a copy, whose rows lie together
    rays = [joints_camera[..., i] / depth for i in (0, 1)]
    trunk = length(vector(joints_camera, "pelvis", "thorax"))
    hidden: Any = False
    for start, end, radius in SOLIDS:
        a, b = H36M17.index(start), H36M17.index(end)
        (x, line_x), (y, line_y) = (
            (ray - ray[..., a, None], (ray[..., b] - ray[..., a])[..., None]) for ray in rays
        )
        along = ((x * line_x + y * line_y) / (line_x**2 + line_y**2).clip(1e-9)).clip(0, 1)
        apart = (x - along * line_x) ** 2 + (y - along * line_y) ** 2
        here = depth[..., a, None] * (1 - along) + depth[..., b, None] * along
        reach = (radius * trunk)[..., None]
        behind = (apart < (reach / here) ** 2) & (depth > here + reach)
        behind[..., [a, b]] = False
        hidden = hidden | behind
    return hidden


_GROUPS = (
    ("l_knee", "l_ankle"), ("r_knee", "r_ankle"), ("l_ankle", "r_ankle"),
    ("l_elbow", "l_wrist"), ("r_elbow", "r_wrist"),
    ("l_wrist", "r_wrist"), ("nose", "head"), ("l_knee", "r_knee", "l_ankle", "r_ankle"),
)  # fmt: skip

SLOW_S = 3.0  # MoveNet's and OpenPose's errors stay for seconds where a person holds a posture


@dataclass(frozen=True)
class Spoilt:
    """What spoils keypoints besides the formula, as shares of the windows."""

    quality: Size = 0.0  # spread (of the logarithm) of a window's noise, for detectors are not alike
    good: Share = 0.0  # a good detector's, with the errors, outliers, exchanges and gaps of GOOD
    # Standard deviation, of the body's size, of an error that lasts SLOW_S, which the confidence does not know of.
    slow: Size = 0.0
    truncated: Share = 0.0  # the image ends somewhere in the body, mostly below
    occluded: Share = 0.0  # a part of the body is not seen for long
    absent: dict[str, Share] = field(default_factory=dict)  # joints that the detector does not have at all
    # Pelvis, thorax and spine are made from shoulders and hips, as remap does for detectors that have none, and
    # the head lies between the ears' middle and its top.
    derived: Share = 0.0


def detect(
    pixels: Tensor,
    joints_camera: Tensor,
    draw: Draw,
    fps: float = 30.0,
    noise: Noise | None = None,
    spoilt: Spoilt | None = None,
) -> tuple[Tensor, Tensor]:
    """What a detector would answer. noise: the formula's constants. spoilt: what spoils keypoints besides.

    pixels: (B, T, 17, 2) exact projections of joints_camera (B, T, 17, 3), H36M17, metres, origin at the camera.
    -> keypoints (B, T, 17, 2) pixels, NaN where missing, and confidence (B, T, 17) in [0, 1].
    """
    noise = noise or Noise()
    count, frames, joints = pixels.shape[:3]
    size = (pixels.amax(2) - pixels.amin(2)).amax(-1)[..., None, None]
    hidden = hidden_joints(joints_camera)
    good, quality = torch.zeros_like(hidden[:, :1, :1]), torch.ones_like(pixels[:, :1, :1, 0])
    if spoilt is not None:
        good = draw.share(spoilt.good, count, 1, 1)
        quality = (spoilt.quality * draw.normal(count, 1, 1, most=2)).exp()

    def level(name: str) -> Tensor:
        """(B, 1, 1) a constant of the window's detector."""
        return torch.where(good, *(pixels.new_tensor(getattr(of, name)) for of in (GOOD, noise)))

    far_joints = torch.tensor([joint in FAR_JOINTS for joint in H36M17.joints], device=draw.device)
    factor = torch.where(far_joints, level("far_joints"), 1.0)
    spread = (quality * torch.where(hidden, noise.hidden, 1.0) * factor)[..., None]
    error = spread * draw.ar1(noise.correlation ** (30 / fps), *pixels.shape) * level("std")[..., None]
    far = draw.share(level("outliers") * quality, count, frames, joints)
    angle = draw.uniform((0.0, math.tau), count, frames, joints)
    jump = torch.where(far, draw.uniform(noise.outlier_size, count, frames, joints), 0.0)
    error = error + jump[..., None] * torch.stack([angle.cos(), angle.sin()], dim=-1)
    keypoints = pixels + error * size
    if spoilt is not None and spoilt.slow:
        lasting = draw.ar1(math.exp(-1 / (SLOW_S * fps)), *pixels.shape)
        keypoints = keypoints + spoilt.slow * spread * lasting * size
    seen = draw.normal(count, frames, joints)
    confidence = (0.9 - 5.0 * length(error) - 0.2 * hidden.to(seen) + 0.06 * seen).clamp(0.05, 1.0)

    profile = in_profile(joints_camera, noise.profile_cosine)
    for order in EXCHANGED_LIMBS:
        swap = draw.runs(level("swap_rate")[..., 0] * profile * 30 / fps, noise.swap_run * fps / 30)
        keypoints = torch.where(swap[..., None, None], picked(keypoints, order), keypoints)
        confidence = torch.where(swap[..., None], confidence[..., order], confidence)

    if spoilt is not None and spoilt.derived:
        made = derive(keypoints, draw.uniform(HEAD_HEIGHT, count)[:, None, None])
        keypoints = torch.where(draw.share(spoilt.derived, count)[:, None, None, None], made, keypoints)

    rate = level("missing_rate") * torch.where(hidden, HIDDEN_MISSING, 1.0) * 30 / fps
    lost = draw.runs(rate.transpose(1, 2), noise.missing_run * fps / 30).transpose(1, 2)
    nobody = (level("absent_rate")[..., 0] * 30 / fps).expand(count, frames)
    lost = lost | draw.runs(nobody, noise.absent_run * fps / 30)[..., None]
    if spoilt is not None:
        lost = lost | _truncated(keypoints, draw, spoilt.truncated)
        lost = lost | _occluded(draw, spoilt.occluded, count, frames, fps)
        for joint, share in spoilt.absent.items():
            lost[..., H36M17.index(joint)] |= draw.share(share, count, 1)
    return torch.where(lost[..., None], torch.nan, keypoints), torch.where(lost, 0.0, confidence)


def in_profile(joints_camera: Array, cosine: float = Noise.profile_cosine) -> Array:
    """(..., T) True where hips and shoulders together point along the view: |cos| of the angle above `cosine`."""
    aside: Any = vector(joints_camera, "r_hip", "l_hip") + vector(joints_camera, "r_shoulder", "l_shoulder")
    view = joints_camera[..., H36M17.index("pelvis"), :]
    return abs(dot(aside, view)) > cosine * length(aside) * length(view)


def derive(keypoints: Array, head_height: Array) -> Array:
    """keypoints (..., 17, 2) with pelvis and thorax in the middle of hips and shoulders, the spine between, the head
    between nose and top, head_height (...,) of the way."""
    out: Any = 1 * keypoints
    shoulders, pelvis = (
        picked(keypoints, H36M17.indices((f"l_{part}", f"r_{part}"))).mean(-2) for part in ("shoulder", "hip")
    )
    nose, top = keypoints[..., H36M17.index("nose"), :], keypoints[..., H36M17.index("head"), :]
    out[..., H36M17.index("head"), :] = nose + head_height * (top - nose)
    for joint, place in (("pelvis", pelvis), ("spine", (shoulders + pelvis) / 2), ("thorax", shoulders)):
        out[..., H36M17.index(joint), :] = place
    return out


def _truncated(keypoints: Tensor, draw: Draw, share: float) -> Tensor:
    """(B, T, 17) True beyond a border that cuts off up to half of the body's extent over the window: below for most,
    else at the left or right; above never, for no lifter can do without the trunk."""
    count = len(keypoints)
    low, high = keypoints.amin(dim=(1, 2), keepdim=True), keypoints.amax(dim=(1, 2), keepdim=True)
    off = draw.uniform((0.0, 0.5), count, 1, 1, 1) * (high - low)
    kind = draw.uniform((0.0, 1.0), count, 1, 1)
    (left, _), (right, below) = (part.unbind(-1) for part in (keypoints < low + off, keypoints > high - off))
    beyond = torch.where(kind < 0.7, below, torch.where(kind < 0.85, left, right))
    return beyond & draw.share(share, count, 1, 1)


def _occluded(draw: Draw, share: float, count: int, frames: int, fps: float) -> Tensor:
    """(B, T, 17) True for a part of the body in runs of about two seconds."""
    parts = torch.tensor([[joint in of for joint in H36M17.joints] for of in _GROUPS], device=draw.device)
    start = torch.full((count, frames), 0.5 / fps, device=draw.device)
    start[:, 0] = 0.5
    when = draw.runs(start, 2.0 * fps) & draw.share(share, count, 1)
    return when[..., None] & parts[draw.integers(len(_GROUPS), count)][:, None]


View = Literal["paper", "wide"]
# What R leads to: "body", gravity and the body's own heading (design.md section 4), or "axes", the data set's own fixed
# axes, as in the paper; these make sense where everybody was recorded facing -x.
Targets = Literal["body", "axes"]

CAMERA_FROM_SOURCE = CAMERA.basis @ PC_CAMERA.basis.T  # the paper's axes: x away, y left, z up


def paper_angles(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch, yaw (count,) in degrees of the published mixture."""
    kind = rng.choice(3, size=count, p=(0.75, 0.15, 0.10))  # front, profile, back
    normal = rng.standard_normal((3, count))
    side = rng.choice((-90.0, 90.0), size=count)
    yaw = np.choose(kind, [rng.uniform(-70, 70, count), side + 10 * normal[0], 180 + 20 * normal[0]])
    # Of each kind the standard deviation of pitch, its limit, and roll's; the back views' are not given there, and are
    # those of the front.
    std, most, roll_std, roll_most = np.array([[12, 20, 4, 8], [8, 15, 3, 6], [12, 20, 4, 8]])[kind].T
    pitch = np.clip(std * normal[1], -most, most)
    return np.clip(roll_std * normal[2], -roll_most, roll_most), pitch, yaw


def wide_angles(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch, yaw (count,) in degrees of a camera that is really pitched and rolled."""
    return rng.uniform(-20, 20, count), rng.uniform(-60, 60, count), rng.uniform(-180, 180, count)


def views(view: View, rng: np.random.Generator, count: int) -> np.ndarray:
    """R_camera_from_body (count, 3, 3) of random views: "paper" = Rz(yaw) Ry(pitch) Rx(roll) and "wide" = Rx(roll)
    Ry(pitch) Rz(yaw), in the paper's axes."""
    order, angles = ("xyz", paper_angles) if view == "paper" else ("XYZ", wide_angles)
    R = Rotation.from_euler(order, np.stack(angles(rng, count), axis=-1), degrees=True)
    return CAMERA_FROM_SOURCE @ R.as_matrix()


def seen(
    joints_world: np.ndarray, R_camera_from_body: np.ndarray, targets: Targets = "body"
) -> tuple[np.ndarray, np.ndarray]:
    """joints (B, 17, 3), +Z up, turned so that their R_camera_from_body is the one given -> (B, 17, 3) relative to
    the pelvis, and (B,) whether the frame has a heading at all. With targets "axes" the world's axes are the body's."""
    R = R_camera_from_body
    if targets == "body":
        R = R @ transpose(R_world_from_body(joints_world))
    return rotate(R, relative(joints_world.astype(np.float64))), np.asarray(is_finite(R).all(axis=-1))
