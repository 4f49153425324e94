"""Whether every stated error holds, in every configuration of a run:  pcnet3d lab evaluate errors -o DIR

And what would make them hold: with --fit the errors of angles and rates are fitted to these takes, of the
configurations FITTED, and written to DIR/joint_noise.json, as models/angle_error has it and as a run takes it (--set
angles.errors=FILE). Every figure is by the procedure of judge.py.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.measures import SD_90
from ....pipeline.files.atomic import write_text
from ....pipeline.plugins.options import did_you_mean
from ....pipeline.signals.angles import ANGLES, MIRRORED_SIGN, OF_BOTH, of_both, sides_of
from ...angle_error.joint_noise import NOISE_FILE, JointNoise, read_noise, shipped_noise
from ...angle_error.posture import FAST, FEATURES, POSTURES, growth
from ...common.metrics import plain
from ...lifter.load import load_lifter
from . import judge
from .judge import Squares, Stated, fitted, held_out, thinned
from .real_data import BALANCING
from .runs import Configuration, Question, finished
from .statements import statements
from .testbed import VIEWS

Cases = dict[str, dict[str, list[Stated]]]  # by configuration and statement
_KNOTS = (0.01, 0.25, 0.5, 0.75, 0.99)  # quantiles of the found angle, to the nearest 5 degrees
_FEWEST = 15  # cases that a take counts with in a posture, half a second: of less a person would count as of minutes
_JOINTS = ("joints in depth", "joints across")
# In which angles' errors are fitted.
FITTED = ("bodies alone", "image", "unsuspected errors", "moving", "typical", "typical, image")
# Bodies in postures that the people hardly take of themselves, with the features (posture.py) whose parts are made as
# large as these ask for: of their 36,872 frames 38 have an upper arm over 150 degrees from the trunk, none over 165.
POSED = {"arms raised": ("arms",)}

ABOUT = (
    "How many lie inside the stated 90 %; every person counts the same, and every take of a person. low, high: the 90"
    " % interval over people; needed: what the bars would have to be multiplied by. bias: mean of found less true; "
    "p50, rms: size of the errors; bar: the median. In degrees where no unit is named. Of strangers: what --fit fits, "
    "each person by bars that were fitted to all the others. Postures: as a run finds them, all configurations "
    "together; of figures of many frames what a fifth of these reach; of frames by takes with half a second."
)


def asked(question: Question) -> dict[str, Configuration]:
    """The configurations that are judged, by name."""
    own = question.how()
    return {
        "bodies alone": own,
        "image": replace(own, image=True),
        "unsuspected errors": replace(own, image=True, unsuspected=2.0),
        "up given": replace(own, up_told=True),
        "moving": replace(own, camera="moving"),
        "moving, image": replace(own, camera="moving", image=True),
        **{pose: replace(own, image=True, pose=pose) for pose in POSED},
        "typical": replace(own, bed="typical"),
        "typical, image": replace(own, bed="typical", image=True),
        "typical, focal given": replace(own, bed="typical", focal_known=True),
        **{f"{side}, image": replace(own, bed="typical", image=True, side=side) for side in VIEWS},
        "60 fps": replace(own, fps=60.0),
        "capture": replace(own, lifter=""),
        "real take": replace(own, real=BALANCING),
        "real take, image": replace(own, real=BALANCING, image=True),
    }


def tables(
    question: Question,
    part: Sequence[str] | None = None,
    fit: bool = False,
    output: Path | None = None,
    errors: Path | None = None,
    draws: int = 1,
) -> dict[str, Any]:
    """Everything the report says. part: only these configurations. draws: of cameras and detectors; one tells of a
    posture that few people take what cameras they happen to get. fit, output: see above; `errors.json` in output holds
    the rows {statement, configuration, set, cases, people, inside, low, high, needed, rms, p50, bar}. errors: a
    file of errors of angles that takes are given; what is fitted begins with these, or the shipped ones.
    InputError for a part that there is not, and one that nothing is fitted in."""
    known = asked(question)
    if unknown := [name for name in part or () if name not in known]:
        raise InputError(
            "name-unknown", f"There is no part '{unknown[0]}'; {did_you_mean(unknown[0], known)}"
        )
    if fit and part and not set(part) & {*FITTED, *POSED}:
        raise InputError(
            "needs-input",
            f"Expected a part that errors are fitted in with --fit: {', '.join([*FITTED, *POSED])}.",
        )
    method = load_lifter(str(question.lifter)).method
    # Other lifters than the shipped one have errors by a file alone: what is fitted begins with one.
    begun = errors or (NOISE_FILE if fit and method != shipped_noise().lifter else None)
    asked_for = {name: replace(of, errors=begun) for name, of in known.items() if not part or name in part}
    cases = collected(question, asked_for, draws)
    rows = [
        row | ({"set": "val"} if known[row["configuration"]].real else {})  # whoever else is judged
        for row in judged(cases, str(question.people))
    ]
    results: dict[str, Any] = {
        **question.heading(),
        "draws": draws,
        "statements": {},
        "postures": {},
        "strangers": {},
    }
    for row in rows:
        bias = judge.mean(cases[row["configuration"]][row["statement"]], lambda take: take.error)
        results["statements"].setdefault(row["statement"], {})[row["configuration"]] = {**row, "bias": bias}
    for statement in results["statements"]:
        apart = by_posture(_pooled(cases, statement))
        results["postures"][statement] = {name: asdict(inside) for name, inside in apart}
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        write_text(output / "errors.json", as_json(rows))
        if fit:
            own = {name: of for name, of in cases.items() if name in FITTED}
            noise = read_noise(begun or NOISE_FILE)
            noise = replace(refitted(own, noise) if own else noise, lifter=method)
            strangers = of_strangers(own)
            for pose, growing in POSED.items():
                noise, shares = with_posture(noise, cases.get(pose, {}), growing)
                for statement, share in shares.items():
                    strangers.setdefault(statement, {})[pose] = share
            write_text(output / "joint_noise.json", noise.as_json())
            results["strangers"] = {
                statement: {name: {"inside": share} for name, share in shares.items()}
                for statement, shares in strangers.items()
            }
    return results


def collected(question: Question, configurations: Mapping[str, Configuration], draws: int = 1) -> Cases:
    """Everything that the question's takes state, in these configurations, by so many seeds from its own on; real
    takes once."""
    cases: Cases = {}
    for name, configuration in configurations.items():
        by_statement = cases.setdefault(name, {})
        for draw in range(1 if configuration.real else draws):
            for take in finished(replace(question, seed=question.seed + draw), configuration):
                for stated in statements(take):
                    if len(stated.error):
                        by_statement.setdefault(stated.statement, []).append(stated)
    return cases


def judged(cases: Cases, people: str) -> Iterator[dict[str, Any]]:
    """A row a statement and configuration."""
    for configuration, by_statement in cases.items():
        for statement, takes in by_statement.items():
            yield {
                "statement": statement,
                "configuration": configuration,
                "set": people,
                **{
                    k: round(v, 3) if isinstance(v, float) else v
                    for k, v in asdict(judge.inside(takes)).items()
                },
                "needed": round(judge.factor(takes), 2),
                "rms": _short(judge.mean(takes, lambda take: take.error**2) ** 0.5),
                "p50": _short(judge.quantile(takes, lambda take: np.abs(take.error))),
                "bar": _short(judge.quantile(takes, lambda take: take.half)),
            }


def as_json(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows as errors.json has them, a line each."""
    lines = ",\n ".join(json.dumps(plain(row)) for row in rows)
    return f"[\n {lines}\n]\n"


