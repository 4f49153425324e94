"""Whether every stated error holds, in every configuration of a run:  pcnet3d evaluate errors -o DIR

And with --fit what would make them hold: the errors of angles and rates, written as models/angle_error/joint_noise.json
is. Every figure is by the procedure of judge.py.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.running.progress import each
from ....pipeline.signals.angles import ANGLES, of_both
from ...angle_error.joint_noise import JointNoise, shipped_noise
from ...common.metrics import SD_90
from ..evaluation.sets import Sets, evaluation_sets
from ..evaluation.tables import Table, page
from . import judge
from .configurations import CONFIGURATIONS, Configuration, finished
from .fit import fitted
from .judge import Stated
from .statements import statements

Cases = dict[str, dict[str, list[Stated]]]  # by configuration and statement
_KNOTS = (0.02, 0.25, 0.5, 0.75, 0.98)  # quantiles of the found angle, to the nearest 5 degrees


def collected(
    rectifier: Rectifier,
    sets: Sets = "val",
    seed: int = 0,
    lifter: str | Path = "pcnet3d",
    configurations: Sequence[Configuration] = CONFIGURATIONS,
) -> Cases:
    """Everything that the takes of these people state, in every configuration."""
    cases: Cases = {}
    for configuration in configurations:
        by_statement = cases.setdefault(configuration.name, {})
        for of in evaluation_sets(sets, configuration.bed):
            takes = finished(configuration, of, rectifier, seed, lifter)
            for take in each(takes, f"{configuration.name}, {of.label}", len(of.long_clips())):
                for stated in statements(take):
                    if len(stated.error):
                        by_statement.setdefault(stated.statement, []).append(stated)
    return cases


def rows(cases: Cases, sets: str) -> list[dict[str, Any]]:
    """{statement, configuration, set, cases, people, inside, low, high, worst_bin, needed}: shares inside the stated
    90 %, with the 90 % interval over people; the least of any tenth of the cases by what is known of them, None where
    nothing is; and what the bars would have to be multiplied by."""
    out = []
    for configuration, by_statement in cases.items():
        for statement, takes in by_statement.items():
            bins = [one.inside for name in takes[0].known for *_, one in judge.bins(takes, name)]
            out.append(
                {
                    "statement": statement,
                    "configuration": configuration,
                    "set": sets,
                    **{
                        k: round(v, 3) if isinstance(v, float) else v
                        for k, v in asdict(judge.inside(takes)).items()
                    },
                    "worst_bin": round(min(bins), 3) if bins else None,
                    "needed": round(judge.factor(takes), 2),
                }
            )
    return out


def by_size(cases: Cases, configuration: str) -> Iterator[tuple[str, float, float, float, float]]:
    """(angle, from, to, mean error, share inside) in tenths of the found angle."""
    for statement, takes in cases[configuration].items():
        if "found" in takes[0].known:
            for low, high, mean, one in judge.bins(takes, "found"):
                yield statement, low, high, mean, one.inside


def as_markdown(table: Sequence[Mapping[str, Any]], cases: Cases) -> str:
    """The report as a page of tables."""
    configurations = list(cases)
    statements_ = list(dict.fromkeys(row["statement"] for row in table))
    found = {(row["statement"], row["configuration"]): row for row in table}

    def cell(statement: str, configuration: str) -> str:
        row = found.get((statement, configuration))
        if row is None:
            return "–"
        worst = "" if row["worst_bin"] is None else f", {100 * row['worst_bin']:.0f}"
        return f"{100 * row['inside']:.0f} ({100 * row['low']:.0f}-{100 * row['high']:.0f}{worst})"

    return page(
        "Stated errors",
        "How many lie inside the stated 90 %; every person counts the same. In brackets the 90 % interval over people, "
        "and the least share of any tenth of the cases by what is known where it is stated.",
        [
            Table(
                "Inside, %",
                ["statement", *configurations],
                ([s, *(cell(s, c) for c in configurations)] for s in statements_),
            ),
            Table(
                "By the angle that was found",
                ["angle", "from", "to", "found less true, deg", "inside, %"],
                (
                    [angle, f"{low:.0f}", f"{high:.0f}", f"{mean:+.0f}", f"{100 * share:.0f}"]
                    for angle, low, high, mean, share in by_size(cases, configurations[0])
                ),
                f"{configurations[0]}; tenths of the cases.",
            ),
        ],
    )


def refitted(cases: Cases, noise: JointNoise | None = None) -> JointNoise:
    """The noise with each angle's factor, and its part by the found angle, that hold in these configurations together;
    and the same of its rates."""
    noise = shipped_noise() if noise is None else noise
    factors, more, rates = {}, {}, {}
    for name in ANGLES:
        both = of_both(name)
        if both not in factors:
            factors[both], more[both] = _angle(_pooled(cases, both), noise.factors[name])
            rates[both] = _rate(_pooled(cases, f"rate of {both}"))
    of_each = {name: of_both(name) for name in ANGLES}
    return replace(
        noise,
        factors={name: factors[both] for name, both in of_each.items()},
        more={name: more[both] for name, both in of_each.items()},
        rates={name: rates[both] for name, both in of_each.items()},
    )


def _pooled(cases: Cases, statement: str) -> list[Stated]:
    return [take for by_statement in cases.values() for take in by_statement.get(statement, ())]


def _angle(takes: Sequence[Stated], factor: float) -> tuple[float, tuple[list[float], list[float]]]:
    found = np.concatenate([take.known["found"] for take in takes])
    knots = np.unique(5 * np.round(np.quantile(found, _KNOTS) / 5))

    def squares(take: Stated) -> np.ndarray:
        noise = (SD_90 * take.known["noise"][:, None]) ** 2
        return np.concatenate([noise, SD_90**2 * _hats(take.known["found"], knots)], axis=1)

    share, *at_knots = np.sqrt(fitted(takes, squares))
    return round(factor * float(share), 3), (knots.tolist(), [round(float(sd), 2) for sd in at_knots])


def _rate(takes: Sequence[Stated]) -> tuple[float, float, float]:
    def squares(take: Stated) -> np.ndarray:
        model, rate = take.known["model"], take.known["rate"]
        return SD_90**2 * np.stack([model**2, rate**2, np.ones(len(rate))], axis=1)

    share, of_rate, least = np.sqrt(fitted(takes, squares))
    return round(float(share), 3), round(float(of_rate), 3), round(float(least), 2)


def _hats(values: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """(N, K) the weights with which values (N,) lie between knots (K,); squares of standard deviations between them."""
    return np.stack([np.interp(values, knots, row) for row in np.eye(len(knots))], axis=1)
