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

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
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
from ...lifter.load import load_lifter
from ..common.cases import Cases, Row, column, quantile, weights
from . import judge
from .judge import Squares, fitted, held_out, thinned
from .runs import Configuration, finished
from .statements import statements
from .testbed import BALANCING, VIEWS

Groups = Mapping[str, Sequence[Cases]]  # what takes state of one thing, by configuration
_KNOTS = (0.01, 0.25, 0.5, 0.75, 0.99)  # quantiles of the found angle, to the nearest 5 degrees
_FEWEST = 15  # cases that a take counts with in a posture, half a second: of less a person would count as of minutes
_JOINTS = ("joints in depth", "joints across")
# In which angles' errors are fitted.
FITTED = ["bodies alone", "image", "unsuspected errors", "moving", "typical", "typical, image"]
_ARMS = FEATURES.index("arms")


def configurations(asked: Configuration) -> dict[str, Configuration]:
    """Those that are judged, by name."""
    return {
        "bodies alone": asked,
        "image": replace(asked, image=True),
        "unsuspected errors": replace(asked, image=True, unsuspected=2.0),
        "up given": replace(asked, up_told=True),
        "moving": replace(asked, camera="moving"),
        "moving, image": replace(asked, camera="moving", image=True),
        "typical": replace(asked, bed="typical"),
        "typical, image": replace(asked, bed="typical", image=True),
        "typical, focal given": replace(asked, bed="typical", focal_known=True),
        **{f"{side}, image": replace(asked, bed="typical", image=True, side=side) for side in VIEWS},
        "60 fps": replace(asked, fps=60.0),
        "capture": replace(asked, lifter=""),
        "real take": replace(asked, real=BALANCING),
        "real take, image": replace(asked, real=BALANCING, image=True),
    }


def rows(asked: Configuration) -> Iterator[Row]:
    """("statements", statement, configuration) and ("postures", statement, posture): Cases of each take. InputError for
    a part that there is not, and one that nothing is fitted in."""
    known = configurations(replace(asked, errors=_begun(asked)))
    if unknown := [name for name in asked.part if name not in known]:
        raise InputError(
            "name-unknown", f"There is no part '{unknown[0]}'; {did_you_mean(unknown[0], known)}"
        )
    if asked.fit and asked.part and not {*asked.part} & {*FITTED}:
        raise InputError(
            "needs-input", f"Expected a part that errors are fitted in with --fit: {', '.join(FITTED)}."
        )
    for name in dict.fromkeys(asked.part or known):
        how = known[name]
        for seed in range(asked.seed, asked.seed + (1 if how.real else asked.draws)):
            for run in finished(replace(how, seed=seed)):
                for statement, cases in statements(run).items():
                    yield ("statements", statement, name), cases
                    yield from ((("postures", statement, of), part) for of, part in by_posture(cases))


def _begun(asked: Configuration) -> Path | None:
    """The errors that takes are given, with which what is fitted begins; None: the shipped ones. Other lifters than the
    shipped one have errors by a file alone."""
    stranger = asked.fit and load_lifter(asked.lifter).method != shipped_noise().lifter
    return asked.errors or (NOISE_FILE if stranger else None)


def by_posture(cases: Cases) -> Iterator[tuple[str, Cases]]:
    """(name, the cases of a take) of all, of each of POSTURES, and of slow and of fast motion, where it has _FEWEST, or
    all of its own."""
    bars = Cases(cases.person, {name: cases[name] for name in ("error", "half")})
    speed = cases["speed"]
    among = {name: cases["posture"] == number for number, name in enumerate(POSTURES)}
    yield "all", bars
    for name, use in {**among, "slow": speed <= FAST, "fast": speed > FAST}.items():
        if use.sum() >= min(_FEWEST, len(cases)):
            yield name, bars.where(use)


def summary(takes: Sequence[Cases]) -> dict[str, Any]:
    """What is said of one statement in one configuration, or one posture."""
    error = column(takes, "error")

    def mean(values: np.ndarray) -> float:
        return float(np.average(values, weights=weights(takes)))

    return {
        **{name: round(share, 3) for name, share in judge.inside(takes).items()},
        "needed": round(judge.factor(takes), 2),
        "rms": _short(mean(error**2) ** 0.5),
        "p50": _short(quantile(takes, np.abs(error))),
        "bar": _short(quantile(takes, column(takes, "half"))),
        "bias": _short(mean(error)),
    }


def further(
    asked: Configuration, output: Path, values: Mapping[tuple[str, ...], Sequence[Cases]]
) -> Iterator[Row]:
    """Where a fit is asked for, write joint_noise.json: ("strangers", statement, configuration), {"inside": share}."""
    if not asked.fit:
        return
    named: dict[str, dict[str, Sequence[Cases]]] = {}
    for (table, statement, name), takes in values.items():
        if table == "statements" and name in FITTED:
            named.setdefault(statement, {})[name] = takes
    noise = refitted(named, read_noise(_begun(asked) or NOISE_FILE))
    noise = replace(noise, lifter=load_lifter(asked.lifter).method)
    write_text(output / "joint_noise.json", noise.as_json())
    for statement, name, share in of_strangers(named):
        yield ("strangers", statement, name), {"inside": round(share, 3)}


