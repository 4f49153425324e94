"""Fit the stated errors of gait figures on validation subjects:  python -m pcnet3d.models.lab.fits.gait_errors

Every figure's error has three parts (models/gait/errors.py), besides what the pelvis path says of all strides alike.
They are those under which the errors of the takes' means are most likely, every person with the same weight, with the
true path and with those from keypoints and a focal length that is known or assumed, of takes as captured and of walks
in drawn styles (models/lab/mocap/restyle.py), then times the factor that brings nine in ten errors within 1.645
standard deviations, in either half of the takes by how far they are from the usual, or by how sure the path is, whether
people or takes have the same weight. The errors of right less left have three parts too, one of them by how much of a
step is depth.
Of the captured joints themselves, as a measured take has them, times and shares of the stride have errors.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
import typer

from ....pipeline.core.frames import CAMERA
from ....pipeline.files.atomic import whole_file
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.running.progress import each
from ...common.metrics import SD_90
from ...gait.errors import ERROR_FILE, OF_LENGTH, OF_STYLE
from ...rectifier.load import load_rectifier
from ..common.modules import run_command
from ..evaluation.gait import TRUE, JudgedGait, judge, judge_both
from ..evaluation.gait_means import Difference, Mean
from ..evaluation.sets import Question
from ..evaluation.testbed import BEDS, MIN_FRAMES, LiftedTake, see
from ..mocap.clips import data_set, read_clips
from ..mocap.restyle import restyled_walks

Judged = TypeVar("Judged", Mean, Difference)

_COVERED = 0.9
_END = 0.01
_COUNTED = 0.95
_LEAST = 1e-4  # of a part, in the figure's unit: none is without error
_CUT = 4.0  # robust standard deviations: beyond, an error is cut to that before the parts are fitted


def fit_all(takes: Sequence[JudgedGait], lengths: bool = True) -> dict[str, Any]:
    """What models.gait.errors.GaitErrors holds, of the takes of one source. lengths: whether those have errors too."""
    left_out = () if lengths else OF_LENGTH

    def kept(fit: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
        return {
            gait: {name: of for name, of in figures.items() if name not in left_out}
            for gait, figures in fit.items()
        }

    return {
        "figures": kept(fit_errors(takes)),
        "differences": kept(fit_differences(takes)),
        "seen": seen_gaits(takes),
    }


def seen_gaits(takes: Sequence[JudgedGait]) -> dict[str, dict[str, dict[str, float]]]:
    """{"walking", "running": {figure of OF_STYLE: {"least", "usual", "most"}}} as they were found: the median, and all
    but the hundredth at either end."""
    styles = [(mean.gait, mean.style) for take in takes for mean in [*take.means.get(TRUE, {}).values()][:1]]

    def ends(gait: str, name: str) -> dict[str, float]:
        values = [style[name] for of, style in styles if of == gait and name in style]
        shares = {"least": _END, "usual": 0.5, "most": 1 - _END}
        return _three_digits({end: float(np.quantile(values, share)) for end, share in shares.items()})

    return {gait: {name: ends(gait, name) for name in OF_STYLE} for gait in ("walking", "running")}


def fit_errors(takes: Sequence[JudgedGait]) -> dict[str, dict[str, dict[str, float]]]:
    """{"walking", "running": {figure: {"shared", "each", "most", and "apart" or "root"}}} by the gait that was found;
    lengths and speeds in lengths of a leg. Single support is the other foot's swing, and no surer than that."""
    found = _fitted([(take.person, take.means) for take in takes], _parts)
    for figures in found.values():
        if {"single_support_percent", "swing_percent"} <= figures.keys():
            single, swing = figures["single_support_percent"], figures["swing_percent"]
            figures["single_support_percent"] = {part: max(single[part], swing[part]) for part in single}
    return found


def fit_differences(takes: Sequence[JudgedGait]) -> dict[str, dict[str, dict[str, float]]]:
    """{"walking", "running": {figure: {"shared", "each", "depth", "most"}}} of right less left; lengths in lengths of a
    leg."""
    return _fitted([(take.person, take.differences) for take in takes], _parts_of_difference)


def _fitted(
    takes: Sequence[tuple[str, dict[str, dict[str, Judged]]]],
    parts: Callable[[str, list[Judged], np.ndarray], dict[str, float]],
) -> dict[str, dict[str, dict[str, float]]]:
    """takes: each the person and {path: {figure: what was found and true}}; parts: of the error of one figure of one
    gait, with the takes' weights (N,)."""
    found: dict[str, dict[str, list[tuple[str, Judged]]]] = {"walking": {}, "running": {}}
    for person, of_paths in takes:
        for path, figures in of_paths.items():
            for name, one in figures.items():
                if path == TRUE or name in OF_LENGTH:
                    found[one.gait].setdefault(name, []).append((person, one))
    return {
        gait: {
            name: parts(name, [one for _, one in of], _weights([person for person, _ in of]))
            for name, of in figures.items()
        }
        for gait, figures in found.items()
    }


def _weights(persons: Sequence[str]) -> np.ndarray:
    """(N,) one for every person, shared by their takes; their mean is 1."""
    weight = np.array([1 / persons.count(person) for person in persons])
    return weight / weight.mean()


