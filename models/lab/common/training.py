"""The loop that every network here is trained with: schedule, averaged weights, log, checkpoints, pieces.

A trainer says what a step's loss is and how the averaged network does on people it never saw; `fit` does the rest. The
run's folder gets checkpoint.pt, best.pt (the averaged weights that did best), and log.jsonl: a JSON object a line with
`step`, `of`, `s` (seconds since this start), `loss` (mean since the last line, or since this start) and the figures of
the validation. pandas draws it:
pandas.read_json("log.jsonl", lines=True).plot(x="step", y="score")
"""

# pyright: reportPrivateImportUsage=false
from __future__ import annotations

import hashlib
import json
import math
import time
import zipfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Self, TypeVar

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
    model_validator,
)
from torch import Tensor, nn

from ....pipeline.core.errors import InputError, readable
from ....pipeline.files.atomic import whole_file, write_text
from ....pipeline.files.unpacked import check_size
from ....pipeline.running.progress import counted

CHECKPOINT = "checkpoint.pt"
_LOOK_EVERY = 50  # steps between looks at the losses: on a GPU each waits until all work is done
Net = TypeVar("Net", bound=nn.Module)


class Schedule(BaseModel):
    """How a network learns: `warmup` steps up to the rate, constant, and down to nothing over the last `cooldown` share
    of the steps, in a line or along half a cosine (Loshchilov & Hutter 2017). optimiser: "muon" for matrices with AdamW
    for the rest, or AdamW for all."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    steps: PositiveInt
    rate: PositiveFloat
    warmup: NonNegativeInt
    cooldown: float = Field(gt=0, le=1)
    weight_decay: NonNegativeFloat
    # Decay of the weights' moving average, which is what is judged and kept.
    average: float = Field(ge=0, lt=1)
    optimiser: Literal["muon", "adamw"] = "muon"
    decline: Literal["linear", "cosine"] = "linear"
    every: PositiveInt = 250  # steps between looks at the validation, each with a checkpoint

    def share(self, step: int) -> float:
        """Of the highest rate, at a step counted from 1."""
        if step <= self.warmup:
            return step / self.warmup
        cools_from = max(self.warmup, round(self.steps * (1 - self.cooldown)))
        left = min(1.0, (self.steps - step + 1) / max(self.steps - cools_from, 1))
        return left if self.decline == "linear" else (1 - math.cos(math.pi * left)) / 2


class Training(BaseModel):
    """What every training is told. kind: what `pcnet3d lab train` trains with the file. subjects: who is learned from.
    start: weights to begin with. data, split: a file of `pcnet3d lab mocap` and one of its train and val subjects
    (mocap/clips.py), instead of the motion capture that the shipped networks saw."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: str
    subjects: Literal["train"] = "train"
    data: Path | None = None
    split: Path | None = None
    start: Path | None = None
    seed: NonNegativeInt
    bf16: bool
    schedule: Schedule

    @model_validator(mode="after")
    def _own_data(self) -> Self:
        if (self.data is None) != (self.split is None):
            raise InputError(
                "needs-input", "expected `data` and `split` together: clips, and which of them to train on"
            )
        return self

    @property
    def trained_on(self) -> str:
        """Whom the network learns from, as its file says it."""
        return f"{self.data.name}, {self.split.name}" if self.data and self.split else self.subjects


@dataclass
class State:
    """Everything that a run needs to go on exactly, for batches depend on the seed and the step only. learns_from: the
    fingerprint of what it is trained and validated on, so that it goes on with nothing else."""

    net: nn.Module
    optimisers: list[torch.optim.Optimizer]
    learns_from: str | None = None
    average: nn.Module = field(init=False)
    step: int = 0
    best: float = math.inf

    def __post_init__(self) -> None:
        self.average = deepcopy(self.net).eval()

    def save(self, folder: Path, config: BaseModel) -> None:
        """Killed at any moment, the last checkpoint stays whole."""
        with whole_file(folder / CHECKPOINT) as partial:
            torch.save(
                {
                    "config": config.model_dump_json(),
                    "learns_from": self.learns_from,
                    "net": self.net.state_dict(),
                    "average": self.average.state_dict(),
                    "optimisers": [optimiser.state_dict() for optimiser in self.optimisers],
                    "step": self.step,
                    "best": self.best,
                },
                partial,
            )

    def load(self, folder: Path, config: BaseModel, device: torch.device) -> None:
        """Go on from the folder's checkpoint, if it has one. InputError when it is damaged, of another network or
        config, or learned from something else."""
        path = folder / CHECKPOINT
        if not path.exists():
            return
        with reading(path):
            saved = _unpickled(path, device)
            for key, now, what in (
                ("config", config.model_dump_json(), "was made with another config"),
                ("learns_from", self.learns_from, "learned from other recordings or another split"),
            ):
                if saved[key] != now:
                    raise InputError(
                        "already-there",
                        f"{path} {what} than this; choose another -o DIR, or put back what it was made with.",
                    )
            self.net.load_state_dict(saved["net"])
            self.average.load_state_dict(saved["average"])
            for optimiser, state in zip(self.optimisers, saved["optimisers"], strict=True):
                optimiser.load_state_dict(state)
            self.step, self.best = int(saved["step"]), saved["best"]


