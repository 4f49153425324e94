"""The lifter's network: a token a joint, mixed by a trunk of dilated temporal convolutions, for any number of frames;
its answer is built on the rays of the keypoints and on what bones' lengths in the image say of their depth."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from pydantic import PositiveInt
from torch import Tensor, nn

from .....pipeline.core.layouts import H36M17
from ....lifter.features import CHANNELS
from ...synthetic.bodies import CHILDREN, PARENTS

_PELVIS = H36M17.index("pelvis")
_JOINTS = len(H36M17)
_TOKENS = _JOINTS + 1
_BONE_OF = [0 if joint == _PELVIS else 1 + CHILDREN.index(joint) for joint in range(_JOINTS)]
_LOG_SD = (-7.0, 1.0)  # of metres: 1 mm to 2.7 m

# Metres of bones of a standard body, by their child joint: means over the 33 people of the training data.
_BONES_M = {
    "r_hip": 0.093, "l_hip": 0.093, "r_knee": 0.375, "l_knee": 0.375, "r_ankle": 0.402, "l_ankle": 0.402,
    "spine": 0.211, "thorax": 0.278, "nose": 0.148, "head": 0.143, "l_shoulder": 0.18, "r_shoulder": 0.18,
    "l_elbow": 0.272, "r_elbow": 0.272, "l_wrist": 0.238, "r_wrist": 0.238,
}  # fmt: skip
_SOFT_M = 0.03  # of depth: keeps the slope finite where a bone is seen at its full length
# The distance of a standard body in metres times its size in the image (rays' root mean square): where training
# begins, the mean over training windows. Two deviations are 0.3 and 0.45.
_DISTANCE = 0.37


@dataclass(frozen=True)
class NetConfig:
    """width: channels of a joint's token. trunk: channels of what mixes joints and frames. dilations: one block each,
    in frames."""

    width: PositiveInt = 48
    trunk: PositiveInt = 384
    dilations: tuple[PositiveInt, ...] = (1, 3, 9, 27, 1, 3, 9, 1)

    @property
    def reach(self) -> int:
        """Frames on each side that a frame's answer depends on."""
        return sum(self.dilations)


class Block(nn.Module):
    """Of tokens (B, T, 18, width): all of a frame go through the trunk, which looks at three frames `dilation` apart,
    and back; then the channels of each token are mixed by weights that all share. Pre-norm, residual."""

    def __init__(self, width: int, trunk: int, dilation: int) -> None:
        super().__init__()
        self.dilation = dilation
        self.norm = nn.LayerNorm(width)
        self.down = nn.Linear(_TOKENS * width, trunk)
        self.mix = nn.Linear(3 * trunk, trunk)  # as a matrix product: faster on CPUs than a dilated Conv1d
        self.back = nn.Linear(trunk, _TOKENS * width)
        self.token_norm = nn.LayerNorm(width)
        self.widen = nn.Linear(width, 2 * width)
        self.out = nn.Linear(2 * width, width)
        with torch.no_grad():
            # Starts as a network for single frames; what frames before and after add is learned.
            self.mix.weight[:, :trunk] = 0
            self.mix.weight[:, 2 * trunk :] = 0

    def forward(self, x: Tensor) -> Tensor:
        near = nn.functional.gelu(self._mixed(self.down(self.norm(x).flatten(-2))))
        x = x + self.back(near).reshape(x.shape)
        return x + self.out(nn.functional.gelu(self.widen(self.token_norm(x))))

    def _mixed(self, here: Tensor) -> Tensor:
        """(B, T, trunk) of the frames and their neighbours; beyond the ends are zeros."""
        frames, width, d = here.shape[1], here.shape[2], self.dilation
        if frames == 1 and not torch.compiler.is_exporting():  # the same numbers without the zeros around
            return nn.functional.linear(here, self.mix.weight[:, width : 2 * width], self.mix.bias)
        if frames <= d and not torch.compiler.is_exporting():  # the same numbers without a long padding
            before = after = torch.zeros_like(here)
        else:
            padded = nn.functional.pad(here, (0, 0, d, d))
            before, after = padded[:, :frames], padded[:, 2 * d :]
        return self.mix(torch.cat([before, here, after], dim=-1))


