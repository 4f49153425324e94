"""Trains 3DPCNet:  pcnet3d train models/pcnet.toml -o DIR

One loop. The config file says everything; DIR gets pcnet.onnx, pcnet.pt (the best by validation), last.pt, the
config and log.jsonl. The same command again goes on from last.pt, to the same numbers as without the break.
"""

from __future__ import annotations

import json
import math
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict

from ..pipeline.errors import InputError
from ..pipeline.outputs import whole_file
from ..pipeline.rotations import geodesic_deg
from .mocap import Clip, Subjects, lying, read_clips
from .pcnet import NetConfig, PCNet
from .pcnet_export import Deployed, export
from .pcnet_losses import Truth, Weights, total
from .pcnet_views import Frames, Mixture, Views, read_lifted, refuse_shared_subjects, seen, views
from .train_config import read_toml

_EVERY = 250  # steps between looks at the validation subjects
_VALIDATION_FRAMES = 2000
_HELD_OUT = ("val", "test", "hdm05")


class TrainConfig(BaseModel):
    """The whole of a training run.

    kind: what `pcnet3d train` trains with this file.
    lifted: files of `pcnet3d testbed` with takes of train subjects, each lifted by a lifter that never saw them.
    lifted_val: the same of val subjects; with it, the best weights are the best on these.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: str = "pcnet"
    subjects: Subjects
    lifted: tuple[Path, ...]
    lifted_val: tuple[Path, ...]
    seed: int
    steps: int
    batch: int
    rate: float  # highest learning rate, after `warmup` steps; then a cosine down to nothing
    warmup: int
    weight_decay: float
    average: float  # decay of the weights' moving average, which is what is kept
    threads: int
    bf16: bool
    symmetric: bool  # the shipped network's answer is averaged with that to the mirrored body
    net: NetConfig
    weights: Weights
    mixture: Mixture


@dataclass
class State:
    """Everything that a run needs to go on exactly: batches depend on the seed and the step only."""

    net: PCNet
    average: PCNet
    optimiser: torch.optim.Optimizer
    step: int = 0
    best: float = math.inf

    def save(self, path: Path, config: TrainConfig) -> None:
        with whole_file(path) as partial:
            torch.save(
                {
                    "config": config.model_dump_json(),
                    "net": self.net.state_dict(),
                    "average": self.average.state_dict(),
                    "optimiser": self.optimiser.state_dict(),
                    "step": self.step,
                    "best": self.best,
                },
                partial,
            )

    def load(self, path: Path, config: TrainConfig) -> None:
        """InputError when the checkpoint is damaged or belongs to another config."""
        try:
            saved = torch.load(path, weights_only=True, map_location=next(self.net.parameters()).device)
            if saved["config"] != config.model_dump_json():
                raise InputError(
                    f"{path} was made with another config; choose another -o DIR, or the config that it was made with."
                )
            self.net.load_state_dict(saved["net"])
            self.average.load_state_dict(saved["average"])
            self.optimiser.load_state_dict(saved["optimiser"])
            self.step, self.best = saved["step"], saved["best"]
        except InputError:
            raise
        except Exception as error:  # torch's errors have no common class but Exception
            reason = str(error).partition("\n")[0] or type(error).__name__
            raise InputError(
                f"Expected a checkpoint of this training at {path}: {reason}; remove it to start anew."
            ) from None


def train_pcnet(config_file: Path, output: Path) -> None:
    """Run a config file. InputError when it is not what TrainConfig says, DIR holds another run, train and
    held-out subjects overlap, or the loss stops being a number (the last good checkpoint stays)."""
    config = read_config(config_file)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    torch.manual_seed(config.seed)
    torch.set_num_threads(config.threads)
    clips = read_clips(config.subjects)
    material = Views(clips, config.mixture, config.lifted)
    names = [clip.name for clip in clips] + list(material.lifted.clips if material.lifted else ())
    for part in _HELD_OUT:
        refuse_shared_subjects(names, [clip.name for clip in read_clips(part)], f"the {part} subjects")  # type: ignore[arg-type]
    check = validation(read_clips("val"), config.lifted_val)

    net = PCNet(config.net).to(device)
    net.bf16 = config.bf16
    average = deepcopy(net).eval()
    average.bf16 = False
    state = State(net, average, optimiser_of(net, config))
    output.mkdir(parents=True, exist_ok=True)
    if (output / "last.pt").exists():
        state.load(output / "last.pt", config)
        print(f"goes on after step {state.step}")
    shutil.copy(config_file, output / "pcnet.toml")
    print(f"{sum(p.numel() for p in net.parameters()):,} parameters, {device}, seed {config.seed}")

    with ThreadPoolExecutor(1) as maker, open(output / "log.jsonl", "a", encoding="utf-8") as log:
        run(state, config, lambda step: material.batch(np.random.default_rng([config.seed, step]), config.batch),
            check, output, maker, log)  # fmt: skip
    best = PCNet(config.net)
    best.load_state_dict(torch.load(output / "pcnet.pt", weights_only=True, map_location="cpu"))
    deployed = Deployed(best.eval(), config.symmetric)
    calibrate(deployed, check.get("lifted", check["paper"]))
    export(deployed, output / "pcnet.onnx", trained_on=config.subjects, network=config.net.net)
    print({key: round(figure, 2) for key, figure in look(deployed, check).items()}, flush=True)


def run(
    state: State,
    config: TrainConfig,
    make: Any,
    check: dict[str, Frames],
    output: Path,
    maker: ThreadPoolExecutor,
    log: Any,
) -> None:
    """The loop: from state.step + 1 to config.steps. make(step) gives the step's Frames."""
    net, optimiser = state.net, state.optimiser
    device = next(net.parameters()).device
    start, losses = time.perf_counter(), []
    coming = maker.submit(make, state.step + 1)
    for step in range(state.step + 1, config.steps + 1):
        joints, valid, truth, R = (torch.from_numpy(array).to(device) for array in coming.result())
        if step < config.steps:
            coming = maker.submit(make, step + 1)
        torch.manual_seed(config.seed + step)  # for dropout
        answer = net(joints, valid)
        loss = total(net, answer, joints, Truth(truth, R, valid), config.weights)
        value = loss.item()
        if not math.isfinite(value):
            raise InputError(
                f"The loss became {value} at step {step}; the last good checkpoint, {output / 'last.pt'}, stays. "
                "Lower `rate`, or look at the data."
            )
        losses.append(value)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        for group in optimiser.param_groups:
            group["lr"] = config.rate * schedule(step, config)
        optimiser.step()
        with torch.no_grad():
            decay = min(config.average, step / (step + 10))
            for kept, new in zip(state.average.parameters(), net.parameters(), strict=True):
                kept.lerp_(new, 1 - decay)
        if step % _EVERY == 0 or step == config.steps:
            figures = look(Deployed(state.average, config.symmetric), check)
            score = figures.get("lifted", figures["paper"])
            line = {"step": step, "of": config.steps, "s": round(time.perf_counter() - start)}
            line |= {"loss": float(np.mean(losses)), **figures}
            losses.clear()
            log.write(json.dumps(line) + "\n")
            log.flush()
            print({key: round(figure, 2) for key, figure in line.items()}, flush=True)
            if score < state.best:
                state.best = score
                with whole_file(output / "pcnet.pt") as partial:
                    torch.save(state.average.state_dict(), partial)
            state.step = step
            state.save(output / "last.pt", config)


