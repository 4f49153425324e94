"""Trains the lifter:  pcnet3d lab train models/lab/training/lifter/lifter.toml -o DIR

The config file says everything; DIR gets lifter.onnx, the config, and what training.py keeps there.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, NonNegativeFloat, NonNegativeInt, PositiveInt, field_validator
from torch import Tensor

from .....pipeline.core.errors import InputError
from .....pipeline.files.atomic import write_text
from .....pipeline.reading.mocap.clip import Clip
from ....lifter import SHIPPED
from ...common.toml_config import read_toml
from ...common.training import (
    State,
    Training,
    device_of,
    fingerprint,
    fit,
    load_weights,
    optimisers_of,
    reading,
)
from ...mocap.clips import data_set, read_clips
from ...mocap.split import read_parts, trained_on
from ...synthetic.draw import Draw
from .exported import export, weights_of
from .net import LifterNet, NetConfig
from .validation import judged, whole_takes
from .windows import Batch, Material, Windows


class Weights(BaseModel):
    """Of the loss's parts beside the mean distance of joints in metres: the error of the joints' motion from frame to
    frame (metres), of the stated velocities (metres a frame), and the negative log-likelihood of the stated deviations,
    which teaches them and nothing else."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    motion: NonNegativeFloat = 0.5
    velocity: NonNegativeFloat = 0.5
    deviation: NonNegativeFloat = 0.005


class TrainConfig(Training):
    """The whole of a training run.

    subjects: "train", or one half of them for cross-fitted lifts. start: of the same `net`: "pcnet3d", the shipped
    one's, or a run's best.pt or exported network. The first `single` steps see single frames, as many different people
    and views as there are frames, which teaches geometry several times faster; then windows, `lengths` long and how
    often (the shares' sum does not matter), teach what time adds.
    """

    kind: str = "lifter"
    subjects: Literal["train", "train-a", "train-b"] = "train"  # nobody who validates or tests it
    frames: PositiveInt  # of a batch, all windows together
    single: NonNegativeInt = 0
    lengths: dict[PositiveInt, NonNegativeFloat]
    net: NetConfig
    weights: Weights = Weights()
    material: Material

    @field_validator("lengths")
    @classmethod
    def _some(cls, lengths: dict[int, float]) -> dict[int, float]:
        if not 0 < sum(lengths.values()) < math.inf:
            raise InputError("bad-value", "expected a length with a share above 0")
        return lengths


def train_lifter(config_file: Path, output: Path, device: str = "cpu", minutes: float | None = None) -> None:
    """Run a config file, or the next piece of it. InputError when it is not what TrainConfig says, or as of `fit`."""
    config = read_config(config_file)
    best = run(config, output, device, minutes, config_file.read_text(encoding="utf-8"))
    if best is not None:
        export(best, output / "lifter.onnx", reach=config.net.reach, trained_on=trained_on(config))


def run(
    config: TrainConfig,
    output: Path,
    device: str = "cpu",
    minutes: float | None = None,
    text: str | None = None,
) -> LifterNet | None:
    """A run, or the next piece of it: the network that did best, or None where the run is not done. text: the file that
    the config comes from, kept beside the weights. InputError as of `fit`."""
    on = device_of(device)
    torch.manual_seed(config.seed)
    train, val = clips_of(config)
    net = LifterNet(config.net)
    if config.start is not None:
        net = started(net, SHIPPED if str(config.start) == "pcnet3d" else config.start)
    net = net.to(on)
    parts = {"train": train, **{f"val {name}": clips for name, clips in val.items()}}
    learns_from = fingerprint((f"{part} {c.name}", c.joints) for part, clips in parts.items() for c in clips)
    state = State(net, optimisers_of(net, config.schedule, net.matrices()), learns_from)
    output.mkdir(parents=True, exist_ok=True)
    state.load(output, config, on)
    if text is not None:
        write_text(output / "lifter.toml", text)
    parameters = sum(p.numel() for p in net.parameters())
    print(
        f"{parameters:,} parameters, reach {config.net.reach} frames, {on}, from step {state.step}",
        flush=True,
    )
    if on.type == "cuda":  # one graph instead of thousands of small operations; on a CPU it gains nothing
        net.hidden = torch.compile(net.hidden, dynamic=False)  # type: ignore[method-assign]
    windows = Windows(train, config.material, on)
    takes = whole_takes([clip for part in val.values() for clip in part])

    def loss_of(step: int) -> Tensor:
        draw = Draw(config.seed, step, on)
        return loss_of_batch(net, windows.batch(draw, *_shape(config, step)), config)

    if not fit(state, config, loss_of, lambda average: judged(average, takes, on), output, minutes):
        return None
    return load_weights(LifterNet(config.net), output / "best.pt")


def started(net: LifterNet, path: Path) -> LifterNet:
    """net with the weights of an earlier run. InputError as of load_weights and weights_of."""
    weights = weights_of(path, net)
    with reading(path, "weights of this network"):
        net.load_state_dict(weights)
    return net.train()


def read_config(path: Path) -> TrainConfig:
    """A training's TOML file. InputError for keys and values that it cannot have."""
    config = read_toml(path, TrainConfig)
    if config.subjects != "train" and config.start is not None and config.start.suffix != ".pt":
        raise InputError(
            "option-conflict",
            f'{path}: with subjects = "{config.subjects}", expected `start` to be the best.pt of a run on them; a '
            "network such as the shipped one has seen the other half. Leave `start` out.",
        )
    return config


def loss_of_batch(net: LifterNet, batch: Batch, config: TrainConfig) -> Tensor:
    """The loss of a network, whose inner layers compute in bfloat16 where the config says so."""
    tokens = net.tokens(batch.x)
    with torch.autocast(batch.x.device.type, torch.bfloat16, enabled=config.bf16):
        hidden = net.hidden(tokens)
    return loss(net.answer(hidden, batch.x), batch, config.weights)


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


def clips_of(config: TrainConfig) -> tuple[tuple[Clip, ...], dict[str, tuple[Clip, ...]]]:
    """Those to train on, and those to validate on by where they come from."""
    if config.data is not None and config.split is not None:
        parts = read_parts(config.data, config.split, ("train", "val"))
        return parts.clips["train"], {"val": parts.clips["val"]}
    val: dict[str, tuple[Clip, ...]] = {}
    for clip in read_clips("val"):
        val[data_set(clip)] = (*val.get(data_set(clip), ()), clip)
    return read_clips(config.subjects), val
