"""Trains 3DPCNet:  pcnet3d train models/pcnet.toml -o DIR

One loop. The config file says everything; DIR gets pcnet.onnx, pcnet.pt (the best by validation), last.pt, the
config and log.jsonl. The same command again goes on from last.pt, to the same numbers as without the break.
On several GPUs, or CPU processes, which share every batch:

    torchrun --nproc-per-node 4 -m pcnet3d.models.train models/pcnet.toml -o DIR

log.jsonl is the run's curve: a JSON object a line with `step`, `s` (seconds since this start), `loss` (mean since the
last line) and the validation's figures in degrees. pandas draws it:
pandas.read_json("log.jsonl", lines=True).plot(x="step", y=["paper", "wide"])
"""

from __future__ import annotations

import json
import math
import time
import zipfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, nullcontext
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import torch
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
)

from ..pipeline.errors import InputError
from ..pipeline.outputs import whole_file
from ..pipeline.progress import counted
from ..pipeline.rotations import geodesic_deg
from ..pipeline.unpacked import check_size
from .mocap import Clip, Subjects, lying, read_clips
from .mocap_parts import Parts, read_parts
from .parallel import Ranks, ranks
from .pcnet import NetConfig, PCNet
from .pcnet_export import Deployed, export
from .pcnet_losses import Truth, Weights, total
from .pcnet_views import Frames, Mixture, Targets, Views, read_lifted, refuse_shared_subjects, seen, views
from .train_config import read_toml

_EVERY = 250  # steps between looks at the validation subjects
_VALIDATION_FRAMES = 2000
_HELD_OUT = ("val", "test", "hdm05")


class TrainConfig(BaseModel):
    """The whole of a training run.

    kind: what `pcnet3d train` trains with this file.
    lifted: files of `pcnet3d testbed` with takes of train subjects, each lifted by a lifter that never saw them.
    lifted_val: the same of val subjects; with it, the best weights are the best on these.
    data, split: a file of `pcnet3d mocap` and one of its train, val and test subjects (mocap_parts), instead of the
        motion capture that the shipped network was trained on.
    targets: what the rotation leads to; "axes" is the paper's, for data whose people all face one way.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: str = "pcnet"
    subjects: Subjects
    lifted: tuple[Path, ...]
    lifted_val: tuple[Path, ...]
    seed: NonNegativeInt
    steps: PositiveInt
    batch: PositiveInt
    rate: PositiveFloat  # highest learning rate, after `warmup` steps; then a cosine down to nothing
    warmup: NonNegativeInt
    weight_decay: NonNegativeFloat
    average: float = Field(ge=0, lt=1)  # decay of the weights' moving average, which is what is kept
    threads: PositiveInt
    bf16: bool
    symmetric: bool  # the shipped network's answer is averaged with that to the mirrored body
    net: NetConfig
    weights: Weights
    mixture: Mixture
    data: Path | None = None
    split: Path | None = None
    targets: Targets = "body"


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
        """InputError when the checkpoint is damaged, of another network, or belongs to another config."""
        with _reading(path) as saved:
            if TrainConfig.model_validate_json(saved["config"]) != config:
                raise InputError(
                    f"{path} was made with another config; choose another -o DIR, or the config that it was made with."
                )
            self.net.load_state_dict(saved["net"])
            self.average.load_state_dict(saved["average"])
            self.optimiser.load_state_dict(saved["optimiser"])
            self.step, self.best = saved["step"], saved["best"]


@contextmanager
def _reading(path: Path) -> Iterator[Any]:
    """What torch saved there, unpickling nothing but tensors and plain values; InputError when it does not fit."""
    remedy = "remove it to start anew, or choose another -o DIR"
    try:
        with zipfile.ZipFile(path) as archive:
            check_size(
                sum(entry.file_size for entry in archive.infolist()), path.stat().st_size, "a checkpoint"
            )
        saved = torch.load(path, weights_only=True, map_location="cpu")
    except OSError as error:
        raise InputError(f"Expected a checkpoint at {path}: {error.strerror}.") from None
    except Exception:  # torch's errors have no common class but Exception, and advise to unpickle
        raise InputError(f"{path} is damaged, or no checkpoint of a training; {remedy}.") from None
    try:
        yield saved
    except InputError:
        raise
    except Exception as error:
        reason = str(error).splitlines()[:2][-1].strip(" \t.")
        raise InputError(f"{path} is no checkpoint of this network ({reason}); {remedy}.") from None


def best_of(config: TrainConfig, folder: Path) -> PCNet:
    """The network with a run's best weights by validation; InputError when they are not there or do not fit."""
    net = PCNet(config.net)
    with _reading(folder / "pcnet.pt") as saved:
        net.load_state_dict(saved)
    return net.eval()


