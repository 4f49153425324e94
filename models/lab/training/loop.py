"""The loop that every network here is trained with: schedule, averaged weights, validation, checkpoints, ONNX files.

A trainer says what a step's loss is and how the averaged network does on people it never saw; `fit` does the rest. The
run's folder gets config.json, checkpoint.pt, best.pt (the averaged weights that did best), and log.jsonl: a JSON object
a line with `step`, `of`, `s` (seconds since this start), `loss` (mean since the last line, or since this start) and the
figures of the validation. pandas draws it: pandas.read_json("log.jsonl", lines=True).plot(x="step", y="score")
"""

# pyright: reportPrivateImportUsage=false
from __future__ import annotations

import hashlib
import json
import math
import time
import warnings
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
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

from ....pipeline.core.errors import InputError, needed_for, readable
from ....pipeline.files.atomic import whole_file, write_text
from ....pipeline.files.unpacked import check_size
from ....pipeline.running.progress import counted

CHECKPOINT = "checkpoint.pt"
SAVED_EVERY_S = 60.0  # so much is lost at most when a run is killed
Net = TypeVar("Net", bound=nn.Module)


class Schedule(BaseModel):
    """How a network learns."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    steps: PositiveInt
    rate: PositiveFloat  # the highest
    warmup: NonNegativeInt  # steps up to it
    # Share of the steps, the last ones, in which it goes down to nothing, in a line or along half a cosine (Loshchilov
    # & Hutter 2017).
    cooldown: float = Field(gt=0, le=1)
    decline: Literal["linear", "cosine"] = "linear"
    optimiser: Literal["muon", "adamw"] = "muon"  # Muon for matrices and AdamW for the rest, or AdamW for all
    weight_decay: NonNegativeFloat  # of matrices
    # Decay of the weights' moving average, which is what is judged and kept.
    average: float = Field(ge=0, lt=1)
    every: PositiveInt = 250  # steps between looks at the validation

    def share(self, step: int) -> float:
        """Of the highest rate, at a step counted from 1."""
        if step <= self.warmup:
            return step / self.warmup
        cools_from = max(self.warmup, round(self.steps * (1 - self.cooldown)))
        left = min(1.0, (self.steps - step + 1) / max(self.steps - cools_from, 1))
        return left if self.decline == "linear" else (1 - math.cos(math.pi * left)) / 2


class Training(BaseModel):
    """What every training is told."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: str  # what `pcnet3d lab train` trains with the file
    # A file of `pcnet3d lab mocap` and one of its train and val subjects (mocap/clips.py), instead of the motion
    # capture that the shipped networks saw.
    data: Path | None = None
    split: Path | None = None
    # Weights to begin with: best.pt of a run of the same net; for the rectifier also its .onnx file, or "pcnet", the
    # shipped one.
    start: Path | None = None
    seed: NonNegativeInt
    bf16: bool  # the inner layers compute in bfloat16
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
        return f"{self.data.name}, {self.split.name}" if self.data and self.split else "train"


