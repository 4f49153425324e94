"""How far apart the figures of two visits are when nothing changed, and how often `compare` would say that they differ:
pcnet3d lab evaluate visits --seed 5 -o DIR

Virtual visits as those that the errors were fitted on (visits.py), by the errors that are shipped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from ...angle_error.repeatability import difference_sd, shipped
from ...common.metrics import SD_90
from ..evaluation.sets import Question
from ..evaluation.tables import Page, Table
from . import judge
from .judge import Stated
from .visits import KINDS, Visit, Visits, collected, differs, with_ranges

PAGE = Page(
    "Differences of two visits",
    "; cameras typical and wild, without and with an image, in turn. Nothing changed between the two visits. Each "
    "person counts the same, in brackets the 90 % interval over people.",
    [
        Table(
            "Minimal detectable changes",
            "figures/*/*/*",
            ["motions", "figure", "the second visit"],
            {
                "pairs": "{cases}",
                "people": "{people}",
                "MDC90": "{mdc90:.3g}",
                "nine in ten differ by less than": "{p90:.3g}",
                "inside MDC90": "{inside:.0%} ({low:.0%} to {high:.0%})",
            },
            "MDC90: the median of what is stated. Degrees, metres, seconds, percent.",
        ),
        Table(
            "Visits that are said to differ",
            "called/*/*",
            ["motions", "the second visit"],
            {
                "pairs": "{cases}",
                "people": "{people}",
                "said to differ in a figure": "{changed:.0%} ({least:.0%} to {most:.0%})",
            },
            "By the test of `compare`, over all figures of both visits at once.",
        ),
    ],
)


def tables(question: Question) -> dict[str, object]:
    """How far apart the figures of two visits are, and how often visits are said to differ, by the errors that
    `compare` states: {"figures": {motions: {figure: {kind: figures}}}, "called": {motions: {kind: figures}}}; motions
    are "walks", those in which both visits find one, and "all"."""
    return question.heading() | judged(collected(question.sets, [question.seed]))


def judged(cases: Sequence[Visits | Stated]) -> dict[str, object]:
    """See `tables`."""
    pairs = [case for case in cases if isinstance(case, Visits) and case.kind in KINDS]
    pairs = [with_ranges(pair, shipped()["ranges"]) for pair in pairs]
    walks = {pair.visit for pair in pairs if pair.figure.startswith("walking.")}
    called: dict[str, dict[str, object]] = {}
    figures: dict[str, dict[str, dict[str, object]]] = {}
    for motions, of in (("walks", [pair for pair in pairs if pair.visit in walks]), ("all", pairs)):
        for kind in KINDS:
            by_visit: dict[Visit, list[Stated]] = {}
            by_figure: dict[str, list[Stated]] = {}
            for pair in (pair for pair in of if pair.kind == kind):
                sd = difference_sd(pair.figure, pair.errors, "again" if pair.same_place else "elsewhere")
                off, half = np.array([pair.found[1] - pair.found[0]]), np.array([SD_90 * sd])
                one = Stated(pair.figure, pair.person, off, half)
                by_visit.setdefault(pair.visit, []).append(one)
                by_figure.setdefault(pair.figure, []).append(one)
            for figure, found in by_figure.items():
                figures.setdefault(motions, {}).setdefault(figure, {})[kind] = {
                    **asdict(judge.inside(found)),
                    "mdc90": judge.quantile(found, lambda one: one.half),
                    "p90": judge.quantile(found, lambda one: np.abs(one.error), judge.COVERED),
                }
            same = judge.inside([differs(found) for found in by_visit.values()])
            called.setdefault(motions, {})[kind] = {
                **asdict(same),
                "changed": 1 - same.inside,
                "least": 1 - same.high,
                "most": 1 - same.low,
            }
    return {"figures": figures, "called": called}
