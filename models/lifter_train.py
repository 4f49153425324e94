"""Trains the lifter:  pcnet3d train models/lifter.toml -o DIR

One loop. The config file says everything; DIR gets lifter.onnx, lifter.pt, the config and log.jsonl.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from pathlib import Path

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict

from ..pipeline.outputs import whole_file
from .bodies import BodyRange
from .cameras import ViewRange
from .lifter_features import CHANNELS
from .lifter_net import LifterNet, NetConfig
from .lifter_windows import Windows
from .metrics import joint_error, procrustes_error, scaled
from .mocap import Clip, Subjects, read_clips
from .noise2d import Noise
from .train_config import read_toml


class Stage(BaseModel):
    """One schedule of learning, from the averaged weights of the stage before it.

    The first `single` steps see single frames, as many different people and views as there are frames, which
    teaches geometry several times faster; then windows, `lengths` long, teach what time adds.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    steps: int  # of the learning rate's schedule: `warmup` steps up, then half a cosine down to nothing
    stop: int | None = None  # step after which the stage ends, if before the schedule does
    frames: int  # of a batch, all windows together
    single: int = 0
    lengths: dict[int, float]  # frames of a window, and how often; the shares' sum does not matter
    rate: float  # the highest learning rate
    warmup: int
    weight_decay: float = 0.05
    average: float  # decay of the weights' moving average, which is what is kept
    velocity: float  # weight of the error of frame-to-frame motion in the loss
    pans: float  # share of windows whose camera slowly follows the person
    derived: float  # share of windows whose pelvis, spine, thorax and head are made as for COCO keypoints
    combined: float  # share of windows whose upper body comes from another motion
    limbs: float  # spread of limb and trunk lengths, see bodies.BodyRange
    trunk: float


class TrainConfig(BaseModel):
    """The whole of a training run. subjects: "train", or one half of them for cross-fitted lifts."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    subjects: Subjects
    seed: int
    threads: int
    net: NetConfig
    stages: tuple[Stage, ...]


def train_lifter(config_file: Path, output: Path) -> None:
    """Run a config file; InputError when it is not what TrainConfig says."""
    config = read_config(config_file)
    torch.manual_seed(config.seed)
    torch.set_num_threads(config.threads)
    clips, check = read_clips(config.subjects), _check_batches()
    net = LifterNet(config.net)
    output.mkdir(parents=True, exist_ok=True)
    print(f"{sum(p.numel() for p in net.parameters()):,} parameters, reach {config.net.reach} frames")
    start = time.perf_counter()
    with open(output / "log.jsonl", "w", encoding="utf-8") as log:
        for number, stage in enumerate(config.stages):
            for step, loss, average in run_stage(net, stage, clips, config.seed + number):
                line = {"stage": number + 1, "step": step, "s": round(time.perf_counter() - start)}
                line |= {"loss_mm": 1000 * loss, **_check(average, check)}
                log.write(json.dumps(line) + "\n")
                log.flush()
                print({k: round(float(v), 1) for k, v in line.items()}, flush=True)
                with whole_file(output / "lifter.pt") as partial:
                    torch.save(average.state_dict(), partial)
            net.load_state_dict(average.state_dict())
    export(net, output / "lifter.onnx", reach=config.net.reach, trained_on=config.subjects)
    shutil.copy(config_file, output / "lifter.toml")


def run_stage(
    net: LifterNet, stage: Stage, clips: Sequence[Clip], seed: int, every: int = 250
) -> Iterator[tuple[int, float, LifterNet]]:
    """Train net in place; yields (step, mean loss since the last, averaged net) now and then, and at the end."""
    rng = np.random.default_rng(seed)
    windows = Windows(
        clips,
        bodies=BodyRange(limbs=stage.limbs, trunk=stage.trunk),
        views=ViewRange(pans=stage.pans),
        noise=Noise(derived=stage.derived),
        combined=stage.combined,
    )
    average = deepcopy(net).eval()
    optimisers = _optimisers(net, stage)
    lengths, shares = (np.array(list(part)) for part in (stage.lengths, stage.lengths.values()))

    def make(step: int) -> tuple[torch.Tensor, torch.Tensor]:
        length = 1 if step <= stage.single else int(rng.choice(lengths, p=shares / shares.sum()))
        x, y = windows.batch(rng, max(stage.frames // length, 1), length)
        return torch.from_numpy(x), torch.from_numpy(y)

    last, losses = stage.stop or stage.steps, []
    with ThreadPoolExecutor(1) as maker:
        coming = maker.submit(make, 1)
        for step in range(1, last + 1):
            x, y = coming.result()
            coming = maker.submit(make, step + 1)
            with torch.autocast("cpu", torch.bfloat16):
                answer = net(x)
            loss = loss_of(answer, y, stage.velocity)
            net.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            for optimiser in optimisers:
                for group in optimiser.param_groups:
                    group["lr"] = stage.rate * _schedule(step, stage)
                optimiser.step()
            losses.append(loss.item())
            with torch.no_grad():
                decay = min(stage.average, step / (step + 10))
                for kept, new in zip(average.parameters(), net.parameters(), strict=True):
                    kept.lerp_(new, 1 - decay)
            if step % every == 0 or step == last:
                yield step, float(np.mean(losses)), average
                losses.clear()


def read_config(path: Path) -> TrainConfig:
    """A training's TOML file. InputError for keys and values that it cannot have."""
    return read_toml(path, TrainConfig)


