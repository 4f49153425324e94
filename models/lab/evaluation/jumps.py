"""Jumps of lifted takes against motion capture:  pcnet3d lab evaluate jumps -o DIR

True flights are those that the captured path shows (models/place/flights.py, MEASURED). Before a camera that stands
still, whose image tells up; the validation people, and of those whom the lifter has seen their jumps, for there are
more of these; by set and frames a second.

bias: median of found less true; error: p50 / mean / p95 of its size; inside: within the stated 90 %; near: within 4 cm.
hops: found besides the true flights, too short or low for the captured rule; invented: found where the captured ankles
do not leave the floor.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, pairwise
from typing import Any, NamedTuple

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.frames import LEVEL
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.path import RootPath
from ....pipeline.core.pose import PoseSequence
from ...place.flights import GRAVITY, Flight, flown
from ..common.metrics import Row
from ..mocap.clips import Clip
from .judge import Stated, bar, summed
from .runs import Configuration, EvaluationSet, Finished, finished
from .testbed import SeenTake

_RULE_FPS = 30.0  # that the rule for captured flights is made for
_TOES = 0.055  # statures; standing on the toes lifts an ankle by 0.05
_FREE = 0.1  # of gravity: a truth that falls faster or slower has lost its scale or its clock
_NEAR_CM = 4.0
_FIGURES = {  # {what is measured: (name of the measure, to the unit of the report)}
    "flight time, ms": ("flight_time", 1000.0),
    "height by flight time, cm": ("height_by_flight_time", 1.0),
    "jump height, cm": ("jump_height", 100.0),
    "contact time, ms": ("contact_time", 1000.0),
}
HEIGHTS = ("height by flight time, cm", "jump height, cm")
_TRAIN = EvaluationSet("train, seen by the lifter", "train", known=True)


class Compared(NamedTuple):
    """Of a take: how many true flights there are, how many of them are found, every figure of these, and how many other
    hops were found, and invented ones."""

    true: int
    found: int
    figures: list[Stated]
    hops: int
    invented: int


def true_flights(truth: SeenTake) -> list[Flight]:
    """What the captured path shows, at 30 frames a second; in statures."""
    every = max(round(truth.keypoints.fps / _RULE_FPS), 1)
    return captured_flights(truth.world[::every], truth.keypoints.times[::every])


def _off_floor(truth: SeenTake, span: tuple[float, float], stature: float) -> bool:
    """Whether both captured ankles are above their floor in the middle of a span of seconds."""
    lowest = truth.world[:, H36M17.indices(("r_ankle", "l_ankle")), 2].min(axis=1)
    middle = int(np.searchsorted(truth.keypoints.times, sum(span) / 2))
    return bool(lowest[middle] - np.percentile(lowest, 20) > _TOES * stature)


def captured_flights(world: np.ndarray, time_s: np.ndarray) -> list[Flight]:
    """world: (T, 17, 3) in a still world whose z is up."""
    root = world[:, H36M17.index("pelvis")].astype(np.float64)
    poses = PoseSequence(world - root[:, None], H36M17, LEVEL, time_s=time_s, path=RootPath(root))
    stature = implied_stature(world)
    return [each for each in flown(poses).flights if abs(each.fall * stature / GRAVITY - 1) < _FREE]


def compared(run: Finished) -> Compared:
    """The jumps that a take's measures have, against the true ones; of both the error of each figure."""
    stature, true = implied_stature(run.truth.truth), true_flights(run.truth)
    jumps = run.done.figures.group("jumps")
    times = {each.number: each.value for each in jumps.repetitions("flight_time")}
    spans = [(start, start + times[i]) for i, start in enumerate(jumps.times("start"))]
    at = [next((of for of in true if start < of.land_s and of.off_s < stop), None) for start, stop in spans]
    others = [span for span, flight in zip(spans, at, strict=True) if flight is None]
    hops = sum(_off_floor(run.truth, span, stature) for span in others)
    figures = []
    for statement, (name, factor) in _FIGURES.items():
        for row in jumps.repetitions(name):
            flight = at[row.number or 0]
            value = None if flight is None else _figure(name, flight, true, stature)
            if value is not None:
                half = factor * bar(row.error)
                figures.append(run.figure(statement, factor * row.value, factor * value, half))
    found = {flight.off_s for flight in at if flight is not None}
    return Compared(len(true), len(found), figures, hops, len(others) - hops)


def _figure(name: str, flight: Flight, true: Sequence[Flight], stature: float) -> float | None:
    """In seconds, metres (of a jump height) and centimetres (of one by time)."""
    time_s = flight.land_s - flight.off_s
    if name == "contact_time":
        before = [flown for flown, following in pairwise(true) if following is flight]
        return flight.off_s - before[0].land_s if before else None
    if name == "jump_height":
        return flight.rise * stature
    return time_s if name == "flight_time" else 100 * GRAVITY / 8 * time_s**2


def rows(asked: Configuration) -> Iterator[Row]:
    """("sets", label, frames a second, "takes", "true", "found", "hops", "invented", and "figures", figure): Stated;
    ("refused",): takes that a run refuses. InputError where the data is not."""
    for fps in (30.0, 60.0):
        how = replace(asked, image=True, fps=fps)
        of_train = finished(how, [_TRAIN], _flies) if asked.people == "val" else ()
        for run in chain(finished(how), of_train):
            place = ("sets", run.label, f"{fps:g}")
            yield ("refused",), int(run.take is None)
            if run.take is None:
                continue
            of = compared(run)
            counts = {
                "takes": 1,
                "true": of.true,
                "found": of.found,
                "hops": of.hops,
                "invented": of.invented,
            }
            yield from (((*place, name), number) for name, number in counts.items())
            yield from (((*place, "figures", each.statement), each) for each in of.figures)


def summary(takes: list[Stated]) -> dict[str, Any]:
    """Of a figure of all takes; of heights also the share that is near."""
    near = np.mean([abs(take.error[0]) <= _NEAR_CM for take in takes])
    return summed(takes) | ({"near": float(near)} if takes[0].statement in HEIGHTS else {})


def _flies(clip: Clip) -> bool:
    return bool(captured_flights(clip.joints, np.arange(len(clip)) / clip.fps))
