"""Whether every stated error holds, in every configuration of a run:  pcnet3d evaluate errors -o DIR

And what would make them hold: with --fit the errors of angles and rates are fitted to these takes and written to
DIR/joint_noise.json, as models/angle_error has it and as a run takes it (--set angles.errors=FILE). Every figure is by
the procedure of judge.py.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.files.atomic import whole_file
from ....pipeline.signals.angles import ANGLES, of_both
from ...angle_error.joint_noise import NOISE_FILE, JointNoise, read_noise, shipped_noise
from ...common.metrics import SD_90
from ...lifter.load import load_lifter
from ..evaluation.finished import Configuration, finished
from ..evaluation.foreign import Answers, Simulated
from ..evaluation.sets import Question
from ..evaluation.tables import Page, Table
from . import judge
from .fit import fitted
from .judge import Stated
from .statements import statements

Cases = dict[str, dict[str, list[Stated]]]  # by configuration and statement
_KNOTS = (0.02, 0.25, 0.5, 0.75, 0.98)  # quantiles of the found angle, to the nearest 5 degrees
_ROWS = "errors.json"

PAGE = Page(
    "Stated errors",
    ". How many lie inside the stated 90 %; every person counts the same, and every take of a person. In brackets the "
    "90 % interval over people, then the least share of any tenth of the cases by what is known where it is stated, "
    "and what the bars would have to be multiplied by.",
    [
        Table(
            "Inside",
            "statements/*/*",
            ["statement", "configuration"],
            {
                "cases": "{cases}",
                "people": "{people}",
                "inside": "{inside:.0%} ({low:.0%} to {high:.0%})",
                "worst tenth": "{worst_bin:.0%}",
                "needed": "{needed:.2f}",
            },
        ),
        Table(
            "By the angle that was found",
            "sizes/*/*",
            ["angle", "found, deg"],
            {"found less true, deg": "{bias:+.1f}", "inside": "{inside:.0%}"},
            "Bodies alone, wild cameras; tenths of the cases.",
        ),
    ],
)


def asked(question: Question, answers: Answers | None = None) -> dict[str, Configuration]:
    """The configurations that are judged, by name: of the question's lifter and of simulated foreign ones, or of a
    lifter's answers."""
    if answers is not None:
        return {
            f"{answers.name}, {bed}{', image' if image else ''}": Configuration(
                image, foreign=answers, bed=bed
            )
            for bed in answers.beds(question.seed)
            for image in (False, True)
        }
    own = Configuration(lifter=str(question.lifter))
    return {
        "bodies alone": own,
        "image": replace(own, image=True),
        "up told": replace(own, up_told=True),
        "moving": replace(own, camera="moving"),
        "moving, image": replace(own, camera="moving", image=True),
        "typical": replace(own, bed="typical"),
        "typical, image": replace(own, bed="typical", image=True),
        "60 fps": replace(own, fps=60.0),
        "capture": replace(own, lifter=""),
        "simulated foreign lifters": Configuration(foreign=Simulated()),
    }


def tables(
    question: Question,
    part: Sequence[str] | None = None,
    fit: bool = False,
    output: Path | None = None,
    answers: Path | None = None,
    errors: Path | None = None,
) -> dict[str, Any]:
    """Everything the report says. part: only these configurations. fit, output: see above; `errors.json` in output
    holds the rows {statement, configuration, set, cases, people, inside, low, high, worst_bin, needed}. answers: judge
    that lifter's (foreign.Answers). errors: a file of errors of angles that takes are given; what is fitted begins with
    these, or the shipped ones."""
    errors = errors or (NOISE_FILE if fit else None)
    foreign = None if answers is None else Answers(answers)
    configurations = asked(question, foreign)
    if fit:  # nothing follows from what nobody made, or a network of another kind
        configurations = {
            name: of for name, of in configurations.items() if not isinstance(of.foreign, Simulated)
        }
    configurations = {name: replace(of, errors=errors) for name, of in configurations.items()}
    cases = collected(question, configurations, part)
    rows = list(judged(cases, str(question.people)))
    results: dict[str, Any] = {**question.heading(), "statements": {}, "sizes": {}}
    for row in rows:
        results["statements"].setdefault(row["statement"], {})[row["configuration"]] = row
    for angle, size, figures in by_size(next(iter(cases.values()), {})):
        results["sizes"].setdefault(angle, {})[size] = figures
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        with whole_file(output / _ROWS) as partial:
            lines = ",\n ".join(json.dumps(row) for row in rows)
            partial.write_text(f"[\n {lines}\n]\n", encoding="utf-8")
        if fit:
            of = load_lifter(str(question.lifter)).method if foreign is None else foreign.name
            noise = replace(refitted(cases, read_noise(errors or NOISE_FILE)), lifter=of)
            with whole_file(output / "joint_noise.json") as partial:
                partial.write_text(noise.as_json(), encoding="utf-8")
    return results


def collected(
    question: Question, configurations: Mapping[str, Configuration], part: Sequence[str] | None = None
) -> Cases:
    """Everything that the question's takes state, in every configuration."""
    cases: Cases = {}
    for name, configuration in configurations.items():
        if part and name not in part:
            continue
        by_statement = cases.setdefault(name, {})
        for take in finished(question, configuration):
            for stated in statements(take, read_noise(configuration.errors or NOISE_FILE)):
                if len(stated.error):
                    by_statement.setdefault(stated.statement, []).append(stated)
    return cases


def judged(cases: Cases, people: str) -> Iterator[dict[str, Any]]:
    """A row a statement and configuration."""
    for configuration, by_statement in cases.items():
        for statement, takes in by_statement.items():
            bins = [one.inside for name in takes[0].known for *_, one in judge.bins(takes, name)]
            yield {
                "statement": statement,
                "configuration": configuration,
                "set": people,
                **{
                    k: round(v, 3) if isinstance(v, float) else v
                    for k, v in asdict(judge.inside(takes)).items()
                },
                "worst_bin": round(min(bins), 3) if bins else None,
                "needed": round(judge.factor(takes), 2),
            }


def by_size(by_statement: Mapping[str, Sequence[Stated]]) -> Iterator[tuple[str, str, dict[str, float]]]:
    """(angle, "from to to", {"bias", "inside"}) in tenths of the found angle."""
    for statement, takes in by_statement.items():
        if "found" in takes[0].known:
            for low, high, mean, one in judge.bins(takes, "found"):
                yield statement, f"{low:.0f} to {high:.0f}", {"bias": mean, "inside": one.inside}


def refitted(cases: Cases, noise: JointNoise | None = None) -> JointNoise:
    """The noise with each angle's factor, its part by the found angle, and the same of its rate, that hold in these
    configurations together."""
    noise = shipped_noise() if noise is None else noise
    factors, more, rates = {}, {}, {}
    for name in ANGLES:
        both = of_both(name)
        if both not in factors:
            factors[both], more[both] = _angle(_pooled(cases, both), noise.factors.get(name, 1.0))
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
