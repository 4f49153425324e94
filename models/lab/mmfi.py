"""The paper's table, for users who have MM-Fi:  pcnet3d lab mmfi TREE -o DIR

One network for each protocol, tested on the people of its own, beside the geometric baseline. Stopped, the same command
goes on. DIR gets mmfi.md, mmfi.json, and a folder for each network.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from typer import Argument, Option

from ...pipeline.core.errors import InputError, needed_for
from ...pipeline.core.rotations import rotate, transpose
from ...pipeline.files.atomic import write_json
from ...pipeline.running.recipe import load_toml
from ..rectifier.geometric import Geometric
from . import training
from .common.config import checked
from .common.metrics import OfTake
from .evaluation.evaluate import publish
from .evaluation.rectifiers import Take, clean_takes, compare, judge, row
from .mocap.clips import Clip
from .mocap.convert import read_folder, write_mocap
from .mocap.mmfi import PROTOCOLS

if TYPE_CHECKING:
    from .training.rectifier import PCNet

# Every so many people of those to train on choose the best weights; the toolbox has no such part.
_VALIDATED = 10

_ABOUT = (
    "Protocols of the data set's toolbox, the paper's views. Rotation in degrees, MPJPE and PA-MPJPE in mm of the "
    "pose with what the residual head adds, turned only: without; the scale is fitted frame by frame, or as it comes "
    "(unscaled), as in the paper. frobenius: what the paper's published code calls degrees."
)


def mmfi(
    tree: Annotated[Path, Argument(help="The data set's folder, with E01 to E04 in it.")],
    output: Annotated[Path, Option("-o", "--output", help="Folder for networks and table.")],
    config: Annotated[Path | None, Option(help="Training config, instead of mmfi.toml.")] = None,
    device: Annotated[str, Option(help="Where to train: auto, cpu or cuda.")] = "auto",
    threads: Annotated[int, Option(min=1, help="CPU threads.")] = 4,
) -> None:
    """Train on MM-Fi by its protocols S2 and S3 and print the paper's table."""
    with needed_for("Training"):
        import torch

        from .training.rectifier import TrainConfig, best_of, parts_of, step_s, train
    torch.set_num_threads(threads)
    clips, notes = read_folder(tree, "mmfi")
    for note in notes:
        print(f"note: {note}")
    splits = {name: split_of(clips, name) for name in PROTOCOLS}
    source = config or Path(training.__file__).with_name("mmfi.toml")
    content = {**load_toml(source, "a training config"), "data": output / "clips.npz"}
    output.mkdir(parents=True, exist_ok=True)
    write_mocap(output / "clips.npz", clips)
    runs = {}
    for name, split in splits.items():
        listed = output / f"{name}.json"
        write_json(listed, split)
        runs[name] = checked({**content, "split": listed}, TrainConfig, str(source))
        print(
            f"{name}: {', '.join(f'{len(split[part])} {part}' for part in ('train', 'val', 'test'))} people"
        )
    hours = len(runs) * runs["S2"].schedule.steps * step_s(runs["S2"], device) / 3600
    print(
        f"{len(runs)} trainings take about {hours:.2g} h, less what an earlier start has trained", flush=True
    )
    rows: dict[str, dict[str, Any]] = {}
    for name, run in runs.items():
        train(run, output / name, device)
        takes = clean_takes(parts_of(run)["test"], "paper", targets=run.targets)
        baseline = row(judge(Geometric(), takes))
        rows[name] = {
            "geometric": {**baseline, "turned only": baseline["mpjpe"]},
            "pcnet": judge_net(best_of(run, output / name), takes, run.symmetric),
        }
    run = runs["S2"]
    said = {"targets": run.targets, "steps": run.schedule.steps, "batch": run.batch}
    publish(output / "mmfi", "MM-Fi", _ABOUT, {**said, "rows": rows})


def split_of(clips: Sequence[Clip], name: str) -> dict[str, Any]:
    """What mocap.clips.read_parts reads: the protocol as far as the clips go, with people of its train part kept for
    validation. InputError when a part is empty."""
    tested = PROTOCOLS[name]
    to_train = sorted({clip.subject for clip in clips} - tested)
    kept = set(to_train[::_VALIDATED])
    people = {
        "train": [subject for subject in to_train if subject not in kept],
        "val": sorted(kept),
        "test": sorted({clip.subject for clip in clips} & tested),
    }
    if empty := [part for part, names in people.items() if not names]:
        raise InputError(
            "nothing-usable",
            f"Expected recordings for {name} of MM-Fi, two people to train on and one to test, but {', '.join(empty)} "
            "has none.",
        )
    return people


def judge_net(net: PCNet, takes: Sequence[Take], symmetric: bool) -> dict[str, Any]:
    """Figures (rectifiers.row) of what the deployed network answers, but of the pose with what the residual head made
    of it, which an exported network does not tell: in the camera's axes, canonicalised with the deployed rotation."""
    import torch

    from .training.rectifier import Deployed
    from .training.rectifier import rotate as turned

    deployed = Deployed(net, symmetric)
    whole: list[OfTake] = []
    bare: list[OfTake] = []
    for take in takes:
        joints = torch.from_numpy(take.joints.astype(np.float32))
        valid = torch.ones(joints.shape[:2])
        with torch.no_grad():
            R, error_deg = (x.double().numpy() for x in deployed(joints, valid))
            answer = net(joints, valid)
            pose = turned(answer.R, answer.canonical).double().numpy()
        whole.append(compare(take, R, error_deg, rotate(transpose(R), pose)))
        bare.append(compare(take, R, error_deg, rotate(transpose(R), take.joints.astype(np.float64))))
    return {**row(whole), "turned only": row(bare)["mpjpe"]}
