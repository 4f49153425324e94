"""Fit the errors of angles and of differences anew:  pcnet3d lab refit -o DIR

To be run after a new lifter or rectifier, with the new networks in their places. Each step writes its own file into
DIR, and puts it in its place in the package, for the next ones rest on it. A step whose file is there is not taken
again: the same command goes on where it was stopped, and to take a step anew, delete its file and those of the steps
behind it. The last step judges what the others fitted, before other cameras.
"""

from __future__ import annotations

import json
import shutil
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Literal, get_args

import numpy as np
import torch
from torch import Tensor
from typer import Option

from ...pipeline.core.camera import pitch_roll_deg, view_rotation
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import Measure
from ...pipeline.core.rotations import rotate
from ...pipeline.files.atomic import refuse_unwritable, whole_file, write_json, write_text
from ...pipeline.running.progress import each
from ...pipeline.signals.angles import ANGLES, of_both
from ..angle_error.joint_noise import NOISE_FILE, shipped_noise
from ..angle_error.repeatability import REPEATABILITY_FILE, Between, figure_of, range_sd, same_part, shipped
from ..lifter.load import load_lifter
from ..rectifier.load import load_rectifier
from .beds import (
    BEDS,
    Configuration,
    Finished,
    given,
    recipe_of,
    see,
)
from .cases import Cases, grouped
from .clips import Clip, lying, read_clips
from .evaluation.errors import FITTED, STRANGERS, Compared, factor, ranges
from .evaluation.evaluate import evaluate
from .synthetic import Cameras, NumpyDraw, ViewRange, place

_JUDGED_SEED = 5  # of cameras and detectors, that nothing is fitted on


# The files that steps write under DIR, in the order in which they rest on each other: who writes it, given its path,
# and its place in the package; None of one that only people read.
Steps = Mapping[str, tuple[Callable[[Path], object], Path | None]]


def steps() -> Steps:
    """All of them."""
    return {
        "angles/joint_noise.json": (partial(kit, 0, True), NOISE_FILE),
        "repeatability.json": (learn_differences, REPEATABILITY_FILE),
        "judged/evaluation.json": (partial(kit, _JUDGED_SEED, False), None),
    }


def kit(seed: int, fit: bool, output: Path) -> None:
    """Stated errors by the kit: fitted in the configurations that they are fitted in, or judged in all."""
    evaluate("errors", output.parent, seed=seed, part=FITTED if fit else None, fit=fit or None)


def take_steps(folder: Path, of: Steps) -> None:
    """Take the steps that are left. InputError for a folder of other networks."""
    networks = {"lifter": load_lifter().method, "rectifier": load_rectifier("pcnet").method}
    said = folder / "networks.json"
    if said.exists() and json.loads(said.read_text(encoding="utf-8")) != networks:
        raise InputError(
            "files-apart",
            f"Expected a folder of {networks['lifter']} and {networks['rectifier']}, but {folder} was begun for "
            "other networks; choose another -o.",
        )
    folder.mkdir(parents=True, exist_ok=True)
    write_json(said, networks)
    for number, (name, (do, put_in)) in enumerate(of.items(), start=1):
        made = folder / name
        print(f"{number} of {len(of)}: {made}{' is there' if made.exists() else ''}", flush=True)
        if not made.exists():
            made.parent.mkdir(parents=True, exist_ok=True)
            # A process of its own: files of the package are read once in each.
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
                pool.submit(do, made).result()
        if put_in is not None:
            with whole_file(put_in) as partial_file:
                shutil.copyfile(made, partial_file)


def refit(output: Annotated[Path, Option("-o", "--output", help="Folder of the steps' files.")]) -> None:
    """Fit the errors of angles and of differences anew, and judge all that runs state."""
    refuse_unwritable(output)
    take_steps(output.absolute(), steps())


# The errors of differences, on virtual visits. A motion of a validation person is filmed, and filmed again: from the
# same tripod, from a tripod that was set up again, and from elsewhere. Nothing has changed, so what the figures of both
# runs differ by is their difference's error; and in each run ranges of motion and right less left are held against the
# truth (evaluation/errors.py). Fitted are what the errors of ranges are made of, their parts in place times the factor
# that makes them hold; and for every figure the factor on the errors of both, added as independent ones, that brings
# nine in ten differences inside, every person counting the same. One draw of cameras and detectors tells little of so
# few people: there are several.