def _short(figure: float) -> float:
    return float(f"{figure:.3g}")


def by_posture(takes: Sequence[Stated]) -> Iterator[tuple[str, judge.Inside]]:
    """(name, how many are inside) of all cases, of each of POSTURES, and of slow and of fast motion, by takes that have
    _FEWEST there, or all of theirs."""

    def of(name: str, least: float, most: float) -> judge.Inside:
        parts = [take.part((take.known[name] > least) & (take.known[name] <= most)) for take in takes]
        pairs = zip(parts, takes, strict=True)
        return judge.inside(
            [part for part, take in pairs if len(part.error) >= min(_FEWEST, len(take.error))]
        )

    yield "all", judge.inside(takes)
    for place, name in enumerate(POSTURES):
        yield name, of("posture", place - 0.5, place + 0.5)
    yield "slow", of("speed", -np.inf, FAST)
    yield "fast", of("speed", FAST, np.inf)


def refitted(cases: Cases, noise: JointNoise) -> JointNoise:
    """The noise with each angle's factors, its part by the found angle, and the same of its rate, and what joints err
    by, that hold in these configurations together."""
    every = dict.fromkeys(map(of_both, ANGLES))
    parts = {both: _angle(_pooled(cases, both), both) for both in every}
    rates = {both: _rate(_pooled(cases, f"rate of {both}")) for both in every}
    factors, tilts, more, postures = ({name: parts[of_both(name)][i] for name in ANGLES} for i in range(4))
    return replace(
        noise,
        factors=factors,
        tilts=tilts,
        more=more,
        postures=postures,
        rates={name: rates[of_both(name)] for name in ANGLES},
        turn=_turn([take for statement in _JOINTS for take in _pooled(cases, statement)], noise.turn),
    )


