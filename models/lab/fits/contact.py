"""Learn when feet are on the floor:  python -m pcnet3d.models.lab.fits.contact TRAIN.npz... --val VAL.npz

The files are those of `pcnet3d testbed` of train and validation subjects, by lifters that never saw them; contacts and
the pelvis path are read from the motion capture that they were made of. It needs the extra `train`. Two minutes.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ....pipeline.core.canonical import R_world_from_body
from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import kabsch, rotate, transpose
from ....pipeline.files.atomic import whole_file
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.signals.filters import lowpass
from ...common.metrics import relative, scaled
from ...gait.contact import CONTACT_FILE, SIDES, ContactNet, contacts, window_features
from ...gait.events import ON_FLOOR
from ..common.extras import needed_for
from ..common.modules import run_command
from ..common.testbed_file import read_testbed
from ..mocap.clips import data_set, read_clips
from ..mocap.contact import true_contact

_SAME_M = 0.01  # of joints whose takes are of the same body; files are rounded
_TILT_DEG = 4.0  # of up about each horizontal axis, as a take's one gravity is off
_HIDDEN = 64
_EPOCHS, _BATCH, _RATE, _DECAY = 8, 512, 3e-3, 0.1
_JITTER = 0.03  # standard deviations of a feature, drawn anew in every batch
_MOVES = 3.0  # weight of frames in which a foot lands or leaves soon, or has just done so
_SOON_S = 0.4
_RUNS = 4.0  # weight of frames of runs, which are one in 25
_RUN_MPS = 1.9  # of the pelvis over the floor, mean of 0.5 s: faster than people walk
_RUN_S = 0.5


def true_takes(paths: Sequence[Path], clips: Sequence[Clip]) -> Iterator[tuple[Clip, np.ndarray, np.ndarray]]:
    """(clip, lifted, R_world_from_camera) of every take of testbed's files: lifted (T, 17, 3) metres by one scale for
    the take, CAMERA axes. InputError for other files, and for takes of other clips or other bodies than the clips'."""
    by_name = {clip.name: clip for clip in clips}
    for path in paths:
        held = read_testbed(path, "lifted", "truth", "clip")
        lifted, truth = held["lifted"], held["truth"]
        for name, (begin, end) in zip(held["clip"], pairwise(held["take_start"]), strict=True):
            clip = by_name.get(str(name))
            if clip is None or len(clip) != end - begin:
                raise InputError(
                    "files-apart",
                    f"Expected takes of the motion capture in PCNET3D_DATA in {path}, got {name}.",
                )
            true = truth[begin:end].astype(np.float64)
            world = relative(clip.joints.astype(np.float64))
            R_world_from_camera = kabsch(world.reshape(-1, 3), true.reshape(-1, 3))
            if np.abs(rotate(R_world_from_camera, true) - world).max() > _SAME_M:
                raise InputError(
                    "files-apart",
                    f"Expected the captured bodies in {path}, got others; leave --bodies of testbed out.",
                )
            yield clip, scaled(lifted[begin:end].astype(np.float64), true, "take"), R_world_from_camera


