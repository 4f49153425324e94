"""Trains 3DPCNet:  pcnet3d lab train models/lab/training/rectifier/pcnet.toml -o DIR

The config file says everything; DIR gets NAME.onnx, the config, and what training.py keeps there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from pydantic import Field, PositiveInt

from .....pipeline.core.errors import InputError
from .....pipeline.core.rotations import geodesic_deg
from .....pipeline.files.atomic import write_text
from .....pipeline.reading.mocap.clip import Clip
from ....shipped import PCNET
from ...common.toml_config import read_toml
from ...common.training import State, Training, device_of, fingerprint, fit, load_weights, optimisers_of
from ...mocap.clips import Subjects, lying, read_clips
from ...mocap.split import Parts, read_parts, trained_on
from ...synthetic.draw import Draw
from ...synthetic.views import Lifted, Targets, View, read_lifted, refuse_shared_subjects, seen, views
from .export import Deployed, export, started
from .frames import Frames, Mixture, TrainingFrames
from .losses import Truth, Weights, total
from .net import NetConfig, PCNet

_VALIDATION_FRAMES = 2000
_LYING_SHARE = 0.1  # of the score
_VIEWS: tuple[View, ...] = ("paper", "wide")
_HELD_OUT: tuple[Subjects, ...] = ("val", "test", "hdm05", "tennis")


class TrainConfig(Training):
    """The whole of a training run.

    kind: what `pcnet3d lab train` trains with this file. name: of the network's file, and what results call it.
    subjects: mocap.clips.Subjects to train on.
    lifted: files of `pcnet3d lab testbed` with takes of train subjects, by whichever lifter (docs/training.md).
    lifted_val: the same of val subjects, by a lifter that never saw them; with it, the best weights are the best on
        these.
    start: of the same network: best.pt or the .onnx file of an earlier run, or "pcnet", the shipped one.
    symmetric: the shipped network's answer is averaged with that to the mirrored body.
    targets: what the rotation leads to; "axes" is the paper's, for data whose people all face one way.
    """

    kind: str = "pcnet"
    name: str = Field("pcnet", pattern=r"^[\w.-]+$")
    subjects: Subjects
    lifted: tuple[Path, ...] = ()
    lifted_val: tuple[Path, ...] = ()
    targets: Targets = "body"
    batch: PositiveInt
    symmetric: bool
    net: NetConfig
    weights: Weights
    mixture: Mixture


def train_pcnet(config_file: Path, output: Path, device: str = "cpu", minutes: float | None = None) -> None:
    """Run a config file, or the next piece of it. InputError when it is not what TrainConfig says, train and held-out
    subjects overlap, or as of `fit`."""
    train(read_config(config_file), config_file.read_text(encoding="utf-8"), output, device, minutes)


def train(
    config: TrainConfig, text: str, output: Path, device: str = "cpu", minutes: float | None = None
) -> None:
    """Run a config, or the next piece of it; text: the file it comes from, kept in DIR."""
    on = device_of(device)
    torch.manual_seed(config.seed)
    frames, checks, learns_from = prepare(config, on)
    net = PCNet(config.net)
    if config.start is not None:
        net = started(net, PCNET.files[0] if str(config.start) == "pcnet" else config.start).train()
    net = net.to(on)
    matrices = [p for p in net.encoder.parameters() if p.ndim == 2]
    state = State(net, optimisers_of(net, config.schedule, matrices), learns_from)
    net.bf16 = config.bf16  # and not what is judged, state.average
    output.mkdir(parents=True, exist_ok=True)
    state.load(output, config, on)
    write_text(output / "pcnet.toml", text)
    print(
        f"{sum(p.numel() for p in net.parameters()):,} parameters, {on}, from step {state.step}", flush=True
    )

    def loss_of(step: int) -> torch.Tensor:
        joints, valid, truth, R = frames.batch(Draw(config.seed, step, on), config.batch)
        return total(net, net(joints, valid), joints, Truth(truth, R, valid), config.weights)

    def look(average: torch.nn.Module) -> dict[str, float]:
        assert isinstance(average, PCNet)
        return check(Deployed(average, config.symmetric), checks)

    if fit(state, config, loss_of, look, output, minutes):
        deployed = Deployed(best_of(config, output), config.symmetric).to(on)
        calibrate(deployed, checks.get("lifted", checks["paper"]))
        print({key: round(figure, 2) for key, figure in check(deployed, checks).items()}, flush=True)
        said = {"trained_on": trained_on(config), "targets": config.targets, "network": config.net.net}
        export(deployed, output / f"{config.name}.onnx", **said, name=config.name)


def read_config(path: Path) -> TrainConfig:
    """A training's TOML file. InputError for keys and values that it cannot have."""
    return read_toml(path, TrainConfig)


def best_of(config: TrainConfig, folder: Path) -> PCNet:
    """The network with a run's best weights by validation; InputError when they are not there or do not fit."""
    return load_weights(PCNet(config.net), folder / "best.pt")