def _pooled(cases: Cases, statement: str) -> list[Stated]:
    return [take for by_statement in cases.values() for take in by_statement.get(statement, ())]


def _angle(
    takes: Sequence[Stated], both: str
) -> tuple[float, float, tuple[list[float], list[float]], list[float]]:
    knots, squares = _of_angle(takes, both)
    share, *rest = np.sqrt(fitted(takes, squares)).tolist()
    rest, postures = rest[: -len(FEATURES)], rest[-len(FEATURES) :]
    tilt, at_knots = (rest[0], rest[1:]) if _needs_gravity(both) else (0.0, rest)
    at, more = knots.tolist(), [round(each, 2) for each in at_knots]
    if both in MIRRORED_SIGN:
        at, more = [-each for each in at[:0:-1]] + at, more[:0:-1] + more
    return round(share, 3), round(tilt, 3), (at, more), [round(each, 2) for each in postures]


def _of_angle(takes: Sequence[Stated], both: str) -> tuple[np.ndarray, Squares]:
    """The found angles at which the part that goes with them is fitted, and what all parts are of: the joints'
    noise, up's error where gravity matters, that one, and the posture. Of an angle that changes sign in a mirror its
    size counts, for a body errs as its mirror image does."""

    def found(take: Stated) -> np.ndarray:
        values = take.known["found"]
        return np.abs(values) if both in MIRRORED_SIGN else values

    of_all = np.concatenate([found(take) for take in takes])
    knots = np.unique(5 * np.round(np.quantile(of_all, _KNOTS) / 5))
    if both in MIRRORED_SIGN:
        knots = np.unique(np.append(0.0, knots))

    parts = ("noise", "tilt") if _needs_gravity(both) else ("noise",)

    def squares(take: Stated) -> np.ndarray:
        known = np.stack([take.known[part] for part in parts], axis=1)
        return SD_90**2 * np.concatenate(
            [known**2, _hats(found(take), knots), growth(take.known) ** 2], axis=1
        )

    return knots, squares


def _needs_gravity(both: str) -> bool:
    return ANGLES[sides_of(both)[0]].needs_gravity