def _short(figure: float) -> float:
    return float(f"{figure:.3g}")


def refitted(named: Mapping[str, Groups], noise: JointNoise) -> JointNoise:
    """The noise with each angle's factors, its part by the found angle, and the same of its rate, and what joints err
    by, that hold in these configurations together; the part of raised arms is not made smaller, for hardly anybody
    raises one here. named: by statement."""
    of_angles = {
        both: _of_angle_and_rate(both, _pooled(named[both]), _pooled(named[f"rate of {both}"]))
        for both in dict.fromkeys(map(of_both, ANGLES))
    }
    parts: dict[str, Any] = {}
    for name in ANGLES:
        for part, value in of_angles[of_both(name)].items():
            parts.setdefault(part, {})[name] = value
        raised = noise.postures.get(name, np.zeros(len(FEATURES)))[_ARMS]
        parts["postures"][name][_ARMS] = max(parts["postures"][name][_ARMS], raised)
    joints = [take for statement in _JOINTS for take in _pooled(named.get(statement, {}))]
    if joints:  # none of a lifter that states no error of joints
        own, focal, pitch = np.sqrt(fitted(joints, _of_turn)).tolist()
        parts["turn"] = round(own, 3), round(focal, 3), round(pitch, 4)
    return replace(noise, **parts)


def _pooled(groups: Groups) -> list[Cases]:
    return [*chain.from_iterable(groups.values())]


def _of_angle_and_rate(both: str, takes: Sequence[Cases], rates: Sequence[Cases]) -> dict[str, Any]:
    """What JointNoise has of an angle of both sides, which these state, and of its rate."""
    knots = _knots(takes, both)
    share, *rest = np.sqrt(fitted(takes, partial(_of_angle, both, knots))).tolist()
    tilt = rest.pop(0) if _needs_gravity(both) else 0.0
    rest = [round(each, 2) for each in rest]
    at, more, postures = knots.tolist(), rest[: len(knots)], rest[len(knots) :]
    if both in MIRRORED_SIGN:
        at, more = [-each for each in at[:0:-1]] + at, more[:0:-1] + more
    of_rate = np.sqrt(fitted(rates, _of_rate)).tolist()
    return {
        "factors": round(share, 3),
        "tilts": round(tilt, 3),
        "more": (at, more),
        "postures": postures,
        "rates": tuple(map(round, of_rate, (3, 3, 2, 1))),
    }


def squares_of(statement: str, takes: Sequence[Cases]) -> Squares | None:
    """What the square of its bar is a weighted sum of; None of a statement that nothing is fitted to."""
    if statement in OF_BOTH:
        return partial(_of_angle, statement, _knots(takes, statement))
    if statement.removeprefix("rate of ") in OF_BOTH:
        return _of_rate
    return _of_turn if statement in _JOINTS else None


def _of_angle(both: str, knots: np.ndarray, take: Cases) -> np.ndarray:
    """The joints' noise, up's error where gravity matters, the part that goes with the found angle, and the posture."""
    parts = ("noise", "tilt") if _needs_gravity(both) else ("noise",)
    known = np.stack([take[part] for part in parts], axis=1)
    found = _found(take, both)
    between = np.stack([np.interp(found, knots, row) for row in np.eye(len(knots))], axis=1)
    return SD_90**2 * np.concatenate([known**2, between, growth(take.values) ** 2], axis=1)


def _of_rate(take: Cases) -> np.ndarray:
    parts = take["model"], take["rate"], np.ones(len(take)), take["faster"]
    return SD_90**2 * np.stack(parts, axis=1) ** 2


def _of_turn(take: Cases) -> np.ndarray:
    return np.stack([take[name] for name in ("own", "by focal", "by pitch")], axis=1)


def _knots(takes: Sequence[Cases], both: str) -> np.ndarray:
    """(K,) the found angles at which the part that goes with them is fitted."""
    of_all = np.concatenate([_found(take, both) for take in takes])
    knots = np.unique(5 * np.round(np.quantile(of_all, _KNOTS) / 5))
    return np.unique(np.append(0.0, knots)) if both in MIRRORED_SIGN else knots


def _found(take: Cases, both: str) -> np.ndarray:
    """Of an angle that changes sign in a mirror its size counts, for a body errs as its mirror image does."""
    return np.abs(take["found"]) if both in MIRRORED_SIGN else take["found"]


def _needs_gravity(both: str) -> bool:
    return ANGLES[sides_of(both)[0]].needs_gravity


def of_strangers(named: Mapping[str, Groups]) -> Iterator[tuple[str, str, float]]:
    """(statement, configuration, share inside) of what is fitted, each person by bars that were fitted to all the
    others."""
    for statement, groups in named.items():
        groups = {name: [thinned(take) for take in takes] for name, takes in groups.items()}
        takes = _pooled(groups)
        squares = squares_of(statement, takes)
        if squares is not None and len({take.person for take in takes}) > 1:  # else nobody to fit them to
            for name, found in held_out(groups, squares).items():
                yield statement, name, judge.inside(found)["inside"]
