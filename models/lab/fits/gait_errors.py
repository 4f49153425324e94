"""Fit the stated errors of gait figures on validation subjects:  python -m pcnet3d.models.lab.fits.gait_errors

Every figure's error has three parts (models/gait/errors.py), besides what the pelvis path says of all strides alike.
They are those under which the errors of the takes' means are most likely, with the true path and with those from
keypoints and a focal length that is known or assumed, of takes as captured and of walks in drawn styles
(models/lab/mocap/restyle.py), then times the factor that brings nine in ten errors within 1.645
standard deviations. The errors of right less left have three parts too, one of them by how much of a step is depth.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import typer

from ....pipeline.files.atomic import whole_file
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.running.progress import each
from ...common.metrics import SD_90
from ...gait.errors import ERROR_FILE, OF_LENGTH, OF_STYLE
from ...rectifier.load import load_rectifier
from ..common.modules import run_command
from ..evaluation.gait import TRUE, JudgedGait, judge_both, judged_takes
from ..evaluation.gait_means import Difference, Mean
from ..evaluation.sets import Question
from ..evaluation.testbed import BEDS, LiftedTake, see
from ..mocap.clips import data_set, read_clips
from ..mocap.restyle import restyled_walks

Judged = TypeVar("Judged", Mean, Difference)

_COVERED = 0.9
_END = 0.01
_LEAST = 1e-4  # of a part, in the figure's unit: none is without error
_CUT = 4.0  # robust standard deviations: beyond, an error is cut to that before the parts are fitted


def seen_gaits(takes: Sequence[JudgedGait]) -> dict[str, dict[str, dict[str, float]]]:
    """{"walking", "running": {figure of OF_STYLE: {"least", "most"}}} as they were found, but for the hundredth at
    either end."""
    styles = [(mean.gait, mean.style) for take in takes for mean in [*take.means.get(TRUE, {}).values()][:1]]
    return {
        gait: {
            name: _three_digits(
                {
                    end: float(
                        np.quantile([style[name] for of, style in styles if of == gait and name in style], at)
                    )
                    for end, at in (("least", _END), ("most", 1 - _END))
                }
            )
            for name in OF_STYLE
        }
        for gait in ("walking", "running")
    }


def fit_errors(takes: Sequence[JudgedGait]) -> dict[str, dict[str, dict[str, float]]]:
    """{"walking", "running": {figure: {"shared", "each", "root"}}} by the gait that was found; lengths and speeds in
    lengths of a leg."""
    return _fitted([take.means for take in takes], _parts)


def fit_differences(takes: Sequence[JudgedGait]) -> dict[str, dict[str, dict[str, float]]]:
    """{"walking", "running": {figure: {"shared", "each", "depth"}}} of right less left; lengths in lengths of a leg."""
    return _fitted([take.differences for take in takes], _parts_of_difference)


def _fitted(
    takes: Sequence[dict[str, dict[str, Judged]]], parts: Callable[[str, list[Judged]], dict[str, float]]
) -> dict[str, dict[str, dict[str, float]]]:
    """takes: each {path: {figure: what was found and true}}; parts: of the error of one figure of one gait."""
    found: dict[str, dict[str, list[Judged]]] = {"walking": {}, "running": {}}
    for of_paths in takes:
        for path, figures in of_paths.items():
            for name, one in figures.items():
                if path == TRUE or name in OF_LENGTH:
                    found[one.gait].setdefault(name, []).append(one)
    return {gait: {name: parts(name, of) for name, of in figures.items()} for gait, figures in found.items()}


def _parts(name: str, means: Sequence[Mean]) -> dict[str, float]:
    unit = np.array([mean.leg if name in OF_LENGTH else 1.0 for mean in means])
    error = np.array([mean.found - mean.true for mean in means]) / unit
    count = np.array([mean.count for mean in means])
    root = np.array([mean.root_sd for mean in means]) / unit * (name in OF_LENGTH)
    alike = np.array([mean.share * mean.found for mean in means]) / unit * (name in OF_LENGTH)
    shared, single, path = _likeliest(error, count, root**2 / count, alike)
    return _three_digits({"shared": shared, "each": single, "root": path if name in OF_LENGTH else 0.0})


def _parts_of_difference(name: str, found: Sequence[Difference]) -> dict[str, float]:
    unit = np.array([one.leg if name in OF_LENGTH else 1.0 for one in found])
    error = np.array([one.found - one.true for one in found]) / unit
    count = np.array([1 / (1 / one.counts[0] + 1 / one.counts[1]) for one in found])
    square = np.array([one.depth**2 for one in found])
    shared, single, depth = _likeliest(error, count, square, np.zeros(len(found)))
    return _three_digits({"shared": shared, "each": single, "depth": depth})


def _likeliest(
    error: np.ndarray, count: np.ndarray, further: np.ndarray, alike: np.ndarray
) -> tuple[float, float, float]:
    """The standard deviations that all of a take's values share, that each has, and that goes with `further`, under
    which errors (N,) of the means of `count` (N,) values are most likely, besides what is wrong in them by `alike`
    (N,), times the factor for nine in ten."""
    from scipy.optimize import minimize

    usual = 1.4826 * np.median(np.abs(error))
    cut = np.clip(error, -_CUT * usual, _CUT * usual)

    def variance(logs: np.ndarray) -> np.ndarray:
        shared, single, third = np.exp(2 * logs)
        return shared + single / count + third * further

    def unlikely(logs: np.ndarray) -> float:
        whole = variance(logs) + alike**2
        return float(np.sum(np.log(whole) + cut**2 / whole))

    bounds = [
        (np.log(_LEAST), np.log(100 * usual)),
        (np.log(_LEAST), np.log(100 * usual)),
        (np.log(_LEAST), 3.0),
    ]
    found = minimize(unlikely, np.log([usual, usual, 0.5]), bounds=bounds, method="L-BFGS-B").x
    square = np.maximum((error / SD_90) ** 2 - alike**2, 0.0) / variance(
        found
    )  # of the factor for each to be inside
    factor = float(np.sqrt(np.quantile(square, _COVERED)))
    shared, single, third = factor * np.exp(found)
    return shared, single, third


def _three_digits(parts: dict[str, float]) -> dict[str, float]:
    return {part: float(f"{value:.3g}") for part, value in parts.items()}


def _lifted(question: Question, clip: Clip) -> LiftedTake:
    seen = see(clip, question.seed, views=question.views)
    return LiftedTake(question.lift_seen(seen, seen.focal_px), seen)


def main(
    output: Annotated[Path, typer.Option("-o", "--output", help="The file to write.")] = ERROR_FILE,
    seeds: Annotated[int, typer.Option(min=1, help="Draws of cameras and noise, of every bed.")] = 2,
) -> None:
    """Fit the stated errors of gait figures on validation subjects."""
    rectifier = load_rectifier("pcnet")
    questions = [Question((rectifier,), seed=seed, bed=bed) for bed in BEDS for seed in range(seeds)]
    clips = [clip for clip in read_clips("val") if data_set(clip) != "tennis"]
    captured = [
        judged
        for question in questions
        for of in question.sets
        for judged in judged_takes(question, of)
        if judged.kind != "none"
    ]
    drawn = [
        judged
        for question in questions
        for walks in [list(restyled_walks(clips, 1, question.seed))]
        for clip, spells in each(walks, f"walks in drawn styles, {question.bed}", len(walks))
        if (judged := judge_both(question, _lifted(question, clip), spells)) is not None
        and judged.kind != "none"
    ]
    takes = [*captured, *drawn]
    figures, differences = fit_errors(takes), fit_differences(takes)
    content = {
        "made_by": "python -m pcnet3d.models.lab.fits.gait_errors",
        "fitted_on": f"{len(captured)} lifted walks and runs of "
        f"{', '.join(of.label for of in questions[0].sets)}, and {len(drawn)} of their walks in drawn styles",
        "seen": seen_gaits(takes),
        "figures": figures,
        "differences": differences,
    }
    with whole_file(output) as partial:
        partial.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(json.dumps({"figures": figures, "differences": differences}, indent=1))


if __name__ == "__main__":
    run_command(main)
