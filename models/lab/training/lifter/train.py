"""Trains the lifter:  pcnet3d lab train models/lab/training/lifter/lifter.toml -o DIR

The whole of a training in one script, over the loop of training/loop.py: windows of motion capture, in other poses, on
another body, before a virtual camera and a detector, made in torch on the device that trains; the loss; how a lifter
does on whole takes of people whom it never saw; and the ONNX file. The config file says everything; DIR gets
lifter.onnx and what loop.py keeps there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, NonNegativeFloat, NonNegativeInt, PositiveInt, field_validator
from torch import Tensor

from .....pipeline.core.errors import InputError
from .....pipeline.core.layouts import H36M17
from ....common.metrics import joint_error
from ....common.vectors import rotate, transpose, unit
from ....lifter.features import ASSUMED_FOCAL, CHANNELS, body_rays, features
from ...common.config import Share, Size
from ...common.metrics import scaled
from ...evaluation.people import by_person
from ...evaluation.testbed import MIN_FRAMES, see
from ...mocap.clips import Clip, lying, read_clips, read_parts
from ...synthetic.bodies import STANDARD_SIZE_M, BodyRange, proportions, redefined, size_m
from ...synthetic.cameras import TYPICAL, WILD, ViewRange, place_among
from ...synthetic.draw import Draw
from ...synthetic.keypoint_noise import EXACT_KEYPOINTS, Noise, Spoilt, detect
from ...synthetic.poses import MotionRange, varied
from ..loop import State, Training, device_of, fingerprint, fit, load_weights
from ..onnx_file import write_onnx
from .net import LifterNet, NetConfig

_FPS = (20.0, 60.0)
_CAPTURED_FPS = 30.0
_UP_DEG = (0.2, 3.0)  # error of an up that is told, a standard deviation in each direction
_FOCAL_SPREAD = 0.2  # of the logarithm of a focal length that was estimated


@dataclass(frozen=True)
class Material(MotionRange, Spoilt):
    """What windows are made of, besides the fields of MotionRange and Spoilt; shares are of the windows."""

    limbs: Size = 0.05  # of bodies.BodyRange, as the next three
    trunk: Size = 0.05
    unchanged: Share = 0.3
    mirrored: Share = 0.5
    typical: Share = 0.0  # before cameras as people use them, the others before any
    placed: Share = 0.0  # with the person where people are in real videos, and as large (synthetic.places)
    pans: Share = 0.0  # the camera slowly follows the person
    derived: Share = 0.0  # pelvis, spine, thorax and head made as for COCO keypoints
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
        """clips: at 30 frames per second. InputError for another rate."""
        if odd := sorted({clip.fps for clip in clips if abs(clip.fps - _CAPTURED_FPS) > 0.01}):
            raise InputError(
                "wrong-content",
                f"Expected motion capture at 30 frames per second to train on, got {odd[0]:g}; convert it.",
            )
        self.device, self.material = torch.device(device), material
        self.joints = torch.from_numpy(np.concatenate([clip.joints for clip in clips])).to(self.device)
        lengths = torch.tensor([len(clip) for clip in clips], dtype=torch.float32)
        self.lengths = lengths.to(self.device)
        self.starts = (lengths.cumsum(0) - lengths).to(self.device)
        lies = torch.tensor([float(lying(clip.joints).sum()) for clip in clips])
        if material.lying and not lies.any():
            raise InputError(
                "nothing-usable",
                "Expected clips in which somebody lies, for the material wants them; leave `lying` out.",
            )
        self.share = (
            1 - material.lying
        ) * lengths / lengths.sum() + material.lying * lies / lies.sum().clamp_min(1)
        self.share = self.share.to(self.device)
        self.people = proportions(clips).to(self.device)
        bodies = ("limbs", "trunk", "unchanged", "mirrored")
        self.bodies = BodyRange(**{name: getattr(material, name) for name in bodies})
        self.noise = Noise(derived=material.derived)

    @torch.no_grad()
    def batch(self, draw: Draw, count: int, frames: int) -> Batch:
        """count windows of so many frames. InputError when no clip is as long."""
        material = self.material
        other = bool(draw.share(material.other_rates, 1))
        fps = float(draw.log_uniform(_FPS, 1)) if other else _CAPTURED_FPS
        captured = partial(self._motion, draw, frames, fps)
        world = varied(captured, count, draw, material, self.bodies, self.people, fps)
        views = TYPICAL, ViewRange(pans=material.pans)
        cameras = place_among(world, draw, *views, material.typical, material.placed)
        joints = cameras.to_camera(world)
        shown = joints
        if material.redefined:
            shown = redefined(joints, draw, material.redefined)
        keypoints, confidence = detect(cameras.project(shown), shown, draw, fps, self.noise, material)
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
        step = _CAPTURED_FPS / fps
        room = self.lengths - 1 - (frames - 1) * step
        weights = torch.where(room >= 0, self.share, 0.0)
        if not bool((weights > 0).any()):
            raise InputError(
                "nothing-usable",
                f"Expected a clip of {frames} frames at {fps:.0f} frames per second, but the longest lasts "
                f"{float(self.lengths.max()) / _CAPTURED_FPS:.1f} s; shorten `lengths`.",
            )
        clip = draw.choice(weights, count)
        begin = draw.uniform((0.0, 1.0), count) * room[clip]
        begin = begin.floor() if step == 1.0 else begin
        # A sum of frame numbers beyond 2^24 / 2^7 would lose the fraction in float32, so the two stay apart.
        offset = begin[:, None] + step * torch.arange(frames, device=self.device)
        whole = offset.floor()
        part = (offset - whole)[..., None, None]
        before = (self.starts[clip][:, None] + whole).long()
        if step == 1.0:
            return self.joints[before]
        after = (before + 1).clamp_max(len(self.joints) - 1)
        return torch.lerp(self.joints[before], self.joints[after], part)


def _other_scores(confidence: Tensor, draw: Draw) -> Tensor:
    """Every detector means something else by its scores, and some give none."""
    gamma = draw.uniform((-0.7, 0.7), len(confidence), 1, 1).exp()
    return torch.where(draw.share(0.15, len(confidence), 1, 1), torch.nan, confidence**gamma)


def target(joints_camera: Tensor, up: Tensor) -> tuple[Tensor, Tensor]:
    """(B, T, 17, 3) what the network should answer for exact joints with the origin at the camera, told up as in
    `features`, and (B, T, 17, 3) their velocities a frame, of the joints relative to the pelvis, in the same axes and
    scale."""
    relative = joints_camera - joints_camera[..., [H36M17.index("pelvis")], :]
    relative = relative * (STANDARD_SIZE_M / size_m(relative))[:, None, None, None]
    R_ray_from_camera = transpose(body_rays(joints_camera, up))
    return rotate(R_ray_from_camera, relative), rotate(R_ray_from_camera, _velocity(relative))


def _velocity(values: Tensor) -> Tensor:
    """Central differences along time (B, T, ...), one-sided at the ends; zero for a single frame."""
    if values.shape[1] == 1:
        return torch.zeros_like(values)
    return torch.gradient(values, dim=1)[0]


_SEED = 1


class Condition(NamedTuple):
    """Before what cameras, whether keypoints and focal length are exact, and whether up is told."""

    views: ViewRange
    exact: bool = False
    up_known: bool = False


CONDITIONS = {
    "wild": Condition(WILD),
    "typical": Condition(TYPICAL),
    "wild_up": Condition(WILD, up_known=True),
    "exact": Condition(WILD, exact=True),
}
SCORED = ("wild", "typical", "wild_up")  # those whose mean chooses


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
    return {name: [_take(clip, each) for clip in judged] for name, each in CONDITIONS.items()}


def _take(clip: Clip, condition: Condition) -> Take:
    seen = see(clip, _SEED, noise=EXACT_KEYPOINTS if condition.exact else None, views=condition.views)
    size = np.asarray(seen.image_size, dtype=float)
    focal = seen.focal_px if condition.exact else ASSUMED_FOCAL * size.max()
    up = np.tile(seen.up, (len(clip), 1)) if condition.up_known else None
    x, R_camera_from_ray = features(
        seen.keypoints.joints.astype(float), seen.keypoints.confidence, size, np.asarray(focal), up
    )
    truth = rotate(transpose(R_camera_from_ray), seen.truth) * (STANDARD_SIZE_M / size_m(seen.truth))
    there = x[:, 3 * 17 : 4 * 17].any(axis=-1)
    return Take(clip.subject, torch.from_numpy(x)[None], truth, ~seen.lying & there)


@torch.no_grad()
def judged(net: torch.nn.Module, takes: dict[str, list[Take]], device: torch.device) -> dict[str, float]:
    """MPJPE in mm of a standard body, the scale aligned in every frame, of every condition: means over the frames of a
    take, over a person's takes, over people; and the mean of SCORED as the "score"."""
    figures: dict[str, float] = {}
    for name, each in takes.items():
        people = by_person((take.person, _error_mm(net, take, device)) for take in each if take.upright.any())
        figures[name] = float(np.mean([*people.values()]))
    return figures | {"score": float(np.mean([figures[name] for name in SCORED]))}


