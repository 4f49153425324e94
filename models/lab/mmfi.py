"""The paper's table, for users who have MM-Fi:  pcnet3d lab mmfi TREE -o DIR

One network for each protocol, tested on the people of its own, beside the geometric baseline. Stopped, the same command
goes on. DIR gets mmfi.md, mmfi.json, and a folder for each network.

MM-Fi (Yang et al. 2023): E0x/Sxx/Axx/ground_truth.npy, 40 people, 27 actions, 10 frames a second, one camera. Joints
are mapped by index, order A of formats.md; the names that are printed for this data set elsewhere are mirrored
(formats.md section 7.1). A clip has the paper's axes, x away from the sensor, y left, z up, as the sensor stands: how
it was mounted is not published, so +Z is up but for the sensor's own tilt.

The protocols are those of the data set's toolbox: github.com/ybhbingo/MMFi_dataset @ 269f648, mmfi_lib/mmfi.py
(decode_config) and config.yaml.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
from typer import Argument, Option

from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import rotate, transpose
from ...pipeline.files.arrays import load
from ...pipeline.files.skeletons import leg_length, upright_share
from ...pipeline.running.progress import each
from ...pipeline.running.recipe import load_toml
from ..rectifier.load import Geometric
from .cases import Cases
from .clips import Clip
from .data import require_sides
from .evaluation.evaluate import publish
from .evaluation.rectifiers import Take, clean_takes, compare, judge, summary
from .synthetic import CAMERA_FROM_SOURCE
from .training.loop import Device, checked
from .training.rectifier import Deployed, TrainConfig, step_s, train

PATTERN = "E[0-9][0-9]/S[0-9][0-9]/A[0-9][0-9]/ground_truth.npy"
FPS = 10.0
SUBJECTS = tuple(f"S{i:02d}" for i in range(1, 41))
# Who is tested, of all 40, in all actions: across subjects every fifth, across environments those recorded in E04.
PROTOCOLS = {"S2": set(SUBJECTS[4::5]), "S3": set(SUBJECTS[30:])}
# Every so many people of those to train on choose the best weights; the toolbox has no such part.
_VALIDATED = 10
_LEG_M = (0.5, 1.15)

_ABOUT = (
    "Protocols of the data set's toolbox, the paper's views. Rotation in degrees, MPJPE and PA-MPJPE in mm of the "
    "pose with what the residual head adds, turned only: without; the scale is fitted frame by frame, or as it comes "
    "(unscaled), as in the paper. frobenius: what the paper's published code calls degrees."
)


def mmfi(
    tree: Annotated[Path, Argument(help="The data set's folder, with E01 to E04 in it.")],
    output: Annotated[Path, Option("-o", "--output", help="Folder for networks and table.")],
    config: Annotated[Path | None, Option(help="Training config, instead of mmfi.toml.")] = None,
    device: Annotated[Device, Option(help="Where to train; auto: a GPU if there is one.")] = "auto",
    threads: Annotated[int, Option(min=1, help="CPU threads.")] = 4,
) -> None:
    """Train on MM-Fi by its protocols S2 and S3 and print the paper's table."""
    torch.set_num_threads(threads)
    clips = read_tree(tree)
    source = config or Path(__file__).parent / "training" / "mmfi.toml"
    run = checked(load_toml(source, "a training config"), TrainConfig, str(source))
    splits = {name: split_of(clips, tested) for name, tested in PROTOCOLS.items()}
    hours = len(splits) * run.schedule.steps * step_s(run, device, splits["S2"]["train"]) / 3600
    print(
        f"{len(splits)} trainings take about {hours:.2g} h, less what an earlier start has trained",
        flush=True,
    )
    rows: dict[str, dict[str, Any]] = {}
    for name, split in splits.items():
        print(f"{name}: {', '.join(f'{len(of)} clips {part}' for part, of in split.items())}")
        deployed = train(run, output / name, device, split)
        takes = clean_takes(split["test"], "paper", targets=run.targets)
        baseline = summary(judge(Geometric(), takes))
        rows[name] = {
            "geometric": {**baseline, "turned only": baseline["mpjpe"]},
            "pcnet": judge_net(deployed, takes),
        }
    said = {"targets": run.targets, "steps": run.schedule.steps, "batch": run.batch}
    publish(output / "mmfi", "MM-Fi", _ABOUT, {**said, "rows": rows})


