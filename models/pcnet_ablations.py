"""What each part of 3DPCNet is worth:  pcnet3d train models/ablations.toml -o DIR

The file is a training config (pcnet_train) with a list of runs, each a name and what it changes. All runs have the
same steps, batches and seed; each trains into a folder of its own in DIR, and the same command again goes on where it
was stopped. After every run DIR/ablations.md and ablations.json tell how the finished ones do on people whom no
network saw.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, Field, PositiveInt

from ..pipeline.config import load_toml
from ..pipeline.errors import InputError
from ..pipeline.outputs import whole_file
from ..pipeline.rotations import rotate, transpose
from . import pcnet
from .evaluation_sets import evaluation_sets
from .geometric import Geometric
from .metrics import Figure, plain, procrustes_error
from .pcnet_evaluate import Judged, Take, clean_takes, compare, judge, lifted, together
from .pcnet_export import Deployed
from .pcnet_train import TrainConfig, best_of, score_of, train
from .train_config import as_toml, checked

_BUDGET = {"steps", "batch", "seed"}
_CHUNK = 1024


class Changes(BaseModel):
    """One of the runs: its name, and the keys of the training config that differ, as `net.net = "gcn"`."""

    model_config = ConfigDict(extra="allow", frozen=True)
    name: str


class Plan(BaseModel):
    """What the file holds beside the training config. every: only every so many frames of a test take are judged."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    every: PositiveInt = 5
    runs: tuple[Changes, ...] = Field(min_length=1)


def train_ablations(config_file: Path, output: Path) -> None:
    """Train all runs and write the tables. InputError, before anything is trained, when a run changes the budget, is
    not what TrainConfig says, or shares its name with another."""
    every, runs = read_plan(config_file)
    sets: dict[str, Take] = {}
    report: dict[str, Any] = {}
    for i, (name, config) in enumerate(runs.items(), start=1):
        folder = output / slug(name)
        print(f"{name} ({i} of {len(runs)})", flush=True)
        if not _finished(folder, config):
            train(config, as_toml(config), folder)
        if not sets:
            sets = judged_sets(every)
            report = {
                "budget": {key: getattr(config, key) for key in sorted(_BUDGET)},
                "every": every,
                "sets": {label: _of_set(take) for label, take in sets.items()},
                "runs": {},
            }
        report["runs"][name] = judge_run(config, folder, sets)
        with whole_file(output / "ablations.json") as partial:
            partial.write_text(json.dumps(plain(report), indent=1), encoding="utf-8")
        with whole_file(output / "ablations.md") as partial:
            partial.write_text(as_markdown(report), encoding="utf-8")
    print(as_markdown(report))


def read_plan(path: Path) -> tuple[int, dict[str, TrainConfig]]:
    """`every`, and the whole config of every run by its name. InputError for what is no plan."""
    base = load_toml(path, "a training config")
    plan = checked({key: base.pop(key) for key in ("every", "runs") if key in base}, Plan, str(path))
    runs: dict[str, TrainConfig] = {}
    for run in plan.runs:
        where, changes = f"{path}, run '{run.name}'", run.model_extra or {}
        if not slug(run.name) or slug(run.name) in map(slug, runs):
            raise InputError(f"{where}: expected a name of its own for every run, in letters and digits.")
        if budget := _BUDGET.intersection(changes):
            raise InputError(f"{where}: expected the same {', '.join(sorted(budget))} for all runs.")
        config = checked(_merged({**base, "kind": "pcnet"}, changes), TrainConfig, where)
        if config.data is not None or config.targets != "body":
            raise InputError(
                f"{where}: expected no `data` and no other `targets`; all runs meet the same test takes."
            )
        runs[run.name] = config
    return plan.every, runs


def slug(name: str) -> str:
    """The name as a folder's."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def judged_sets(every: int, seed: int = 0) -> dict[str, Take]:
    """Upright frames of the test takes, one long take for each set: lifted ones, and clean ones from the paper's
    views."""
    sets = {}
    for one in evaluation_sets():
        for kind, takes in (
            ("lifted", lifted(one, seed)),
            ("clean", clean_takes(one.clips(), "paper", seed)),
        ):
            few = [take.some(slice(None, None, every)) for take in takes]
            upright = [take.some(~take.lying) for take in few]
            joints, truth, R, lying = (
                np.concatenate([getattr(take, part) for take in upright])
                for part in ("joints", "truth", "R", "lying")
            )
            sets[f"{one.label}, {kind}, upright"] = Take(joints, truth, R, lying, "")
    return sets


def judge_run(config: TrainConfig, folder: Path, sets: dict[str, Take]) -> dict[str, Any]:
    """A finished run's figures: parameters, validation, and Judged's on every set; `rotation, one pass` is without
    the average with the mirrored body."""
    net = best_of(config, folder)
    figures = {}
    for label, take in sets.items():
        figures[label] = _figures(judge_net(net, take, config.symmetric), take)
        once = judge_net(net, take, symmetric=False)
        figures[label]["rotation, one pass"] = Figure.of(once.rotation)
    parameters = sum(p.numel() for p in net.parameters())
    return {"parameters": parameters, "val": best_look(folder), "sets": figures}


@torch.no_grad()
def judge_net(net: pcnet.PCNet, take: Take, symmetric: bool) -> Judged:
    """Like pcnet_evaluate.judge, but of what the residual head made of the pose as well, which the exported network
    does not tell: the corrected pose, in the camera's axes, is canonicalised with the deployed rotation."""
    deployed, parts = Deployed(net, symmetric), []
    for start in range(0, len(take.R), _CHUNK):
        part = take.some(slice(start, start + _CHUNK))
        joints = torch.from_numpy(part.joints.astype(np.float32))
        valid = torch.ones(joints.shape[:2])
        R, error_deg = (x.double().numpy() for x in deployed(joints, valid))
        answer = net(joints, valid)
        pose = pcnet.rotate(answer.R, answer.canonical).double().numpy()
        parts.append(compare(part, R, error_deg, rotate(transpose(R), pose)))
    return together(parts)