def with_posture(
    noise: JointNoise, cases: Mapping[str, Sequence[Stated]], growing: Sequence[str]
) -> tuple[JointNoise, dict[str, float]]:
    """The noise whose parts of these features are as large as these cases ask for, all others as they are, and none
    smaller than it was: bars have to hold in usual motion too. Of each angle also the share inside, each person by
    parts that were fitted to all the others."""
    columns, postures, shares = [FEATURES.index(name) for name in growing], dict(noise.postures), {}

    def squares(take: Stated) -> np.ndarray:
        return SD_90**2 * growth(take.known)[:, columns] ** 2

    for both in OF_BOTH:
        names = sides_of(both)
        takes = [_without(noise, names[0], take, columns) for take in cases.get(both, ())]
        takes = [take.part(np.flatnonzero(squares(take).sum(axis=1))) for take in takes]
        takes = [take for take in takes if len(take.error)]
        if len({take.person for take in takes}) < 2:
            continue
        asked_for = np.sqrt(fitted(takes, squares, on_top=True))
        shares[both] = round(judge.inside(held_out({"": takes}, squares, on_top=True)[""]).inside, 3)
        for name in names:
            parts = np.array(noise.postures.get(name, np.zeros(len(FEATURES))))
            parts[columns] = np.maximum(parts[columns], asked_for)
            postures[name] = [round(each, 2) for each in parts.tolist()]
    return replace(noise, postures=postures), shares


def _without(noise: JointNoise, name: str, take: Stated, columns: Sequence[int]) -> Stated:
    """The take with the noise's bars of an angle but for these features' parts."""
    beyond = growth(take.known)
    beyond[:, columns] = 0
    parts = noise.factors[name] * take.known["noise"], noise.tilts[name] * take.known["tilt"]
    return replace(take, half=SD_90 * noise.whole(name, *parts, take.known["found"], beyond))


def _turn(takes: Sequence[Stated], known: tuple[float, float, float]) -> tuple[float, float, float]:
    if not takes:  # of a lifter that states no error of joints
        return known

    own, focal, pitch = np.sqrt(fitted(takes, _of_turn))
    return round(float(own), 3), round(float(focal), 3), round(float(pitch), 4)


def _rate(takes: Sequence[Stated]) -> tuple[float, float, float, float]:
    share, of_rate, least, of_speed = np.sqrt(fitted(takes, _of_rate)).tolist()
    return round(share, 3), round(of_rate, 3), round(least, 2), round(of_speed, 1)


def _of_turn(take: Stated) -> np.ndarray:
    return np.stack([take.known[name] for name in ("own", "by focal", "by pitch")], axis=1)


def _of_rate(take: Stated) -> np.ndarray:
    model, rate, faster = (take.known[name] for name in ("model", "rate", "faster"))
    return SD_90**2 * np.stack([model**2, rate**2, np.ones(len(rate)), faster**2], axis=1)


def of_strangers(cases: Cases) -> dict[str, dict[str, float]]:
    """{statement: {configuration: share inside}} of what is fitted in these configurations, each person by bars that
    were fitted to all the others."""
    out: dict[str, dict[str, float]] = {}
    for statement in dict.fromkeys(chain.from_iterable(cases.values())):
        by_group = {name: [*map(thinned, of[statement])] for name, of in cases.items() if statement in of}
        takes = [*chain.from_iterable(by_group.values())]
        if len({take.person for take in takes}) < 2:  # nobody to fit them to
            continue
        squares: Squares | None = None
        if statement in OF_BOTH:
            squares = _of_angle(takes, statement)[1]
        elif statement.removeprefix("rate of ") in OF_BOTH:
            squares = _of_rate
        elif statement in _JOINTS:
            squares = _of_turn
        if squares is not None:
            found = held_out(by_group, squares)
            out[statement] = {name: round(judge.inside(of).inside, 3) for name, of in found.items()}
    return out


def _hats(values: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """(N, K) the weights with which values (N,) lie between knots (K,); squares of standard deviations between them."""
    return np.stack([np.interp(values, knots, row) for row in np.eye(len(knots))], axis=1)
