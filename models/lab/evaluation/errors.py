"""Whether every stated error holds, in every configuration of a run:  pcnet3d lab evaluate errors -o DIR

How many lie inside the stated 90 % (`inside`); every person counts the same, and every take of a person. low, high: the
90 % interval over people; needed: what the bars would have to be multiplied by. bias: mean of found less true; p50,
rms: size of the errors; bar: the median. In degrees where no unit is named. Postures: as a run finds them, all
configurations together; of figures of many frames what a fifth of these reach; of frames by takes with half a second.

And what would make them hold: with --fit the errors of angles and rates are fitted to these takes, of the
configurations FITTED, and written to DIR/joint_noise.json, as models/angle_error has it and as a run takes it (--set
angles.errors=FILE). Of strangers: what --fit fits, each person by bars that were fitted to all the others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import SD_90, Measure, Measures
from ....pipeline.core.rotations import angle_deg, geodesic_deg, is_finite, rotate, transpose, unit
from ....pipeline.files.atomic import write_text
from ....pipeline.plugins.options import did_you_mean
from ....pipeline.signals.angles import (
    ANGLES,
    FINE,
    MIDLINE,
    MIRRORED_SIGN,
    OF_BOTH,
    continuous,
    near,
    of_both,
    sides_of,
)
from ....pipeline.signals.filters import derivative
from ...angle_error.joint_noise import (
    NOISE_FILE,
    JointNoise,
    levers,
    read_noise,
    shipped_noise,
    turns_of,
)
from ...angle_error.posture import FAST, FEATURES, POSTURES, arms_of, growth
from ...angle_error.repeatability import ends
from ...angle_error.take_angles import angle_rates, angle_series, smoothed
from ...lifter.load import load_lifter
from ..beds import BALANCING, BINS, VIEWS, Configuration, Finished, accelerations, finished
from ..cases import (
    Cases,
    Row,
    by_person,
    column,
    grouped,
    interval,
    joined,
    mean,
    people_of,
    quantile,
    scale_of,
    weights,
)
from .gait import true_gait, walks
from .jumps import compared

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
        **{name: round(share, 3) for name, share in inside(takes).items()},
        "needed": round(factor(takes), 2),
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
                yield statement, name, inside(found)["inside"]


COVERED = 0.9  # what "90 %" states
_BINS = 10
_FEWEST_PEOPLE = 3  # of a tenth
_CASES = 250  # of a take
# Covered of the people of the fit, that COVERED of strangers before other cameras are. By folds of people about
# 0.91 lie inside before the same cameras; other cameras cost about a hundredth.
STRANGERS = 0.915
_SOFT = 0.02  # of the loss's corner, in logarithms
_TINY = 1e-12
_NOTHING = 9.0  # in logarithms, by which a part that is none is smaller than usual squares of errors

Squares = Callable[[Cases], np.ndarray]  # (N, K) what the square of the bar is a weighted sum of


def inside(takes: Sequence[Cases]) -> dict[str, Any]:
    """{"cases", "people", "inside": the share of cases within their bars, "low", "high": the 90 % interval of that
    share over people like these}, of takes that are judged (Cases.judged)."""
    shares = by_person(
        (take.person, np.array([np.mean(np.abs(take["error"]) <= take["half"])]))
        for take in takes
        if len(take)
    )
    of_people = np.array([share for (share,) in shares.values()])
    low, high = interval(of_people, np.ones(len(of_people)))
    share = {"inside": mean(of_people), "low": low, "high": high}
    return {"cases": sum(map(len, takes)), "people": len(of_people), **share}


def factor(takes: Sequence[Cases], covered: float = COVERED) -> float:
    """What to multiply the bars by so that `covered` of the cases are inside: the quantile of |error| over bar."""
    return quantile(takes, np.abs(column(takes, "error")) / column(takes, "half"), covered)


def _tenths(takes: Sequence[Cases], name: str) -> Iterator[np.ndarray]:
    """(N,) bool of the cases of all takes that are in a tenth of them by what is known under `name`, of every tenth but
    those of too few people; of postures each by itself, however few they are."""
    values, people = column(takes, name), people_of(takes)
    if len(values) < _BINS:
        return
    if name == "posture":
        yield from (values == which for which in np.unique(values[np.isfinite(values)]))
        return
    edges = np.unique(np.nanquantile(values, np.linspace(0, 1, _BINS + 1)))
    for low, high in pairwise(edges):
        use = (values >= low) & ((values <= high) if high == edges[-1] else (values < high))
        if len(np.unique(people[use])) >= _FEWEST_PEOPLE:
            yield use


def fitted(takes: Sequence[Cases], squares: Squares) -> np.ndarray:
    """(K,) the weights, none below 0, by which STRANGERS of the cases are inside.

    The 90 % quantile of the size of an error is the root of a sum of squares, each a known quantity times a weight, as
    errors of independent causes add. It is fitted by quantile regression of the error's logarithm (Koenker and Bassett
    1978), in all and in every tenth of the cases, so that neither long takes nor large errors nor usual cases decide.
    """
    from scipy.optimize import minimize

    takes = [thinned(take) for take in takes]
    x = np.concatenate([squares(take) for take in takes])
    error = np.log(np.abs(column(takes, "error")) + _TINY)
    known = [name for name in takes[0].values if name not in ("error", "half")]
    parts = [None, *(use for name in known for use in _tenths(takes, name))]
    weight = np.mean([each / each.sum() for each in (weights(takes, use) for use in parts)], axis=0)
    size = np.average(error, weights=weight)
    error = error - size  # so that a part is as small in any unit
    usual = np.average(x, axis=0, weights=weight) + _TINY
    x = x / usual

    def loss(logs: np.ndarray) -> tuple[float, np.ndarray]:
        parts = x * np.exp(logs)
        total = parts.sum(axis=1) + _TINY
        over = error - 0.5 * np.log(total)
        soft = np.logaddexp(0, over / _SOFT) * _SOFT  # max(over, 0), with a round corner
        value = weight @ (soft - (1 - STRANGERS) * over)
        slope = 1 / (1 + np.exp(-np.clip(over / _SOFT, -50, 50))) - (1 - STRANGERS)
        return float(value), -0.5 * ((weight * slope / total) @ parts)

    start = np.full(x.shape[1], np.log(3 / x.shape[1]))
    logs = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=[(-12, 12)] * len(start)).x
    return np.where(logs < -_NOTHING, 0.0, np.exp(logs + 2 * size)) / usual


def held_out(by_group: Mapping[str, Sequence[Cases]], squares: Squares) -> dict[str, list[Cases]]:
    """Each person's takes with the bars that those of all the others ask for, of all groups together; by group."""
    takes = [take for group in by_group.values() for take in group]
    out: dict[str, list[Cases]] = {name: [] for name in by_group}
    for person in sorted({take.person for take in takes}):
        found = fitted([take for take in takes if take.person != person], squares)
        for name, group in by_group.items():
            own = (take for take in group if take.person == person)
            out[name] += [take.having(half=np.sqrt(squares(take) @ found)) for take in own]
    return out