def fingerprint(arrays: Iterable[tuple[str, np.ndarray]]) -> str:
    """SHA-256 of arrays (...,) of any shape with their names, in their order."""
    whole = hashlib.sha256()
    for name, array in arrays:
        whole.update(f"{name} {array.shape} {array.dtype}\n".encode())
        whole.update(array.tobytes())
    return whole.hexdigest()


@contextmanager
def reading(path: Path, expected: str = "a checkpoint") -> Iterator[Path]:
    """For reading a checkpoint, or what else is `expected`: InputError in words for whatever is wrong with it."""
    try:
        with readable(path, expected):
            yield path
    except InputError:
        raise
    except Exception as error:  # torch's errors have no common class but Exception, and advise to unpickle
        reason = (str(error).splitlines() or [""])[:2][-1].strip(" \t.")[:200]
        way = (
            "remove it to start anew, or choose another -o DIR"
            if expected == "a checkpoint"
            else "give another file"
        )
        raise InputError(
            "file-damaged",
            f"Expected {expected} at {path}, but it is damaged or of another network ({reason}); {way}.",
        ) from None


def load_weights(net: Net, path: Path) -> Net:
    """A net with the weights that torch.save wrote there, unpickling nothing but tensors; InputError when they are not
    there or do not fit."""
    weights = read_weights(path)
    with reading(path):
        net.load_state_dict(weights)
    return net.eval()


def read_weights(path: Path) -> dict[str, Tensor]:
    """By their names in a network, as torch.save wrote them; InputError when they are not there."""
    with reading(path, "weights"):
        return _unpickled(path, torch.device("cpu"))


def _unpickled(path: Path, device: torch.device) -> Any:
    """What torch.save wrote: tensors and plain values, nothing else is unpickled, and no more than its size allows."""
    with zipfile.ZipFile(path) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
        check_size(size, path.stat().st_size, f"a checkpoint at {path}")
        if archive.testzip() is not None:
            raise ValueError("its content is not what it was")
    return torch.load(path, weights_only=True, map_location=device)


def device_of(name: str) -> torch.device:
    """auto: a GPU where there is one, else the CPU. InputError for a device that is not here."""
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0].strip(".")
        raise InputError(
            "no-device",
            f"Expected a device that torch can use here (auto, cpu, cuda), got '{name}': {reason}.",
        ) from None
    return device


def optimisers_of(
    net: nn.Module, schedule: Schedule, matrices: Iterable[nn.Parameter]
) -> list[torch.optim.Optimizer]:
    """Muon (Jordan et al. 2024) for the matrices, at AdamW's step size, unless the schedule says AdamW; AdamW for
    everything else, without decay for what is no matrix."""
    matrices = list(matrices) if schedule.optimiser == "muon" else []
    taken = {id(p) for p in matrices}
    others = [p for p in net.parameters() if id(p) not in taken]
    groups = [
        {"params": [p for p in others if p.ndim == 2], "weight_decay": schedule.weight_decay},
        {"params": [p for p in others if p.ndim != 2], "weight_decay": 0.0},
    ]
    adamw = torch.optim.AdamW(groups, lr=schedule.rate, betas=(0.9, 0.98))
    if not matrices:
        return [adamw]
    muon = torch.optim.Muon(
        matrices,
        lr=schedule.rate,
        weight_decay=schedule.weight_decay,
        adjust_lr_fn="match_rms_adamw",
        ns_steps=5,
    )
    return [muon, adamw]


