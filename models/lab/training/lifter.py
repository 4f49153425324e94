"""The lifter and its training:  pcnet3d lab train models/lab/training/lifter.toml -o DIR

The network: a token a joint, mixed by a trunk of dilated temporal convolutions, for any number of frames; its answer is
built on the rays of the keypoints and on what bones' lengths in the image say of their depth.

The whole of its training in one script, over the loop of loop.py: windows of motion capture, in other poses, on another
body, before a virtual camera and a detector, made in torch on the device that trains; the loss; how a lifter does on
whole takes of people whom it never saw; and the ONNX file. The config file says what differs from the defaults here;
DIR gets lifter.onnx and what loop.py keeps there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import torch
from pydantic import Field, NonNegativeInt, PositiveInt
from torch import Tensor, nn

from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ...common.metrics import joint_error
from ...common.vectors import rotate, transpose, unit
from ...lifter.features import ASSUMED_FOCAL, CHANNELS, body_rays, features
from ..beds import MIN_FRAMES, see
from ..cases import by_person, scaled
from ..clips import FPS, Clip, lying, read_clips
from ..synthetic import (
    CHILDREN,
    PARENTS,
    STANDARD_SIZE_M,
    TYPICAL,
    WILD,
    BodyRange,
    Draw,
    MotionRange,
    Share,
    Spoilt,
    ViewRange,
    detect,
    place_among,
    proportions,
    redefined,
    size_m,
    varied,
)
from .loop import Device, Training, device_of, fingerprint, fit, write_onnx

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

# What is built.
WIDTH = 48  # channels of a joint's token
TRUNK = 384  # channels of what mixes joints and frames
DILATIONS = (1, 3, 9, 27, 1, 3, 9, 1)  # one block each, in frames


class Block(nn.Module):
    """Of tokens (B, T, 18, WIDTH): all of a frame go through the trunk, which looks at three frames `dilation` apart,
    and back; then the channels of each token are mixed by weights that all share. Pre-norm, residual."""

    def __init__(self, dilation: int) -> None:
        super().__init__()
        self.dilation = dilation
        self.norm = nn.LayerNorm(WIDTH)
        self.down = nn.Linear(_TOKENS * WIDTH, TRUNK)
        self.mix = nn.Linear(3 * TRUNK, TRUNK)  # as a matrix product: faster on CPUs than a dilated Conv1d
        self.back = nn.Linear(TRUNK, _TOKENS * WIDTH)
        self.token_norm = nn.LayerNorm(WIDTH)
        self.widen = nn.Linear(WIDTH, 2 * WIDTH)
        self.out = nn.Linear(2 * WIDTH, WIDTH)
        with torch.no_grad():
            # Starts as a network for single frames; what frames before and after add is learned.
            self.mix.weight[:, :TRUNK] = 0
            self.mix.weight[:, 2 * TRUNK :] = 0

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

    def __init__(self) -> None:
        super().__init__()
        self.enter = nn.Linear(6, WIDTH)
        self.enter_frame = nn.Linear(CHANNELS - 4 * _JOINTS, WIDTH)
        self.which = nn.Embedding(_TOKENS, WIDTH)  # which joint a token is of
        self.blocks = nn.ModuleList(Block(dilation) for dilation in DILATIONS)
        self.norm = nn.LayerNorm(WIDTH)
        self.leave = nn.Linear(WIDTH, 3)  # across: of a joint that was not seen
        self.leave_off = nn.Linear(WIDTH, 2)
        self.leave_distance = nn.Linear(WIDTH, 1)
        self.leave_bone = nn.Linear(WIDTH, 2)  # of the bone that ends in the joint
        self.leave_sd = nn.Linear(WIDTH, 2)
        self.leave_velocity = nn.Linear(WIDTH, 3)
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

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        return self.answer(self.hidden(self.tokens(features)), features)

    def tokens(self, features: Tensor) -> Tensor:
        """(B, T, 18, WIDTH): what each joint shows; the last token is the frame's own: place, size and up."""
        shown, there = _bones(features)
        shown = _DISTANCE * shown
        depth = _depth(self.lengths, shown)
        # Bones by their child joint: the pelvis, which is no bone's, comes first in the tree and gets zeros.
        bones = torch.stack([shown, depth], dim=-1) * there[..., None]
        by_joint = torch.cat([torch.zeros_like(bones[..., :1, :]), bones], dim=-2)[..., _BONE_OF, :]
        trusted = torch.stack([features[..., 2 * _JOINTS : 3 * _JOINTS], _present(features)], dim=-1)
        own = torch.cat([_image(features), trusted, 3 * by_joint], dim=-1)
        frame = self.enter_frame(features[..., 4 * _JOINTS :])[..., None, :]
        return torch.cat([self.enter(own), frame], dim=-2) + self.which.weight

    def hidden(self, tokens: Tensor) -> Tensor:
        """(B, T, 18, WIDTH): all layers but the first and last ones, which bfloat16 would round to millimetres."""
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


