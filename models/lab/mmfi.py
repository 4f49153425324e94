"""The paper's table, for users who have MM-Fi:  pcnet3d lab mmfi TREE -o DIR

One network for each protocol, each tested on the people of every protocol, beside the geometric baseline. Stopped, the
same command goes on. DIR gets mmfi.md, mmfi.json, and a folder for each network.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

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
from .evaluation.rectifiers import Judged, Take, clean_takes, compare, judge, together
from .evaluation.tables import Page, Table, written
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


_PAGE = Page(
    "MM-Fi",
    "Protocols of the data set's toolbox, activities {activities}, targets {targets}, the paper's views; "
    "{steps:,} steps of {batch:,} poses. Rotation is p50 / mean / p95, the others are means. MPJPE and PA-MPJPE are "
    "of the pose with what the residual head adds, turned only is without; the scale is fitted frame by frame, or as "
    "it comes, as in the paper. The last column is what the paper's published code calls degrees.",
    [
        Table(
            "",
            "rows/*",
            [],
            {
                "trained on": "{trained}", "tested on": "{tested}", "frames": "{frames:,}",
                "of people trained on": "{known people:.0%}", "rotation, deg": "{rotation}",
                "MPJPE, mm": "{mpjpe.mean:.1f}", "as it comes, mm": "{unscaled.mean:.1f}",
                "PA-MPJPE, mm": "{pa_mpjpe.mean:.1f}",
                "MPJPE turned only, mm": "{turned only.mean:.1f}", "Frobenius 'deg'": "{frobenius.mean:.1f}",
            },
        )
    ],
)  # fmt: skip


def mmfi(
    tree: Annotated[Path, typer.Argument(help="The data set's folder, with E01 to E04 in it.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for networks and table.")],
    steps: Annotated[int | None, typer.Option(min=1, help="Training steps, instead of the config's.")] = None,
    protocols: Annotated[
        list[str], typer.Option("--protocol", help="S1, S2 or S3, trained and tested; repeatable.")
    ] = ["S2", "S3"],  # noqa: B006 (typer copies it)
    activities: Annotated[Activities, typer.Option(help="Daily, rehabilitation or all actions.")] = "P3",
    config: Annotated[
        Path | None, typer.Option(help="Training config instead of models/lab/training/rectifier/mmfi.toml.")
    ] = None,
    device: Annotated[
        str, typer.Option(help="Where to train: auto (a GPU where there is one), cpu or cuda.")
    ] = "auto",
    threads: Annotated[int, typer.Option(min=1, help="CPU threads.")] = 4,
) -> None:
    """Train on MM-Fi by its protocols and print the paper's table."""
    with needed_for("Training"):
        import torch

        from .training.rectifier.train import TrainConfig, train
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
    for name, run in runs.items():
        counts = [f"{len(names)} {part}" for part, names in splits[name].items() if part != "by"]
        print(f"{name}: {', '.join(counts)} clips")
        train(run, as_toml(run), output / name, device)
    # What onnxruntime can use is not what torch can; the exported networks are judged where it offers.
    with computing_on(CPU if device == CPU else AUTO) as where:
        rows = table(runs, output)
    run = next(iter(runs.values()))
    results = {
        "rows": rows, "activities": activities, "targets": run.targets, "steps": run.schedule.steps, "batch": run.batch
    }  # fmt: skip
    text = written(results, _PAGE)
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


def table(runs: dict[str, TrainConfig], output: Path) -> list[dict[str, Any]]:
    """A row for every test part and every network, GEOMETRIC first: Judged.row's figures of the exported network, the
    poses with what its residual head adds, and the share of the tested frames whose people it was trained on."""
    from .training.rectifier.train import best_of, parts_of

    parts = {name: parts_of(run) for name, run in runs.items()}
    rows = []
    for tested, run in runs.items():
        takes = clean_takes(parts[tested].clips["test"], "paper", targets=run.targets)
        every = np.ones(sum(len(take.R) for take in takes), dtype=bool)
        baseline = judge(Geometric(), takes).row(every)
        rows.append({"trained": "geometric", "tested": tested, "turned only": baseline["mpjpe"], **baseline})
        for trained, other in runs.items():
            row = judge(PCNetRectifier(output / trained / "pcnet.onnx"), takes).row(every)
            net = best_of(other, output / trained)
            whole = together([judge_net(net, take, other.symmetric) for take in takes]).row(every)
            row |= {
                "turned only": row["mpjpe"],
                **{name: whole[name] for name in ("mpjpe", "unscaled", "pa_mpjpe")},
            }
            known = known_share(parts[trained], parts[tested].clips["test"])
            rows.append({"trained": trained, "tested": tested, "known people": known, **row})
    return rows


def known_share(parts: Parts, test: Sequence[Clip]) -> float:
    """Share of the frames of `test` whose people are in the train or val part of another split."""
    people = {clip.subject for part in ("train", "val") for clip in parts.clips[part]}
    return sum(len(clip) for clip in test if clip.subject in people) / sum(map(len, test))


def judge_net(net: PCNet, take: Take, symmetric: bool) -> Judged:
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
    return together(parts)