def _parts(name: str, means: Sequence[Mean], weight: np.ndarray) -> dict[str, float]:
    length = name in OF_LENGTH
    unit = np.array([mean.leg if length else 1.0 for mean in means])
    error = np.array([mean.found - mean.true for mean in means]) / unit
    count = np.array([mean.count for mean in means])
    alike = np.array([mean.share * mean.found for mean in means]) / unit * length
    if length:
        further = (np.array([mean.root_sd for mean in means]) / unit) ** 2 / count
    else:
        stance = np.array([mean.style.get("stance_percent", np.nan) for mean in means])
        known = stance[np.isfinite(stance)]
        further = np.nan_to_num((stance - (np.median(known) if len(known) else 0.0)) ** 2)
    shared, single, third = _likeliest(error, count, further, alike, weight)
    return _three_digits(
        {"shared": shared, "each": single, "root" if length else "apart": third, "most": _most(count)}
    )


def _parts_of_difference(name: str, found: Sequence[Difference], weight: np.ndarray) -> dict[str, float]:
    unit = np.array([one.leg if name in OF_LENGTH else 1.0 for one in found])
    error = np.array([one.found - one.true for one in found]) / unit
    count = np.array([1 / (1 / one.counts[0] + 1 / one.counts[1]) for one in found])
    square = np.array([one.depth**2 for one in found])
    shared, single, depth = _likeliest(error, count, square, np.zeros(len(found)), weight)
    return _three_digits({"shared": shared, "each": single, "depth": depth, "most": _most(count)})


def _most(count: np.ndarray) -> float:
    """Of how many values a mean was, for all but a few: more may share what these did not tell."""
    return float(np.quantile(count, _COUNTED))


def _likeliest(
    error: np.ndarray, count: np.ndarray, further: np.ndarray, alike: np.ndarray, weight: np.ndarray
) -> tuple[float, float, float]:
    """The standard deviations that all of a take's values share, that each has, and that goes with `further`, under
    which errors (N,) of the means of `count` (N,) values are most likely, besides what is wrong in them by `alike`
    (N,), times the factor for nine in ten. weight: (N,) of the errors."""
    from scipy.optimize import minimize

    usual = 1.4826 * _quantile(np.abs(error), weight, 0.5)
    cut = np.clip(error, -_CUT * usual, _CUT * usual)

    def variance(logs: np.ndarray) -> np.ndarray:
        shared, single, third = np.exp(2 * logs)
        return shared + single / count + third * further

    def unlikely(logs: np.ndarray) -> float:
        whole = variance(logs) + alike**2
        return float(weight @ (np.log(whole) + cut**2 / whole))

    bounds = [
        (np.log(_LEAST), np.log(100 * usual)),
        (np.log(_LEAST), np.log(100 * usual)),
        (np.log(_LEAST), 3.0),
    ]
    found = minimize(unlikely, np.log([usual, usual, 0.5]), bounds=bounds, method="L-BFGS-B").x
    # Of the factor for each to be inside.
    square = np.maximum((error / SD_90) ** 2 - alike**2, 0.0) / variance(found)
    far = further > np.median(further)
    halves = [half for half in (far, ~far) if half.any()]
    alone = np.ones(len(weight))  # takes of the same weight too: people with few walks say little
    squares = [_quantile(square[half], of[half], _COVERED) for half in halves for of in (weight, alone)]
    factor = float(np.sqrt(max(squares)))
    shared, single, third = factor * np.exp(found)
    return shared, single, third


def _quantile(values: np.ndarray, weight: np.ndarray, share: float) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(reached, share * reached[-1])])


def _three_digits(parts: dict[str, float]) -> dict[str, float]:
    return {part: float(f"{value:.3g}") for part, value in parts.items()}


def _lifted(question: Question, clip: Clip) -> LiftedTake:
    seen = see(clip, question.seed, views=question.views)
    return LiftedTake(question.lift_seen(seen, seen.focal_px), seen)


def _captured(question: Question, clip: Clip) -> LiftedTake:
    """The captured joints in the place of a lift."""
    seen = see(clip, question.seed, views=question.views)
    return LiftedTake(seen.keypoints.with_(joints=seen.truth, frame=CAMERA, confidence=None), seen)


def main(
    output: Annotated[Path, typer.Option("-o", "--output", help="The file to write.")] = ERROR_FILE,
    seeds: Annotated[int, typer.Option(min=1, help="Draws of cameras and noise, of every bed.")] = 2,
) -> None:
    """Fit the stated errors of gait figures on validation subjects."""
    rectifier = load_rectifier("pcnet")
    clips = [clip for clip in read_clips("val") if data_set(clip) != "tennis" and len(clip) >= MIN_FRAMES]
    lifted, measured = [], []
    for question in (Question((rectifier,), seed=seed, bed=bed) for bed in BEDS for seed in range(seeds)):
        takes = [*((clip, None) for clip in clips), *restyled_walks(clips, 1, question.seed)]
        for clip, spells in each(takes, f"takes, {question.bed} cameras", len(takes)):
            lifted.append(judge_both(question, _lifted(question, clip), spells))
            if question.bed == "typical":  # cameras make no difference
                measured.append(judge(rectifier, _captured(question, clip), None, spells))
    of_source = {
        source: [take for take in takes if take is not None and take.kind != "none"]
        for source, takes in (("lifted", lifted), ("measured", measured))
    }
    content = {
        "made_by": "python -m pcnet3d.models.lab.fits.gait_errors",
        "fitted_on": f"{len(of_source['lifted'])} lifted and {len(of_source['measured'])} captured walks and runs of "
        "validation subjects, as they are and in drawn styles",
        **{source: fit_all(takes, source == "lifted") for source, takes in of_source.items()},
    }
    with whole_file(output) as partial:
        partial.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(content, indent=1))


if __name__ == "__main__":
    run_command(main)
