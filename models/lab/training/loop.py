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
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, PositiveFloat, PositiveInt, ValidationError
from torch import Tensor, nn

from ....pipeline.core.errors import InputError, needed_for, readable
from ....pipeline.files.atomic import whole_file, write_text
from ....pipeline.running.progress import counted
from ..clips import Clip
from ..synthetic import Size

Device = Literal["auto", "cpu", "cuda"]
CHECKPOINT = "checkpoint.pt"
SAVED_EVERY_S = 60.0  # so much is lost at most when a run is killed
Net = TypeVar("Net", bound=nn.Module)
Config = TypeVar("Config", bound=BaseModel)


def checked(content: dict[str, Any], model: type[Config], where: str) -> Config:
    """The content as that model; InputError with `where` and the key that is wrong."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise InputError("bad-value", ": ".join(filter(None, [where, key, f"{first['msg']}."]))) from None


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
    weight_decay: Size  # of matrices
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
    seed: NonNegativeInt
    bf16: bool  # the inner layers compute in bfloat16
    schedule: Schedule


def fit(
    net: Net,
    matrices: Iterable[nn.Parameter],
    config: Training,
    learns_from: str,
    loss_of: Callable[[int], Tensor],
    look: Callable[[Net], dict[str, float]],
    output: Path,
) -> Net:
    """The loop: all steps of the config that the output folder's checkpoint has not made yet. The network with the
    weights that did best.

    matrices: of the net, those that Muon is for. learns_from: the `fingerprint` of what it is trained and validated on.
    loss_of(step): of the net, the same for the same step. look(average): figures of the validation; the lower its
    "score", the better. InputError for a checkpoint that is damaged, of another network or config, or learned from
    something else, and when a loss, gradient or figure is no number any more; the last checkpoint stays.
    """
    schedule, device = config.schedule, next(net.parameters()).device
    optimisers, average = optimisers_of(net, schedule, matrices), deepcopy(net).eval()
    # What a run needs to go on exactly, for batches depend on the seed and the step only.
    parts = {"net": net, "average": average, **{type(each).__name__: each for each in optimisers}}
    run = {"config": config.model_dump_json(), "learns_from": learns_from, "step": 0, "best": math.inf}
    output.mkdir(parents=True, exist_ok=True)
    if (output / CHECKPOINT).exists():
        run |= _loaded(output / CHECKPOINT, run, parts, device)
    write_text(output / "config.json", config.model_dump_json(indent=1, exclude_none=True))
    print(
        f"{sum(p.numel() for p in net.parameters()):,} parameters, {device}, from step {run['step']}",
        flush=True,
    )
    saved = start = time.perf_counter()
    losses: list[float] = []
    with open(output / "log.jsonl", "a", encoding="utf-8") as log, counted("train", schedule.steps) as tell:
        for step in range(run["step"] + 1, schedule.steps + 1):
            torch.manual_seed(config.seed + step)  # for dropout
            net.train()
            loss = loss_of(step)
            net.zero_grad(set_to_none=True)
            loss.backward()
            norm = torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            _refuse_lost(loss.item() + float(norm), "The loss or a gradient", step)
            for optimiser in optimisers:
                for group in optimiser.param_groups:
                    group["lr"] = schedule.rate * schedule.share(step)
                optimiser.step()
            decay = min(schedule.average, step / (step + 10))
            with torch.no_grad():
                torch._foreach_lerp_(list(average.parameters()), list(net.parameters()), 1 - decay)
            losses.append(loss.item())
            run["step"] = step
            tell(step)
            if step % schedule.every == 0 or step == schedule.steps:
                figures = look(average)
                _refuse_lost(figures["score"], "A figure of the validation", step)
                line = {"step": step, "of": schedule.steps, "s": round(time.perf_counter() - start)}
                line |= {"loss": float(np.mean(losses)), **figures}
                losses.clear()
                log.write(json.dumps(line) + "\n")
                log.flush()
                print({key: round(value, 4) for key, value in line.items()}, flush=True)
                if figures["score"] < run["best"]:
                    run["best"] = figures["score"]
                    _save(average.state_dict(), output / "best.pt")
            elif time.perf_counter() - saved < SAVED_EVERY_S:
                continue
            _save(run | {name: part.state_dict() for name, part in parts.items()}, output / CHECKPOINT)
            saved = time.perf_counter()
    with reading(output / "best.pt", "weights"):
        average.load_state_dict(torch.load(output / "best.pt", weights_only=True, map_location=device))
    return average


def _save(content: dict[str, Any], path: Path) -> None:
    """Killed at any moment, the last file stays whole."""
    with whole_file(path) as partial:
        torch.save(content, partial)


def _loaded(
    path: Path, run: dict[str, Any], parts: Mapping[str, Any], device: torch.device
) -> dict[str, Any]:
    """The step and the best score of a checkpoint of the same run, whose state the parts get."""
    with reading(path, "a checkpoint"):
        saved = torch.load(path, weights_only=True, map_location=device)  # unpickles nothing but tensors
        if (saved["config"], saved["learns_from"]) != (run["config"], run["learns_from"]):
            raise InputError(
                "already-there",
                f"{path} was made with another config, other recordings or another split; choose another -o DIR, or "
                "put back what it was made with.",
            )
        for name, part in parts.items():
            part.load_state_dict(saved[name])
        return {"step": saved["step"], "best": saved["best"]}


def _refuse_lost(value: float, what: str, step: int) -> None:
    if not math.isfinite(value):
        raise InputError(
            "bad-value",
            f"{what} became {value} at step {step}; the last checkpoint stays. Lower `rate`, or look at the data.",
        )


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
    adamw = torch.optim.AdamW(groups, betas=(0.9, 0.98))
    if not matrices:
        return [adamw]
    decay = schedule.weight_decay
    return [torch.optim.Muon(matrices, weight_decay=decay, adjust_lr_fn="match_rms_adamw"), adamw]


def fingerprint(clips: Mapping[str, Sequence[Clip]], *more: np.ndarray) -> str:
    """SHA-256 of the clips of each part, their names and their order, and of more arrays."""
    whole = hashlib.sha256()
    for part, of_part in clips.items():
        for clip in of_part:
            whole.update(f"{part} {clip.name}\n".encode())
            whole.update(clip.joints.tobytes())
    for array in more:
        whole.update(array.tobytes())
    return whole.hexdigest()


@contextmanager
def reading(path: Path, expected: str) -> Iterator[None]:
    """For reading networks and checkpoints: InputError in words for whatever is wrong with what is `expected`."""
    try:
        with readable(path, expected):
            yield
    except InputError:
        raise
    except Exception as error:  # torch's errors have no common class but Exception, and advise to unpickle
        reason = (str(error).splitlines() or [""])[:2][-1].strip(" \t.")[:200]
        raise InputError(
            "file-damaged",
            f"Expected {expected} at {path}, but it is damaged or of another network ({reason}); remove it, or give "
            "another.",
        ) from None


def write_onnx(
    net: nn.Module,
    path: Path,
    inputs: Mapping[str, Tensor],
    free: Sequence[str],
    outputs: Sequence[str],
    said: Mapping[str, object],
    half: bool = False,
) -> None:
    """inputs: examples by name, in the order that the network takes them. free: names of their first axes, which may
    have any size. outputs: names. said: kept in the file's metadata. half: matrices are kept in half precision; the
    file computes with them in float32."""
    with needed_for("The network is trained; writing it as ONNX"):
        import onnx
        import onnxscript  # noqa: F401  (torch's exporter needs it, and says so in many lines)

    axes = {axis: torch.export.Dim(name) for axis, name in enumerate(free)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of torch's exporter, about torch's own code
        program = torch.onnx.export(
            net.cpu().eval(),
            tuple(inputs.values()),
            input_names=list(inputs),
            output_names=list(outputs),
            dynamic_shapes=tuple(axes for _ in inputs),
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


def device_of(name: Device) -> torch.device:
    """auto: a GPU where there is one, else the CPU. InputError where there is none for cuda."""
    usable = torch.cuda.is_available()
    if name == "cuda" and not usable:
        raise InputError(
            "no-device", "Expected a GPU that torch can use, but there is none; give --device cpu."
        )
    return torch.device("cuda" if usable and name != "cpu" else "cpu")