def thinned(take: Cases) -> Cases:
    """At most _CASES of it, drawn: every tenth would be of the same joint."""
    rows = np.sort(np.random.default_rng(0).permutation(len(take))[:_CASES])
    return take.where(rows)


Stated = tuple[str, Cases]  # the name of a statement, and what a take has of it
_MEAN_OF_RMS = np.sqrt(np.pi) / 2
_UP_90, _HEADING_90 = 1.712, 2.062  # 90 % over mean of Rayleigh, of half a Gaussian
_PELVIS = H36M17.index("pelvis")
_AWAY = H36M17.indices([name for name in H36M17.joints if name != "pelvis"])  # which is the origin
# Roots of the 90 % quantiles of chi square, three and two degrees of freedom.
_CHI_90, _RAYLEIGH_90 = 2.5003, 2.1460
_QUANTITIES = {"": "position, m", "v": "velocity, m/s", "a": "acceleration, m/s2"}  # by prefix of the columns
_VISIBLE = 0.95  # of the frames of a found range, whose truth is known
# Of walks, by the names of gait.walks.
_OF_WALKS = {
    "stance, %": "stance_percent",
    "double support, %": "double_support_percent",
    "single support, %": "single_support_percent",
    "step time, s": "step_time_s",
    "step length, m": "step_length",
    "walking speed, m/s": "walking_speed",
    "cadence, steps/min": "cadence",
}
_OF_MOVEMENTS = {"mean_rise": "mean rise, deg", "mean_duration": "mean duration, s"}
_MOVEMENTS = {("knee_bends",): "knee bends"} | {
    ("arm_raises", side): "arm raises" for side in ("right", "left")
}