def train_pcnet(config_file: Path, output: Path) -> None:
    """Run a config file. InputError when it is not what TrainConfig says, DIR holds another run, train and
    held-out subjects overlap, or the loss stops being a number (the last good checkpoint stays)."""
    train(read_config(config_file), config_file.read_text(encoding="utf-8"), output)


def train(config: TrainConfig, text: str, output: Path) -> None:
    """Run a config, in every process that torchrun started; text: the file it comes from, kept in DIR."""
    torch.manual_seed(config.seed)
    torch.set_num_threads(config.threads)
    material, check = prepare(config)

    with ranks() as here, ExitStack() as open_files:
        net = PCNet(config.net).to(here.device)
        net.bf16 = config.bf16
        average = deepcopy(net).eval()
        average.bf16 = False
        state = State(net, average, optimiser_of(net, config))
        output.mkdir(parents=True, exist_ok=True)
        if (output / "last.pt").exists():
            state.load(output / "last.pt", config)
        log = None
        if here.rank == 0:
            with whole_file(output / "pcnet.toml") as partial:
                partial.write_text(text, encoding="utf-8")
            log = open_files.enter_context(open(output / "log.jsonl", "a", encoding="utf-8"))
            if state.step:
                print(f"goes on after step {state.step}")
            print(
                f"{sum(p.numel() for p in net.parameters()):,} parameters, "
                f"{here.size} x {here.device.type}, seed {config.seed}"
            )
        run(state, config, lambda step: material.batch(np.random.default_rng([config.seed, step]), config.batch),
            check, output, here, log)  # fmt: skip
    if here.rank:
        return
    deployed = Deployed(best_of(config, output), config.symmetric)
    calibrate(deployed, check.get("lifted", check["paper"]))
    properties = {"trained_on": trained_on(config), "targets": config.targets, "network": config.net.net}
    export(deployed, output / "pcnet.onnx", **properties)
    print({key: round(figure, 2) for key, figure in look(deployed, check).items()}, flush=True)


def run(
    state: State,
    config: TrainConfig,
    make: Callable[[int], Frames],
    check: dict[str, Frames],
    output: Path,
    here: Ranks,
    log: TextIO | None,
) -> None:
    """The loop: from state.step + 1 to config.steps. make(step) gives the step's Frames, the same in every process,
    which takes its part of them; the sum of the parts' gradients is that of the whole batch. log: of rank 0."""
    net, optimiser = state.net, state.optimiser
    start, losses = time.perf_counter(), []
    bar = counted("train", config.steps) if log else nullcontext(lambda done: None)
    with ThreadPoolExecutor(1) as maker, bar as tell:
        coming = maker.submit(make, state.step + 1)
        for step in range(state.step + 1, config.steps + 1):
            batch = coming.result()
            if step < config.steps:
                coming = maker.submit(make, step + 1)
            part = here.part(len(batch.R))
            joints, valid, truth, R = (torch.from_numpy(array[part]).to(here.device) for array in batch)
            torch.manual_seed(config.seed + step + 1_000_003 * here.rank)  # for dropout
            answer = net(joints, valid)
            loss = total(net, answer, joints, Truth(truth, R, valid), config.weights)
            loss = loss * (len(R) / len(batch.R))
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            here.add_gradients(net.parameters())
            value, norm = here.total(loss), torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0).item()
            _refuse_lost(value, norm, step, output)
            losses.append(value)
            for group in optimiser.param_groups:
                group["lr"] = config.rate * schedule(step, config)
            optimiser.step()
            with torch.no_grad():
                decay = min(config.average, step / (step + 10))
                for kept, new in zip(state.average.parameters(), net.parameters(), strict=True):
                    kept.lerp_(new, 1 - decay)
            tell(step)
            if log and (step % _EVERY == 0 or step == config.steps):
                figures = look(Deployed(state.average, config.symmetric), check)
                score = score_of(figures)
                _refuse_lost(value, score, step, output)
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


