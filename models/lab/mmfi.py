"""The paper's table, for users who have MM-Fi:  pcnet3d lab mmfi TREE -o DIR

One network for each protocol, each tested on the people of every protocol, beside the geometric baseline. Stopped, the
same command goes on. DIR gets mmfi.md, mmfi.json, and a folder for each network.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from typer import Argument, Option

from ...pipeline.core.device import AUTO, CPU, computing_on
from ...pipeline.core.errors import InputError
from ...pipeline.core.extras import needed_for
from ...pipeline.core.rotations import rotate, transpose
from ...pipeline.files.atomic import write_json, write_text
from ...pipeline.reading.mocap import Clip
from ...pipeline.running.recipe import load_toml
from ..common.metrics import plain
from ..rectifier.geometric import Geometric
from ..rectifier.onnx import PCNetRectifier
from .common.toml_config import as_toml, checked
from .evaluation.people import OfTake
from .evaluation.rectifiers import Take, clean_takes, compare, judge, row
from .evaluation.tables import written
from .mocap.clips import Parts
from .mocap.convert import read_folder
from .mocap.files import write_mocap
from .mocap.mmfi import Activities, protocol
from .training import rectifier as training

if TYPE_CHECKING:
    from .training.rectifier.net import PCNet
    from .training.rectifier.train import TrainConfig

_CHUNK = 1024
_VALIDATED = 10  # every so many of those to train on choose the best weights; the toolbox has no such part


_ABOUT = (
    "Protocols of the data set's toolbox, the paper's views. Rotation in degrees, MPJPE and PA-MPJPE in mm of the "
    "pose with what the residual head adds, turned only: without; the scale is fitted frame by frame, or as it comes "
    "(unscaled), as in the paper. frobenius: what the paper's published code calls degrees. known people: the share "
    "of tested frames of people trained on."
)


def mmfi(
    tree: Annotated[Path, Argument(help="The data set's folder, with E01 to E04 in it.")],
    output: Annotated[Path, Option("-o", "--output", help="Folder for networks and table.")],
    steps: Annotated[int | None, Option(min=1, help="Training steps, instead of the config's.")] = None,
    protocols: Annotated[list[str], Option("--protocol", help="S1, S2 or S3; repeatable.")] = ["S2", "S3"],  # noqa: B006 (typer copies it)
    activities: Annotated[Activities, Option(help="Daily, rehabilitation or all actions.")] = "P3",
    config: Annotated[Path | None, Option(help="Training config, instead of mmfi.toml.")] = None,
    device: Annotated[str, Option(help="Where to train: auto, cpu or cuda.")] = "auto",
    threads: Annotated[int, Option(min=1, help="CPU threads.")] = 4,
) -> None:
    """Train on MM-Fi by its protocols and print the paper's table."""
    with needed_for("Training"):
        import torch

        from .common.training import device_of
        from .training.rectifier.train import TrainConfig, step_s, train
    torch.set_num_threads(threads)
    clips, notes = read_folder(tree, "mmfi")
    for note in notes:
        print(f"note: {note}")
    splits = {name: split_of(clips, name, activities) for name in dict.fromkeys(protocols)}
    source = config or Path(training.__file__).with_name("mmfi.toml")
    content = load_toml(source, "a training config")
    if steps is not None:
        content["schedule"] = {**content.get("schedule", {}), "steps": steps}
    output.mkdir(parents=True, exist_ok=True)
    write_mocap(output / "clips.npz", clips)
    runs = {}
    for name, split in splits.items():
        # Other activities are another split: a network's config keeps naming the one that it was trained on.
        listed = output / f"{name}-{activities}.json"
        write_json(listed, split)
        paths = {"data": output / "clips.npz", "split": listed}
        runs[name] = checked({**content, **paths}, TrainConfig, str(source))
    one = next(iter(runs.values()))
    hours = len(runs) * one.schedule.steps * step_s(one, device_of(device)) / 3600
    print(
        f"{len(runs)} trainings of {one.schedule.steps:,} steps, about {hours:.2g} h on {device}; stopped, the same "
        "command goes on",
        flush=True,
    )
    for name, run in runs.items():
        counts = [f"{len(names)} {part}" for part, names in splits[name].items() if part != "by"]
        print(f"{name}: {', '.join(counts)} clips")
        train(run, as_toml(run), output / name, device)
    # What onnxruntime can use is not what torch can; the exported networks are judged where it offers.
    with computing_on(CPU if device == CPU else AUTO) as where:
        rows = table(runs, output)
    said = {"targets": one.targets, "steps": one.schedule.steps, "batch": one.batch}
    results = {"activities": activities, **said, "rows": rows}
    text = written(results, "MM-Fi", _ABOUT)
    write_json(output / "mmfi.json", plain({"rows": rows, "device": where.summary()}))
    write_text(output / "mmfi.md", text)
    print(text)


