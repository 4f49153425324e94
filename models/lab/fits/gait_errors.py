"""Widen the stated errors of gait figures where they do not hold on validation subjects, a step of refit.

Runs state errors by the parts of the errors in place (models/gait/errors.py), and evaluation/gait.py joins them with
the truth. A figure's parts are multiplied by the factor that brings as many true means inside as it takes for nine in
ten of strangers, every person counting the same (evaluation/judge.py), and by no less than 1: they were fitted on walks
in other styles too, which are not made any more, and unusual walks err more. Of the captured joints themselves, as a
measured take has them, times and shares of the stride have errors.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ....pipeline.files.atomic import write_text
from ...gait.errors import ERROR_FILE
from ..common.cases import Cases, grouped
from ..evaluation import judge
from ..evaluation.gait import SIDES_APART, true_gait, walks
from ..evaluation.judge import STRANGERS
from ..evaluation.runs import Configuration, EvaluationSet, Finished, finished
from ..evaluation.testbed import BEDS

_SEEDS = 2  # draws of cameras and noise, of every bed
_FEWEST = 3  # people
_NO_ERRORS = ("most", "usual_scatter")  # of a figure's parts

Parts = Mapping[str, Mapping[str, Mapping[str, float]]]  # {"walking", "running": {figure: parts}}
# Figures of takes' walks as runs state them: "walking" or "running", as it was found, and the figure, of a difference
# of the sides with SIDES_APART behind.
Found = Mapping[tuple[str, str], Sequence[Cases]]


def walks_of(takes: Iterator[Finished]) -> Iterator[tuple[tuple[str, str], Cases]]:
    """Those of takes in which somebody walks and walks are found."""
    for run in takes:
        if run.levelled:
            gait = run.done.figures.group("walking").text("gait")
            for figure, cases in walks(run, true_gait(run.truth)):
                if len(stated := cases.judged()):
                    yield ("running" if gait == "running" else "walking", figure), stated


def widened(errors: Parts, found: Found, behind: str = "") -> Parts:
    """The parts times the factors on the bars that they make. A figure of a gait that too few people show has the
    factor of that figure in both gaits, or 1. behind: what ends the names of the figures."""

    def factor(gait: str, name: str) -> float:
        own, other = (found.get((each, name + behind), []) for each in (gait, *(errors.keys() - {gait})))
        for takes in (own, [*own, *other]):
            if len({each.person for each in takes}) >= _FEWEST:
                return max(1.0, judge.factor(takes, STRANGERS))
        return 1.0

    def times(by: float, parts: Mapping[str, float]) -> dict[str, float]:
        return {name: of if name in _NO_ERRORS else float(f"{by * of:.3g}") for name, of in parts.items()}

    return {
        gait: {name: times(factor(gait, name), parts) for name, parts in figures.items()}
        for gait, figures in errors.items()
    }


def learn(output: Path) -> None:
    """Write the errors that were fitted."""
    sets = [EvaluationSet("CMU val", "val", of="cmu"), EvaluationSet("ACCAD m1", "val", of="accad")]
    asked = {
        "lifted": [Configuration(bed=bed, focal_known=known) for bed in BEDS for known in (True, False)],
        "measured": [Configuration(lifter="", up_told=True)],  # cameras make no difference
    }
    content = json.loads(ERROR_FILE.read_text(encoding="utf-8"))
    for source, configurations in asked.items():
        found = grouped(
            walk
            for seed in range(_SEEDS)
            for how in configurations
            for walk in walks_of(finished(replace(how, seed=seed), sets))
        )
        for name, behind in (("figures", ""), ("differences", SIDES_APART)):
            content[source][name] = widened(content[source][name], found, behind)
    write_text(output, json.dumps(content, indent=1) + "\n")