# What an error is of: a difference, or a range; and the figure.
Kind = tuple[Between | Literal["range"], str]
Kinds = Mapping[Kind, Sequence[Cases]]
_DRAWS = 2  # of cameras and detectors
_RANGE = "range_of_motion."
_LEAST_S, _LONGEST_S = 1.0, 10.0  # of a motion; of a longer one, its beginning
_LYING = 0.1  # of the frames, of a motion that is left out
# Of a tripod that is set up again: standard deviation of yaw, greatest change of pitch and roll, in degrees; of the
# distance, a share; of where in the image the person is, as a share of the distance.
_YAW_DEG, _PITCH_DEG, _DISTANCE, _AIM = 3.0, 2.0, 0.1, 0.03
_ELSEWHERE_DEG = 60.0  # about the vertical, at least
_MARGIN = 0.98  # of the half image, which holds every joint
FEWEST_PEOPLE, FEWEST_PAIRS = 8, 60  # one of them, for a factor
_AGAIN = 1000  # by which a second visit's seed is larger than the first one's
_CONFIGURATIONS = [
    Configuration(image=image, bed=bed) for image in (False, True) for bed in ("typical", "wild")
]


def visits(clip: Clip, asked: Configuration) -> Iterator[tuple[Kind, Cases]]:
    """The figures of a clip's pairs of visits, of which the first is the same in all: "again" from the same tripod and
    from one that was set up again, and "elsewhere"; and of every run the pairs within it and its ranges (`_within`)."""
    rng = np.random.default_rng([asked.seed, zlib.crc32(clip.name.encode()), 4])
    world = torch.from_numpy(clip.joints[None].astype(np.float64))
    views = BEDS[asked.bed]
    first = place(world, NumpyDraw(rng), views)
    again, other = set_up_again(first, world, rng), elsewhere(first, world, rng, views)
    pipeline = recipe_of(asked).with_options("measures", repeat=[*ANGLES]).build()

    def visit(cameras: Cameras, seed: int) -> Finished:
        truth, how = see(clip, seed, cameras=cameras), replace(asked, seed=seed)
        return Finished(pipeline(given(truth, how)), truth, "", how)

    before = visit(first, asked.seed)
    figures = _figures(before)
    yield from _within(before)
    pairs: list[tuple[Between, Cameras]] = [("again", first), ("again", again), ("elsewhere", other)]
    for kind, camera in pairs:
        after = visit(camera, _AGAIN + asked.seed)
        yield from _within(after)
        for key, second in _figures(after).items():
            row = figures.get(key)
            if row is None or row.error is None or second.error is None:
                continue
            if same_part(before.done.figures.group(*row.group), after.done.figures.group(*second.group)):
                error = float(np.hypot(row.error, second.error))
                yield (kind, key[0]), after.figure(second.value - row.value, 0.0, error)


def _within(run: Finished) -> Iterator[tuple[Kind, Cases]]:
    """Pairs of sides of one run, and its ranges."""
    of, groups = _ranges(run), run.done.figures.group("range_of_motion")
    for name, this in of.items():
        both = of_both(name)
        yield ("range", both), run.figure(this.found, this.true, this.error)
        left = f"l_{both}"
        if name.startswith("r_") and left in of and same_part(groups.group(name), groups.group(left)):
            yield ("sides", _RANGE + both), run.figure(*of[left].less(this))


def _ranges(run: Finished) -> dict[str, Compared]:
    """With the errors by the parts in place, whichever lifter they were fitted to."""
    lasts_s = float(run.truth.time_s[-1])
    return {
        name: of._replace(error=range_sd(of_both(name), of.found, of.ends, lasts_s))
        for name, of in ranges(run).items()
    }


def _figures(run: Finished) -> dict[tuple[str, str], Measure]:
    """Those that two visits are compared by, by figure and side."""
    figures, of, found = run.done.figures, _ranges(run), {}
    gait = figures.group("walking").text("gait")
    for row in figures:
        if not isinstance(row, Measure) or (figure := figure_of(row, gait)) is None:
            continue
        if row.group[0] == "range_of_motion" and row.group[1] in of:
            row = replace(row, error=of[row.group[1]].error)
        found[figure, row.side] = row
    return found


