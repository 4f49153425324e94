"""3DPCNet and its training:  pcnet3d lab train models/lab/training/pcnet.toml -o DIR

Which way is up and which way does the body face, from one frame's 3D joints. The paper's network: a graph branch and a
Transformer branch, fused by gated cross-attention, a 6D rotation head and an optional residual head. NetConfig's
defaults are the paper's; pcnet.toml has other ones.

The whole of its training in one script, over the loop of loop.py: bodies seen from somewhere, one frame at a time, made
in torch on the device that trains; the paper's losses; validation; and the ONNX file. Frames have two sources: motion
capture, in other poses, on other bodies, from a random view, with joints missing or turned over in depth; and lifted
takes of the test bed. The config file says what differs from the defaults here; DIR gets NAME.onnx and what loop.py
keeps there.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
import torch
from pydantic import Field, PositiveInt, model_validator
from torch import Tensor, nn
from torch.nn import functional

from ....pipeline.core.anthropometry import SEGMENTS
from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import geodesic_deg, is_finite
from ...common.vectors import rotate
from ..clips import Clip, lying, read_clips, read_rows, subject_of
from ..synthetic import (
    BodyRange,
    Draw,
    MotionRange,
    Share,
    Size,
    Targets,
    View,
    from_vector,
    mirror,
    proportions,
    redefined,
    seen,
    varied,
    views,
)
from .loop import Device, Training, device_of, fingerprint, fit, write_onnx

JOINTS = len(H36M17)
_PELVIS = H36M17.index("pelvis")
_BONES = [H36M17.indices(bone) for bone in H36M17.bones]
_SCALE_BONES = [H36M17.indices(bone) for bone in SEGMENTS]
_SPREAD = 4.0  # joints over stature lie within about 0.5; the layers want numbers near 1
_TYPICAL_DEG = 6.0  # where the expected error starts
# What R_camera_from_body of a body is times that of its mirror image in the camera's x = 0.
_MIRRORED_R = [[-1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [1.0, -1.0, 1.0]]
GRAPH_LAYERS, ATTENTION_LAYERS, HEADS = 3, 2, 8  # the paper's


@dataclass(frozen=True)
class NetConfig:
    """What is built. The defaults are the paper's network; `align` is not in the paper.

    width: features of a joint. output: features of the pose before the heads.
    residual: "off"; "free", an offset for every joint (the paper's).
    align: turn the joints into the torso's axes first and let the network correct those; the camera's axes
        are told beside them.
    """

    width: Annotated[int, Field(gt=0, multiple_of=HEADS)] = 256
    output: PositiveInt = 384
    dropout: float = 0.0
    residual: Literal["off", "free"] = "free"
    align: bool = False


class Answer(NamedTuple):
    """R: (B, 3, 3) R_camera_from_body. error_deg: (B,) its expected error. canonical: (B, 17, 3) in BODY, unit of
    the input. residual: (B, 17, 3) what the residual head added, over the body's size, or None. attention:
    (B, heads, 17, 17) of the fusion."""

    R: Tensor
    error_deg: Tensor
    canonical: Tensor
    residual: Tensor | None
    attention: Tensor


class PCNet(nn.Module):
    """joints (B, 17, 3) in CAMERA axes, any unit and origin, zeros where missing; valid (B, 17), 1 or 0."""

    def __init__(self, config: NetConfig, bf16: bool = False) -> None:
        """bf16: in training the layers compute in bfloat16; the geometry stays in float32."""
        super().__init__()
        self.config, self.bf16 = config, bf16
        self.encoder = Branches(4 + 9 * config.align, config)
        self.norm = nn.LayerNorm(config.output)
        self.rotation = nn.Linear(config.output, 6)
        nn.init.normal_(self.rotation.weight, std=0.01)
        with torch.no_grad():  # starts as no rotation, with `align` as the torso's axes
            self.rotation.bias.copy_(torch.tensor([1.0, 0, 0, 0, 1, 0]))
        self.error = nn.Sequential(nn.Linear(config.output, 64), nn.GELU(), nn.Linear(64, 1))
        nn.init.constant_(self.error[-1].bias, float(np.log(_TYPICAL_DEG)))  # type: ignore[arg-type]
        if config.residual != "off":
            self.residual = nn.Linear(config.output, JOINTS * 3)
            nn.init.zeros_(self.residual.weight)
            nn.init.zeros_(self.residual.bias)

    def forward(self, joints: Tensor, valid: Tensor) -> Answer:
        joints = (joints - joints[:, [_PELVIS]]) * valid[..., None]
        size = body_size(joints, valid)[:, None, None]
        shape, told, R_camera_from_torso = joints / size, [valid[..., None]], None
        if self.config.align:
            R_camera_from_torso = torso_axes(joints, valid)
            shape = rotate(R_camera_from_torso.mT, shape)
            told.append(R_camera_from_torso.flatten(1)[:, None].expand(-1, JOINTS, -1))
        low = self.bf16 and self.training
        with torch.autocast(joints.device.type, torch.bfloat16) if low else nullcontext():
            z, attention = self.encoder(torch.cat([_SPREAD * shape, *told], dim=-1))
        z = self.norm(z.float())
        R = gram_schmidt(self.rotation(z))
        if R_camera_from_torso is not None:
            R = R_camera_from_torso @ R
        canonical, delta = rotate(R.mT, joints), None
        if self.config.residual != "off":
            base = canonical / size
            moved = base + self.residual(z).unflatten(1, (-1, 3))
            moved = (moved - moved[:, [_PELVIS]]) * valid[..., None]
            delta = moved - base
            canonical = moved * size
        # Its own layers only: how sure the network is must not bend what it answers.
        error_deg = self.error(z.detach())[:, 0].clamp(-3.0, 5.0).exp()
        return Answer(R, error_deg, canonical, delta, attention)


class Branches(nn.Module):
    """The graph branch, the Transformer branch, and their fusion; (B, 17, F) -> (B, output).

    Inside, features are (17 * B, width), joint by joint: then layers are plain matrix products, the graph mixes joints
    in one more, and attention splits its heads without copying, in all a fifth faster than (B, 17, width).
    """

    def __init__(self, inputs: int, config: NetConfig) -> None:
        super().__init__()
        width = config.width
        self.graph = GraphBranch(inputs, width)
        self.attention = AttentionBranch(inputs, width)
        self.norm_graph, self.norm_attention = nn.LayerNorm(width), nn.LayerNorm(width)
        self.cross = Attention(width)
        self.gate = nn.Linear(2 * width, 2)
        self.out = nn.Sequential(nn.Dropout(config.dropout), nn.Linear(JOINTS * width, config.output))

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        x = x.transpose(0, 1).flatten(0, 1)
        graph, attention = self.norm_graph(self.graph(x)), self.norm_attention(self.attention(x))
        fused, weights = self.cross(graph, attention)
        graph, attention, fused = (_by_joint(part) for part in (graph, attention, fused))
        gate = self.gate(torch.cat([graph.mean(0), attention.mean(0)], dim=-1)).softmax(-1)
        z = fused + gate[:, :1] * graph + gate[:, 1:] * attention
        return self.out(z.transpose(0, 1).flatten(1)), weights


class GraphBranch(nn.Module):
    """Graph convolutions along bones, with an adjacency that is partly learned."""

    skeleton: Tensor

    def __init__(self, inputs: int, width: int) -> None:
        super().__init__()
        self.enter = nn.Linear(inputs, width)
        self.layers = nn.ModuleList(nn.Linear(width, width) for _ in range(GRAPH_LAYERS))
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in range(GRAPH_LAYERS))
        self.register_buffer("skeleton", skeleton_adjacency(), persistent=False)
        self.learned = nn.Parameter(skeleton_adjacency())
        self.alpha = nn.Parameter(torch.zeros(()))

    def adjacency(self) -> Tensor:
        """(17, 17): sigmoid(alpha) A_0 + (1 - sigmoid(alpha)) A_learned, A_learned symmetric."""
        share = self.alpha.sigmoid()
        return share * self.skeleton + (1 - share) * (self.learned + self.learned.T) / 2

    def forward(self, x: Tensor) -> Tensor:
        x, adjacency = self.enter(x), self.adjacency()
        for layer, norm in zip(self.layers, self.norms, strict=True):
            mixed = adjacency @ layer(norm(x)).reshape(JOINTS, -1)
            x = x + functional.gelu(mixed.reshape(x.shape))
        return x


class AttentionBranch(nn.Module):
    """A Transformer encoder over the joints, with learned positions."""

    def __init__(self, inputs: int, width: int) -> None:
        super().__init__()
        self.enter = nn.Linear(inputs, width)
        self.position = nn.Parameter(0.02 * torch.randn(JOINTS, width))
        self.layers = nn.ModuleList(EncoderLayer(width) for _ in range(ATTENTION_LAYERS))

    def forward(self, x: Tensor) -> Tensor:
        x = (_by_joint(self.enter(x)) + self.position[:, None]).flatten(0, 1)
        for layer in self.layers:
            x = layer(x)
        return x


class EncoderLayer(nn.Module):
    """Pre-norm self-attention and a feed-forward part, four times as wide."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm_1, self.norm_2 = nn.LayerNorm(width), nn.LayerNorm(width)
        self.attend = Attention(width)
        self.forward_part = nn.Sequential(nn.Linear(width, 4 * width), nn.GELU(), nn.Linear(4 * width, width))

    def forward(self, x: Tensor) -> Tensor:
        here = self.norm_1(x)
        x = x + self.attend(here, here)[0]
        return x + self.forward_part(self.norm_2(x))


class Attention(nn.Module):
    """Multi-head attention that also returns its weights."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.query, self.key_value = nn.Linear(width, width), nn.Linear(width, 2 * width)
        self.out = nn.Linear(width, width)

    def forward(self, queries: Tensor, source: Tensor) -> tuple[Tensor, Tensor]:
        width = self.out.in_features

        def split(x: Tensor) -> Tensor:
            return x.reshape(JOINTS, -1, HEADS, width // HEADS).permute(1, 2, 0, 3)

        q = split(self.query(queries))
        # Two products rather than one whose answer would be cut in two, which copies it.
        weight, bias = self.key_value.weight, self.key_value.bias
        k = split(functional.linear(source, weight[:width], bias[:width]))
        v = split(functional.linear(source, weight[width:], bias[width:]))
        weights = (q @ k.mT / q.shape[-1] ** 0.5).softmax(-1)  # (B, heads, 17, 17)
        return self.out((weights @ v).permute(2, 0, 1, 3).reshape(-1, width)), weights


def _by_joint(x: Tensor) -> Tensor:
    """(17 * B, F) -> (17, B, F), and that as it is."""
    return x.reshape(JOINTS, -1, x.shape[-1])


def gram_schmidt(six: Tensor) -> Tensor:
    """(B, 6) -> rotations (B, 3, 3): x = a/|a|, z = x x b normalised, y = z x x, as columns (Zhou et al. 2019)."""
    x = functional.normalize(six[:, :3], dim=-1)
    z = functional.normalize(torch.linalg.cross(x, six[:, 3:]), dim=-1)
    return torch.stack([x, torch.linalg.cross(z, x), z], dim=-1)


def body_size(joints: Tensor, valid: Tensor) -> Tensor:
    """(B,) stature that the bones speak of, in the joints' unit; by the bones that are there."""
    ends = torch.tensor(_SCALE_BONES, device=joints.device)
    there = valid[:, ends[:, 0]] * valid[:, ends[:, 1]]
    length = (joints[:, ends[:, 0]] - joints[:, ends[:, 1]]).norm(dim=-1)
    fraction = torch.tensor(list(SEGMENTS.values()), device=joints.device, dtype=joints.dtype)
    size = (length * there).sum(-1) / (fraction * there).sum(-1).clamp_min(1e-6)
    return torch.where(size > 0, size, torch.ones_like(size))


def torso_axes(joints: Tensor, valid: Tensor) -> Tensor:
    """R_camera_from_torso (B, 3, 3): GEOMETRIC from whatever of the torso is there, without gravity.

    Left is the sum of the unit hip and shoulder axes; the trunk leads from the pelvis to thorax and shoulders.
    What is missing altogether is taken from an upright person who faces the camera.
    """

    def at(name: str) -> Tensor:
        return joints[:, H36M17.index(name)]

    def there(*names: str) -> Tensor:
        return valid[:, H36M17.indices(names)].prod(-1, keepdim=True)

    both = there("l_shoulder", "r_shoulder")
    hips = functional.normalize(at("l_hip") - at("r_hip"), dim=-1) * there("l_hip", "r_hip")
    shoulders = functional.normalize(at("l_shoulder") - at("r_shoulder"), dim=-1) * both
    middle = functional.normalize(at("l_shoulder") + at("r_shoulder"), dim=-1) * both
    trunk = middle + functional.normalize(at("thorax"), dim=-1) * there("thorax")
    left = functional.normalize(hips + shoulders + 1e-6 * joints.new_tensor([1.0, 0, 0]), dim=-1)
    trunk = trunk + 1e-6 * joints.new_tensor([0.0, -1, 0])
    facing = functional.normalize(torch.linalg.cross(left, trunk), dim=-1)
    return torch.stack([-facing, -left, torch.linalg.cross(facing, left)], dim=-1)


def skeleton_adjacency() -> Tensor:
    """(17, 17) bones and every joint itself, symmetrically normalised (Kipf & Welling 2017)."""
    adjacency = torch.eye(JOINTS)
    start, end = torch.tensor(_BONES).T
    adjacency[start, end] = adjacency[end, start] = 1
    degree = adjacency.sum(-1).rsqrt()
    return degree[:, None] * adjacency * degree


_FPS = 30.0  # of poses that move; a single frame of them is taken


class Lifted(NamedTuple):
    """Lifted frames: joints and truth (N, 17, 3), CAMERA axes relative to the pelvis, the truth at the lift's scale;
    R (N, 3, 3) R_camera_from_body; lying (N,), of clips.lying; clips, the takes' names."""

    joints: np.ndarray
    truth: np.ndarray
    R: np.ndarray
    lying: np.ndarray
    clips: tuple[str, ...]


def read_lifted(paths: Iterable[Path]) -> Lifted:
    """The frames of `pcnet3d lab testbed` files that were lifted and have a truth. InputError for anything else."""
    parts, clips = [], []
    floats = {
        "lifted": (("frames", 17, 3), "f"),
        "truth": (("frames", 17, 3), "f"),
        "R_camera_from_body": (("frames", 3, 3), "f"),
    }
    others = {"lying": (("frames",), "fiub"), "clip": (("clips",), "U")}
    for path in paths:
        held = read_rows(path, "takes as `pcnet3d lab testbed` writes them", "take_start", **floats, **others)
        lifted, truth, R = (held[name].astype(np.float32) for name in floats)
        scale = (lifted * truth).sum((-2, -1)) / np.maximum((truth * truth).sum((-2, -1)), 1e-9)
        fine = is_finite(lifted).all(-1) & is_finite(R).all(-1)
        frames = lifted, truth * scale[:, None, None], R, held["lying"].astype(bool)
        parts.append([array[fine] for array in frames])
        clips += map(str, held["clip"])
    return Lifted(*map(np.concatenate, zip(*parts, strict=True)), clips=tuple(clips))


@dataclass(frozen=True)
class Mixture(MotionRange):
    """Shares of a batch, and how far its bodies and joints are from the capture; the defaults change nothing. All but
    the first three are shares of the captured frames, as are MotionRange's: bodies that lean, crawl or lie keep the
    world's up as their truth."""

    lifted: Share = 0.0  # lifted frames, of the files given to the training
    roll_deg: Size = 0.0  # the camera's roll that is added to them, uniform
    # Of lifted and of captured frames, drawn among those of people who lie, crawl or bend deeply, who are few.
    lying: Share = 0.0
    wide: Share = 0.0  # seen from `wide` views
    noisy: Share = 0.0  # with Gaussian noise of up to NOISE_M, twice as much in depth
    flipped: Share = 0.0  # with limbs turned over in depth
    missing: Share = 0.0  # with missing joints; lifted frames too


class Frames(NamedTuple):
    """joints, truth: (B, 17, 3) CAMERA axes, relative to the pelvis; what the network gets (zeros where missing), and
    the same without what spoilt it. valid: (B, 17), 1 or 0. R: (B, 3, 3) R_camera_from_body. All float32."""

    joints: Tensor
    valid: Tensor
    truth: Tensor
    R: Tensor

    @property
    def canonical(self) -> Tensor:
        """(B, 17, 3) the truth in BODY."""
        return rotate(self.R.mT, self.truth)


class Pool:
    """Frames to draw from, as tensors with a row for each."""

    def __init__(self, what: str, lies: np.ndarray, mixture: Mixture, *tensors: Tensor) -> None:
        """lies: (N,) which of the frames show people who lie. InputError when the mixture wants some, but none do."""
        if mixture.lying and not lies.any():
            raise InputError(
                "nothing-usable",
                f"Expected {what} in which somebody lies, for the mixture wants them; leave `lying` out.",
            )
        self.tensors, self.share = tensors, mixture.lying
        self.lying = torch.from_numpy(np.flatnonzero(lies)).to(tensors[0].device)

    def drawn(self, draw: Draw, count: int) -> list[Tensor]:
        """(count, ...) of each tensor at random, the mixture's share of them of people who lie."""
        rows = draw.integers(len(self.tensors[0]), count)
        if self.share:
            lies = draw.share(self.share, count)
            rows = torch.where(lies, self.lying[draw.integers(len(self.lying), count)], rows)
        return [tensor[rows] for tensor in self.tensors]


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
        """InputError when the mixture wants lifted frames, or people who lie, and there are none."""
        if mixture.lifted and lifted is None:
            raise InputError(
                "needs-input",
                "Expected files of lifted takes, for the mixture wants them; make some with pcnet3d lab testbed.",
            )
        self.device, self.mixture = torch.device(device), mixture
        self.targets: Targets = targets
        joints = np.concatenate([clip.joints for clip in clips])
        self.captured = Pool("clips", lying(joints), mixture, torch.from_numpy(joints).to(self.device))
        self.people = proportions(clips).to(self.device)
        # A body mirrored in x = 0 faces the other way, which only its own heading follows.
        mirrored = 0.5 if targets == "body" else 0.0
        self.bodies = BodyRange(unchanged=mixture.unchanged, mirrored=mirrored)
        if lifted is not None:
            arrays = (torch.from_numpy(of).to(self.device) for of in (lifted.joints, lifted.truth, lifted.R))
            self.lifted = Pool("lifted takes", lifted.lying, mixture, *arrays)

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
        def captured(number: int) -> Tensor:
            return self.captured.drawn(draw, number)[0][:, None]

        mixture = self.mixture
        world = varied(captured, count, draw, mixture, self.bodies, self.people, _FPS)
        world = redefined(world, draw, mixture.redefined)
        wide = (draw.rng.uniform(size=count) < mixture.wide)[:, None, None]
        turns = np.where(wide, views("wide", draw.rng, count), views("paper", draw.rng, count))
        shown, fine = seen(world[:, 0].cpu().numpy(), turns, self.targets)
        truth, R = (torch.from_numpy(x[fine]).float().to(self.device) for x in (shown, turns))
        return noisy(flipped(truth, draw, mixture.flipped), draw, mixture.noisy), truth, R

    def _lifted(self, draw: Draw, count: int) -> tuple[Tensor, Tensor, Tensor]:
        """Lifted frames, half of them mirrored left to right, before a camera that is rolled further."""
        joints, truth, R = self.lifted.drawn(draw, count)
        mirrored = draw.share(0.5, count, 1, 1)
        joints, truth = (torch.where(mirrored, mirror(x), x) for x in (joints, truth))
        R = torch.where(mirrored, R * R.new_tensor(_MIRRORED_R), R)
        angle = draw.uniform((-self.mixture.roll_deg, self.mixture.roll_deg), count, 1).deg2rad()
        roll = from_vector(angle * angle.new_tensor([0.0, 0.0, 1.0]))
        return rotate(roll, joints), rotate(roll, truth), roll @ R


_FLIPPED = {
    f"{side}_{joint}": [f"{side}_{part}" for part in below]
    for side in "lr"
    for joint, below in {
        "hip": ("knee", "ankle"), "knee": ("ankle",), "shoulder": ("elbow", "wrist"), "elbow": ("wrist",),
    }.items()
}  # fmt: skip


def flipped(joints: Tensor, draw: Draw, share: float) -> Tensor:
    """joints (B, 17, 3) in CAMERA axes, limb bones of a share of the bodies turned over in depth, as lifters do to what
    the image cannot tell; the image stays the same."""
    out = joints.clone()
    some = draw.share(share, len(out))
    for joint, below in _FLIPPED.items():
        at, rows = H36M17.index(joint), H36M17.indices(below)
        change = -2 * (out[:, rows[0], 2] - out[:, at, 2]) * (some & draw.share(0.2, len(out)))
        out[:, rows, 2] += change[:, None]
    return out


NOISE_M = 0.03


def noisy(joints: Tensor, draw: Draw, share: float) -> Tensor:
    """joints (B, 17, 3) in CAMERA axes, a share of the bodies with Gaussian noise of a standard deviation of up to
    NOISE_M, twice that in depth; relative to the pelvis, whose own noise thereby is all joints'."""
    count = len(joints)
    std = draw.uniform((0.0, NOISE_M), count, 1, 1) * draw.share(share, count, 1, 1)
    out = joints + std * draw.normal(*joints.shape) * torch.tensor([1.0, 1.0, 2.0], device=joints.device)
    return out - out[:, [_PELVIS]]


def present(draw: Draw, count: int, missing: float) -> Tensor:
    """(count, 17) False for about one to six joints of a share of the frames, never for the pelvis."""
    share = draw.uniform((0.05, 0.35), count, 1)
    gone = draw.share(share, count, JOINTS) & draw.share(missing, count, 1)
    gone[:, _PELVIS] = False
    return ~gone


_ANGLES = [
    H36M17.indices([f"{side}_{part}" for part in parts])
    for side in "lr"
    for parts in (
        ("shoulder", "elbow", "wrist"),
        ("hip", "knee", "ankle"),
        ("shoulder", "hip", "knee"),
        ("hip", "shoulder", "elbow"),
    )
]


# Weights of the terms of the loss: the paper's,
POSE, ROTATION, CYCLE, PERCEPTUAL = 1.0, 1.0, 0.25, 0.15
REGULAR, ERROR = 1e-3, 0.1  # and of what it gives no weights


def total(net: PCNet, answer: Answer, frames: Frames) -> Tensor:
    """The weighted sum of what follows, of the network's answer to these frames.

    With the residual off, cycle and perceptual do not depend on the network: R R^T X is X, and turning a body
    changes neither its bones nor its angles.
    """
    joints, there = frames.joints, frames.valid[..., None]
    angle = geodesic(answer.R, frames.R)
    loss = ROTATION * angle.mean() + ERROR * error_likelihood(answer.error_deg, angle)
    if answer.residual is None:
        # No rotation can take an estimator's own error away: it is judged on what it was given.
        loss = loss + POSE * pose(answer.canonical * there, rotate(frames.R.mT, joints) * there)
    else:
        loss = loss + POSE * pose(answer.canonical * there, frames.canonical * there)
        loss = loss + CYCLE * cycle(answer.R, answer.canonical, joints * there)
        loss = loss + PERCEPTUAL * perceptual(answer.canonical, frames.canonical, frames.valid)
    return loss + REGULAR * regular(net, answer)


def pose(canonical: Tensor, truth: Tensor) -> Tensor:
    """mean_j |x_j - y_j|^2, square metres."""
    return (canonical - truth).square().sum(-1).mean()


def geodesic(R_1: Tensor, R_2: Tensor) -> Tensor:
    """(B,) angle between rotations in radians: atan2(|skew part|, (trace - 1) / 2) of R_1^T R_2.

    The gradient is finite everywhere, at 0 and 180 degrees too, where arccos has none.
    """
    difference = (R_1[..., :, None] * R_2[..., None, :]).sum(-3)
    skew = difference - difference.mT
    sine = torch.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1) / 2
    cosine = (difference.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2
    return torch.atan2((sine.square().sum(-1) + 1e-12).sqrt(), cosine)


def cycle(R: Tensor, canonical: Tensor, joints: Tensor) -> Tensor:
    """mean_j |R x_j - y_j|^2: what the canonical pose becomes when it is turned back, against the input."""
    return (rotate(R, canonical) - joints).square().sum(-1).mean()


def perceptual(canonical: Tensor, truth: Tensor, valid: Tensor) -> Tensor:
    """Mean difference of bone lengths (metres) plus that of joint angles (radians): elbows, knees, hips, shoulders."""
    bones, angles = (torch.tensor(rows, device=truth.device) for rows in (_BONES, _ANGLES))
    there = [valid[:, rows].prod(-1) for rows in (bones, angles)]
    lengths = (_lengths(canonical, bones) - _lengths(truth, bones)).abs() * there[0]
    turned = (_angles(canonical, angles) - _angles(truth, angles)).abs() * there[1]
    return lengths.mean() + turned.mean()


def regular(net: PCNet, answer: Answer) -> Tensor:
    """Residual L2, distance of the learned graph from the skeleton's, and likeness of the attention heads."""
    loss = answer.R.new_zeros(())
    if answer.residual is not None:
        loss = loss + answer.residual.square().sum(-1).mean()
    graph = net.encoder.graph
    loss = loss + (graph.learned - graph.skeleton).square().mean()
    return loss + attention_likeness(answer.attention)


def attention_likeness(attention: Tensor) -> Tensor:
    """Mean cosine between the maps of different heads; 0 when no two heads look at the same joints. (B, H, 17, 17)."""
    maps = functional.normalize(attention.float().flatten(2), dim=-1)
    likeness = maps @ maps.mT
    heads = likeness.shape[-1]
    return (likeness.sum((-2, -1)) - heads).mean() / max(heads * (heads - 1), 1)


def error_likelihood(expected_deg: Tensor, angle: Tensor) -> Tensor:
    """Exponential likelihood log(e) + a / e: least where e is the mean of the true angles a (given in radians)."""
    return (expected_deg.log() + angle.detach().rad2deg() / expected_deg).mean()


def _lengths(joints: Tensor, bones: Tensor) -> Tensor:
    bone = joints[:, bones[:, 0]] - joints[:, bones[:, 1]]
    return (bone.square().sum(-1) + 1e-12).sqrt()


def _angles(joints: Tensor, triples: Tensor) -> Tensor:
    """(B, angles) at the middle joint, radians."""
    a = joints[:, triples[:, 0]] - joints[:, triples[:, 1]]
    b = joints[:, triples[:, 2]] - joints[:, triples[:, 1]]
    sine = (torch.linalg.cross(a, b).square().sum(-1) + 1e-12).sqrt()
    return torch.atan2(sine, (a * b).sum(-1))


class Deployed(nn.Module):
    """What the run time asks for: joints (B, 17, 3), valid (B, 17) -> R (B, 3, 3), error_deg (B,).

    symmetric: average with the answer to the mirrored body, so that left and right are treated alike; twice the work,
        in one pass over twice the batch, which takes less of a single pose's time than two passes.
    """

    def __init__(self, net: PCNet, symmetric: bool) -> None:
        super().__init__()
        self.net, self.symmetric = net, symmetric

    def forward(self, joints: Tensor, valid: Tensor) -> tuple[Tensor, Tensor]:
        if not self.symmetric:
            answer = self.net(joints, valid)
            return answer.R, answer.error_deg
        other_side = torch.from_numpy(H36M17.mirror).to(joints.device)
        mirrored = joints[:, other_side] * joints.new_tensor([-1.0, 1, 1])
        both = self.net(torch.cat([joints, mirrored]), torch.cat([valid, valid[:, other_side]]))
        R, mirrored_R = both.R.unflatten(0, (2, -1))
        R = R + mirrored_R * R.new_tensor(_MIRRORED_R)
        error_deg, mirrored_deg = both.error_deg.unflatten(0, (2, -1))
        return gram_schmidt(torch.cat([R[..., 0], R[..., 1]], dim=-1)), (error_deg * mirrored_deg).sqrt()


def export(deployed: Deployed, path: Path, **properties: object) -> None:
    """Write "joints" (B, 17, 3) and "valid" (B, 17) -> "R" (B, 3, 3) and "error_deg" (B,), any B. properties: kept in
    the file's metadata."""
    inputs = {"joints": torch.randn(2, JOINTS, 3), "valid": torch.ones(2, JOINTS)}
    said = {"pcnet3d": "rectifier", **properties}
    write_onnx(deployed, path, inputs, ("batch",), ("R", "error_deg"), said)


_VALIDATION_FRAMES = 2000
_LYING_SHARE = 0.1  # of the score


class TrainConfig(Training):
    """The whole of a training run."""

    kind: str = "pcnet"
    name: str = Field("pcnet", pattern=r"^[\w.-]+$")  # of the network's file, and what results call it
    # Files of `pcnet3d lab testbed` with takes of train subjects, by whichever lifter (docs/training.md).
    lifted: tuple[Path, ...] = ()
    # The same of val subjects, by a lifter that never saw them; with it, the best weights are the best on these.
    lifted_val: tuple[Path, ...] = ()
    # What the rotation leads to; "axes" is the paper's, for data whose people all face one way.
    targets: Targets = "body"
    batch: PositiveInt
    symmetric: bool  # the network's answer is averaged with that to the mirrored body
    net: NetConfig = NetConfig()
    mixture: Mixture = Mixture()

    @model_validator(mode="after")
    def _as_recorded(self) -> Self:
        poses = self.mixture.poses
        turned = self.lifted or self.lifted_val or poses.turned or poses.leaning or poses.laid
        if self.targets == "axes" and turned:
            raise InputError(
                "option-conflict",
                'expected bodies as they were recorded for targets = "axes"; leave lifted, lifted_val, turned, leaning '
                "and laid out",
            )
        return self


def train(
    config: TrainConfig,
    output: Path,
    device: Device = "cpu",
    clips: Mapping[str, Sequence[Clip]] | None = None,
) -> Deployed:
    """Run a config, or what is left of it: the network that it comes to. clips: {"train", "val"}, of the data folder
    where none are given. InputError when lifted takes are of other people than theirs, or as of `fit`."""
    on = device_of(device)
    torch.manual_seed(config.seed)
    clips = clips or {"train": read_clips("train"), "val": read_clips("val")}
    takes = lifted_takes(config, clips)
    frames = TrainingFrames(clips["train"], config.mixture, takes.get("train"), config.targets, on)
    checks = validation(clips["val"], takes.get("val"), config.targets, on)
    arrays = [array for lifted in takes.values() for array in (lifted.joints, lifted.R)]
    net = PCNet(config.net, config.bf16).to(on)
    matrices = [p for p in net.encoder.parameters() if p.ndim == 2]

    def loss_of(step: int) -> Tensor:
        batch = frames.batch(Draw(config.seed, step, on), config.batch)
        return total(net, net(batch.joints, batch.valid), batch)

    def look(average: PCNet) -> dict[str, float]:
        return check(Deployed(average, config.symmetric), checks)

    best = fit(net, matrices, config, fingerprint(clips, *arrays), loss_of, look, output)
    deployed = Deployed(best, config.symmetric)
    calibrate(deployed, checks.get("lifted", checks["paper"]))
    print({key: round(figure, 2) for key, figure in check(deployed, checks).items()}, flush=True)
    export(deployed, output / f"{config.name}.onnx", targets=config.targets, name=config.name)
    return deployed.cpu()


def step_s(config: TrainConfig, device: Device, clips: Sequence[Clip]) -> float:
    """Seconds that a step takes on these clips alone, by the second one of a network that is thrown away."""
    on = device_of(device)
    net, start = PCNet(config.net, config.bf16).to(on), 0.0
    frames = TrainingFrames(clips, config.mixture, None, config.targets, on)
    for step in (1, 2):
        start = time.perf_counter()
        batch = frames.batch(Draw(config.seed, step, on), config.batch)
        loss = total(net, net(batch.joints, batch.valid), batch)
        loss.backward()
        loss.item()  # waits for the device
    return time.perf_counter() - start


def lifted_takes(config: TrainConfig, clips: Mapping[str, Sequence[Clip]]) -> dict[str, Lifted]:
    """{"train", "val": the config's lifted takes}, where it has some. InputError when they are of people of another
    part."""
    takes: dict[str, Lifted] = {}
    for part, paths in (("train", config.lifted), ("val", config.lifted_val)):
        if paths:
            takes[part] = read_lifted(paths)
            people = {subject_of(clip.name) for clip in clips[part]}
            if strange := sorted(set(map(subject_of, takes[part].clips)) - people):
                raise InputError(
                    "files-apart",
                    f"Expected lifted takes of {part} subjects alone, got some of {', '.join(strange)}.",
                )
    return takes


def validation(
    clips: Sequence[Clip], lifted: Lifted | None, targets: Targets, device: torch.device | str = "cpu"
) -> dict[str, Frames]:
    """The same frames of the val subjects for every run: upright ones as "paper", "wide" and, where given, "lifted";
    captured ones as "lying", where there are some."""
    rng = np.random.default_rng(1)

    def some(rows: np.ndarray) -> np.ndarray:
        return rng.permutation(rows)[:_VALIDATION_FRAMES]

    def shown(world: np.ndarray, view: View) -> tuple[np.ndarray, np.ndarray]:
        R = views(view, rng, len(world))
        joints, fine = seen(world, R, targets)
        return joints[fine], R[fine]

    world = np.concatenate([clip.joints for clip in clips])
    lies = lying(world)
    upright = some(world[~lies])
    held = {"paper": shown(upright, "paper"), "wide": shown(upright, "wide")}
    if lifted:
        for name, kind in (("lifted", ~lifted.lying), ("lifted_lying", lifted.lying)):
            if kind.any():
                rows = some(np.flatnonzero(kind))
                held[name] = lifted.joints[rows], lifted.R[rows]
    if lies.any():
        held["lying"] = shown(some(world[lies]), "paper")
    checks = {}
    for name, arrays in held.items():
        joints, R = (torch.from_numpy(array.astype(np.float32)).to(device) for array in arrays)
        checks[name] = Frames(joints, torch.ones_like(joints[..., 0]), joints, R)
    return checks


def check(deployed: Deployed, checks: dict[str, Frames]) -> dict[str, float]:
    """Mean rotation error in degrees on every part of the validation, and what the network expected it to be; as the
    "score", that on lifted frames where there are some, else on captured ones, of people who lie with a tenth."""
    figures = {}
    for name, frames in checks.items():
        true, expected = _errors(deployed, frames)
        figures |= {name: float(true.mean()), f"{name}_expected": float(expected.mean())}
    upright, lies = ("lifted", "lifted_lying") if "lifted" in figures else ("paper", "lying")
    worse = figures.get(lies, figures[upright]) - figures[upright]
    return figures | {"score": figures[upright] + _LYING_SHARE * worse}


def calibrate(deployed: Deployed, frames: Frames) -> None:
    """Scale the expected error so that its mean is the true mean on people that the training never saw."""
    true, expected = _errors(deployed, frames)
    with torch.no_grad():
        deployed.net.error[-1].bias += math.log(true.mean() / expected.mean())  # type: ignore[operator]


@torch.no_grad()
def _errors(deployed: Deployed, frames: Frames) -> tuple[np.ndarray, np.ndarray]:
    R, error_deg = deployed(frames.joints, frames.valid)
    return geodesic_deg(R.double().cpu().numpy(), frames.R.double().cpu().numpy()), error_deg.cpu().numpy()
