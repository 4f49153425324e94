"""Fit all that rests on the networks anew:  pcnet3d lab refit -o DIR

To be run after a new lifter or rectifier, with the new networks in their places.
Each step writes its own file into DIR, and puts it in its place in the package, for the next ones rest on it. A step
whose file is there is not taken again: the same command goes on where it was stopped, and to take a step anew, delete
its file and those of the steps behind it. The last step judges what the others fitted, before other cameras.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

from typer import Option

from ....pipeline.core.errors import InputError
from ....pipeline.files.atomic import refuse_unwritable, whole_file, write_json
from ...angle_error.joint_noise import NOISE_FILE
from ...angle_error.repeatability import REPEATABILITY_FILE
from ...lifter.load import load_lifter
from ...rectifier.load import load_rectifier
from ..evaluation.errors import FITTED
from ..evaluation.evaluate import evaluate
from . import joint_noise, visits

_JUDGED_SEED = 5  # of cameras and detectors, that nothing is fitted on
_NETWORKS = "networks.json"


@dataclass(frozen=True)
class Step:
    """made: the file that it writes, under DIR. do: writes it, given its path. place: of that file in the package; None
    of one that only people read."""

    made: str
    do: Callable[[Path], object]
    place: Path | None = None


def steps() -> list[Step]:
    """All of them, in the order in which they rest on each other."""
    return [
        Step("modes.json", joint_noise.learn, NOISE_FILE),
        Step("angles/joint_noise.json", partial(kit, 0, True), NOISE_FILE),
        Step("repeatability.json", visits.learn, REPEATABILITY_FILE),
        Step("judged/evaluation.json", partial(kit, _JUDGED_SEED, False)),
    ]


def kit(seed: int, fit: bool, output: Path) -> None:
    """Stated errors by the kit: fitted in the configurations that they are fitted in, or judged in all."""
    evaluate("errors", output.parent, seed=seed, part=FITTED if fit else None, fit=fit or None)


def take_steps(folder: Path, of: Sequence[Step]) -> None:
    """Take the steps that are left. InputError for a folder of other networks."""
    networks = {"lifter": load_lifter().method, "rectifier": load_rectifier("pcnet").method}
    said = folder / _NETWORKS
    if said.exists() and json.loads(said.read_text(encoding="utf-8")) != networks:
        raise InputError(
            "files-apart",
            f"Expected a folder of {networks['lifter']} and {networks['rectifier']}, but {folder} was begun for "
            "other networks; choose another -o.",
        )
    folder.mkdir(parents=True, exist_ok=True)
    write_json(said, networks)
    for number, step in enumerate(of, start=1):
        made = folder / step.made
        print(f"{number} of {len(of)}: {made}{' is there' if made.exists() else ''}", flush=True)
        if not made.exists():
            made.parent.mkdir(parents=True, exist_ok=True)
            # A process of its own: files of the package are read once in each.
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
                pool.submit(step.do, made).result()
        if step.place is not None:
            with whole_file(step.place) as partial_file:
                shutil.copyfile(made, partial_file)


def refit(output: Annotated[Path, Option("-o", "--output", help="Folder of the steps' files.")]) -> None:
    """Fit all that rests on the networks anew, and judge it."""
    refuse_unwritable(output)
    take_steps(output.absolute(), steps())
