"""3DPCNet: which way is up and which way does the body face, from one frame's 3D joints (torch).

The paper's network: a graph branch and a Transformer branch, fused by gated cross-attention, a 6D rotation head and
an optional residual head. NetConfig's defaults are the paper's; pcnet.toml and paper.toml beside it have other ones.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import torch
from pydantic import PositiveInt
from torch import Tensor, nn
from torch.nn import functional

from .....pipeline.core.anthropometry import SEGMENTS
from .....pipeline.core.errors import InputError
from .....pipeline.core.layouts import H36M17

JOINTS = len(H36M17)
_PELVIS = H36M17.index("pelvis")
_PARENT, _CHILD = (list(ends) for ends in zip(*(H36M17.indices(bone) for bone in H36M17.bones), strict=True))
_SCALE_BONES = [H36M17.indices(bone) for bone in SEGMENTS]
_SPREAD = 4.0  # joints over stature lie within about 0.5; the layers want numbers near 1
_TYPICAL_DEG = 6.0  # where the expected error starts


@dataclass(frozen=True)
class NetConfig:
    """What is built. The defaults are the paper's network; `align` is not in the paper.

    width: features of a joint. output: features of the pose before the heads.
    residual: "off"; "free", an offset for every joint (the paper's).
    align: turn the joints into the torso's axes first and let the network correct those; the camera's axes
        are told beside them.
    """

    width: PositiveInt = 256
    output: PositiveInt = 384
    graph_layers: PositiveInt = 3
    attention_layers: PositiveInt = 2
    heads: PositiveInt = 8
    dropout: float = 0.0
    residual: Literal["off", "free"] = "free"
    align: bool = False

    def __post_init__(self) -> None:
        if self.width % self.heads:
            raise InputError(
                "bad-value", f"expected a width that {self.heads} heads can share, got {self.width}"
            )


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
        shape = joints / size
        if self.config.align:
            R_camera_from_torso = torso_axes(joints, valid)
            shape = rotate(R_camera_from_torso.mT, shape)
            camera = R_camera_from_torso.flatten(1)
        else:
            R_camera_from_torso = camera = None
        low = self.bf16 and self.training
        with torch.autocast(joints.device.type, torch.bfloat16) if low else nullcontext():
            z, attention = self.encoder(_SPREAD * shape, valid, camera)
        z = self.norm(z.float())
        R = gram_schmidt(self.rotation(z))
        if R_camera_from_torso is not None:
            R = multiply(R_camera_from_torso, R)
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
        self.graph = GraphBranch(inputs, width, config.graph_layers)
        self.attention = AttentionBranch(inputs, width, config.attention_layers, config.heads)
        self.norm_graph, self.norm_attention = nn.LayerNorm(width), nn.LayerNorm(width)
        self.cross = Attention(width, config.heads)
        self.gate = nn.Linear(2 * width, 2)
        self.out = nn.Sequential(nn.Dropout(config.dropout), nn.Linear(JOINTS * width, config.output))

    def forward(self, shape: Tensor, valid: Tensor, camera: Tensor | None) -> tuple[Tensor, Tensor]:
        parts = [shape, valid[..., None]]
        if camera is not None:
            parts.append(camera[:, None].expand(-1, JOINTS, -1))
        x = torch.cat(parts, dim=-1).transpose(0, 1).flatten(0, 1)
        graph, attention = self.norm_graph(self.graph(x)), self.norm_attention(self.attention(x))
        fused, weights = self.cross(graph, attention)
        graph, attention, fused = (_by_joint(part) for part in (graph, attention, fused))
        gate = self.gate(torch.cat([graph.mean(0), attention.mean(0)], dim=-1)).softmax(-1)
        z = fused + gate[:, :1] * graph + gate[:, 1:] * attention
        return self.out(z.transpose(0, 1).flatten(1)), weights


class GraphBranch(nn.Module):
    """Graph convolutions along bones, with an adjacency that is partly learned."""

    skeleton: Tensor

    def __init__(self, inputs: int, width: int, layers: int) -> None:
        super().__init__()
        self.enter = nn.Linear(inputs, width)
        self.layers = nn.ModuleList(nn.Linear(width, width) for _ in range(layers))
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in range(layers))
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

    def __init__(self, inputs: int, width: int, layers: int, heads: int) -> None:
        super().__init__()
        self.enter = nn.Linear(inputs, width)
        self.position = nn.Parameter(0.02 * torch.randn(JOINTS, width))
        self.layers = nn.ModuleList(EncoderLayer(width, heads) for _ in range(layers))

    def forward(self, x: Tensor) -> Tensor:
        x = (_by_joint(self.enter(x)) + self.position[:, None]).flatten(0, 1)
        for layer in self.layers:
            x = layer(x)
        return x


class EncoderLayer(nn.Module):
    """Pre-norm self-attention and a feed-forward part, four times as wide."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.norm_1, self.norm_2 = nn.LayerNorm(width), nn.LayerNorm(width)
        self.attend = Attention(width, heads)
        self.forward_part = nn.Sequential(nn.Linear(width, 4 * width), nn.GELU(), nn.Linear(4 * width, width))

    def forward(self, x: Tensor) -> Tensor:
        here = self.norm_1(x)
        x = x + self.attend(here, here)[0]
        return x + self.forward_part(self.norm_2(x))


class Attention(nn.Module):
    """Multi-head attention that also returns its weights."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.query, self.key_value = nn.Linear(width, width), nn.Linear(width, 2 * width)
        self.out = nn.Linear(width, width)

    def forward(self, queries: Tensor, source: Tensor) -> tuple[Tensor, Tensor]:
        width = self.out.in_features

        def split(x: Tensor) -> Tensor:
            return x.reshape(JOINTS, -1, self.heads, width // self.heads).permute(1, 2, 0, 3)

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


def rotate(R: Tensor, x: Tensor) -> Tensor:
    """Apply R (B, 3, 3) to points x (B, N, 3) as columns; without a matrix product, which bf16 would round."""
    return (R[:, None] * x[..., None, :]).sum(-1)


def multiply(R_a_from_b: Tensor, R_b_from_c: Tensor) -> Tensor:
    """R_a_from_c (B, 3, 3), in the precision of the inputs as well."""
    return (R_a_from_b[..., None] * R_b_from_c[:, None]).sum(-2)


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

    hips = functional.normalize(at("l_hip") - at("r_hip"), dim=-1) * there("l_hip", "r_hip")
    shoulders = functional.normalize(at("l_shoulder") - at("r_shoulder"), dim=-1)
    shoulders = shoulders * there("l_shoulder", "r_shoulder")
    middle = functional.normalize(at("l_shoulder") + at("r_shoulder"), dim=-1)
    middle = middle * there("l_shoulder", "r_shoulder")
    trunk = middle + functional.normalize(at("thorax"), dim=-1) * there("thorax")
    left = functional.normalize(hips + shoulders + 1e-6 * joints.new_tensor([1.0, 0, 0]), dim=-1)
    trunk = trunk + 1e-6 * joints.new_tensor([0.0, -1, 0])
    facing = functional.normalize(torch.linalg.cross(left, trunk), dim=-1)
    return torch.stack([-facing, -left, torch.linalg.cross(facing, left)], dim=-1)


def skeleton_adjacency() -> Tensor:
    """(17, 17) bones and every joint itself, symmetrically normalised (Kipf & Welling 2017)."""
    adjacency = torch.eye(JOINTS)
    adjacency[_PARENT, _CHILD] = adjacency[_CHILD, _PARENT] = 1
    degree = adjacency.sum(-1).rsqrt()
    return degree[:, None] * adjacency * degree