def statements(run: Finished) -> dict[str, Cases]:
    """Everything that is judged of one take, by name; nothing of one that a run refuses. The run's rows name a figure
    and its error. What is true comes from the bed: the captured feet for walks (gait.py), captured flights for jumps
    (jumps.py), the same rows of a run on the captured joints for repeated movements, and the true angles over the same
    frames for ranges of motion."""
    return together(chain(of_frames(run), of_figures(run)))


def together(stated: Iterable[Stated]) -> dict[str, Cases]:
    """What a take states by name, several of one name, such as both sides, as one; without those of no case."""
    parts = grouped((name, cases) for name, cases in stated if len(cases))
    return {name: joined(of) for name, of in parts.items()}


def of_frames(run: Finished) -> Iterator[Stated]:
    """Everything that is judged of one take's frames. One that is not levelled has joints, where all are known, and a
    place."""
    if run.take is None:
        return
    if run.lifted and is_finite(run.truth.truth).all():
        yield from joints(run)
    if run.levelled:
        yield "up", up(run)
        yield "BODY's rotation", rotation(run)
        if run.lifted and run.take.kinematics:
            yield from angles(run)
    if run.lifted:
        yield from paths(run)


def up(run: Finished) -> Cases:
    """One case a take before a static camera, one a frame before a moving one."""
    rectified = run.done.need("rectified")
    found = np.broadcast_to(rectified.R_source_from_level[..., :, 2], (len(run.rows), 3))
    true = np.broadcast_to(run.truth.up, (len(run.truth.lying), 3))[run.rows]
    error, half = angle_deg(found, true), rectified.up_bound_deg
    if run.static:
        return run.stated(error[:1], half[:1], **run.reached())
    return run.stated(error, half)


def rotation(run: Finished) -> Cases:
    """BODY's rotation."""
    rectified = run.done.need("rectified")
    error = geodesic_deg(rectified.R_source_from_body, run.truth.R_camera_from_body[run.rows])
    of_up = np.minimum(_MEAN_OF_RMS * rectified.up_error_deg, rectified.error_deg)
    half = np.hypot(_UP_90 * of_up, _HEADING_90 * np.sqrt(rectified.error_deg**2 - of_up**2))
    return run.stated(error, half)