def set_up_again(first: Cameras, world: Tensor, rng: np.random.Generator) -> Cameras:
    """The camera (1,) about where it was, as far away as every joint (1, T, J, 3) stays inside the image."""
    R, place = first.R_camera_from_world[0, 0].numpy(), first.position[0].numpy()
    pitch, roll = pitch_roll_deg(R[:, 2])
    yaw = np.degrees(np.arctan2(R[2, 1], R[2, 0])) + _YAW_DEG * rng.standard_normal()
    pitch, roll = np.array([pitch, roll]) + rng.uniform(-_PITCH_DEG, _PITCH_DEG, 2)
    points = world.reshape(-1, 3).numpy()
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    offset = rotate(R, (centre - place)[None])[0]
    distance = float(np.linalg.norm(offset))
    offset = offset * rng.uniform(1 - _DISTANCE, 1 + _DISTANCE)
    offset[:2] += _AIM * distance * rng.standard_normal(2)
    turned = view_rotation(np.array(yaw), np.array(pitch), np.array(roll))
    while True:
        cameras = replace(
            first,
            R_camera_from_world=torch.from_numpy(turned[None, None]),
            position=torch.from_numpy(centre[None] - rotate(turned.T, offset[None])),
        )
        joints, half = cameras.to_camera(world), cameras.image_size[0] / 2
        off = (cameras.project(joints)[0] - half).abs()
        if (joints[..., 2] > 0).all() and (off <= _MARGIN * half).all():
            return cameras
        offset = offset * [0.97, 0.97, 1.02]


def elsewhere(first: Cameras, world: Tensor, rng: np.random.Generator, views: ViewRange) -> Cameras:
    """Another camera (1,) of these views that sees every joint (1, T, J, 3), at least _ELSEWHERE_DEG about the vertical
    from where it was."""
    away = first.R_camera_from_world[0, 0, 2].numpy()
    yaw = float(np.degrees(np.arctan2(away[1], away[0])))
    return place(
        world, NumpyDraw(rng), replace(views, yaw_deg=(yaw + _ELSEWHERE_DEG, yaw + 360 - _ELSEWHERE_DEG))
    )


def filmed() -> list[Clip]:
    """The upright motions of validation people that are long enough."""
    found = []
    for clip in read_clips("val"):
        cut = replace(clip, joints=clip.joints[: round(_LONGEST_S * clip.fps)])
        if len(cut) >= _LEAST_S * clip.fps and lying(cut.joints.astype(np.float64)).mean() < _LYING:
            found.append(cut)
    return found


def fitted_differences(kinds: Kinds) -> dict[str, object]:
    """What repeatability.json holds."""
    by_angle = {
        angle: factor(kinds[kind, angle], STRANGERS) for kind, angle in sorted(kinds) if kind == "range"
    }
    in_place = shipped()["ranges"]
    wider = {
        _RANGE + angle: by for angle, by in by_angle.items()
    }  # bars of ranges' differences, so many times
    by_kind: dict[str, dict[str, list[Cases]]] = {place: {} for place in get_args(Between)}
    for (kind, figure), takes in kinds.items():
        if kind != "range":
            bars = ((take, wider.get(figure, 1.0) * take["half"]) for take in takes)
            by_kind[kind][figure] = [take.having(half=half) for take, half in bars]
    return {
        "made_by": "pcnet3d lab refit",
        "lifter": shipped_noise().lifter,
        "ranges": {
            angle: (round(by * ends, 2), round(by * found, 3))
            for angle, by in by_angle.items()
            for ends, found in [in_place.get(angle, (1.0, 0.0))]
        },
        "factors": {kind: factors(by_figure) for kind, by_figure in by_kind.items()},
    }


def factors(by_figure: Mapping[str, Sequence[Cases]]) -> dict[str, float]:
    """{figure: factor}. A figure of few people and pairs has that of all of its kind, and none where they are few
    too."""
    by_kind = grouped((_kind(figure), pair) for figure, pairs in by_figure.items() for pair in pairs)
    found = {}
    for figure, own in sorted(by_figure.items()):
        enough = next((of for of in (own, by_kind[_kind(figure)]) if _enough(of)), None)
        if enough is not None:
            found[figure] = float(f"{factor(enough):.2g}")
    return found


def _kind(figure: str) -> str:
    kind = figure.split(".")[0]
    return "repetitions" if kind in ("knee_bends", "arm_raises") else kind


def _enough(pairs: Sequence[Cases]) -> bool:
    return len({pair.person for pair in pairs}) >= FEWEST_PEOPLE or len(pairs) >= FEWEST_PAIRS


def learn_differences(output: Path) -> None:
    """Write the errors that were fitted to the `visits` of all clips, each draw in _CONFIGURATIONS in turn."""
    turns = [(seed + i, clip, seed) for seed in range(_DRAWS) for i, clip in enumerate(filmed())]
    kinds = grouped(
        pair
        for turn, clip, seed in each(iter(turns), "visits", len(turns))
        for pair in visits(clip, replace(_CONFIGURATIONS[turn % len(_CONFIGURATIONS)], seed=seed))
    )
    write_text(output, json.dumps(fitted_differences(kinds), indent=1) + "\n")
