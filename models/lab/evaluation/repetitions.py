"""Counts, beginnings and ends of repeated movements against labels:  pcnet3d lab evaluate repetitions -o DIR

movements.json names the movements of twenty takes of CMU and ACCAD, train and validation people, with the seconds at
which each begins and ends, read by eye off curves of the true angles. A movement that is listed with nothing is looked
for and not there. Judged on the captured joints and on lifted ones, before three cameras each; the lifter was trained
on most of these people, so that its figures here are better than on others, and the rules of stages/measures were
chosen on these takes.

A series: one kind of movement of one side in one take; counts: series that were counted right; found, begin, end: of
labelled movements those found, and those that begin and end within 0.15 s of the label.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ....pipeline.core.errors import InputError
from ..common.metrics import Row
from .runs import Configuration, EvaluationSet, finished

LABELS = Path(__file__).with_name("movements.json")
_NEAR_S = 0.15
_CAMERAS = 3  # before which each take is lifted
_SETS = (
    EvaluationSet("train, seen by the lifter", "train", known=True),
    EvaluationSet("validation", "val"),
)

Spans = list[tuple[float, float]]


class Series(NamedTuple):
    """One kind of movement of one side in one take: whether it was counted right, how many movements are labelled, and
    the errors (begin, end) in seconds of those found."""

    right: bool
    movements: int
    off_s: list[tuple[float, float]]


def summary(values: list[Series]) -> dict[str, Any]:
    """What the page says of them."""
    right, movements, off_s = zip(*values, strict=True)
    off = np.abs(np.array([pair for pairs in off_s for pair in pairs]).reshape(-1, 2))
    begin, end = (off <= _NEAR_S).mean(axis=0) if len(off) else (np.nan, np.nan)
    found = len(off) / sum(movements) if sum(movements) else np.nan
    times = {"found": found, "begin": float(begin), "end": float(end)}
    return {
        "series": len(right), "movements": sum(movements), "counts": float(np.mean(right)),
        **{name: value for name, value in times.items() if np.isfinite(value)},
    }  # fmt: skip


def judge(labelled: Spans, found: Spans) -> Series:
    """(begin, end) in seconds of one movement. A labelled one is found by the one that shares the most time with it."""
    off_s = []
    for begin, end in labelled:
        shared = [min(end, stop) - max(begin, start) for start, stop in found]
        if shared and max(shared) > 0:
            start, stop = found[int(np.argmax(shared))]
            off_s.append((start - begin, stop - end))
    return Series(len(labelled) == len(found), len(labelled), off_s)


def rows(asked: Configuration) -> Iterator[Row]:
    """("judged", poses, movement): Series. InputError where the data is not."""
    labels: dict[str, dict[str, Spans]] = json.loads(LABELS.read_text(encoding="utf-8"))
    captured = {clip.name for of in _SETS for clip in of.clips()}
    if missing := sorted(set(labels) - captured):
        raise InputError(
            "nothing-usable",
            f"Expected the labelled take {missing[0]} in the motion capture; set PCNET3D_DATA.",
        )
    lifted = (("lifted", replace(asked, image=True, seed=seed)) for seed in range(_CAMERAS))
    for poses, how in (("captured", Configuration(lifter="", up_told=True)), *lifted):
        for run in finished(how, _SETS, lambda clip: clip.name in labels):
            for movement, labelled in labels[run.truth.clip].items():
                names = movement.split(".")  # such as "knee_bends" or "arm_raises.left"
                series = judge(labelled, [] if run.take is None else run.take.figures.group(*names).spans)
                yield ("judged", poses, names[0]), series
                yield ("judged", poses, "all"), series
