"""Our networks beside the default one of the paper's authors, on the same poses:  pcnet3d lab authors -o DIR

What their public code trains by default (github.com/tharindu326/3DPCNet), written anew: sizes, losses, rates and the
six views of every frame are theirs, the code is ours. It learns from CMU's training people.

There an input is x = R c of the canonical pose c, and the network learns R. Their code then turns x by R once more,
R x + residual, where R^T x would lead back to c; the residual has to make up for that.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import cosine_similarity, mse_loss
from typer import Option

from ...pipeline.core.device import computing_on
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.pose import package_version
from ...pipeline.core.rotations import rotate, transpose
from ...pipeline.files.atomic import refuse_unwritable
from ...pipeline.reading.settings import OnDevice
from ...pipeline.running.progress import counted
from ..common import vectors
from ..rectifier.load import load_rectifier
from .beds import EVALUATION_SETS, Sets
from .cases import Cases
from .clips import data_set, read_clips
from .evaluation.evaluate import note_look, publish, refuse_unexplained
from .evaluation.rectifiers import Take, clean_takes, compare, judge, summary
from .synthetic import CAMERA_FROM_SOURCE
from .training.rectifier import geodesic, gram_schmidt

VIEWS = 6
BATCH, RATE, WEIGHT_DECAY = 256, 1e-4, 1e-4
HALVED = 20 / 50  # share of the steps after which the rate is halved, again and again
POSE, ROTATION, CYCLE, PERCEPTUAL, RESIDUAL = 1.0, 0.75, 0.2, 0.1, 0.0005
_BONES = tuple(zip(*(H36M17.indices(bone) for bone in H36M17.bones), strict=True))
# Meant is an elbow, but the numbers are another layout's; in that of their data they are these joints.
_ELBOW = H36M17.indices(("r_knee", "spine", "nose"))

_ABOUT = (
    "Every frame of clean poses from the paper's views. Rotation in degrees; unscaled: MPJPE in mm of the pose as it "
    "comes. R x + residual: what the authors' code gives out; R^T x: the same network's rotation on the other side."
)


def authors(
    output: Annotated[Path, Option("-o", "--output", help="Folder for the table, .md and .json.")],
    sets: Annotated[Sets, Option(help="Validation people, or others, with --because.")] = "val",
    because: Annotated[str, Option(help="Why test people are looked at; goes to the ledger.")] = "",
    steps: Annotated[int, Option(min=1, help="Steps of 256 poses; the default takes minutes.")] = 20_000,
    device: OnDevice = "auto",
) -> None:
    """Train the default network of the paper's authors and test it beside the shipped rectifiers."""
    refuse_unexplained(sets, because)
    refuse_unwritable(output)
    judged = {of.label: clean_takes(of.clips(), "paper") for of in EVALUATION_SETS[sets]}
    clips = [clip for clip in read_clips("train") if data_set(clip) == "cmu"]
    net = trained([take for seed in range(VIEWS) for take in clean_takes(clips, "paper", seed)], steps)
    rows: dict[str, dict[str, Any]] = {}
    with computing_on(device):
        shipped = [load_rectifier(name) for name in ("geometric", "pcnet", "paper")]
        for label, takes in judged.items():
            own, back = judge_net(net, takes)
            rows[label] = {rectifier.method: summary(judge(rectifier, takes)) for rectifier in shipped}
            rows[label] |= {"authors, R x + residual": summary(own), "authors, R^T x": summary(back)}
    output.mkdir(parents=True, exist_ok=True)
    if because:
        networks = [rectifier.method for rectifier in shipped if "@" in rectifier.method]
        note_look(output, f"pcnet3d lab authors --sets {sets}", networks, because)
    results = {"pcnet3d": package_version(), "steps": steps, "rows": rows}
    publish(output / "authors", "authors", _ABOUT, results)