_RATES = (20.0, 60.0)  # frames a second
_UP_DEG = (0.2, 3.0)  # error of an up that is told, a standard deviation in each direction
_FOCAL_SPREAD = 0.2  # of the logarithm of a focal length that was estimated


@dataclass(frozen=True)
class Material(BodyRange, MotionRange, Spoilt):
    """What windows are made of, besides the fields of these; shares are of the windows."""

    typical: Share = 0.0  # before cameras as people use them, the others before any
    placed: Share = 0.0  # with the person where people are in real videos, and as large (synthetic.PLACES)
    pans: Share = 0.0  # the camera slowly follows the person
    other_rates: Share = 0.3  # of batches: at another frame rate than 30, between 20 and 60
    focal_known: Share = 0.3  # the focal length is told exactly
    focal_estimated: Share = 0.0  # it is told with an error; the others have the assumed one
    up_known: Share = 0.0  # which way is up is told, with an error (_UP_DEG)
    # From clips drawn by how many of their frames show somebody who lies, crawls or bends deeply: they are few.
    lying: Share = 0.0


class Batch(NamedTuple):
    """x: (B, T, CHANNELS) features. joints: (B, T, 17, 3) the answer, relative to the pelvis in the ray frame, metres
    of a standard body, for how large a person is cannot be seen. velocity: (B, T, 17, 3) the same a frame."""

    x: Tensor
    joints: Tensor
    velocity: Tensor


class Windows:
    """Random windows of clips; the same draw gives the same batch."""

    def __init__(self, clips: Sequence[Clip], material: Material, device: torch.device | str = "cpu") -> None:
        """clips: at FPS. InputError where nobody lies and the material wants it."""
        self.device, self.material = torch.device(device), material
        self.joints = torch.from_numpy(np.concatenate([clip.joints for clip in clips])).to(self.device)
        lengths = torch.tensor([float(len(clip)) for clip in clips])
        lies = torch.tensor([float(lying(clip.joints).sum()) for clip in clips])
        if material.lying and not lies.any():
            raise InputError(
                "nothing-usable",
                "Expected clips in which somebody lies, for the material wants them; leave `lying` out.",
            )
        share = (1 - material.lying) * lengths / lengths.sum()
        share += material.lying * lies / lies.sum().clamp_min(1)
        starts = lengths.cumsum(0) - lengths
        self.lengths, self.starts, self.share = (of.to(self.device) for of in (lengths, starts, share))
        self.people = proportions(clips).to(self.device)

    @torch.no_grad()
    def batch(self, draw: Draw, count: int, frames: int) -> Batch:
        """count windows of so many frames. InputError when no clip is as long."""
        material = self.material
        other = bool(draw.share(material.other_rates, 1))
        fps = float(draw.log_uniform(_RATES, 1)) if other else FPS
        captured = partial(self._motion, draw, frames, fps)
        world = varied(captured, count, draw, material, material, self.people, fps)
        views = TYPICAL, ViewRange(pans=material.pans)
        cameras = place_among(world, draw, *views, material.typical, material.placed)
        joints = cameras.to_camera(world)
        shown = redefined(joints, draw, material.redefined)
        keypoints, confidence = detect(cameras.project(shown), shown, draw, fps, spoilt=material)
        focal_px = self._told_focal(draw, cameras.focal_px, cameras.image_size)
        up = self._told_up(draw, cameras.R_camera_from_world[..., 2])
        x, _ = features(keypoints, _other_scores(confidence, draw), cameras.image_size, focal_px, up)
        return Batch(x, *target(joints, up))

    def _told_focal(self, draw: Draw, focal_px: Tensor, image_size: Tensor) -> Tensor:
        kind = draw.uniform((0.0, 1.0), len(focal_px))
        estimated = focal_px * (_FOCAL_SPREAD * draw.normal(len(focal_px), most=2)).exp()
        known, told = self.material.focal_known, self.material.focal_known + self.material.focal_estimated
        assumed = ASSUMED_FOCAL * image_size.amax(-1)
        return torch.where(kind < known, focal_px, torch.where(kind < told, estimated, assumed))

    def _told_up(self, draw: Draw, up: Tensor) -> Tensor:
        """(B, T or 1, 3) what is told of up (B, T or 1, 3), NaN for the windows that are told nothing."""
        count = len(up)
        error = torch.deg2rad(draw.log_uniform(_UP_DEG, count))[:, None, None]
        told = unit(up + error * draw.normal(count, 1, 3))
        return torch.where(draw.share(self.material.up_known, count)[:, None, None], told, torch.nan)

    def _motion(self, draw: Draw, frames: int, fps: float, count: int) -> Tensor:
        step = FPS / fps
        room = self.lengths - 1 - (frames - 1) * step
        weights = torch.where(room >= 0, self.share, 0.0)
        if not bool((weights > 0).any()):
            raise InputError(
                "nothing-usable",
                f"Expected a clip of {frames} frames at {fps:.0f} frames per second, but the longest lasts "
                f"{float(self.lengths.max()) / FPS:.1f} s; shorten `lengths`.",
            )
        clip = draw.choice(weights, count)
        begin = draw.uniform((0.0, 1.0), count) * room[clip]
        begin = begin.floor() if step == 1.0 else begin
        # A sum of frame numbers beyond 2^24 / 2^7 would lose the fraction in float32, so the two stay apart.
        offset = begin[:, None] + step * torch.arange(frames, device=self.device)
        whole = offset.floor()
        part = (offset - whole)[..., None, None]
        before = (self.starts[clip][:, None] + whole).long()
        after = (before + 1).clamp_max(len(self.joints) - 1)
        return torch.lerp(self.joints[before], self.joints[after], part)