def examples(
    paths: Sequence[Path], clips: Sequence[Clip], rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Features (N, F), contact (N,) 0 or 1, weight (N,): of both feet of every take, lifted with an up that is a
    little off, and as it was captured."""
    from scipy.spatial.transform import Rotation

    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for clip, lifted, R_world_from_camera in true_takes(paths, clips):
        time_s = np.arange(len(clip)) / clip.fps
        spells = true_contact(clip.joints, time_s)
        runs = np.where(floor_speed(clip.joints, clip.fps) > _RUN_MPS, _RUNS, 1.0)
        off = Rotation.from_rotvec([*rng.normal(0, np.radians(_TILT_DEG), 2), 0.0]).as_matrix()
        for level in (rotate(off @ R_world_from_camera, lifted), relative(clip.joints.astype(np.float64))):
            body = in_body(level, time_s)
            for side in SIDES:
                features = window_features(body, time_s, side)
                known = np.isfinite(features).all(axis=1)
                events = spells[side][np.isfinite(spells[side])]
                apart = np.abs(time_s[:, None] - events).min(axis=1, initial=np.inf)
                weight = runs * np.where(apart < _SOON_S, _MOVES, 1.0)
                parts.append((features[known], on_floor(spells[side], time_s)[known], weight[known]))
    features, contact, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
    return features, contact, weight


def floor_speed(joints: np.ndarray, fps: float) -> np.ndarray:
    """(T,) m/s at which the pelvis goes over the floor, mean of the half second around; joints (T, 17, 3) metres, +Z
    up."""
    root = joints[:, H36M17.index("pelvis"), :2]
    speed = np.linalg.norm(np.gradient(root, axis=0), axis=-1) * fps
    window = np.ones(max(1, round(_RUN_S * fps)))
    return np.convolve(speed, window, "same") / np.convolve(np.ones(len(speed)), window, "same")


def in_body(level: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, 17, 3) low-passed joints in BODY axes, by the definition of those; level: (T, 17, 3) with +Z up."""
    smooth = lowpass(level.reshape(len(level), -1), time_s).reshape(level.shape)
    return rotate(transpose(R_world_from_body(smooth)), smooth)


def on_floor(spells: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T,) 1 within any of the spells (N, 2) in seconds, whose NaN are the ends of the take, else 0."""
    start, stop = np.where(np.isnan(spells), (-np.inf, np.inf), spells).T
    return ((time_s[:, None] >= start) & (time_s[:, None] <= stop)).any(axis=1).astype(np.float64)


def trained(features: np.ndarray, contact: np.ndarray, weight: np.ndarray, seed: int = 0) -> ContactNet:
    """The network that says best which of the frames are contacts. features (N, F), contact (N,) 0 or 1, weight (N,) in
    the cross-entropy."""
    with needed_for("Training"):
        import torch

    torch.manual_seed(seed)
    centre, scale = features.mean(axis=0), features.std(axis=0) + 1e-6
    x = torch.tensor((features - centre) / scale, dtype=torch.float32)
    y, w = (torch.tensor(values, dtype=torch.float32) for values in (contact, weight / weight.mean()))
    net = torch.nn.Sequential(
        torch.nn.Linear(x.shape[1], _HIDDEN), torch.nn.Tanh(), torch.nn.Linear(_HIDDEN, 1)
    )
    batches = len(x) // _BATCH
    optimiser = torch.optim.AdamW(net.parameters(), lr=_RATE, weight_decay=_DECAY)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, _EPOCHS * batches)
    for _ in range(_EPOCHS):
        for rows in torch.randperm(len(x))[: batches * _BATCH].reshape(batches, _BATCH):
            said = net(x[rows] + _JITTER * torch.randn(_BATCH, x.shape[1]))[:, 0]
            loss = torch.nn.functional.binary_cross_entropy_with_logits(said, y[rows], w[rows])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
    hidden, hidden_bias, out, out_bias = (
        part.detach().numpy().astype(np.float64) for part in net.parameters()
    )
    return ContactNet(centre, scale, hidden.T, hidden_bias, out[0], float(out_bias[0]))


def scores(net: ContactNet, paths: Sequence[Path], clips: Sequence[Clip]) -> dict[str, float]:
    """Precision, recall and accuracy of contact over the frames of lifted takes, in true axes."""
    said, true = [], []
    for clip, lifted, R_world_from_camera in true_takes(paths, clips):
        time_s = np.arange(len(clip)) / clip.fps
        spells = true_contact(clip.joints, time_s)
        found = contacts(in_body(rotate(R_world_from_camera, lifted), time_s), time_s, net=net)
        for side in SIDES:
            known = np.isfinite(found[side])
            said.append(found[side][known] > ON_FLOOR)
            true.append(on_floor(spells[side], time_s)[known] > 0.5)
    yes, is_so = np.concatenate(said), np.concatenate(true)
    both = (yes & is_so).sum()
    return {
        "precision": float(both / yes.sum()),
        "recall": float(both / is_so.sum()),
        "accuracy": float((yes == is_so).mean()),
        "frames": len(yes),
    }


def main(
    train: Annotated[
        list[Path], typer.Argument(help="Lifted train subjects, by lifters that never saw them.")
    ],
    val: Annotated[list[Path], typer.Option(help="Lifted validation subjects.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The file to write.")] = CONTACT_FILE,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
) -> None:
    """Learn when feet are on the floor."""
    clips = read_clips("train")
    features, contact, weight = examples(train, clips, np.random.default_rng(seed))
    net = trained(features, contact, weight, seed)
    said = {name: round(value, 3) for name, value in scores(net, val, read_clips("val")).items()}
    names = {str(name) for path in train for name in read_testbed(path, "clip")["clip"]}
    sets = sorted({data_set(clip) for clip in clips if clip.name in names})
    content: dict[str, Any] = {
        "made_by": "python -m pcnet3d.models.lab.fits.contact",
        "learned_on": f"{len(features):,} frames of train subjects of {', '.join(sets)}, lifted and as captured",
        "files": len(train),
        "seed": seed,
        "validation": said,
        "joints": f"{H36M17.name}, see contact.window_features",
        **{name: _short(getattr(net, name)) for name in ("centre", "scale", "hidden", "hidden_bias", "out")},
        "out_bias": round(net.out_bias, 5),
    }
    with whole_file(output) as partial:
        partial.write_text(json.dumps(content) + "\n", encoding="utf-8")
    print(f"{output}: validation {said}")


def _short(values: np.ndarray) -> list[Any]:
    return np.round(values, 5).tolist()


if __name__ == "__main__":
    run_command(main)
