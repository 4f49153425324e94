"""Whether every stated error holds, in every configuration of a run:  pcnet3d lab evaluate errors -o DIR

How many lie inside the stated 90 % (judge.py); every person counts the same, and every take of a person. low, high: the
90 % interval over people; needed: what the bars would have to be multiplied by. bias: mean of found less true; p50,
rms: size of the errors; bar: the median. In degrees where no unit is named. Postures: as a run finds them, all
configurations together; of figures of many frames what a fifth of these reach; of frames by takes with half a second.

And what would make them hold: with --fit the errors of angles and rates are fitted to these takes, of the
configurations FITTED, and written to DIR/joint_noise.json, as models/angle_error has it and as a run takes it (--set
angles.errors=FILE). Of strangers: what --fit fits, each person by bars that were fitted to all the others.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
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
from .judge import Squares, Stated, by_statement, fitted, held_out, thinned
from .runs import Configuration, finished
from .statements import statements
from .testbed import BALANCING, VIEWS

Cases = dict[str, dict[str, list[Stated]]]  # by configuration and statement
_KNOTS = (0.01, 0.25, 0.5, 0.75, 0.99)  # quantiles of the found angle, to the nearest 5 degrees
_FEWEST = 15  # cases that a take counts with in a posture, half a second: of less a person would count as of minutes
_JOINTS = ("joints in depth", "joints across")
# In which angles' errors are fitted.
FITTED = ("bodies alone", "image", "unsuspected errors", "moving", "typical", "typical, image")
# Bodies whose arms a program raised, by which the parts for raised arms are made as large as these ask for: of the
# people's 36,872 frames 38 have an upper arm over 150 degrees from the trunk, none over 165.
RAISED, _ARMS = "arms raised", FEATURES.index("arms")


def configurations(asked: Configuration) -> dict[str, Configuration]:
    """Those that are judged, by name."""
    return {
        "bodies alone": asked,
        "image": replace(asked, image=True),
        "unsuspected errors": replace(asked, image=True, unsuspected=2.0),
        "up given": replace(asked, up_told=True),
        "moving": replace(asked, camera="moving"),
        "moving, image": replace(asked, camera="moving", image=True),
        RAISED: replace(asked, image=True, arms_raised=True),
        "typical": replace(asked, bed="typical"),
        "typical, image": replace(asked, bed="typical", image=True),
        "typical, focal given": replace(asked, bed="typical", focal_known=True),
        **{f"{side}, image": replace(asked, bed="typical", image=True, side=side) for side in VIEWS},
        "60 fps": replace(asked, fps=60.0),
        "capture": replace(asked, lifter=""),
        "real take": replace(asked, real=BALANCING),
        "real take, image": replace(asked, real=BALANCING, image=True),
    }


def tables(
    asked: Configuration,
    output: Path,
    part: Sequence[str] | None = None,
    fit: bool = False,
    draws: int = 1,
) -> dict[str, Any]:
    """Everything the report says. part: only these configurations. draws: of cameras and detectors, by so many seeds;
    one tells of a posture that few people take what cameras they happen to get. fit: see above. `errors.json` in output
    holds the rows {statement, configuration, set, cases, people, inside, low, high, needed, rms, p50, bar}. What is
    fitted begins with the errors that takes are given, or the shipped ones. InputError for a part that there is not,
    and one that nothing is fitted in."""
    known = configurations(asked)
    if unknown := [name for name in part or () if name not in known]:
        raise InputError(
            "name-unknown", f"There is no part '{unknown[0]}'; {did_you_mean(unknown[0], known)}"
        )
    if fit and part and not {*part} & {*FITTED, RAISED}:
        raise InputError(
            "needs-input",
            f"Expected a part that errors are fitted in with --fit: {', '.join([*FITTED, RAISED])}.",
        )
    method = load_lifter(asked.lifter).method
    # Other lifters than the shipped one have errors by a file alone: what is fitted begins with one.
    begun = asked.errors or (NOISE_FILE if fit and method != shipped_noise().lifter else None)
    cases: Cases = {}
    for name, of in known.items():
        if not part or name in part:
            seeds = range(asked.seed, asked.seed + (1 if of.real else draws))
            takes = chain.from_iterable(finished(replace(of, errors=begun, seed=seed)) for seed in seeds)
            cases[name] = by_statement(chain.from_iterable(map(statements, takes)))
    rows: list[dict[str, Any]] = []
    results: dict[str, Any] = {"draws": draws, "statements": {}, "postures": {}, "strangers": {}}
    for name, found in cases.items():
        people = "val" if known[name].real else asked.people  # whoever else is judged
        for statement, takes in found.items():
            rows.append({"statement": statement, "configuration": name, "set": people, **judged(takes)})
            bias = judge.mean(takes, lambda take: take.error)
            results["statements"].setdefault(statement, {})[name] = {**rows[-1], "bias": bias}
    for statement in results["statements"]:
        apart = by_posture(_pooled(cases, statement))
        results["postures"][statement] = {name: asdict(inside) for name, inside in apart}
    output.mkdir(parents=True, exist_ok=True)
    write_text(output / "errors.json", as_json(rows))
    if fit:
        own = {name: of for name, of in cases.items() if name in FITTED}
        noise = read_noise(begun or NOISE_FILE)
        noise = replace(refitted(own, noise) if own else noise, lifter=method)
        noise, of_raised = with_raised_arms(noise, cases.get(RAISED, {}))
        write_text(output / "joint_noise.json", noise.as_json())
        for statement, shares in [*of_strangers(own).items(), *of_raised.items()]:
            results["strangers"].setdefault(statement, {}).update(
                {name: {"inside": share} for name, share in shares.items()}
            )
    return results


def judged(takes: Sequence[Stated]) -> dict[str, Any]:
    """What a row says of one statement in one configuration."""
    shares = asdict(judge.inside(takes)).items()
    return {
        **{name: round(share, 3) if isinstance(share, float) else share for name, share in shares},
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
    of_angles = {both: _of_angle_and_rate(cases, both) for both in dict.fromkeys(map(of_both, ANGLES))}
    parts: dict[str, Any] = {}
    for name in ANGLES:
        for part, value in of_angles[of_both(name)].items():
            parts.setdefault(part, {})[name] = value
    joints = [take for statement in _JOINTS for take in _pooled(cases, statement)]
    if joints:  # none of a lifter that states no error of joints
        own, focal, pitch = np.sqrt(fitted(joints, _of_turn)).tolist()
        parts["turn"] = round(own, 3), round(focal, 3), round(pitch, 4)
    return replace(noise, **parts)


def _pooled(cases: Cases, statement: str) -> list[Stated]:
    return [take for found in cases.values() for take in found.get(statement, ())]


def _of_angle_and_rate(cases: Cases, both: str) -> dict[str, Any]:
    """What JointNoise has of an angle of both sides."""
    takes = _pooled(cases, both)
    knots = _knots(takes, both)
    share, *rest = np.sqrt(fitted(takes, partial(_of_angle, both, knots))).tolist()
    tilt = rest.pop(0) if _needs_gravity(both) else 0.0
    rest = [round(each, 2) for each in rest]
    at, more, postures = knots.tolist(), rest[: len(knots)], rest[len(knots) :]
    if both in MIRRORED_SIGN:
        at, more = [-each for each in at[:0:-1]] + at, more[:0:-1] + more
    rates = np.sqrt(fitted(_pooled(cases, f"rate of {both}"), _of_rate)).tolist()
    return {
        "factors": round(share, 3),
        "tilts": round(tilt, 3),
        "more": (at, more),
        "postures": postures,
        "rates": tuple(map(round, rates, (3, 3, 2, 1))),
    }


def squares_of(statement: str, takes: Sequence[Stated]) -> Squares | None:
    """What the square of its bar is a weighted sum of; None of a statement that nothing is fitted to."""
    if statement in OF_BOTH:
        return partial(_of_angle, statement, _knots(takes, statement))
    if statement.removeprefix("rate of ") in OF_BOTH:
        return _of_rate
    return _of_turn if statement in _JOINTS else None


def _of_angle(both: str, knots: np.ndarray, take: Stated) -> np.ndarray:
    """The joints' noise, up's error where gravity matters, the part that goes with the found angle, and the posture."""
    parts = ("noise", "tilt") if _needs_gravity(both) else ("noise",)
    known = np.stack([take.known[part] for part in parts], axis=1)
    found = _found(take, both)
    between = np.stack([np.interp(found, knots, row) for row in np.eye(len(knots))], axis=1)
    return SD_90**2 * np.concatenate([known**2, between, growth(take.known) ** 2], axis=1)


def _of_rate(take: Stated) -> np.ndarray:
    model, rate, faster = (take.known[name] for name in ("model", "rate", "faster"))
    return SD_90**2 * np.stack([model**2, rate**2, np.ones(len(rate)), faster**2], axis=1)


def _of_turn(take: Stated) -> np.ndarray:
    return np.stack([take.known[name] for name in ("own", "by focal", "by pitch")], axis=1)


def _knots(takes: Sequence[Stated], both: str) -> np.ndarray:
    """(K,) the found angles at which the part that goes with them is fitted."""
    of_all = np.concatenate([_found(take, both) for take in takes])
    knots = np.unique(5 * np.round(np.quantile(of_all, _KNOTS) / 5))
    return np.unique(np.append(0.0, knots)) if both in MIRRORED_SIGN else knots


def _found(take: Stated, both: str) -> np.ndarray:
    """Of an angle that changes sign in a mirror its size counts, for a body errs as its mirror image does."""
    return np.abs(take.known["found"]) if both in MIRRORED_SIGN else take.known["found"]


def _needs_gravity(both: str) -> bool:
    return ANGLES[sides_of(both)[0]].needs_gravity


def with_raised_arms(
    noise: JointNoise, cases: Mapping[str, Sequence[Stated]]
) -> tuple[JointNoise, dict[str, dict[str, float]]]:
    """The noise whose parts of raised arms are as large as these cases ask for, all others as they are, and none
    smaller than it was: bars have to hold in usual motion too. Of each angle also {RAISED: the share inside}, each
    person by parts that were fitted to all the others."""
    postures, shares = dict(noise.postures), {}

    def squares(take: Stated) -> np.ndarray:
        return SD_90**2 * growth(take.known)[:, [_ARMS]] ** 2

    for both in OF_BOTH:
        names = sides_of(both)
        raised = (take.part(np.flatnonzero(squares(take)[:, 0])) for take in cases.get(both, ()))
        takes = [_without_arms(noise, names[0], take) for take in raised if len(take.error)]
        if len({take.person for take in takes}) < 2:
            continue
        asked_for = np.sqrt(fitted(takes, squares, on_top=True))[0]
        inside = judge.inside(held_out({"": takes}, squares, on_top=True)[""]).inside
        shares[both] = {RAISED: round(inside, 3)}
        for name in names:
            parts = list(noise.postures.get(name, np.zeros(len(FEATURES))))
            parts[_ARMS] = max(parts[_ARMS], asked_for)
            postures[name] = [round(float(each), 2) for each in parts]
    return replace(noise, postures=postures), shares


def _without_arms(noise: JointNoise, name: str, take: Stated) -> Stated:
    """The take with the noise's bars of an angle but for the part of raised arms."""
    beyond = growth(take.known)
    beyond[:, _ARMS] = 0
    parts = noise.factors[name] * take.known["noise"], noise.tilts[name] * take.known["tilt"]
    return replace(take, half=SD_90 * noise.whole(name, *parts, take.known["found"], beyond))


def of_strangers(cases: Cases) -> dict[str, dict[str, float]]:
    """{statement: {configuration: share inside}} of what is fitted in these configurations, each person by bars that
    were fitted to all the others."""
    out: dict[str, dict[str, float]] = {}
    for statement in dict.fromkeys(chain.from_iterable(cases.values())):
        by_group = {name: [*map(thinned, of[statement])] for name, of in cases.items() if statement in of}
        takes = [*chain.from_iterable(by_group.values())]
        squares = squares_of(statement, takes)
        if squares is not None and len({take.person for take in takes}) > 1:  # else nobody to fit them to
            found = held_out(by_group, squares)
            out[statement] = {name: round(judge.inside(of).inside, 3) for name, of in found.items()}
    return out