def begun(
    net: nn.Module,
    matrices: Iterable[nn.Parameter],
    config: Training,
    text: str,
    learns_from: str,
    output: Path,
) -> State:
    """The state with which a run into `output` goes on, or begins, whose config comes from this text. matrices: of the
    net, those that Muon is for. learns_from: as State's. InputError as of State.load."""
    state = State(net, optimisers_of(net, config.schedule, matrices), learns_from)
    device = next(net.parameters()).device
    output.mkdir(parents=True, exist_ok=True)
    state.load(output, config, device)
    write_text(output / f"{config.kind}.toml", text)
    parameters = sum(p.numel() for p in net.parameters())
    print(f"{parameters:,} parameters, {device}, from step {state.step}", flush=True)
    return state


def fit(
    state: State,
    config: Training,
    loss_of: Callable[[int], Tensor],
    look: Callable[[nn.Module], dict[str, float]],
    output: Path,
    minutes: float | None = None,
) -> bool:
    """The loop: from state.step + 1 to config.schedule.steps, or until so many minutes have passed; True when it is
    done. loss_of(step): of state.net, the same for the same step.
    look(average): figures of the validation; the lower its "score", the better.

    InputError when a loss, gradient or figure is no number any more, or the device has no memory left; the last good
    checkpoint stays.
    """
    schedule = config.schedule
    start, losses, unseen = time.perf_counter(), [], []
    with open(output / "log.jsonl", "a", encoding="utf-8") as log, counted("train", schedule.steps) as tell:
        while state.step < schedule.steps:
            step = state.step + 1
            torch.manual_seed(config.seed + step)  # for dropout
            try:
                unseen.append(_step(state, schedule, step, loss_of))
            except torch.OutOfMemoryError:
                raise InputError(
                    "no-device",
                    f"The device has no memory left at step {step}; {_kept(output)}. Make the batch smaller.",
                ) from None
            state.step = step
            tell(step)
            over = minutes is not None and time.perf_counter() - start > 60 * minutes
            judge = step % schedule.every == 0 or step == schedule.steps
            if judge or over or len(unseen) == _LOOK_EVERY:
                losses += _values(unseen, step, output)
                unseen.clear()
            if judge:
                figures = look(state.average)
                _refuse_lost(figures["score"], "A figure of the validation", step, output)
                line = {"step": step, "of": schedule.steps, "s": round(time.perf_counter() - start)}
                line |= {"loss": float(np.mean(losses)), **figures}
                losses.clear()
                log.write(json.dumps(line) + "\n")
                log.flush()
                print({key: round(value, 4) for key, value in line.items()}, flush=True)
                if figures["score"] < state.best:
                    state.best = figures["score"]
                    with whole_file(output / "best.pt") as partial:
                        torch.save(state.average.state_dict(), partial)
            elif not over:
                continue
            # Where a piece ends between two looks there is none: it might choose other weights than a run in one piece.
            state.save(output, config)
            if over and step < schedule.steps:
                print(
                    f"stops after step {step} of {schedule.steps}; the same command goes on from there",
                    flush=True,
                )
                return False
    return True


def _step(state: State, schedule: Schedule, step: int, loss_of: Callable[[int], Tensor]) -> Tensor:
    """(2,) the loss and the gradient's length, which nobody has waited for yet."""
    state.net.train()
    loss = loss_of(step)
    state.net.zero_grad(set_to_none=True)
    loss.backward()
    norm = torch.nn.utils.clip_grad_norm_(state.net.parameters(), 1.0)
    for optimiser in state.optimisers:
        for group in optimiser.param_groups:
            group["lr"] = schedule.rate * schedule.share(step)
        optimiser.step()
    with torch.no_grad():
        decay = min(schedule.average, step / (step + 10))
        torch._foreach_lerp_(list(state.average.parameters()), list(state.net.parameters()), 1 - decay)
    return torch.stack([loss.detach(), norm.detach()])


def _values(unseen: list[Tensor], step: int, output: Path) -> list[float]:
    """The losses of the last steps up to `step`. InputError where one or its gradient is no number."""
    losses, norms = torch.stack(unseen).T.tolist()
    for at, (loss, norm) in enumerate(zip(losses, norms, strict=True), step - len(losses) + 1):
        _refuse_lost(loss, "The loss", at, output)
        _refuse_lost(norm, "A gradient", at, output)
    return losses


def _refuse_lost(value: float, what: str, step: int, output: Path) -> None:
    if not math.isfinite(value):
        raise InputError(
            "bad-value",
            f"{what} became {value} at step {step}; {_kept(output)}. Lower `rate`, or look at the data.",
        )


def _kept(output: Path) -> str:
    last = output / CHECKPOINT
    return f"the last good checkpoint, {last}, stays" if last.exists() else "there was no checkpoint yet"
