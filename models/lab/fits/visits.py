"""Fit the errors of differences on virtual visits, a step of refit.

A motion of a validation person is filmed, and filmed again: from the same tripod, from a tripod that was set up again,
and from elsewhere. Nothing has changed, so what the figures of both runs differ by is their difference's error; and in
each run ranges of motion, right less left and one repetition less another are held against the truth
(evaluation/statements.py). Written as models/angle_error/repeatability.json: what the errors of ranges are made of,
their parts in place times the factor that makes them hold; and for every figure the factor on the errors of both, added
as independent ones, that brings nine in ten differences inside, every person counting the same (evaluation/judge.py).
One draw of cameras and detectors tells little of so few people: there are several.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import torch
from torch import Tensor

from ....pipeline.core.camera import pitch_roll_deg, view_rotation
from ....pipeline.core.measures import SD_90, Measure
from ....pipeline.core.rotations import rotate
from ....pipeline.core.take import Take
from ....pipeline.files.atomic import write_text
from ....pipeline.running.progress import each
from ....pipeline.signals.angles import ANGLES, OF_BOTH, of_both
from ...angle_error.joint_noise import shipped_noise
from ...angle_error.repeatability import (
    Between,
    figure_of,
    range_sd,
    same_part,
    shipped,
)
from ..evaluation import judge
from ..evaluation.judge import STRANGERS, Stated
from ..evaluation.runs import EVALUATION_SETS, Configuration, EvaluationSet, given, recipe_of
from ..evaluation.statements import Ranged, ranges, repetitions, true_angles
from ..evaluation.testbed import BEDS, see
from ..mocap.clips import Clip, lying
from ..synthetic.cameras import Cameras, ViewRange, place
from ..synthetic.draw import NumpyDraw

Kind = Between | Literal["range"]  # of what an error is: of a difference, or of a range
Kinds = Mapping[str, Sequence[Stated]]  # what is stated, by kind
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


def visits(clip: Clip, configuration: Configuration, seed: int) -> Iterator[tuple[Kind, Stated]]:
    """The figures of a clip's pairs of visits, of which the first is the same in all: "again" from the same tripod and
    from one that was set up again, and "elsewhere"; and of every run the pairs within it and its ranges (`_within`)."""
    rng = np.random.default_rng([seed, zlib.crc32(clip.name.encode()), 4])
    world = torch.from_numpy(clip.joints[None].astype(np.float64))
    views = BEDS[configuration.bed]
    first = place(world, NumpyDraw(rng), views)
    again, other = set_up_again(first, world, rng), elsewhere(first, world, rng, views)
    before, true = _run(clip, first, configuration, seed)
    figures = _figures(before, true, clip)
    yield from _within(before, true, clip)
    pairs: list[tuple[Kind, Cameras]] = [("again", first), ("again", again), ("elsewhere", other)]
    for kind, camera in pairs:
        after, true = _run(clip, camera, configuration, _AGAIN + seed)
        yield from _within(after, true, clip)
        for place_of, other in _figures(after, true, clip).items():
            row = figures.get(place_of)
            if row is None or row.error is None or other.error is None:
                continue
            if same_part(before.figures.group(*row.group), after.figures.group(*other.group)):
                found, errors = (row.value, other.value), (row.error, other.error)
                yield kind, difference(place_of[0], clip, found, errors)


def difference(
    figure: str, clip: Clip, found: tuple[float, float], errors: tuple[float, float], true: float = 0.0
) -> Stated:
    """How wrong the second figure less the first is, where it truly is `true`, and the 90 % bar that independent errors
    of both would give it."""
    off, half = found[1] - found[0] - true, SD_90 * np.hypot(*errors)
    return Stated(figure, clip.subject, np.array([off]), np.array([half]))


def _within(take: Take, truth: dict[str, np.ndarray], clip: Clip) -> Iterator[tuple[Kind, Stated]]:
    """Pairs of sides and of repetitions of one run, and its ranges. truth: of statements.true_angles."""
    of = ranges(take, truth)
    groups = take.figures.group("range_of_motion")
    for name, one in of.items():
        both, error = of_both(name), _range_error(name, one, clip)
        yield "range", Stated(both, clip.subject, np.array([one.found - one.true]), np.array([SD_90 * error]))
        left = f"l_{both}"
        other = of.get(left)
        if name.startswith("r_") and other and same_part(groups.group(name), groups.group(left)):
            errors, found = (error, _range_error(left, other, clip)), (one.found, other.found)
            yield "sides", difference(_RANGE + both, clip, found, errors, other.true - one.true)
    for two in repetitions(take, truth):
        figure, true = f"peak.{of_both(two.angle)}", two.true[1] - two.true[0]
        yield "repetitions", difference(figure, clip, two.found, two.errors, true)


def _run(
    clip: Clip, cameras: Cameras, configuration: Configuration, seed: int
) -> tuple[Take, dict[str, np.ndarray]]:
    """As a run leaves it, and its true angles."""
    seen = see(clip, seed, cameras=cameras)
    recipe = recipe_of(configuration).with_options("measures", repeat=[*ANGLES])
    take = recipe.build()(given(seen, seed, configuration))
    return take, true_angles(seen, take.need("poses").frame_index)


def _range_error(name: str, of: Ranged, clip: Clip) -> float:
    """By the parts in place, whichever lifter they were fitted to."""
    return range_sd(of_both(name), of.found, of.ends, (len(clip) - 1) / clip.fps)


def _figures(take: Take, truth: dict[str, np.ndarray], clip: Clip) -> dict[tuple[str, str], Measure]:
    """Those that two visits are compared by, by figure and side. truth: of statements.true_angles."""
    gait, of = take.figures.group("walking").text("gait"), ranges(take, truth)
    found = {}
    for row in take.figures:
        if not isinstance(row, Measure) or (figure := figure_of(row, gait)) is None:
            continue
        if row.group[0] == "range_of_motion" and row.group[1] in of:
            row = replace(row, error=_range_error(row.group[1], of[row.group[1]], clip))
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
        if _inside(cameras, world):
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


def _inside(cameras: Cameras, world: Tensor) -> bool:
    joints = cameras.to_camera(world)
    half = cameras.image_size[0] / 2
    off = (cameras.project(joints)[0] - half).abs()
    return bool((joints[..., 2] > 0).all() and (off <= _MARGIN * half).all())


def clips(sets: Sequence[EvaluationSet]) -> list[Clip]:
    """The upright motions of the sets' people that are long enough."""
    found = []
    for of in sets:
        for clip in of.clips():
            longest, whole = round(_LONGEST_S * clip.fps), len(clip)
            cut = replace(clip, joints=clip.joints[: min(longest, whole)])
            if len(cut) >= _LEAST_S * clip.fps and lying(cut.joints.astype(np.float64)).mean() < _LYING:
                found.append(cut)
    return found


