"""Training frames of 3DPCNet, made in torch on the device that trains: bodies seen from somewhere, one at a time.

Two sources: motion capture, in other poses, on other bodies, from a random view, with joints missing or turned over in
depth; and lifted takes of the test bed, made by lifters that never saw the person.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from .....pipeline.core.errors import InputError
from .....pipeline.core.layouts import H36M17
from .....pipeline.reading.mocap.clip import Clip
from ....common.vectors import rotate
from ...common.toml_config import Share, Size
from ...mocap.clips import lying
from ...synthetic.bodies import BodyRange, proportions, redefined
from ...synthetic.draw import Draw
from ...synthetic.joint_errors import flipped, noisy, present
from ...synthetic.motion import MotionRange, varied
from ...synthetic.views import Lifted, Targets, about, mixed_views, seen

_FPS = 30.0  # of poses that move; a single frame of them is taken


@dataclass(frozen=True)
class Mixture(MotionRange):
    """Shares of a batch, and how far its bodies and joints are from the capture; the defaults change nothing.

    lifted: share of lifted frames (of the files given to the training), roll_deg: the camera's roll added to them,
    uniform. lying: share of lifted and of captured frames that are drawn among those of people who lie, crawl or bend
    deeply (mocap.clips.lying), who are few. What follows is shares of the captured frames, as are MotionRange's fields:
    bodies that lean, crawl or lie keep the world's up as their truth. wide: seen from `wide` views. noisy: with
    Gaussian noise of up to noise_m, twice that in depth. flipped: with limbs turned over in depth. missing: with
    missing joints; lifted frames too.
    """

    lifted: Share = 0.0
    roll_deg: Size = 0.0
    lying: Share = 0.0
    wide: Share = 0.0
    noisy: Share = 0.0
    noise_m: Size = 0.03
    flipped: Share = 0.0
    missing: Share = 0.0


class Frames(NamedTuple):
    """joints, truth: (B, 17, 3) CAMERA axes, relative to the pelvis; what the network gets (zeros where missing), and
    the same without what spoilt it. valid: (B, 17), 1 or 0. R: (B, 3, 3) R_camera_from_body. All float32."""

    joints: Tensor
    valid: Tensor
    truth: Tensor
    R: Tensor


class TrainingFrames:
    """Random frames of clips and of lifted takes; the same draw gives the same batch."""

    def __init__(
        self,
        clips: Sequence[Clip],
        mixture: Mixture,
        lifted: Lifted | None = None,
        targets: Targets = "body",
        device: torch.device | str = "cpu",
    ) -> None:
        """InputError when the mixture wants lifted frames and there are none, or turns bodies that targets "axes" take
        as they were recorded."""
        if mixture.lifted and lifted is None:
            raise InputError(
                "needs-input",
                "Expected files of lifted takes, for the mixture wants them; make some with pcnet3d lab testbed.",
            )
        if targets == "axes" and any((mixture.poses.turned, mixture.poses.leaning, mixture.poses.laid)):
            raise InputError(
                "option-conflict",
                'Expected bodies as they were recorded for targets = "axes"; leave turned, leaning and laid out.',
            )
        self.device, self.mixture = torch.device(device), mixture
        self.targets: Targets = targets
        joints = np.concatenate([clip.joints for clip in clips])
        self.joints = torch.from_numpy(joints).to(self.device)
        self.lying = self._rows(lying(joints), "clips")
        self.people = proportions(clips).to(self.device)
        # A body mirrored in x = 0 faces the other way, which only its own heading follows.
        mirrored = 0.5 if targets == "body" else 0.0
        self.bodies = BodyRange(unchanged=mixture.unchanged, mirrored=mirrored)
        arrays = () if lifted is None else (lifted.joints, lifted.truth, lifted.R)
        self.lifted = tuple(torch.from_numpy(array).to(self.device) for array in arrays)
        self.lifted_lying = self._rows(lifted.lying, "lifted takes") if lifted else self.lying

    @torch.no_grad()
    def batch(self, draw: Draw, count: int) -> Frames:
        """`count` frames, a little less where a frame has no heading."""
        lifted = round(count * self.mixture.lifted)
        parts = [self._captured(draw, count - lifted)] if count > lifted else []
        if lifted:
            parts.append(self._lifted(draw, lifted))
        joints, truth, R = (torch.cat(tensors) for tensors in zip(*parts, strict=True))
        valid = present(draw, len(joints), self.mixture.missing).float()
        return Frames(joints * valid[..., None], valid, truth, R)

    def _captured(self, draw: Draw, count: int) -> tuple[Tensor, Tensor, Tensor]:
        mixture = self.mixture
        captured = partial(self._motion, draw)
        world = varied(captured, count, draw, mixture, self.bodies, self.people, _FPS)
        if mixture.redefined:
            world = redefined(world, draw, mixture.redefined_m, mixture.redefined)
        views = mixed_views(draw.rng, count, mixture.wide)
        shown, fine = seen(world[:, 0].cpu().numpy(), views, self.targets)
        truth, R = (torch.from_numpy(x[fine]).float().to(self.device) for x in (shown, views))
        joints = flipped(truth, draw, mixture.flipped) if mixture.flipped else truth
        if mixture.noisy:
            joints = noisy(joints, draw, mixture.noisy, mixture.noise_m)
        return joints, truth, R

    def _rows(self, lies: np.ndarray, what: str) -> Tensor:
        if self.mixture.lying and not lies.any():
            raise InputError(
                "nothing-usable",
                f"Expected {what} in which somebody lies, for the mixture wants them; leave `lying` out.",
            )
        return torch.from_numpy(np.flatnonzero(lies)).to(self.device)

    def _motion(self, draw: Draw, count: int) -> Tensor:
        """(count, 1, 17, 3) captured frames, drawn at random."""
        return self.joints[self._drawn(draw, len(self.joints), self.lying, count)][:, None]

    def _drawn(self, draw: Draw, of: int, lying: Tensor, count: int) -> Tensor:
        """(count,) rows at random, the mixture's share of them among those that lie."""
        rows = draw.integers(of, count)
        if not self.mixture.lying:
            return rows
        return torch.where(
            draw.share(self.mixture.lying, count), lying[draw.integers(len(lying), count)], rows
        )

    def _lifted(self, draw: Draw, count: int) -> tuple[Tensor, Tensor, Tensor]:
        """Lifted frames, half of them mirrored left to right, before a camera that is rolled further."""
        row = self._drawn(draw, len(self.lifted[0]), self.lifted_lying, count)
        joints, truth, R = (part[row] for part in self.lifted)
        across, body = R.new_tensor([-1.0, 1.0, 1.0]), R.new_tensor([1.0, -1.0, 1.0])
        mirrored = draw.share(0.5, count, 1, 1)
        other_side = H36M17.mirror.tolist()
        joints, truth = (torch.where(mirrored, x[:, other_side] * across, x) for x in (joints, truth))
        R = torch.where(mirrored, R * across[:, None] * body, R)
        roll = about(2, draw.uniform((-self.mixture.roll_deg, self.mixture.roll_deg), count))
        return rotate(roll, joints), rotate(roll, truth), roll @ R
