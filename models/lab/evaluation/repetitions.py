"""Counts, beginnings and ends of repeated movements against labels:  pcnet3d lab evaluate repetitions -o DIR

movements.json names the movements of twenty takes of CMU and ACCAD, train and validation people, with the seconds at
which each begins and ends, read by eye off curves of the true angles. A movement that is listed with nothing is looked
for and not there. Judged on the captured joints and on lifted ones, before three cameras each; the lifter was trained
on most of these people, so that its figures here are better than on others, and the rules of stages/measures were
chosen on these takes.

A series: one kind of movement of one side in one take; right: series with as many movements as labelled; movements:
those that are labelled; found, begin, end: of these how many are found, and begin and end within 0.15 s of the label.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ....pipeline.core.errors import InputError
from ..beds import Configuration, EvaluationSet, finished
from ..cases import Row

LABELS = Path(__file__).with_name("movements.json")
_NEAR_S = 0.15
_CAMERAS = 3  # before which each take is lifted
_SETS = (
    EvaluationSet("train, seen by the lifter", "train", known=True),
    EvaluationSet("validation", "val"),
)

Spans = list[tuple[float, float]]


def judge(labelled: Spans, found: Spans) -> dict[str, int]:
    """Counts of one series. A labelled movement is found by the one that shares the most time with it."""
    counts = {"series": 1, "right": int(len(labelled) == len(found)), "movements": len(labelled)}
    off_s = []
    for begin, end in labelled:
        shared = [min(end, stop) - max(begin, start) for start, stop in found]
        if shared and max(shared) > 0:
            start, stop = found[int(np.argmax(shared))]
            off_s.append((abs(start - begin), abs(stop - end)))
    near = np.sum(np.reshape(off_s, (-1, 2)) <= _NEAR_S, axis=0).tolist()
    return {**counts, "found": len(off_s), "begin": near[0], "end": near[1]}


def rows(asked: Configuration) -> Iterator[Row]:
    """("judged", poses, movement, what is counted). InputError where the data is not."""
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
                found = [] if run.take is None else run.take.figures.group(*names).spans
                for name, count in judge(labelled, found).items():
                    yield ("judged", poses, names[0], name), count
                    yield ("judged", poses, "all", name), count