def read_tree(tree: Path) -> list[Clip]:
    """The recordings of a tree, named by subject and action ("S05_A13"). InputError where there is none, for a file
    that is no such recording, and of recordings that contradict what is assumed of their joints."""
    files = sorted({*tree.glob(PATTERN), *tree.glob(f"*/{PATTERN}")})
    if not files:
        raise InputError("nothing-usable", f"Expected recordings as {PATTERN} in {tree}, found none.")
    clips = []
    for path in each(files, "files", len(files)):
        environment, subject, action = path.parts[-4:-1]
        if subject not in SUBJECTS or environment != f"E{(int(subject[1:]) - 1) // 10 + 1:02d}":
            raise InputError("name-unknown", f"{path}: MM-Fi has no {environment}/{subject}.")
        joints = load(path, ("frames", 17, 3)).astype(np.float64)
        world = rotate(CAMERA_FROM_SOURCE.T, joints).astype(np.float32)
        if not (np.isfinite(world).all() and _LEG_M[0] <= leg_length(world) <= _LEG_M[1]):
            raise InputError("wrong-content", f"{path}: expected all joints in every frame, in metres.")
        clips.append(Clip(f"{subject}_{action}", subject, "mmfi", FPS, world))
    # What is assumed of the joints' order and axes.
    joints = np.concatenate([clip.joints for clip in clips])
    require_sides(joints)
    hips = joints[:, H36M17.index("l_hip")] - joints[:, H36M17.index("r_hip")]
    stand, face = upright_share(joints), float((hips[:, 1] < 0).mean())  # who faces -x has the left at -y
    if min(stand, face) < 0.5:
        raise InputError(
            "wrong-axes",
            "Expected people who stand and face MM-Fi's sensor, x right, y down, z away, but only "
            f"{100 * min(stand, face):.0f} % of the frames do.",
        )
    return clips


def split_of(clips: Sequence[Clip], tested: Set[str]) -> dict[str, list[Clip]]:
    """The clips of each part of a protocol, with people of its train part kept for validation. InputError when a part
    is empty."""
    kept = set(sorted({clip.subject for clip in clips} - tested)[::_VALIDATED])
    split: dict[str, list[Clip]] = {"train": [], "val": [], "test": []}
    for clip in clips:
        part = "test" if clip.subject in tested else "val" if clip.subject in kept else "train"
        split[part].append(clip)
    if empty := [part for part, of in split.items() if not of]:
        raise InputError(
            "nothing-usable",
            "Expected recordings of MM-Fi, two people to train on and one to test in each protocol, but "
            f"{', '.join(empty)} has none.",
        )
    return split


def judge_net(deployed: Deployed, takes: Sequence[Take]) -> dict[str, Any]:
    """Figures of what a network answers, but of the pose with what the residual head made of it, which an exported
    network does not tell: in the camera's axes, canonicalised with the deployed rotation."""
    whole: list[Cases] = []
    bare: list[Cases] = []
    for take in takes:
        joints = torch.from_numpy(take.joints.astype(np.float32))
        valid = torch.ones(joints.shape[:2])
        with torch.no_grad():
            R, error_deg = (x.double().numpy() for x in deployed(joints, valid))
            answer = deployed.net(joints, valid)
        pose = rotate(answer.R.double().numpy(), answer.canonical.double().numpy())
        whole.append(compare(take, R, error_deg, rotate(transpose(R), pose)))
        bare.append(compare(take, R, error_deg, rotate(transpose(R), take.joints.astype(np.float64))))
    return {**summary(whole), "turned only": summary(bare)["mpjpe"]}