def _other_scores(confidence: Tensor, draw: Draw) -> Tensor:
    """Every detector means something else by its scores, and some give none."""
    gamma = draw.uniform((-0.7, 0.7), len(confidence), 1, 1).exp()
    return torch.where(draw.share(0.15, len(confidence), 1, 1), torch.nan, confidence**gamma)


def target(joints_camera: Tensor, up: Tensor) -> tuple[Tensor, Tensor]:
    """(B, T, 17, 3) what the network should answer for exact joints with the origin at the camera, told up as in
    `features`, and (B, T, 17, 3) their velocities a frame, of the joints relative to the pelvis, in the same axes and
    scale: central differences, one-sided at the ends; zero for a single frame."""
    relative = joints_camera - joints_camera[..., [_PELVIS], :]
    relative = relative * (STANDARD_SIZE_M / size_m(relative))[:, None, None, None]
    alone = relative.shape[1] == 1
    velocity = torch.zeros_like(relative) if alone else torch.gradient(relative, dim=1)[0]
    R_ray_from_camera = transpose(body_rays(joints_camera, up))
    return rotate(R_ray_from_camera, relative), rotate(R_ray_from_camera, velocity)


CONDITIONS = {  # before what cameras, and whether up is told
    "wild": (WILD, False),
    "typical": (TYPICAL, False),
    "wild_up": (WILD, True),
}


@dataclass(frozen=True, eq=False)
class Take:
    """One take before one camera. x: (1, T, CHANNELS) features. joints: (T, 17, 3) the answer, relative to the pelvis
    in the ray frame, metres of a standard body. upright: (T,) those that are judged."""

    person: str
    x: Tensor
    joints: np.ndarray
    upright: np.ndarray


def whole_takes(clips: Sequence[Clip]) -> dict[str, list[Take]]:
    """The clips of MIN_FRAMES frames or more in which somebody is upright, by condition; the same for every run.
    InputError where there is none."""
    judged = [clip for clip in clips if len(clip) >= MIN_FRAMES and not lying(clip.joints).all()]
    if not judged:
        raise InputError(
            "nothing-usable",
            f"Expected a clip to validate on of {MIN_FRAMES} frames or more in which somebody is upright, but there is "
            "none; add one to the split's val.",
        )
    return {name: [_take(clip, *how) for clip in judged] for name, how in CONDITIONS.items()}


def _take(clip: Clip, views: ViewRange, up_known: bool) -> Take:
    seen = see(clip, seed=1, views=views)
    size = np.asarray(seen.image_size, dtype=float)
    focal = np.asarray(ASSUMED_FOCAL * size.max())
    up = np.tile(seen.up, (len(clip), 1)) if up_known else None
    pixels = seen.keypoints.joints.astype(float)
    x, R_camera_from_ray = features(pixels, seen.keypoints.confidence, size, focal, up)
    truth = rotate(transpose(R_camera_from_ray), seen.truth) * (STANDARD_SIZE_M / size_m(seen.truth))
    there = x[:, 3 * 17 : 4 * 17].any(axis=-1)
    return Take(clip.subject, torch.from_numpy(x)[None], truth, ~seen.lying & there)