def network() -> nn.ModuleDict:
    """Joints (B, 51) to features (B, 256), and these to the rotation's six numbers and a residual of every joint."""
    layers: list[nn.Module] = []
    for inputs, outputs in ((51, 512), (512, 256), (256, 128)):
        layers += [nn.Linear(inputs, outputs), nn.ReLU(), nn.Dropout(0.1)]
    encoder = nn.Sequential(*layers, nn.Linear(128, 256))
    net = nn.ModuleDict({"encoder": encoder, "rotation": nn.Linear(256, 6), "residual": nn.Linear(256, 51)})
    for weights in net.parameters():
        nn.init.xavier_uniform_(weights) if weights.ndim == 2 else nn.init.zeros_(weights)
    return net


def answer(net: nn.ModuleDict, joints: Tensor) -> tuple[Tensor, Tensor]:
    """R (B, 3, 3) and the residual (B, 17, 3) in metres for joints (B, 17, 3) relative to the pelvis, in the paper's
    axes: x away, y left, z up."""
    features = net["encoder"](joints.flatten(1))
    return gram_schmidt(net["rotation"](features)), net["residual"](features).unflatten(1, (-1, 3))


def loss_of(net: nn.ModuleDict, joints: Tensor, R: Tensor) -> Tensor:
    """Their loss for inputs (B, 17, 3) whose true rotations are R (B, 3, 3)."""
    truth = vectors.rotate(R.mT, joints)
    found, residual = answer(net, joints)
    canonical = vectors.rotate(found, joints) + residual
    (lengths, elbow), (true_lengths, true_elbow) = _shape(canonical), _shape(truth)
    perceptual = mse_loss(lengths, true_lengths) + mse_loss(elbow, true_elbow)
    cycle = mse_loss(vectors.rotate(found, canonical), joints)
    loss = POSE * mse_loss(canonical, truth) + ROTATION * geodesic(found, R).mean()
    return loss + CYCLE * cycle + PERCEPTUAL * perceptual + RESIDUAL * residual.norm(dim=-1).mean()


def _shape(joints: Tensor) -> tuple[Tensor, Tensor]:
    """Bones' lengths (B, bones) in metres and the angle (B,) in radians at the second of the joints of _ELBOW."""
    start, end = _BONES
    a, b, c = (joints[:, joint] for joint in _ELBOW)
    cosine = cosine_similarity(a - b, c - b, dim=-1).clamp(-1 + 1e-6, 1 - 1e-6)  # arccos has no gradient at 1
    return (joints[:, end] - joints[:, start]).norm(dim=-1), cosine.acos()


def trained(takes: Sequence[Take], steps: int) -> nn.ModuleDict:
    """The network after so many steps of random frames of the takes."""
    torch.manual_seed(0)
    torch.set_num_threads(1)  # layers so small gain nothing by more
    R = np.concatenate([CAMERA_FROM_SOURCE.T @ take.R for take in takes])
    joints = np.concatenate([rotate(CAMERA_FROM_SOURCE.T, take.joints) for take in takes])
    truth, given = (torch.from_numpy(array.astype(np.float32)) for array in (R, joints))
    net = network()
    optimiser = torch.optim.Adam(net.parameters(), lr=RATE, weight_decay=WEIGHT_DECAY)
    schedule = torch.optim.lr_scheduler.StepLR(optimiser, max(1, round(HALVED * steps)), gamma=0.5)
    with counted("train", steps) as tell:
        for step in range(1, steps + 1):
            rows = torch.randint(len(given), (BATCH,))
            optimiser.zero_grad()
            loss_of(net, given[rows], truth[rows]).backward()
            torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            tell(step)
    return net.eval()


def judge_net(net: nn.ModuleDict, takes: Sequence[Take]) -> tuple[list[Cases], list[Cases]]:
    """Errors (rectifiers.compare) of R x + residual, and of R^T x."""
    own, back = [], []
    for take in takes:
        joints = rotate(CAMERA_FROM_SOURCE.T, take.joints)
        with torch.no_grad():
            R, residual = (x.double().numpy() for x in answer(net, torch.from_numpy(joints).float()))
        found, unstated = CAMERA_FROM_SOURCE @ R, np.full(len(R), np.nan)
        own.append(compare(take, found, unstated, rotate(R, joints) + residual))
        back.append(compare(take, found, unstated, rotate(transpose(R), joints)))
    return own, back