def prepare(config: TrainConfig, device: torch.device) -> tuple[TrainingFrames, dict[str, Frames], str]:
    """What a config learns from, what it is validated on, and the fingerprint of both. InputError when people of one
    part are in another."""
    parts = parts_of(config)
    lifted = read_lifted(config.lifted) if config.lifted else None
    if parts.by == "subject":
        names = [clip.name for clip in parts.clips["train"]] + list(lifted.clips if lifted else ())
        for part, clips in parts.clips.items():
            if part != "train":
                refuse_shared_subjects(names, [clip.name for clip in clips], f"the {part} subjects")
    lifted_val = read_lifted(config.lifted_val) if config.lifted_val else None
    if lifted_val:
        everybody = parts.clips["train"] if config.data else read_clips("train")
        refuse_shared_subjects(lifted_val.clips, [clip.name for clip in everybody], "the validation's")
    frames = TrainingFrames(parts.clips["train"], config.mixture, lifted, config.targets, device)
    checks = validation(parts.clips["val"], lifted_val, config.targets)
    held = [(f"{part} {c.name}", c.joints) for part in ("train", "val") for c in parts.clips[part]]
    for name, takes in (("lifted", lifted), ("lifted_val", lifted_val)):
        held += [(name, array) for array in (takes.joints, takes.R)] if takes else []
    on = {name: Frames(*(part.to(device) for part in check)) for name, check in checks.items()}
    return frames, on, fingerprint(held)


def parts_of(config: TrainConfig) -> Parts:
    """The clips to train on and those held out. InputError when the config's keys contradict each other."""
    if config.targets == "axes" and (config.lifted or config.lifted_val):
        raise InputError(
            "option-conflict",
            'Lifted takes know the target "body" only; leave them out, or set targets = "body".',
        )
    if config.data is None or config.split is None:
        held_out = {str(part): read_clips(part) for part in _HELD_OUT}
        return Parts({"train": read_clips(config.subjects), **held_out}, "subject")
    parts = read_parts(config.data, config.split)
    if parts.by == "clip" and (config.lifted or config.lifted_val):
        raise InputError(
            "bad-value", "With `data`, expected lifted takes only where the split lists subjects."
        )
    return parts


def validation(clips: Sequence[Clip], lifted: Lifted | None, targets: Targets) -> dict[str, Frames]:
    """The same frames of the val subjects for every run: upright ones as "paper", "wide" and, where given, "lifted";
    captured ones as "lying", where there are some."""
    rng = np.random.default_rng(1)
    world = np.concatenate([clip.joints for clip in clips])
    lies = lying(world)
    upright = _some(rng, world[~lies])
    checks = {view: _seen(rng, upright, view, targets) for view in _VIEWS}
    if lifted:
        for name, kind in (("lifted", ~lifted.lying), ("lifted_lying", lifted.lying)):
            if kind.any():
                rows = _some(rng, np.flatnonzero(kind))
                checks[name] = _whole(lifted.joints[rows], lifted.R[rows])
    if lies.any():
        checks["lying"] = _seen(rng, _some(rng, world[lies]), "paper", targets)
    return checks


def _seen(rng: np.random.Generator, world: np.ndarray, view: View, targets: Targets) -> Frames:
    R = views(view, rng, len(world))
    joints, fine = seen(world, R, targets)
    return _whole(joints[fine], R[fine])


def _some(rng: np.random.Generator, rows: np.ndarray) -> np.ndarray:
    return rng.permutation(rows)[:_VALIDATION_FRAMES]


def _whole(joints: np.ndarray, R: np.ndarray) -> Frames:
    shown, R_camera_from_body = (torch.from_numpy(array.astype(np.float32)) for array in (joints, R))
    return Frames(shown, torch.ones(shown.shape[:2]), shown, R_camera_from_body)


def check(deployed: Deployed, checks: dict[str, Frames]) -> dict[str, float]:
    """Mean rotation error in degrees on every part of the validation, and what the network expected it to be; as the
    "score", that on lifted frames where there are some, else on captured ones, of people who lie with a tenth."""
    figures = {}
    for name, frames in checks.items():
        true, expected = _errors(deployed, frames)
        figures |= {name: float(true.mean()), f"{name}_expected": float(expected.mean())}
    upright, lies = ("lifted", "lifted_lying") if "lifted" in figures else ("paper", "lying")
    worse = figures.get(lies, figures[upright]) - figures[upright]
    return figures | {"score": figures[upright] + _LYING_SHARE * worse}


def calibrate(deployed: Deployed, frames: Frames) -> None:
    """Scale the expected error so that its mean is the true mean on people that the training never saw."""
    true, expected = _errors(deployed, frames)
    with torch.no_grad():
        deployed.net.error[-1].bias += math.log(true.mean() / expected.mean())  # type: ignore[operator]


@torch.no_grad()
def _errors(deployed: Deployed, frames: Frames) -> tuple[np.ndarray, np.ndarray]:
    R, error_deg = deployed(frames.joints, frames.valid)
    return geodesic_deg(R.double().cpu().numpy(), frames.R.double().cpu().numpy()), error_deg.cpu().numpy()
