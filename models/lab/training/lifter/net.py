"""The lifter's network: dilated temporal convolutions with residual blocks, for any number of frames, whose answer is
drawn towards the rays of the keypoints and towards what bones' lengths in the image say of their depth."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from .....pipeline.core.errors import InputError
from .....pipeline.core.layouts import H36M17
from ....lifter.features import CHANNELS
from ...synthetic.bodies import bone_tree

_PELVIS = H36M17.index("pelvis")
_JOINTS = len(H36M17)
_CHILDREN, _PARENTS = bone_tree()
BONES = len(_CHILDREN)
ADDED = ("leave_gate.", "leave_distance.", "leave_bone.")  # layers that the first networks do not have
_LOG_SD = (-7.0, 1.0)  # of metres: 1 mm to 2.7 m

# Metres of bones of a standard body, by their child joint: means over the 33 people of the training data.
_BONES_M = {
    "r_hip": 0.093, "l_hip": 0.093, "r_knee": 0.375, "l_knee": 0.375, "r_ankle": 0.402, "l_ankle": 0.402,
    "spine": 0.211, "thorax": 0.278, "nose": 0.148, "head": 0.143, "l_shoulder": 0.18, "r_shoulder": 0.18,
    "l_elbow": 0.272, "r_elbow": 0.272, "l_wrist": 0.238, "r_wrist": 0.238,
}  # fmt: skip
_SOFT_M = 0.03  # of depth: keeps the slope finite where a bone is seen at its full length
# The distance of a standard body in metres times its size in the image (rays' root mean square): the mean over training
# windows. Two deviations are 0.3 and 0.45.
_DISTANCE = 0.37


@dataclass(frozen=True)
class NetConfig:
    """width: channels of the hidden layers. dilations: one residual block each, in frames."""

    width: int = 352
    dilations: tuple[int, ...] = (1, 3, 9, 27, 1, 3, 9, 1)

    def __post_init__(self) -> None:
        sizes = {"width": self.width, "dilations": min(self.dilations, default=1)}
        if small := [name for name, size in sizes.items() if size < 1]:
            raise InputError("bad-value", f"expected {' and '.join(small)} of at least 1")

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
        return x + self.out(nn.functional.gelu(self._mixed(self.norm(x))))

    def _mixed(self, here: Tensor) -> Tensor:
        """(B, T, width) of the frames and their neighbours; beyond the ends are zeros."""
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

    `leave` answers alone at first. What is learned on top of it: how far a joint that was seen moves across its ray
    towards it (`leave_gate`), at a distance that fits the whole body best but for `leave_distance`, and which share of
    the depth that a bone's length in the image leaves of its length a bone goes along the ray (`leave_bone`).
    """

    lengths: Tensor
    chains: Tensor

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.enter = nn.Linear(CHANNELS + 2 * BONES, config.width)
        self.blocks = nn.ModuleList(Block(config.width, d) for d in config.dilations)
        self.norm = nn.LayerNorm(config.width)
        self.leave = nn.Linear(config.width, 3 * _JOINTS)
        self.leave_sd = nn.Linear(config.width, 2 * _JOINTS)
        self.leave_velocity = nn.Linear(config.width, 3 * _JOINTS)
        self.leave_gate = nn.Linear(config.width, 2 * _JOINTS)
        self.leave_distance = nn.Linear(config.width, 1)
        self.leave_bone = nn.Linear(config.width, 2 * BONES)
        for layer in (self.leave_gate, self.leave_distance, self.leave_bone):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)
        nn.init.zeros_(self.leave_sd.weight)
        nn.init.constant_(self.leave_sd.bias, -3.0)  # 5 cm
        lengths = torch.tensor([_BONES_M[H36M17.joints[child]] for child in _CHILDREN])
        chains = torch.zeros(_JOINTS, BONES)  # 1 for the bones between the pelvis and the joint
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
        x = self.enter(torch.cat([features, 3 * bones], dim=-1))
        for block in self.blocks:
            x = block(x)
        return x

    def answer(self, hidden: Tensor, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """joints, sd and velocity of what `hidden` gives for these features."""
        x, features = self.norm(hidden.float()), features.float()
        own = self.leave(x).unflatten(-1, (_JOINTS, 3))
        own = own - own[..., [_PELVIS], :]
        # The body is `distance / size` away, a joint by its depth more: its ray is so far across there.
        size = (features[..., [4 * _JOINTS + 3]] - 2).exp()  # features.py: log(mean_size) + 2
        rays, present = _image(features), _present(features)[..., None]
        across = own[..., :2] - rays * (size * own[..., 2])[..., None]
        middle = (across * present).sum(-2, keepdim=True) / present.sum(-2, keepdim=True).clamp_min(1)
        ray_middle = (rays * present).sum(-2, keepdim=True) / present.sum(-2, keepdim=True).clamp_min(1)
        from_middle = (rays - ray_middle) * present
        distance = ((across - middle) * from_middle).sum((-1, -2)) / (
            from_middle.square().sum((-1, -2)) + 0.01
        )
        distance = distance[..., None] * self.leave_distance(x).clamp(-1, 1).exp()  # (B, T, 1)

        shown, there = _bones(features)
        share, longer = self.leave_bone(x).unflatten(-1, (2, -1)).unbind(-2)
        bones = _depth(self.lengths * (longer.tanh() / 2).exp(), distance * shown) * there
        deeper = (share * bones) @ self.chains.T
        depth = own[..., 2] + deeper
        beside = (distance[..., None] * (rays - ray_middle) + middle - across) + rays * (size * deeper)[
            ..., None
        ]
        gate, trusting = self.leave_gate(x).unflatten(-1, (2, -1)).unbind(-2)
        trust = features[..., 2 * _JOINTS : 3 * _JOINTS]
        sideways = own[..., :2] + present * (gate + trusting * trust)[..., None] * beside
        joints = torch.cat([sideways - sideways[..., [_PELVIS], :], depth[..., None]], dim=-1)
        velocity = self.leave_velocity(x).unflatten(-1, (_JOINTS, 3))
        sd = self.leave_sd(x).unflatten(-1, (_JOINTS, 2)).clamp(*_LOG_SD).exp()
        return joints, sd, velocity - velocity[..., [_PELVIS], :]


def _image(features: Tensor) -> Tensor:
    """(B, T, 17, 2) of features.py."""
    return features[..., : 2 * _JOINTS].unflatten(-1, (_JOINTS, 2))


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
