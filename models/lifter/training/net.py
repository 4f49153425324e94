"""The lifter's network: dilated temporal convolutions with residual blocks, for any number of frames, whose answer is
built on the rays of the keypoints and the lengths of bones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor, nn

from ....pipeline.errors import InputError
from ....pipeline.layouts import H36M17
from ...synthetic.bodies import bone_tree
from ..features import CHANNELS

_PELVIS = H36M17.index("pelvis")
_JOINTS = len(H36M17)
_LOG_SD = (-7.0, 1.0)  # of metres: 1 mm to 2.7 m
_CHILD, _PARENT = bone_tree()

# Metres of bones of a standard body, by their child joint: means over the people of the training data.
_BONES_M = {
    "r_hip": 0.093, "l_hip": 0.093, "r_knee": 0.375, "l_knee": 0.375, "r_ankle": 0.402, "l_ankle": 0.402,
    "spine": 0.211, "thorax": 0.278, "nose": 0.148, "head": 0.143, "l_shoulder": 0.18, "r_shoulder": 0.18,
    "l_elbow": 0.272, "r_elbow": 0.272, "l_wrist": 0.238, "r_wrist": 0.238,
}  # fmt: skip
_SOFT_M = 0.03  # below this much foreshortening the image does not tell depth
_DISTANCE = 0.37  # of the body times its size in the image, metres of a standard body: where training begins


@dataclass(frozen=True)
class NetConfig:
    """width: channels of the hidden layers. dilations: one residual block each, in frames. ray, bones: build the answer
    on them."""

    width: int = 320
    dilations: tuple[int, ...] = (1, 3, 9, 27, 1, 3)
    kind: Literal["frames", "joints", "mixed"] = "frames"
    trunk: int = 256
    ray: bool = False
    bones: bool = False

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
        return x + self.out(nn.functional.gelu(_taps(self.norm(x), self.dilation, self.mix)))


def _taps(here: Tensor, d: int, mix: nn.Linear) -> Tensor:
    """mix of here (B, T, ..., W) and the frames d before and after it, zeros beyond the ends."""
    frames, width = here.shape[1], here.shape[-1]
    if frames == 1 and not torch.compiler.is_exporting():  # the same numbers without the zeros around
        return nn.functional.linear(here, mix.weight[:, width : 2 * width], mix.bias)
    if frames <= d and not torch.compiler.is_exporting():  # the same numbers without a long padding
        before = after = torch.zeros_like(here)
    else:
        padded = nn.functional.pad(here, (0, 0) * (here.ndim - 2) + (d, d))
        before, after = padded[:, :frames], padded[:, 2 * d :]
    return mix(torch.cat([before, here, after], dim=-1))


class JointBlock(nn.Module):
    """Mixes joints, then time, then channels of tokens (B, T, 18, C)."""

    def __init__(self, width: int, dilation: int, heads: int = 4) -> None:
        super().__init__()
        self.dilation, self.heads = dilation, heads
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in range(3))
        self.joints = nn.Parameter(torch.randn(heads, _JOINTS + 1, _JOINTS + 1) / (_JOINTS + 1) ** 0.5)
        self.enter = nn.Linear(width, width)
        self.leave = nn.Linear(width, width)
        self.mix = nn.Linear(3 * width, width)
        self.up = nn.Linear(width, 2 * width)
        self.out = nn.Linear(2 * width, width)
        with torch.no_grad():
            self.mix.weight[:, :width] = 0
            self.mix.weight[:, 2 * width :] = 0

    def forward(self, x: Tensor) -> Tensor:
        B, T, J, C = x.shape
        h = self.enter(self.norms[0](x)).reshape(B * T, J, self.heads, C // self.heads)
        h = torch.einsum("hij,njhc->nihc", self.joints.to(h.dtype), h).reshape(B, T, J, C)
        x = x + self.leave(nn.functional.gelu(h))
        x = x + nn.functional.gelu(_taps(self.norms[1](x), self.dilation, self.mix))
        return x + self.out(nn.functional.gelu(self.up(self.norms[2](x))))


class MixedBlock(nn.Module):
    """Tokens (B, T, 18, C) whose joints and frames are mixed by one trunk, channels by shared weights."""

    def __init__(self, width: int, dilation: int, trunk: int) -> None:
        super().__init__()
        self.dilation = dilation
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in range(2))
        self.down = nn.Linear((_JOINTS + 1) * width, trunk)
        self.mix = nn.Linear(3 * trunk, trunk)
        self.back = nn.Linear(trunk, (_JOINTS + 1) * width)
        self.up = nn.Linear(width, 2 * width)
        self.out = nn.Linear(2 * width, width)
        with torch.no_grad():
            self.mix.weight[:, :trunk] = 0
            self.mix.weight[:, 2 * trunk :] = 0

    def forward(self, x: Tensor) -> Tensor:
        h = self.down(self.norms[0](x).flatten(-2))
        h = nn.functional.gelu(_taps(h, self.dilation, self.mix))
        x = x + self.back(h).reshape(x.shape)
        return x + self.out(nn.functional.gelu(self.up(self.norms[1](x))))


class LifterNet(nn.Module):
    """(B, T, CHANNELS) features -> joints (B, T, 17, 3) relative to the pelvis in the ray frame, metres of a standard
    body; sd (B, T, 17, 2), their standard deviation in metres across the ray (of one axis) and along it; and velocity
    (B, T, 17, 3), metres a frame."""

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.config = config
        tokens = config.kind != "frames"
        more = 2 * len(_CHILD) if config.bones else 0
        if tokens:
            own = 4 + (2 if config.bones else 0)
            self.enter = nn.Linear(own, config.width)
            self.enter_all = nn.Linear(CHANNELS - 4 * _JOINTS, config.width)
            self.place = nn.Parameter(torch.randn(_JOINTS + 1, config.width) * 0.5)
            kind = JointBlock if config.kind == "joints" else MixedBlock
            args = () if config.kind == "joints" else (config.trunk,)
            self.blocks = nn.ModuleList(kind(config.width, d, *args) for d in config.dilations)
        else:
            self.enter = nn.Linear(CHANNELS + more, config.width)
            self.blocks = nn.ModuleList(Block(config.width, dilation) for dilation in config.dilations)
        self.norm = nn.LayerNorm(config.width)
        per = 1 if tokens else _JOINTS
        self.leave = nn.Linear(config.width, 3 * per)
        self.leave_sd = nn.Linear(config.width, 2 * per)
        self.leave_velocity = nn.Linear(config.width, 3 * per)
        nn.init.zeros_(self.leave_sd.weight)
        nn.init.constant_(self.leave_sd.bias, -3.0)  # 5 cm
        if config.ray:
            self.distance = nn.Linear(config.width, 1)
            nn.init.zeros_(self.distance.weight)
            nn.init.zeros_(self.distance.bias)
        if config.bones:
            self.leave_bones = nn.Linear(config.width, 2 * (1 if tokens else len(_CHILD)))
            nn.init.zeros_(self.leave_bones.weight)
            nn.init.zeros_(self.leave_bones.bias)
        lengths = torch.tensor([_BONES_M[H36M17.joints[child]] for child in _CHILD])
        ends = torch.zeros(_JOINTS, len(_CHILD))  # (joint, bone): bones between the pelvis and the joint
        for bone, (child, parent) in enumerate(zip(_CHILD, _PARENT, strict=True)):
            ends[child] = ends[parent]
            ends[child, bone] = 1
        self.register_buffer("lengths", lengths, persistent=False)
        self.register_buffer("ends", ends, persistent=False)

    def matrices(self) -> list[nn.Parameter]:
        """Those that Muon is for."""
        return [p for p in self.blocks.parameters() if p.ndim == 2]

    def compile_hidden(self) -> None:
        """From now on `hidden` is one graph (torch.compile), made anew for every length of windows."""
        self.hidden = torch.compile(self.hidden, dynamic=False)  # type: ignore[method-assign]

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        return self.answer(self.hidden(features), features)

    def _bones(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """(B, T, 16) length in the image of every bone in metres of a standard body, and whether both ends are there."""
        image, present = self._image(features)
        line = image[:, :, _CHILD] - image[:, :, _PARENT]
        return _DISTANCE * line.square().sum(-1).add(1e-8).sqrt(), present[:, :, _CHILD] * present[:, :, _PARENT]

    def _image(self, features: Tensor) -> tuple[Tensor, Tensor]:
        image = features[..., : 2 * _JOINTS].unflatten(-1, (_JOINTS, 2))
        return image, features[..., 3 * _JOINTS : 4 * _JOINTS]

    def hidden(self, features: Tensor) -> Tensor:
        """(B, T, width): everything but the last layers, which bfloat16 would round to millimetres."""
        extra = None
        if self.config.bones:
            length, there = self._bones(features)
            deep = self._deep(self.lengths, length)
            extra = torch.stack([length, deep], dim=-1) * there[..., None]
        if self.config.kind == "frames":
            x = self.enter(features if extra is None else torch.cat([features, extra.flatten(-2) * 3], dim=-1))
        else:
            image, present = self._image(features)
            trust = features[..., 2 * _JOINTS : 3 * _JOINTS]
            own = [image, trust[..., None], present[..., None]]
            if extra is not None:
                by_joint = extra.new_zeros(*image.shape)
                by_joint[:, :, _CHILD] = extra * 3
                own.append(by_joint)
            tokens = self.enter(torch.cat(own, dim=-1))
            x = torch.cat([tokens, self.enter_all(features[..., 4 * _JOINTS :])[:, :, None]], dim=-2) + self.place
        for block in self.blocks:
            x = block(x)
        return x

    def answer(self, hidden: Tensor, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """joints, sd and velocity of what `hidden` gives."""
        x = self.norm(hidden.float())
        features = features.float()
        image, present = self._image(features)
        if self.config.kind == "frames":
            own, whole = x, x
            points = lambda layer, n: layer(own).unflatten(-1, (-1, n))  # noqa: E731
        else:
            own, whole = x[:, :, :_JOINTS], x[:, :, _JOINTS]
            points = lambda layer, n: layer(own)  # noqa: E731
        joints = points(self.leave, 3)
        lateral, depth = joints[..., :2], joints[..., 2]
        distance = _DISTANCE * self.distance(whole).clamp(-1, 1).exp() if self.config.ray else None
        if self.config.bones:
            length, there = self._bones(features)
            if distance is not None:
                length = length / _DISTANCE * distance
            bones = points(self.leave_bones, 2)
            if self.config.kind != "frames":
                bones = bones[:, :, _CHILD]
            longer, share = bones.unbind(-1)
            deep = self._deep(self.lengths * (0.5 * longer.tanh()).exp(), length) * there
            depth = depth + (share * deep) @ self.ends.T
        depth = depth - depth[..., [_PELVIS]]
        if distance is not None:
            mean_size = (features[..., 4 * _JOINTS + 3] - 2).exp()[..., None]
            lateral = lateral + image * (distance + mean_size * depth)[..., None] * present[..., None]
        joints = torch.cat([lateral - lateral[:, :, [_PELVIS]], depth[..., None]], dim=-1)
        velocity = points(self.leave_velocity, 3)
        velocity = velocity - velocity[:, :, [_PELVIS]]
        return joints, points(self.leave_sd, 2).clamp(*_LOG_SD).exp(), velocity

    def _deep(self, length: Tensor, shown: Tensor) -> Tensor:
        """Metres along the ray of bones of this length that the image shows this long."""
        return ((length**2 - shown**2).clamp_min(0) + _SOFT_M**2).sqrt()
