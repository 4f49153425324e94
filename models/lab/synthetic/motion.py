"""Motion of batches, of the lifter's windows and the rectifier's frames alike: captured motion, in other poses and on
other bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import torch
from torch import Tensor

from ..common.toml_config import Share, Size
from .bodies import BodyRange, combine, vary
from .draw import Draw
from .poses import PoseRange, posed


@dataclass(frozen=True)
class MotionRange:
    """How far motion is from the capture; the defaults change nothing. Shares are of a batch."""

    combined: Share = 0.0  # the upper body comes from another motion
    poses: PoseRange = field(default_factory=PoseRange)
    unchanged: Share = 1.0  # on the captured body
    real: Share = 0.0  # with the bone lengths of one of the captured people (bodies.proportions)
    redefined: Share = 0.0  # joints as another source defines them, so far away:
    redefined_m: Size = 0.02  # standard deviation


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
    motion = captured(count)
    mixed = round(of.combined * count)
    if mixed:
        motion = torch.cat([combine(motion[:mixed], captured(mixed)), motion[mixed:]])
    # Another order of the same motions: poses to take limbs from.
    motion = posed(motion, motion.roll(1, 0), draw, of.poses, fps)
    return vary(motion, draw, bodies, people, of.real)