def best_look(folder: Path) -> dict[str, float]:
    """The validation's figures at the step whose weights were kept."""
    lines = [json.loads(line) for line in (folder / "log.jsonl").read_text(encoding="utf-8").splitlines()]
    best = min(lines, key=score_of)
    return {name: best[name] for name in ("paper", "wide", "lifted") if name in best}


def as_markdown(report: dict[str, Any]) -> str:
    """The report as a page of tables."""
    budget = ", ".join(f"{key} {value:,}" for key, value in report["budget"].items())
    lines = [
        "# Ablations",
        "",
        f"One training each: {budget}. Judged on one of {report['every']} frames, in degrees, mm and per cent. "
        "One pass: without the average with the mirrored body. Bones: mean change of their lengths.",
        "",
        _row(["run", "parameters", "val paper", "val wide", "val lifted"]),
        _row(["---"] * 5),
    ]
    for name, run in report["runs"].items():
        val = [f"{run['val'][key]:.2f}" if key in run["val"] else "" for key in ("paper", "wide", "lifted")]
        lines.append(_row([name, f"{run['parameters']:,}", *val]))
    for label, about in report["sets"].items():
        lines += [
            "",
            f"## {label}",
            "",
            f"{about['frames']:,} frames; the input's own PA-MPJPE is {about['pa_mpjpe'].mean:.1f} mm.",
            "",
            _row(["run", "rotation mean", "p50", "one pass", "tilt", "MPJPE", "PA-MPJPE change", "bones"]),
            _row(["---"] * 8),
        ]
        rows = {"geometric": about["geometric"]}
        rows |= {name: run["sets"][label] for name, run in report["runs"].items()}
        for name, row in rows.items():
            once = f"{row['rotation, one pass'].mean:.2f}" if "rotation, one pass" in row else ""
            cells = [f"{row['rotation'].mean:.2f}", f"{row['rotation'].p50:.2f}", once]
            cells += [f"{row['tilt'].mean:.2f}", f"{row['mpjpe'].mean:.1f}"]
            change = round(row["pa_mpjpe change"].mean, 2) + 0.0  # no -0.00
            cells += [f"{change:+.2f}", f"{row['bones'].mean:.2f}"]
            lines.append(_row([name, *cells]))
    return "\n".join(lines) + "\n"


def _of_set(take: Take) -> dict[str, Any]:
    return {
        "frames": len(take.R),
        "pa_mpjpe": Figure.of(_own_error(take)),
        "geometric": _figures(judge(Geometric(), [take]), take),
    }


def _figures(judged: Judged, take: Take) -> dict[str, Figure]:
    """`pa_mpjpe change`: of the canonical pose against the input, frame by frame; below 0 where it was denoised."""
    names = ("rotation", "tilt", "mpjpe", "pa_mpjpe", "bones")
    figures = {name: Figure.of(getattr(judged, name)) for name in names}
    return figures | {"pa_mpjpe change": Figure.of(judged.pa_mpjpe - _own_error(take))}


def _own_error(take: Take) -> np.ndarray:
    """(T,) PA-MPJPE of the input in mm."""
    return 1000 * procrustes_error(take.joints.astype(np.float64), take.truth)


def _finished(folder: Path, config: TrainConfig) -> bool:
    """Whether the folder holds this very run; another one's is left to the training to refuse."""
    made_from = folder / "pcnet.toml"
    return (folder / "pcnet.onnx").is_file() and made_from.read_text(encoding="utf-8") == as_toml(config)


def _merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Tables are merged key by key, everything else is replaced."""
    out = dict(base)
    for key, value in changes.items():
        both = isinstance(value, dict) and isinstance(base.get(key), dict)
        out[key] = _merged(base[key], value) if both else value
    return out


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"