class LifterNet(nn.Module):
    """(B, T, CHANNELS) features -> joints (B, T, 17, 3) relative to the pelvis in the ray frame, metres of a standard
    body; sd (B, T, 17, 2), their standard deviation in metres across the ray (of one axis) and along it; and velocity
    (B, T, 17, 3), metres a frame.

    A joint that was seen lies on its ray but for what `leave_off` moves it across: with exact keypoints the answer's
    projection is exact. A bone's depth is a share of what its length in the image leaves of its length, so that the
    network need not learn roots of squares.
    """

    lengths: Tensor
    chains: Tensor

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.enter = nn.Linear(6, config.width)
        self.enter_frame = nn.Linear(CHANNELS - 4 * _JOINTS, config.width)
        self.which = nn.Embedding(_TOKENS, config.width)  # which joint a token is of
        self.blocks = nn.ModuleList(Block(config.width, config.trunk, d) for d in config.dilations)
        self.norm = nn.LayerNorm(config.width)
        self.leave = nn.Linear(config.width, 3)  # across: of a joint that was not seen
        self.leave_off = nn.Linear(config.width, 2)
        self.leave_distance = nn.Linear(config.width, 1)
        self.leave_bone = nn.Linear(config.width, 2)  # of the bone that ends in the joint
        self.leave_sd = nn.Linear(config.width, 2)
        self.leave_velocity = nn.Linear(config.width, 3)
        nn.init.normal_(self.which.weight, std=0.5)
        for layer in (self.leave_off, self.leave_distance, self.leave_bone, self.leave_sd):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)
        nn.init.constant_(self.leave_sd.bias, -3.0)  # 5 cm
        lengths = torch.tensor([_BONES_M[H36M17.joints[child]] for child in CHILDREN])
        chains = torch.zeros(_JOINTS, len(CHILDREN))  # 1 for the bones between the pelvis and the joint
        for bone, (child, parent) in enumerate(zip(CHILDREN, PARENTS, strict=True)):
            chains[child] = chains[parent]
            chains[child, bone] = 1
        self.register_buffer("lengths", lengths, persistent=False)
        self.register_buffer("chains", chains, persistent=False)

    def matrices(self) -> list[nn.Parameter]:
        """Those that Muon is for."""
        return [p for p in self.blocks.parameters() if p.ndim == 2]

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        return self.answer(self.hidden(self.tokens(features)), features)

    def tokens(self, features: Tensor) -> Tensor:
        """(B, T, 18, width): what each joint shows; the last token is the frame's own: place, size and up."""
        shown, there = _bones(features)
        shown = _DISTANCE * shown
        depth = _depth(self.lengths, shown)
        # Bones by their child joint: the pelvis, which is no bone's, comes first in the tree and gets zeros.
        bones = torch.stack([shown, depth], dim=-1) * there[..., None]
        by_joint = torch.cat([torch.zeros_like(bones[..., :1, :]), bones], dim=-2)[..., _BONE_OF, :]
        trust = features[..., 2 * _JOINTS : 3 * _JOINTS]
        own = torch.cat(
            [_image(features), torch.stack([trust, _present(features)], dim=-1), 3 * by_joint], dim=-1
        )
        frame = self.enter_frame(features[..., 4 * _JOINTS :])[..., None, :]
        return torch.cat([self.enter(own), frame], dim=-2) + self.which.weight

    def hidden(self, tokens: Tensor) -> Tensor:
        """(B, T, 18, width): all layers but the first and last ones, which bfloat16 would round to millimetres."""
        for block in self.blocks:
            tokens = block(tokens)
        return tokens

    def answer(self, hidden: Tensor, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """joints, sd and velocity of what `hidden` gives for these features."""
        x, features = self.norm(hidden.float()), features.float()
        x, frame = x[..., :_JOINTS, :], x[..., _JOINTS, :]
        free = self.leave(x)
        distance = _DISTANCE * self.leave_distance(frame).clamp(-1, 1).exp()  # (B, T, 1)
        shown, there = _bones(features)
        share, longer = self.leave_bone(x[..., CHILDREN, :]).unbind(-1)
        bones = _depth(self.lengths * (longer.tanh() / 2).exp(), distance * shown) * there
        depth = free[..., 2] + (share * bones) @ self.chains.T
        depth = depth - depth[..., [_PELVIS]]
        # The pelvis is `distance / size` away, a joint by its depth more: its ray is so far across there.
        size = (features[..., [4 * _JOINTS + 3]] - 2).exp()  # features.py: log(mean_size) + 2
        ray = _image(features) * (distance + size * depth)[..., None]
        seen = _present(features)[..., None]
        across = seen * (ray + self.leave_off(x)) + (1 - seen) * free[..., :2]
        joints = torch.cat([across - across[..., [_PELVIS], :], depth[..., None]], dim=-1)
        velocity = self.leave_velocity(x)
        return joints, self.leave_sd(x).clamp(*_LOG_SD).exp(), velocity - velocity[..., [_PELVIS], :]


def _image(features: Tensor) -> Tensor:
    """(B, T, 17, 2) of features.py."""
    return features[..., : 2 * _JOINTS].unflatten(-1, (_JOINTS, 2))


def _present(features: Tensor) -> Tensor:
    """(B, T, 17) 1 or 0, of features.py."""
    return features[..., 3 * _JOINTS : 4 * _JOINTS]


def _bones(features: Tensor) -> tuple[Tensor, Tensor]:
    """(B, T, 16) every bone's length in the image, and 1 where both its ends were seen, else 0."""
    image, present = _image(features), _present(features)
    line = image[..., CHILDREN, :] - image[..., PARENTS, :]
    return (line.square().sum(-1) + 1e-8).sqrt(), present[..., CHILDREN] * present[..., PARENTS]


def _depth(length: Tensor, shown: Tensor) -> Tensor:
    """Metres along the ray between the ends of bones of these lengths that are shown so long."""
    return ((length.square() - shown.square()).clamp_min(0) + _SOFT_M**2).sqrt()