def collected(sets: Sequence[EvaluationSet], seeds: Sequence[int]) -> Kinds:
    """The `visits` of all clips of the sets with each seed, in _CONFIGURATIONS in turn."""
    turns = [(seed + i, clip, seed) for seed in seeds for i, clip in enumerate(clips(sets))]
    kinds: dict[str, list[Stated]] = {}
    for turn, clip, seed in each(iter(turns), "visits", len(turns)):
        for kind, stated in visits(clip, _CONFIGURATIONS[turn % len(_CONFIGURATIONS)], seed):
            kinds.setdefault(kind, []).append(stated)
    return kinds


def fit(kinds: Kinds) -> dict[str, object]:
    """What repeatability.json holds."""
    by_angle: dict[str, list[Stated]] = {}
    for of_range in kinds["range"]:
        by_angle.setdefault(of_range.statement, []).append(of_range)
    of_ranges = {angle: judge.factor(of, STRANGERS) for angle, of in sorted(by_angle.items())}
    in_place = shipped()["ranges"]
    return {
        "made_by": "pcnet3d lab refit",
        "lifter": shipped_noise().lifter,
        "ranges": {
            angle: (round(by * ends, 2), round(by * found, 3))
            for angle, by in of_ranges.items()
            for ends, found in [in_place.get(angle, (1.0, 0.0))]
        },
        "factors": factors(with_ranges(kinds, of_ranges)),
    }


def with_ranges(kinds: Kinds, of_ranges: Mapping[str, float]) -> Kinds:
    """Pairs of ranges with bars that are so many times as large, by angle; others as they are."""
    return {
        kind: [
            replace(pair, half=of_ranges.get(pair.statement.removeprefix(_RANGE), 1.0) * pair.half)
            if pair.statement.startswith(_RANGE)
            else pair
            for pair in pairs
        ]
        for kind, pairs in kinds.items()
    }


def factors(kinds: Kinds) -> dict[Between, dict[str, float]]:
    """{Between: {figure: factor}}. A figure of few people and pairs has that of all of its kind, and none where they
    are few too."""
    return {place: _factors(kinds.get(place, ())) for place in get_args(Between)}


def _factors(pairs: Sequence[Stated]) -> dict[str, float]:
    by_figure: dict[str, list[Stated]] = {}
    by_kind: dict[str, list[Stated]] = {}
    for pair in pairs:
        by_figure.setdefault(pair.statement, []).append(pair)
        by_kind.setdefault(_kind(pair.statement), []).append(pair)
    if "peak" in by_kind:  # of every angle, of which these people may have repeated none
        by_figure = {f"peak.{angle}": [] for angle in OF_BOTH} | by_figure
    found = {}
    for figure, own in sorted(by_figure.items()):
        enough = next((of for of in (own, by_kind[_kind(figure)]) if _enough(of)), None)
        if enough is not None:
            found[figure] = float(f"{judge.factor(enough):.2g}")
    return found


def _kind(figure: str) -> str:
    kind = figure.split(".")[0]
    return "repetitions" if kind in ("knee_bends", "arm_raises") else kind


def _enough(pairs: Sequence[Stated]) -> bool:
    return len({pair.person for pair in pairs}) >= FEWEST_PEOPLE or len(pairs) >= FEWEST_PAIRS


def learn(output: Path) -> None:
    """Write the errors that were fitted."""
    content = fit(collected(EVALUATION_SETS["val"], range(_DRAWS)))
    write_text(output, json.dumps(content, indent=1) + "\n")