def loss_of(answer: torch.Tensor, truth: torch.Tensor, velocity: float) -> torch.Tensor:
    """Mean distance of joints, and of their motion from frame to frame; (B, T, 17, 3)."""
    error = answer - truth
    loss = error.norm(dim=-1).mean()
    if velocity and error.shape[1] > 1:
        loss = loss + velocity * error.diff(dim=1).norm(dim=-1).mean()
    return loss


def export(net: LifterNet, path: Path, **properties: object) -> None:
    """Write the network as ONNX: "features" (B, T, CHANNELS) -> "joints" (B, T, 17, 3), any B and T.

    properties: kept in the file's metadata; the run time needs `reach`.
    """
    import onnx

    batch, frames = torch.export.Dim("batch"), torch.export.Dim("frames")
    program = torch.onnx.export(
        net.eval(),
        (torch.zeros(2, 90, CHANNELS),),
        input_names=["features"],
        output_names=["joints"],
        dynamic_shapes=({0: batch, 1: frames},),
        dynamo=True,
        external_data=False,
        verbose=False,
    )
    assert program is not None
    model = program.model_proto
    onnx.helper.set_model_props(model, {key: str(value) for key, value in properties.items()})
    with whole_file(path) as partial:
        onnx.save(model, str(partial))


def _optimisers(net: LifterNet, stage: Stage) -> list[torch.optim.Optimizer]:
    """Muon (Jordan et al. 2024) for the blocks' matrices, at AdamW's step size; AdamW for everything else."""
    matrices = [p for p in net.blocks.parameters() if p.ndim == 2]
    taken = {id(p) for p in matrices}
    others = [p for p in net.parameters() if id(p) not in taken]
    return [
        torch.optim.Muon(
            matrices,
            lr=stage.rate,
            weight_decay=stage.weight_decay,
            adjust_lr_fn="match_rms_adamw",
            ns_steps=5,
        ),
        torch.optim.AdamW(others, lr=stage.rate, betas=(0.9, 0.98), weight_decay=stage.weight_decay),
    ]


def _schedule(step: int, stage: Stage) -> float:
    """Share of the highest learning rate: a linear start, then half a cosine down to nothing."""
    if step <= stage.warmup:
        return step / stage.warmup
    done = (step - stage.warmup) / max(stage.steps - stage.warmup, 1)
    return 0.5 * (1 + float(np.cos(np.pi * min(done, 1.0))))


def _check_batches() -> list[tuple[torch.Tensor, np.ndarray]]:
    """The same windows of the val subjects for every run, on the captured bodies."""
    windows = Windows(read_clips("val"), bodies=BodyRange(unchanged=1.0, mirrored=0.0), other_rates=0.0)
    rng = np.random.default_rng(1)
    batches = (windows.batch(rng, count, frames) for count, frames in ((48, 120), (400, 1)))
    return [(torch.from_numpy(x), y) for x, y in batches]


def _check(net: LifterNet, batches: list[tuple[torch.Tensor, np.ndarray]]) -> dict[str, float]:
    """Errors in mm of a standard body: of 4 s windows, and of single frames."""
    figures = {}
    for name, (x, y) in zip(("mpjpe", "single"), batches, strict=True):
        with torch.no_grad():
            answer = net(x).numpy().astype(np.float64)
        figures[name] = 1000 * joint_error(scaled(answer, y), y).mean()
        if name == "mpjpe":
            figures["pa"] = 1000 * procrustes_error(answer, y).mean()
            figures["depth"] = 1000 * np.abs(scaled(answer, y) - y)[..., 2].mean()
    return figures