def split_of(clips: Sequence[Clip], name: str, activities: Activities) -> dict[str, Any]:
    """What mocap.clips.read_parts reads: the protocol as far as the clips go, by clip, with people (for S1: clips) of
    its train part kept for validation. InputError when a part is empty."""
    train, test = protocol(name, activities)
    of = {(clip.subject, clip.name[-3:]): clip.name for clip in clips}
    to_train = sorted(key for key in train if key in of)
    units = to_train if name == "S1" else sorted({subject for subject, _ in to_train})
    kept = set(units[::_VALIDATED])
    split = {
        "by": "clip",
        "train": [of[key] for key in to_train if not {key, key[0]} & kept],
        "val": [of[key] for key in to_train if {key, key[0]} & kept],
        "test": [of[key] for key in sorted(test) if key in of],
    }
    if empty := [part for part, names in split.items() if not names]:
        raise InputError(
            "nothing-usable",
            f"Expected recordings for {name} of MM-Fi, two people to train on and one to test, but {', '.join(empty)} "
            "has none.",
        )
    return split


def table(runs: dict[str, TrainConfig], output: Path) -> dict[str, dict[str, dict[str, Any]]]:
    """{tested on: {trained on: figures}}, GEOMETRIC first: figures (rectifiers.row) of the exported network, the poses
    with what its residual head adds, and the share of the tested frames whose people it was trained on."""
    from .training.rectifier.train import best_of, parts_of

    parts = {name: parts_of(run) for name, run in runs.items()}
    rows: dict[str, dict[str, dict[str, Any]]] = {}
    for tested, run in runs.items():
        takes = clean_takes(parts[tested].clips["test"], "paper", targets=run.targets)
        baseline = row(judge(Geometric(), takes))
        rows[tested] = {"geometric": {**baseline, "turned only": baseline["mpjpe"]}}
        for trained, other in runs.items():
            turned = row(judge(PCNetRectifier(output / trained / "pcnet.onnx"), takes))
            net = best_of(other, output / trained)
            whole = row([part for take in takes for part in judge_net(net, take, other.symmetric)])
            rows[tested][trained] = {
                **turned,
                **{name: whole[name] for name in ("mpjpe", "unscaled", "pa_mpjpe")},
                "turned only": turned["mpjpe"],
                "known people": known_share(parts[trained], parts[tested].clips["test"]),
            }
    return rows


def known_share(parts: Parts, test: Sequence[Clip]) -> float:
    """Share of the frames of `test` whose people are in the train or val part of another split."""
    people = {clip.subject for part in ("train", "val") for clip in parts.clips[part]}
    return sum(len(clip) for clip in test if clip.subject in people) / sum(map(len, test))


def judge_net(net: PCNet, take: Take, symmetric: bool) -> list[OfTake]:
    """Like rectifiers.judge, but of what the residual head made of the pose as well, which the exported network does
    not tell: the corrected pose, in the camera's axes, is canonicalised with the deployed rotation."""
    import torch

    from .training.rectifier.net import rotate as turned
    from .training.rectifier.train import Deployed

    deployed, parts = Deployed(net, symmetric), []
    for start in range(0, len(take.R), _CHUNK):
        part = take.some(slice(start, start + _CHUNK))
        joints = torch.from_numpy(part.joints.astype(np.float32))
        valid = torch.ones(joints.shape[:2])
        with torch.no_grad():
            R, error_deg = (x.double().numpy() for x in deployed(joints, valid))
            answer = net(joints, valid)
            pose = turned(answer.R, answer.canonical).double().numpy()
        parts.append(compare(part, R, error_deg, rotate(transpose(R), pose)))
    return parts