def joints(run: Finished) -> Iterator[Stated]:
    """Joints relative to the pelvis, in the camera's axes: the length of their error in standard deviations of their
    covariance; and what it is fitted by, their errors along the ray to the body and across it. None of a take without
    such a covariance."""
    filtered, rectified = run.done.need("filtered"), run.done.need("rectified")
    own, turning = rectified.level.covariance, turns_of(run.done)
    if filtered.covariance is None or own is None or turning is None:
        return
    R = transpose(rectified.R_source_from_level)
    found, true = filtered.joints.astype(np.float64), rotate(R, run.truth.truth[run.rows])
    size = scale_of(found, true, "take").item()
    error = size * found[:, _AWAY] - true[:, _AWAY]
    covariance = size**2 * filtered.covariance[:, _AWAY].astype(np.float64)
    fine = is_finite(covariance.reshape(*error.shape[:2], 9)) & is_finite(error)

    def of_each(values: np.ndarray) -> np.ndarray:
        """Those of the fine joints, of values of frames (T,)."""
        return np.broadcast_to(values[:, None], fine.shape)[fine]

    ray = np.broadcast_to(turning.ray[:, None], error.shape)[fine]
    reach = np.linalg.norm(found[:, _AWAY], axis=-1) / implied_stature(filtered.joints)
    bins = {name: of_each(run.stances[name]) for name in BINS}
    pitch, focal = of_each(turning.pitch), of_each(turning.focal)
    known = {
        "stated": np.sqrt(np.einsum("tjii->tj", covariance))[fine],
        "reach": reach[fine],
        "pitch": pitch,
        "off the axis": focal,
        **bins,
    }
    error, covariance = error[fine], covariance[fine]
    solved = np.linalg.solve(covariance, error[..., None])[..., 0]
    distance = np.sqrt(np.maximum((solved * error).sum(-1), 0))
    yield "joints", run.stated(distance, np.full(len(distance), _CHI_90), **bins)
    lever = size**2 * levers(filtered.joints, turning.ray)[:, _AWAY][fine]
    own = size**2 * own[:, _AWAY][fine]
    along = (error * ray).sum(-1)
    off = np.sqrt(np.maximum((error**2).sum(-1) - along**2, 0))
    for statement, miss, factor, part in (
        ("joints in depth", along, SD_90, _along),
        ("joints across", off, _RAYLEIGH_90, _across),
    ):
        square = part(lever, ray)
        parts = {"own": part(own, ray), "by focal": square * focal**2, "by pitch": square * pitch**2}
        squares = {name: factor**2 * each for name, each in parts.items()}
        yield statement, run.stated(miss, factor * np.sqrt(part(covariance, ray)), **known, **squares)


