"""The lifter's network: dilated temporal convolutions with residual blocks, for any number of frames, whose answer is
built on the rays of the keypoints and on what bones' lengths in the image say of their depth."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from ....pipeline.errors import InputError
from ....pipeline.layouts import H36M17
from ...synthetic.bodies import bone_tree
from ..features import CHANNELS

_PELVIS = H36M17.index("pelvis")
_JOINTS = len(H36M17)
_CHILDREN, _PARENTS = bone_tree()
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
    """width: channels of the hidden layers. dilations: one residual block each, in frames."""

    width: int = 320
    dilations: tuple[int, ...] = (1, 3, 9, 27, 1, 3)

    def __post_init__(self) -> None:
        sizes = {"width": self.width, "dilations": min(self.dilations, default=1)}
        if small := [name for name, size in sizes.items() if size < 1]:
            raise InputError(f"expected {' and '.join(small)} of at least 1")

    @property
    def reach(self) -> int:
        """Frames on each side that a frame's answer depends on."""
        return sum(self.dilations)


class Block(nn.Module):
    """Pre-norm residual block: a convolution over three frames `dilation` apart, then one within the frame."""

    def __init__(self, width: int, dilation: int) -> None:
        super().__init__()
        self.dilation = dilation
        self.norm = nn.LayerNorm(width)
        self.mix = nn.Linear(3 * width, width)  # as a matrix product: faster on CPUs than a dilated Conv1d
        self.out = nn.Linear(width, width)
        with torch.no_grad():
            # Starts as a network for single frames; what frames before and after add is learned.
            self.mix.weight[:, :width] = 0
            self.mix.weight[:, 2 * width :] = 0

    def forward(self, x: Tensor) -> Tensor:
        frames, d = x.shape[1], self.dilation
        here = self.norm(x)
        if frames == 1 and not torch.compiler.is_exporting():  # the same numbers without the zeros around
            width = x.shape[-1]
            near = nn.functional.linear(here, self.mix.weight[:, width : 2 * width], self.mix.bias)
            return x + self.out(nn.functional.gelu(near))
        if frames <= d and not torch.compiler.is_exporting():  # the same numbers without a long padding
            before = after = torch.zeros_like(here)
        else:
            padded = nn.functional.pad(here, (0, 0, d, d))  # zeros before the first and after the last frame
            before, after = padded[:, :frames], padded[:, 2 * d :]
        near = torch.cat([before, here, after], dim=-1)  # (B, T, 3 width)
        return x + self.out(nn.functional.gelu(self.mix(near)))


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
        self.enter = nn.Linear(CHANNELS + 2 * len(_CHILDREN), config.width)
        self.blocks = nn.ModuleList(Block(config.width, dilation) for dilation in config.dilations)
        self.norm = nn.LayerNorm(config.width)
        self.leave = nn.Linear(config.width, 3 * _JOINTS)  # across: of joints that were not seen
        self.leave_off = nn.Linear(config.width, 2 * _JOINTS)
        self.leave_distance = nn.Linear(config.width, 1)
        self.leave_bones = nn.Linear(config.width, 2 * len(_CHILDREN))
        self.leave_sd = nn.Linear(config.width, 2 * _JOINTS)
        self.leave_velocity = nn.Linear(config.width, 3 * _JOINTS)
        for layer in (self.leave_off, self.leave_distance, self.leave_bones, self.leave_sd):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)
        nn.init.constant_(self.leave_sd.bias, -3.0)  # 5 cm
        lengths = torch.tensor([_BONES_M[H36M17.joints[child]] for child in _CHILDREN])
        chains = torch.zeros(_JOINTS, len(_CHILDREN))  # 1 for the bones between the pelvis and the joint
        for bone, (child, parent) in enumerate(zip(_CHILDREN, _PARENTS, strict=True)):
            chains[child] = chains[parent]
            chains[child, bone] = 1
        self.register_buffer("lengths", lengths, persistent=False)
        self.register_buffer("chains", chains, persistent=False)

    def matrices(self) -> list[nn.Parameter]:
        """Those that Muon is for."""
        return [p for p in self.blocks.parameters() if p.ndim == 2]

    def compile_hidden(self) -> None:
        """From now on `hidden` is one graph (torch.compile), made anew for every length of windows."""
        self.hidden = torch.compile(self.hidden, dynamic=False)  # type: ignore[method-assign]

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        return self.answer(self.hidden(features), features)

    def hidden(self, features: Tensor) -> Tensor:
        """(B, T, width): everything but the last layers, which bfloat16 would round to millimetres."""
        shown, there = _bones(features)
        shown = _DISTANCE * shown
        bones = torch.cat([shown * there, _depth(self.lengths, shown) * there], dim=-1)
        x = self.enter(torch.cat([features, bones], dim=-1))
        for block in self.blocks:
            x = block(x)
        return x

    def answer(self, hidden: Tensor, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """joints, sd and velocity of what `hidden` gives for these features."""
        x, features = self.norm(hidden.float()), features.float()
        free = _points(self.leave(x), 3)
        distance = _DISTANCE * self.leave_distance(x).clamp(-1, 1).exp()  # (B, T, 1)
        shown, there = _bones(features)
        share, longer = _points(self.leave_bones(x), 2).unbind(-1)
        bones = _depth(self.lengths * (longer.tanh() / 2).exp(), distance * shown) * there
        depth = free[..., 2] + (share * bones) @ self.chains.T
        depth = depth - depth[..., [_PELVIS]]
        # The pelvis is `distance / size` away, a joint by its depth more: its ray is so far across there.
        size = (features[..., [4 * _JOINTS + 3]] - 2).exp()  # features.py: log(mean_size) + 2
        ray = _image(features) * (distance + size * depth)[..., None]
        seen = _present(features)[..., None]
        across = seen * (ray + _points(self.leave_off(x), 2)) + (1 - seen) * free[..., :2]
        joints = torch.cat([across - across[..., [_PELVIS], :], depth[..., None]], dim=-1)
        velocity = _points(self.leave_velocity(x), 3)
        return (
            joints,
            _points(self.leave_sd(x), 2).clamp(*_LOG_SD).exp(),
            velocity - velocity[..., [_PELVIS], :],
        )


def _points(values: Tensor, numbers: int) -> Tensor:
    return values.unflatten(-1, (-1, numbers))


def _image(features: Tensor) -> Tensor:
    """(B, T, 17, 2) of features.py."""
    return _points(features[..., : 2 * _JOINTS], 2)


def _present(features: Tensor) -> Tensor:
    """(B, T, 17) 1 or 0, of features.py."""
    return features[..., 3 * _JOINTS : 4 * _JOINTS]


def _bones(features: Tensor) -> tuple[Tensor, Tensor]:
    """(B, T, 16) every bone's length in the image, and 1 where both its ends were seen, else 0."""
    image, present = _image(features), _present(features)
    line = image[..., _CHILDREN, :] - image[..., _PARENTS, :]
    return (line.square().sum(-1) + 1e-8).sqrt(), present[..., _CHILDREN] * present[..., _PARENTS]


def _depth(length: Tensor, shown: Tensor) -> Tensor:
    """Metres along the ray between the ends of bones of these lengths that are shown so long."""
    return ((length.square() - shown.square()).clamp_min(0) + _SOFT_M**2).sqrt()