class State:
    """Everything that a run needs to go on exactly, for batches depend on the seed and the step only."""

    def __init__(
        self, net: nn.Module, matrices: Iterable[nn.Parameter], config: Training, learns_from: str
    ) -> None:
        """matrices: of the net, those that Muon is for. learns_from: the `fingerprint` of what it is trained and
        validated on."""
        self.net, self.config, self.learns_from = net, config, learns_from
        self.optimisers = optimisers_of(net, config.schedule, matrices)
        self.average = deepcopy(net).eval()
        self.step, self.best = 0, math.inf

    def save(self, folder: Path) -> None:
        """Killed at any moment, the last checkpoint stays whole."""
        with whole_file(folder / CHECKPOINT) as partial:
            torch.save(
                {
                    "config": self.config.model_dump_json(),
                    "learns_from": self.learns_from,
                    "net": self.net.state_dict(),
                    "average": self.average.state_dict(),
                    "optimisers": [optimiser.state_dict() for optimiser in self.optimisers],
                    "step": self.step,
                    "best": self.best,
                },
                partial,
            )

    def load(self, folder: Path) -> None:
        """Go on from the folder's checkpoint, if it has one. InputError when it is damaged, of another network or
        config, or learned from something else."""
        path = folder / CHECKPOINT
        if not path.exists():
            return
        with reading(path):
            saved = _unpickled(path, next(self.net.parameters()).device)
            for key, now, what in (
                ("config", self.config.model_dump_json(), "was made with another config"),
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


def fit(
    state: State,
    loss_of: Callable[[int], Tensor],
    look: Callable[[nn.Module], dict[str, float]],
    output: Path,
) -> None:
    """The loop: all steps of the config that the output folder's checkpoint has not made yet.

    loss_of(step): of state.net, the same for the same step. look(average): figures of the validation; the lower its
    "score", the better. InputError as of State.load, when a loss, gradient or figure is no number any more, or the
    device has no memory left; the last checkpoint stays.
    """
    config, schedule = state.config, state.config.schedule
    output.mkdir(parents=True, exist_ok=True)
    state.load(output)
    write_text(output / "config.json", config.model_dump_json(indent=1, exclude_none=True))
    device = next(state.net.parameters()).device
    parameters = sum(p.numel() for p in state.net.parameters())
    print(f"{parameters:,} parameters, {device}, from step {state.step}", flush=True)
    saved = start = time.perf_counter()
    losses: list[float] = []
    with open(output / "log.jsonl", "a", encoding="utf-8") as log, counted("train", schedule.steps) as tell:
        for step in range(state.step + 1, schedule.steps + 1):
            torch.manual_seed(config.seed + step)  # for dropout
            try:
                losses.append(_learn(state, step, loss_of, output))
            except torch.OutOfMemoryError:
                raise InputError(
                    "no-device",
                    f"The device has no memory left at step {step}; {_kept(output)}. Make the batch smaller.",
                ) from None
            state.step = step
            tell(step)
            if step % schedule.every == 0 or step == schedule.steps:
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
            elif time.perf_counter() - saved < SAVED_EVERY_S:
                continue
            state.save(output)
            saved = time.perf_counter()


def _learn(state: State, step: int, loss_of: Callable[[int], Tensor], output: Path) -> float:
    """The loss of a step, after which the network has learned from it. InputError where it is no number."""
    schedule = state.config.schedule
    state.net.train()
    loss = loss_of(step)
    state.net.zero_grad(set_to_none=True)
    loss.backward()
    norm = torch.nn.utils.clip_grad_norm_(state.net.parameters(), 1.0)
    _refuse_lost(loss.item(), "The loss", step, output)
    _refuse_lost(float(norm), "A gradient", step, output)
    for optimiser in state.optimisers:
        for group in optimiser.param_groups:
            group["lr"] = schedule.rate * schedule.share(step)
        optimiser.step()
    with torch.no_grad():
        decay = min(schedule.average, step / (step + 10))
        torch._foreach_lerp_(list(state.average.parameters()), list(state.net.parameters()), 1 - decay)
    return loss.item()


def _refuse_lost(value: float, what: str, step: int, output: Path) -> None:
    if not math.isfinite(value):
        raise InputError(
            "bad-value",
            f"{what} became {value} at step {step}; {_kept(output)}. Lower `rate`, or look at the data.",
        )


def _kept(output: Path) -> str:
    last = output / CHECKPOINT
    return f"the last good checkpoint, {last}, stays" if last.exists() else "there was no checkpoint yet"


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


def write_onnx(
    net: nn.Module,
    path: Path,
    inputs: Mapping[str, Tensor],
    free: Sequence[Any],
    outputs: Sequence[str],
    said: Mapping[str, object],
    half: bool = False,
) -> None:
    """inputs: examples by name, in the order that the network takes them. free: for each input, {axis:
    torch.export.Dim} of those that may have any size. outputs: names. said: kept in the file's metadata. half: matrices
    are kept in half precision; the file computes with them in float32."""
    with needed_for("The network is trained; writing it as ONNX"):
        import onnx
        import onnxscript  # noqa: F401  (torch's exporter needs it, and says so in many lines)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of torch's exporter, about torch's own code
        program = torch.onnx.export(
            net.cpu().eval(),
            tuple(inputs.values()),
            input_names=list(inputs),
            output_names=list(outputs),
            dynamic_shapes=tuple(free),
            dynamo=True,
            external_data=False,
            verbose=False,
        )
    assert program is not None
    model = program.model_proto
    for node in model.graph.node:
        del node.metadata_props[:]  # its place in the source files, by their paths on this machine
    onnx.helper.set_model_props(model, {key: str(value) for key, value in said.items()})
    if half:
        _halve(model)
    with whole_file(path) as partial:
        partial.write_bytes(model.SerializeToString())


def _halve(model: Any) -> None:
    """The matrices of an onnx.ModelProto in half precision, which it makes float32 when it is opened."""
    from onnx import TensorProto, helper, numpy_helper

    casts = []
    for each in model.graph.initializer:
        matrix = numpy_helper.to_array(each)
        if matrix.dtype == np.float32 and matrix.ndim > 1:
            kept = f"{each.name}.half"
            casts.append(helper.make_node("Cast", [kept], [each.name], to=TensorProto.FLOAT))
            each.CopyFrom(numpy_helper.from_array(matrix.astype(np.float16), kept))
    nodes = [*casts, *model.graph.node]
    del model.graph.node[:]
    model.graph.node.extend(nodes)


def read_onnx(path: Path) -> tuple[Sequence[Any], dict[str, Tensor]]:
    """The nodes of a network's file, in the order in which they compute, and its tensors by their names. InputError
    when it cannot be read."""
    with needed_for("Reading weights out of an ONNX file"):
        import onnx
        from onnx import numpy_helper

    with reading(path, "a network"):
        graph = onnx.load(str(path), load_external_data=False).graph
        tensors = {
            each.name: torch.from_numpy(numpy_helper.to_array(each).copy()) for each in graph.initializer
        }
        return tuple(graph.node), tensors


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
