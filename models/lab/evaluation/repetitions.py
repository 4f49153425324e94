"""Counts, beginnings and ends of repeated movements against labels:  pcnet3d lab evaluate repetitions -o DIR

movements.json names the movements of twenty takes of CMU and ACCAD, train and validation people, with the seconds at
which each begins and ends, read by eye off curves of the true angles. A movement that is listed
with nothing is looked for and not there. Judged on the captured joints and on lifted ones, before three cameras each;
the lifter was trained on most of these people, so that its figures here are better than on others, and the rules of
stages/measures were chosen on these takes.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.take import Take
from ....pipeline.running.progress import each
from ..mocap.clips import Subjects, read_clips
from .runs import Configuration, EvaluationSet, Question, finished

LABELS = Path(__file__).with_name("movements.json")
_NEAR_S = 0.15
_CAMERAS = 3  # before which each take is lifted
_SETS: tuple[tuple[Subjects, str], ...] = (("train", "train, seen by the lifter"), ("val", "validation"))
ABOUT = (
    "A series: one kind of movement of one side in one take; counts: series that were counted right; found, begin, "
    "end: of labelled movements those found, and those that begin and end within 0.15 s of the label."
)

Spans = list[tuple[float, float]]


@dataclass
class Judged:
    """Series: how many were labelled and found with the same count; movements: of the labelled ones how many there are,
    and the errors (begin, end) in seconds of those found."""

    right: list[bool] = field(default_factory=list)
    movements: int = 0
    off_s: list[tuple[float, float]] = field(default_factory=list)

    def row(self) -> dict[str, Any]:
        off = np.abs(np.array(self.off_s).reshape(-1, 2))
        near = (off <= _NEAR_S).mean(axis=0) if len(off) else (np.nan, np.nan)
        share = len(off) / self.movements if self.movements else np.nan
        times = {"found": share, "begin": float(near[0]), "end": float(near[1])}
        return {
            "series": len(self.right), "movements": self.movements, "counts": float(np.mean(self.right)),
            **{name: value for name, value in times.items() if np.isfinite(value)},
        }  # fmt: skip


def found_in(take: Take, movement: str) -> Spans:
    """(begin, end) in seconds of a movement such as "knee_bends" or "arm_raises.left" in a take's measures."""
    return take.figures.group(*movement.split(".")).spans


def judge(judged: Judged, labelled: Spans, found: Spans) -> None:
    """Add a series. A labelled movement is found by the one that shares the most time with it."""
    judged.right.append(len(labelled) == len(found))
    judged.movements += len(labelled)
    for begin, end in labelled:
        shared = [min(end, stop) - max(begin, start) for start, stop in found]
        if shared and max(shared) > 0:
            start, stop = found[int(np.argmax(shared))]
            judged.off_s.append((start - begin, stop - end))


def tables(question: Question) -> dict[str, Any]:
    """{"judged": {poses: {movement: Judged.row}}, "wrong": {"poses, take, movement": "labelled, found"}}.
    InputError where the data is not."""
    labels: dict[str, dict[str, Spans]] = json.loads(LABELS.read_text(encoding="utf-8"))
    captured = {clip.name for subjects, _ in _SETS for clip in read_clips(subjects)}
    if missing := sorted(set(labels) - captured):
        raise InputError(
            "nothing-usable",
            f"Expected the labelled take {missing[0]} in the motion capture; set PCNET3D_DATA.",
        )
    kinds = {
        "captured": Configuration(lifter="", up_told=True),
        "lifted": question.how(image=True),
    }
    results: dict[str, Any] = {**question.heading(), "judged": {}, "wrong": {}}
    for poses, how in kinds.items():
        sets = [EvaluationSet(label, subjects) for subjects, label in _SETS]
        cameras = [replace(question, seed=seed) for seed in range(_CAMERAS if how.lifter else 1)]
        takes = (
            (asked.seed, judged)
            for asked in cameras
            for judged in finished(asked, how, sets, lambda clip: clip.name in labels)
        )
        by_movement: dict[str, Judged] = {}
        for seed, of in each(takes, poses, len(labels) * len(cameras)):
            for movement, labelled in labels[of.truth.clip].items():
                spans = [] if of.take is None else found_in(of.take, movement)
                judge(by_movement.setdefault(movement.split(".")[0], Judged()), labelled, spans)
                judge(by_movement.setdefault("all", Judged()), labelled, spans)
                if len(spans) != len(labelled):
                    camera = f" before camera {seed}" if how.lifter else ""
                    key = f"{poses}{camera}, {of.truth.clip}, {movement}"
                    results["wrong"][key] = f"{len(labelled)}, {len(spans)}"
        results["judged"][poses] = {movement: judged.row() for movement, judged in by_movement.items()}
    return results
