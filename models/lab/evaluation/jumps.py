"""Jumps of lifted takes against motion capture:  pcnet3d lab evaluate jumps -o DIR

True flights are those that the captured path shows (models/place/flights.py, MEASURED). Before a camera that stands
still, whose image tells up; the validation people, and of those whom the lifter has seen their jumps, for there are
more of these; by set and frames a second.

bias: median of found less true; error: p50 / mean / p95 of its size; inside: within the stated 90 %; near: within 4 cm.
hops: found besides the true flights, too short or low for the captured rule; invented: found where the captured ankles
do not leave the floor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.frames import LEVEL
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import PoseSequence, RootPath
from ...place.flights import GRAVITY, Flight, flown
from ..beds import Configuration, EvaluationSet, Finished, SeenTake, finished
from ..cases import Cases, Row, column, summed
from ..clips import Clip

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
_TRAIN = EvaluationSet("train, seen by the lifter", "train", known=True)


def true_flights(truth: SeenTake) -> list[Flight]:
    """What the captured path shows, at 30 frames a second; in statures."""
    every = max(round(truth.keypoints.fps / _RULE_FPS), 1)
    return captured_flights(truth.world[::every], truth.time_s[::every])


def _off_floor(truth: SeenTake, span: tuple[float, float], stature: float) -> bool:
    """Whether both captured ankles are above their floor in the middle of a span of seconds."""
    lowest = truth.world[:, H36M17.indices(("r_ankle", "l_ankle")), 2].min(axis=1)
    middle = int(np.searchsorted(truth.time_s, sum(span) / 2))
    return bool(lowest[middle] - np.percentile(lowest, 20) > _TOES * stature)


def captured_flights(world: np.ndarray, time_s: np.ndarray) -> list[Flight]:
    """world: (T, 17, 3) in a still world whose z is up."""
    root = world[:, H36M17.index("pelvis")].astype(np.float64)
    poses = PoseSequence(world - root[:, None], H36M17, LEVEL, time_s=time_s, path=RootPath(root))
    stature = implied_stature(world)
    return [each for each in flown(poses).flights if abs(each.fall * stature / GRAVITY - 1) < _FREE]


def compared(run: Finished) -> Iterator[tuple[str, int | Cases]]:
    """Of a take: how many true flights there are ("true"), how many of them its measures have ("found"), how many other
    hops were found ("hops"), and invented ones ("invented"); and every figure of the true ones that were found."""
    stature, true = implied_stature(run.truth.truth), true_flights(run.truth)
    jumps = run.done.figures.group("jumps")
    times = {each.number: each.value for each in jumps.repetitions("flight_time")}
    spans = [(start, start + times[i]) for i, start in enumerate(jumps.times("start"))]
    at = [next((of for of in true if start < of.land_s and of.off_s < stop), None) for start, stop in spans]
    others = [span for span, flight in zip(spans, at, strict=True) if flight is None]
    hops = sum(_off_floor(run.truth, span, stature) for span in others)
    yield "true", len(true)
    yield "found", len({flight.off_s for flight in at if flight is not None})
    yield "hops", hops
    yield "invented", len(others) - hops
    for figure, (name, factor) in _FIGURES.items():
        for row in jumps.repetitions(name):
            flight = at[row.number or 0]
            value = None if flight is None else _true_figures(flight, true, stature).get(name)
            if value is not None:
                error = None if row.error is None else factor * row.error
                cases = run.figure(factor * row.value, factor * value, error)
                is_height = figure.endswith(", cm")
                yield figure, cases.having(near=abs(cases["error"]) <= _NEAR_CM) if is_height else cases


def _true_figures(flight: Flight, true: list[Flight], stature: float) -> dict[str, float]:
    """By the names of measures, in seconds, metres (of a jump height) and centimetres (of one by time)."""
    time_s, number = flight.land_s - flight.off_s, true.index(flight)
    height_cm = 100 * GRAVITY / 8 * time_s**2
    figures = {
        "flight_time": time_s,
        "height_by_flight_time": height_cm,
        "jump_height": flight.rise * stature,
    }
    return figures | ({"contact_time": flight.off_s - true[number - 1].land_s} if number else {})


def rows(asked: Configuration) -> Iterator[Row]:
    """("sets", label, frames a second, "takes", "true", "found", "hops", "invented", and "figures", figure: Cases);
    ("refused",): takes that a run refuses. InputError where the data is not."""
    for fps in (30.0, 60.0):
        how = replace(asked, image=True, fps=fps)
        of_train = finished(how, [_TRAIN], _flies) if asked.people == "val" else ()
        for run in chain(finished(how), of_train):
            place = ("sets", run.label, f"{fps:g}")
            yield ("refused",), int(run.take is None)
            if run.take is not None:
                yield (*place, "takes"), 1
                for name, value in compared(run):
                    yield (*place, *["figures"] * isinstance(value, Cases), name), value


def summary(takes: list[Cases]) -> dict[str, Any]:
    """Of a figure of all takes; of heights also the share that is near."""
    near = {"near": float(column(takes, "near").mean())} if "near" in takes[0].values else {}
    return summed(takes) | near


def _flies(clip: Clip) -> bool:
    return bool(captured_flights(clip.joints, np.arange(len(clip)) / clip.fps))
