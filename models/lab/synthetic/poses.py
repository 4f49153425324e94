"""Motion that the capture does not show: limbs of other motions, limbs within anatomical limits, turned bodies, other
people's proportions. Of the lifter's windows and the rectifier's frames alike.

Limbs are directions of their two bones in the frame of the trunk's end that they hang on (front, left, up): a ball
joint by swing and twist, then a hinge. Ranges are about those of healthy adults (Boone and Azen 1979, rounded up).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor

from ....pipeline.core.layouts import H36M17
from ...common.vectors import across, length, picked, rotate, transpose, unit
from ..common.config import Share
from .bodies import BodyRange, body_frame, combine, vary, vector
from .draw import Draw

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