def _refuse_lost(loss: float, figure: float, step: int, output: Path) -> None:
    """InputError when the loss, or what depends on the weights, is no number any more."""
    if math.isfinite(loss) and math.isfinite(figure):
        return
    last = output / "last.pt"
    kept = f"the last good checkpoint, {last}, stays" if last.exists() else "there was no checkpoint yet"
    what = f"The loss became {loss}" if not math.isfinite(loss) else f"Gradient or validation became {figure}"
    raise InputError(f"{what} at step {step}; {kept}. Lower `rate`, or look at the data.")


def read_config(path: Path) -> TrainConfig:
    """A training's TOML file. InputError for keys and values that it cannot have."""
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


def prepare(config: TrainConfig) -> tuple[Views, dict[str, Frames]]:
    """What a config learns from, and what it is validated on. InputError when people of one part are in another."""
    parts = parts_of(config)
    material = Views(parts.clips["train"], config.mixture, config.lifted, config.targets)
    if parts.by == "subject":
        names = [clip.name for clip in parts.clips["train"]]
        names += material.lifted.clips if material.lifted else ()
        for part, clips in parts.clips.items():
            if part != "train":
                refuse_shared_subjects(names, [clip.name for clip in clips], f"the {part} subjects")
    everybody = parts.clips["train"] if config.data else read_clips("train") if config.lifted_val else ()
    return material, validation(parts.clips["val"], config.lifted_val, everybody, config.targets)


def parts_of(config: TrainConfig) -> Parts:
    """The clips to train on and those held out. InputError when the config's keys contradict each other."""
    if config.targets == "axes" and (config.lifted or config.lifted_val):
        raise InputError('Lifted takes know the target "body" only; leave them out, or set targets = "body".')
    if (config.data is None) != (config.split is None):
        raise InputError("Expected `data` and `split` together: clips, and which of them to train on.")
    if config.data is None or config.split is None:
        held_out = {part: read_clips(part) for part in _HELD_OUT}  # type: ignore[arg-type]
        return Parts({"train": read_clips(config.subjects), **held_out}, "subject")
    parts = read_parts(config.data, config.split)
    if config.subjects != "train" or (parts.by == "clip" and (config.lifted or config.lifted_val)):
        raise InputError(
            'With `data`, expected subjects = "train", and lifted takes only where the split lists subjects.'
        )
    return parts


def trained_on(config: TrainConfig) -> str:
    """The data of a training, in the words that the network's file keeps."""
    return f"{config.data.name}, {config.split.name}" if config.data and config.split else config.subjects


def validation(
    clips: Sequence[Clip], lifted: tuple[Path, ...], train: Sequence[Clip], targets: Targets
) -> dict[str, Frames]:
    """The same upright frames of the val subjects for every run: "paper", "wide" and, where given, "lifted".

    InputError when lifted takes show people of `train`."""
    rng = np.random.default_rng(1)
    world = np.concatenate([clip.joints for clip in clips])
    world = _some(rng, world[~lying(world)])
    check = {}
    for view in ("paper", "wide"):
        R = views(view, rng, len(world))
        joints, fine = seen(world, R, targets)
        check[view] = _whole(joints[fine], R[fine])
    if lifted:
        takes = read_lifted(lifted)
        refuse_shared_subjects(takes.clips, [clip.name for clip in train], "the validation's")
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


def score_of(figures: dict[str, float]) -> float:
    """What the best weights are the best by: the error on lifted frames where there are some, else captured ones."""
    return figures.get("lifted", figures["paper"])


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