def _along(covariance: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """(N,) the variance of covariances (N, 3, 3) along rays (N, 3)."""
    return np.einsum("ni,nij,nj->n", ray, covariance, ray)


def _across(covariance: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """(N,) that of either axis across."""
    return (np.einsum("nii->n", covariance) - _along(covariance, ray)) / 2


def angles(run: Finished) -> Iterator[Stated]:
    """Every angle and its rate, both sides together; `noise`, `tilt` and `model` are what their errors are made of,
    before their factors (JointNoise.whole, of_rate), the posture what angles' grow with."""
    take, of, rows = run.done, run.stances, run.rows
    noise = shipped_noise() if run.asked.errors is None else read_noise(run.asked.errors)
    plain = replace(noise, factors={}, tilts={}, more={}, postures={})
    parts_of, faster = angle_series(take.need("poses"), take.need("rectified"), take.need("filtered"), plain)
    true_rates = angle_rates(run.true_angles, run.truth.time_s)
    columns = take.need("kinematics")
    for name in ANGLES:
        value, sd = columns[f"{name}_deg"], columns[f"{name}_sd_deg"]
        rate, rate_sd = columns[f"{name}_degps"], columns[f"{name}_sd_degps"]
        true, raw, both = run.true_angles[name], parts_of[name], of_both(name)
        use = (true.reason[rows] == FINE) & (columns[f"{name}_reason"] == FINE) & np.isfinite(raw.noise_deg)
        error = np.where(use, near(value - true.value_deg[rows], 0.0), np.nan)
        known = {"found": value, "stated": sd, "noise": raw.noise_deg, "tilt": raw.tilt_deg}
        known |= {each: of[each] for each in FEATURES} | {"arms": of[arms_of(name)]}
        yield both, run.stated(error, SD_90 * sd, **known)
        error = np.where(use, rate - true_rates[name][0][rows], np.nan)
        model = noise.of_model(name, rate_sd, rate, faster)
        yield (
            f"rate of {both}",
            run.stated(error, SD_90 * rate_sd, rate=np.abs(rate), model=model, faster=faster),
        )


def paths(run: Finished) -> Iterator[Stated]:
    """Everything of lifted poses in metres; motions before a static camera, for one that pans turns them."""
    camera = run.done.need("camera")
    if camera.focal_source != "told":
        off = np.array([1 - run.truth.focal_px / camera.focal_px])
        half = np.array([SD_90 * camera.focal_sd_px / camera.focal_px])
        yield "focal length, %", run.stated(100 * off, 100 * half, **run.reached())
    root = run.done.need("poses").root
    if root is not None:
        yield from place(run)
        for each in run.done.notices:
            if each.code == "placed":
                off = frame_by_frame(root, run.truth.joints_camera[run.rows, _PELVIS])
                half = np.full(len(off), each.values["within"])
                yield "pelvis from frame to frame, m", run.stated(off, half)
    if run.levelled and run.static:
        yield from motions(run)


def place(run: Finished) -> Iterator[Stated]:
    """The pelvis from the camera along the ray to it and across, frame by frame, and the size of the body, which moves
    it all."""
    poses, truth = run.done.need("poses"), run.truth
    path, true = poses.path, truth.joints_camera[run.rows, _PELVIS]
    assert path is not None
    assert path.covariance is not None
    along = unit(true)
    right = unit(np.cross(along, [0.0, 1.0, 0.0]))
    for way, axes in {"along": [along], "across": [right, np.cross(right, along)]}.items():
        for axis in axes:
            sd = np.sqrt(np.einsum("tj,tjk,tk->t", axis, path.covariance, axis))
            off = ((path.points - true) * axis).sum(axis=1)
            yield f"pelvis {way} the ray, m", run.stated(off, SD_90 * sd)
    if path.shared is not None:
        scale = scale_of(poses.joints.astype(np.float64), truth.truth[run.rows], "take").item()
        off, half = np.array([100 * (1 / scale - 1)]), np.array([100 * SD_90 * path.shared[0]])
        yield "body's size, %", run.stated(off, half, **run.reached())


def frame_by_frame(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """(T,) metres by which pelvises (T, 3) are off, but for the whole path's size and what the focal length does to all
    depths, of which a run says how wrong they are beside; NaN of frames without one."""
    there = is_finite(found)
    parts = np.stack([found, found * [0.0, 0.0, 1.0]], axis=-1)
    best = np.linalg.lstsq(parts[there].reshape(-1, 2), true[there].ravel(), rcond=None)[0]
    return np.linalg.norm(parts @ best - true, axis=1)


def motions(run: Finished) -> Iterator[Stated]:
    """Positions, velocities and accelerations of wrists and ankles from the pelvis, each axis of LEVEL a case, of
    upright frames. The truth is turned into the LEVEL that was found: how wrong its up is has an error of its own."""
    columns, rows = run.done.need("kinematics"), run.rows
    R = transpose(run.done.need("rectified").R_source_from_level)
    true = rotate(R, run.truth.truth)[rows]
    time_s, upright = run.truth.time_s[rows], ~run.truth.lying[rows]
    if not is_finite(true).all():
        return
    signals = {"": true, "v": derivative(smoothed(true, time_s), time_s), "a": accelerations(true, time_s)}
    for part in ("wrist", "ankle"):
        for prefix, quantity in _QUANTITIES.items():
            for joint in (f"r_{part}", f"l_{part}"):
                for i, axis in enumerate("xyz"):
                    column = f"{joint}_{prefix}{axis}"
                    error = columns[column] - signals[prefix][:, H36M17.index(joint), i]
                    half = SD_90 * columns.get(f"{column}_sd", np.full(len(rows), np.nan))
                    yield f"{part} {quantity}", run.stated(np.where(upright, error, np.nan), half)


def of_figures(run: Finished) -> Iterator[Stated]:
    """Every figure with an error whose truth is known; nothing of a take that a run refuses or cannot level."""
    if not run.levelled:
        return
    every = [(name, of) for name, of in compared(run) if isinstance(of, Cases)]
    if run.static:
        of_walks = dict(walks(run, true_gait(run.truth)))
        every += [(name, of_walks[figure]) for name, figure in _OF_WALKS.items() if figure in of_walks]
    if run.lifted and run.static:
        every += movements(run)
    if run.lifted and run.done.kinematics:
        every += within(run)
    whole = run.reached()
    for name, cases in every:
        yield name, Cases(cases.person, {**whole, **cases.values}).judged()


def movements(run: Finished) -> Iterator[Stated]:
    """Peaks of repetitions that are true ones too, and means where each true one is found, and no other. Of static
    cameras, for nobody knows the true figures of others."""
    if not any(run.done.figures.group(*names).spans for names in _MOVEMENTS):
        return
    true = run.captured().figures
    for names, movement in _MOVEMENTS.items():
        found = run.done.figures.group(*names)
        for figure, row, truth in same_rows(found, true.group(*names)):
            known = {} if row.number is None else run.reached(found.spans[row.number])
            yield f"{movement}: {figure}", run.figure(row.value, truth.value, row.error, **known)


def same_rows(found: Measures, true: Measures) -> Iterator[tuple[str, Measure, Measure]]:
    """(figure, row found, the true one) of the repetitions of one movement; a peak is that of the repetition that
    shares the most time with it."""
    spans, true_spans = (np.array(of.spans) for of in (found, true))
    if not len(spans) or not len(true_spans):
        return
    shared = np.minimum(spans[:, None, 1], true_spans[:, 1]) - np.maximum(spans[:, None, 0], true_spans[:, 0])
    true_peaks = {peak.number: peak for peak in true.repetitions("peak")}  # one that a gap hides has none
    for peak in found.repetitions("peak"):
        of = shared[peak.number or 0]
        if of.max() > 0 and int(of.argmax()) in true_peaks:
            yield "peak, deg", peak, true_peaks[int(of.argmax())]
    same = shared.max(axis=1).min() > 0 and np.array_equal(shared.argmax(axis=1), np.arange(len(true_spans)))
    for name, figure in _OF_MOVEMENTS.items():
        row, truth = found.figure(name), true.figure(name)
        if same and row is not None and truth is not None:
            yield figure, row, truth


class Compared(NamedTuple):
    """A figure in degrees, found and true, and its stated standard deviation. ends: of a range, the standard deviation
    that independent errors of its ends would give it."""

    found: float
    true: float
    error: float
    ends: float = float("nan")

    def less(self, other: Compared) -> tuple[float, float, float]:
        """By how much it is larger, found and true, and the standard deviation that independent errors would give."""
        return self.found - other.found, self.true - other.true, float(np.hypot(self.error, other.error))


def within(run: Finished) -> Iterator[Stated]:
    """Ranges of motion, and right less left."""
    every = ranges(run)
    for both in dict.fromkeys(of_both(name) for name in every):
        of = [every[name] for name in (both, f"r_{both}", f"l_{both}") if name in every]
        for side in of:
            yield f"range of {both}", run.figure(side.found, side.true, side.error)
        index = run.done.figures.group("symmetry", both).figure("symmetry_index")
        if both not in MIDLINE and len(of) == 2 and index is not None and index.error is not None:
            right, left = of
            size = (right.found + left.found) / 2  # an index in degrees, for that of small ranges has none
            found, true, _ = right.less(left)
            yield f"right less left range of {both}", run.figure(found, true, index.error / 100 * size)


def ranges(run: Finished) -> dict[str, Compared]:
    """Those of each angle that states one with its error; nothing where the truth lacks frames of it."""
    columns, every = run.done.kinematics or {}, {}
    for name in ANGLES:
        row = run.done.figures.group("range_of_motion", name).figure("p05_p95")
        if row is None or row.error is None:
            continue
        values, centre = continuous(columns[f"{name}_deg"], ANGLES[name].centre_deg), ANGLES[name].centre_deg
        visible = np.isfinite(values)
        true = run.true_angles[name].value_deg[run.rows]
        beside = continuous(np.where(visible, true, np.nan), centre)
        if np.isfinite(beside).sum() >= _VISIBLE * visible.sum():
            _, sds = ends(values, columns[f"{name}_sd_deg"])
            (low, high), _ = ends(beside, np.full(len(beside), np.nan))
            every[name] = Compared(row.value, high - low, row.error, float(np.hypot(*sds)))
    return every