@torch.no_grad()
def judged(net: torch.nn.Module, takes: dict[str, list[Take]], device: torch.device) -> dict[str, float]:
    """MPJPE in mm of a standard body, the scale aligned in every frame, of every condition: means over the upright
    frames of a take, over a person's takes, over people; and the mean of all conditions as the "score"."""

    def error_mm(take: Take) -> np.ndarray:
        joints = net(take.x.to(device))[0][0].double().cpu().numpy()[take.upright]
        truth = take.joints[take.upright]
        return np.array([1000 * joint_error(scaled(joints, truth), truth).mean()])

    figures: dict[str, float] = {}
    for name, each in takes.items():
        people = by_person((take.person, error_mm(take)) for take in each if take.upright.any())
        figures[name] = float(np.mean([*people.values()]))
    return figures | {"score": float(np.mean([*figures.values()]))}


def export(net: LifterNet, path: Path) -> None:
    """Write the network as ONNX: "features" (B, T, CHANNELS) -> "joints" (B, T, 17, 3), "sd" (B, T, 17, 2) and
    "velocity" (B, T, 17, 3), any B and T. Matrices are kept in half precision; the metadata say of how many frames on
    each side an answer depends (`reach`), and on whom it was trained."""
    inputs, outputs = {"features": torch.zeros(2, 90, CHANNELS)}, ("joints", "sd", "velocity")
    said = {"reach": sum(DILATIONS), "trained_on": "train"}
    write_onnx(net, path, inputs, ("batch", "frames"), outputs, said, half=True)


# Weights of the loss's parts beside the mean distance of joints in metres:
MOTION = 0.4  # error of the joints' motion from frame to frame, metres
VELOCITY = 0.5  # of the stated velocities, metres a frame
DEVIATION = 0.005  # negative log-likelihood of the stated deviations, which teaches them and nothing else

Weight = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class TrainConfig(Training):
    """The whole of a training run."""

    kind: str = "lifter"
    frames: PositiveInt  # of a batch, all windows together
    # The first steps see single frames, as many different people and views as there are frames, which teaches geometry
    # several times faster; then windows teach what time adds.
    single: NonNegativeInt = 0
    lengths: dict[PositiveInt, Weight] = Field(min_length=1)  # of windows, in frames: how often
    material: Material


def train(config: TrainConfig, output: Path, device: Device = "cpu") -> None:
    """Run a config, or what is left of it. InputError as of `fit`."""
    on = device_of(device)
    torch.manual_seed(config.seed)
    clips = {"train": read_clips("train"), "val": read_clips("val")}
    net = LifterNet().to(on)
    # On a GPU one graph instead of thousands of small operations; on a CPU it gains nothing.
    layers = torch.compile(net.hidden, dynamic=False) if on.type == "cuda" else net.hidden
    windows, takes = Windows(clips["train"], config.material, on), whole_takes(clips["val"])

    def loss_of(step: int) -> Tensor:
        batch = windows.batch(Draw(config.seed, step, on), *_shape(config, step))
        tokens = net.tokens(batch.x)
        with torch.autocast(on.type, torch.bfloat16, enabled=config.bf16):
            hidden = layers(tokens)
        return loss(net.answer(hidden, batch.x), batch)

    matrices = [p for p in net.blocks.parameters() if p.ndim == 2]
    best = fit(net, matrices, config, fingerprint(clips), loss_of, lambda net: judged(net, takes, on), output)
    export(best, output / "lifter.onnx")


def loss(answer: tuple[Tensor, Tensor, Tensor], truth: Batch) -> Tensor:
    """Mean distance of joints in metres, and what the weights above say."""
    joints, sd, velocity = answer
    error = joints - truth.joints
    total = error.norm(dim=-1).mean()
    if error.shape[1] > 1:
        total = total + MOTION * error.diff(dim=1).norm(dim=-1).mean()
        total = total + VELOCITY * (velocity - truth.velocity).norm(dim=-1).mean()
    square = error.detach()[:, :, 1:] ** 2  # the pelvis is where it is
    across, along = square[..., :2].mean(-1), square[..., 2]
    sd_across, sd_along = sd[:, :, 1:].unbind(-1)
    likelihood = (
        2 * (sd_across.log() + across / (2 * sd_across**2)) + sd_along.log() + along / (2 * sd_along**2)
    )
    return total + DEVIATION * likelihood.mean()


def _shape(config: TrainConfig, step: int) -> tuple[int, int]:
    """Windows of a step's batch, and their frames."""
    rng = np.random.default_rng([config.seed, step])
    lengths, shares = (np.array(list(part)) for part in (config.lengths, config.lengths.values()))
    length = 1 if step <= config.single else int(rng.choice(lengths, p=shares / shares.sum()))
    return max(config.frames // length, 1), length