def _error_mm(net: torch.nn.Module, take: Take, device: torch.device) -> np.ndarray:
    """(1,) mean over a take's upright frames."""
    joints = net(take.x.to(device))[0][0].float().cpu().numpy().astype(np.float64)[take.upright]
    truth = take.joints[take.upright]
    return np.array([1000 * joint_error(scaled(joints, truth), truth).mean()])


def export(net: LifterNet, path: Path, **properties: object) -> None:
    """Write the network as ONNX: "features" (B, T, CHANNELS) -> "joints" (B, T, 17, 3), "sd" (B, T, 17, 2) and
    "velocity" (B, T, 17, 3), any B and T. Matrices are kept in half precision. properties: kept in the file's metadata;
    the run time needs `reach`."""
    free = {0: torch.export.Dim("batch"), 1: torch.export.Dim("frames")}
    inputs = {"features": torch.zeros(2, 90, CHANNELS)}
    write_onnx(net, path, inputs, (free,), ("joints", "sd", "velocity"), properties, half=True)


class Weights(BaseModel):
    """Of the loss's parts beside the mean distance of joints in metres."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    motion: NonNegativeFloat = 0.5  # error of the joints' motion from frame to frame, metres
    velocity: NonNegativeFloat = 0.5  # of the stated velocities, metres a frame
    # Negative log-likelihood of the stated deviations, which teaches them and nothing else.
    deviation: NonNegativeFloat = 0.005


class TrainConfig(Training):
    """The whole of a training run."""

    kind: str = "lifter"
    frames: PositiveInt  # of a batch, all windows together
    # The first steps see single frames, as many different people and views as there are frames, which teaches geometry
    # several times faster; then windows teach what time adds.
    single: NonNegativeInt = 0
    lengths: dict[PositiveInt, NonNegativeFloat]  # of windows, in frames: how often (the sum does not matter)
    net: NetConfig
    weights: Weights = Weights()
    material: Material

    @field_validator("lengths")
    @classmethod
    def _some(cls, lengths: dict[int, float]) -> dict[int, float]:
        if not 0 < sum(lengths.values()) < math.inf:
            raise InputError("bad-value", "expected a length with a share above 0")
        return lengths


def train(config: TrainConfig, output: Path, device: str = "cpu") -> None:
    """Run a config, or what is left of it. InputError as of `fit`."""
    on = device_of(device)
    torch.manual_seed(config.seed)
    clips, val = clips_of(config)
    net = LifterNet(config.net)
    if config.start is not None:
        net = load_weights(net, config.start)
    net = net.to(on)
    parts = {"train": clips, "val": val}
    learns_from = fingerprint((f"{part} {c.name}", c.joints) for part, of in parts.items() for c in of)
    state = State(net, net.matrices(), config, learns_from)
    if on.type == "cuda":  # one graph instead of thousands of small operations; on a CPU it gains nothing
        net.hidden = torch.compile(net.hidden, dynamic=False)  # type: ignore[method-assign]
    windows = Windows(clips, config.material, on)
    takes = whole_takes(val)

    def loss_of(step: int) -> Tensor:
        batch = windows.batch(Draw(config.seed, step, on), *_shape(config, step))
        tokens = net.tokens(batch.x)
        with torch.autocast(on.type, torch.bfloat16, enabled=config.bf16):
            hidden = net.hidden(tokens)
        return loss(net.answer(hidden, batch.x), batch, config.weights)

    fit(state, loss_of, lambda average: judged(average, takes, on), output)
    best = load_weights(LifterNet(config.net), output / "best.pt")
    export(best, output / "lifter.onnx", reach=config.net.reach, trained_on=config.trained_on)


def loss(answer: tuple[Tensor, Tensor, Tensor], truth: Batch, weights: Weights) -> Tensor:
    """Mean distance of joints in metres, and what `Weights` says."""
    joints, sd, velocity = answer
    error = joints - truth.joints
    total = error.norm(dim=-1).mean()
    if error.shape[1] > 1:
        total = total + weights.motion * error.diff(dim=1).norm(dim=-1).mean()
        total = total + weights.velocity * (velocity - truth.velocity).norm(dim=-1).mean()
    square = error.detach()[:, :, 1:] ** 2  # the pelvis is where it is
    across, along = square[..., :2].mean(-1), square[..., 2]
    sd_across, sd_along = sd[:, :, 1:].unbind(-1)
    likelihood = (
        2 * (sd_across.log() + across / (2 * sd_across**2)) + sd_along.log() + along / (2 * sd_along**2)
    )
    return total + weights.deviation * likelihood.mean()


def _shape(config: TrainConfig, step: int) -> tuple[int, int]:
    """Windows of a step's batch, and their frames."""
    rng = np.random.default_rng([config.seed, step])
    lengths, shares = (np.array(list(part)) for part in (config.lengths, config.lengths.values()))
    length = 1 if step <= config.single else int(rng.choice(lengths, p=shares / shares.sum()))
    return max(config.frames // length, 1), length


def clips_of(config: TrainConfig) -> tuple[tuple[Clip, ...], tuple[Clip, ...]]:
    """Those to train on, and those to validate on."""
    if config.data is not None and config.split is not None:
        parts = read_parts(config.data, config.split, ("train", "val"))
        return parts["train"], parts["val"]
    return read_clips("train"), read_clips("val")