def read_config(path: Path) -> TrainConfig:
    return read_toml(path, TrainConfig)


def optimiser_of(net: PCNet, config: TrainConfig) -> torch.optim.Optimizer:
    """AdamW; no decay for biases, norms and positions."""
    matrices = [p for p in net.parameters() if p.ndim == 2 and p.shape != (17, 17)]
    others = [p for p in net.parameters() if p.ndim != 2 or p.shape == (17, 17)]
    groups = [
        {"params": matrices, "weight_decay": config.weight_decay},
        {"params": others, "weight_decay": 0.0},
    ]
    return torch.optim.AdamW(groups, lr=config.rate, betas=(0.9, 0.98), fused=True)


def schedule(step: int, config: TrainConfig) -> float:
    """Share of the highest learning rate: a linear start, then half a cosine down to nothing."""
    if step <= config.warmup:
        return step / config.warmup
    done = (step - config.warmup) / max(config.steps - config.warmup, 1)
    return 0.5 * (1 + math.cos(math.pi * min(done, 1.0)))


def validation(clips: tuple[Clip, ...], lifted: tuple[Path, ...]) -> dict[str, Frames]:
    """The same upright frames of the val subjects for every run: "paper", "wide" and, where given, "lifted"."""
    rng = np.random.default_rng(1)
    world = np.concatenate([clip.joints for clip in clips])
    world = _some(rng, world[~lying(world)])
    check = {}
    for view in ("paper", "wide"):
        R = views(view, rng, len(world))
        joints, fine = seen(world, R)
        check[view] = _whole(joints[fine], R[fine])
    if lifted:
        takes = read_lifted(lifted)
        refuse_shared_subjects(takes.clips, [clip.name for clip in read_clips("train")], "the validation's")
        rows = _some(rng, np.flatnonzero(~takes.lying))
        check["lifted"] = _whole(takes.joints[rows], takes.R[rows])
    return check


def _some(rng: np.random.Generator, rows: np.ndarray) -> np.ndarray:
    return rng.permutation(rows)[:_VALIDATION_FRAMES]


def _whole(joints: np.ndarray, R: np.ndarray) -> Frames:
    valid = np.ones(joints.shape[:2], dtype=np.float32)
    return Frames(joints.astype(np.float32), valid, joints.astype(np.float32), R.astype(np.float32))


def look(deployed: Deployed, check: dict[str, Frames]) -> dict[str, float]:
    """Mean rotation error in degrees on every part of the validation, and what the network expected it to be."""
    figures = {}
    for name, frames in check.items():
        true, expected = _errors(deployed, frames)
        figures |= {name: float(true.mean()), f"{name}_expected": float(expected.mean())}
    return figures


def calibrate(deployed: Deployed, frames: Frames) -> None:
    """Scale the expected error so that its mean is the true mean on people that the training never saw."""
    true, expected = _errors(deployed, frames)
    with torch.no_grad():
        deployed.net.error[-1].bias += math.log(true.mean() / expected.mean())  # type: ignore[operator]


def _errors(deployed: Deployed, frames: Frames) -> tuple[np.ndarray, np.ndarray]:
    device = next(deployed.parameters()).device
    with torch.no_grad():
        R, error_deg = deployed(*(torch.from_numpy(x).to(device) for x in (frames.joints, frames.valid)))
    return geodesic_deg(R.double().cpu().numpy(), frames.R), error_deg.cpu().numpy()
