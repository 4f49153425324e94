"""Fit the stated errors of gait figures on validation subjects, a step of refit.

Every figure's error has parts (models/gait/errors.py), besides what the pelvis path says of all strides alike. They are
those under which the errors of the takes' means are most likely, every person with the same weight, with the true path
and with those from keypoints and a focal length that is known or assumed. Then they are multiplied by the factor that
brings as many errors within 1.645 standard deviations as it takes for nine in ten of strangers, in either half of the
takes by the last part, whether people or takes have the same weight. The errors of right less left have parts too, one
of them by how much of a step is depth. Of the captured joints themselves, as a measured take has them, times and shares
of the stride have errors. The shipped gait_error.json was fitted on walks in other styles too, which are not made any
more.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.frames import CAMERA
from ....pipeline.files.atomic import write_text
from ....pipeline.running.progress import each
from ...common.metrics import SD_90
from ...gait.errors import OF_LANDINGS, OF_LENGTH
from ...rectifier.load import load_rectifier
from ..evaluation.gait import SIDES_APART, TRUE, Judged, JudgedGait, judge, judge_both
from ..evaluation.judge import STRANGERS
from ..evaluation.runs import Question
from ..evaluation.testbed import BEDS, MIN_FRAMES, LiftedTake, see
from ..mocap.clips import data_set, read_clips

_SEEDS = 2  # draws of cameras and noise, of every bed
_END = 0.01
_COUNTED = 0.95
_FEWEST = 3  # people
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
    found: dict[str, dict[str, list[float]]] = {gait: {} for gait in ("walking", "running")}
    for take in takes:
        for mean in [*take.figures.get(TRUE, {}).values()][:1]:
            for name, value in mean.style.items():
                found[mean.gait].setdefault(name, []).append(value)
    shares = {"least": _END, "usual": 0.5, "most": 1 - _END}
    return {
        gait: {
            name: _three_digits({end: float(np.quantile(of, share)) for end, share in shares.items()})
            for name, of in styles.items()
        }
        for gait, styles in found.items()
    }


def fit_errors(takes: Sequence[JudgedGait]) -> dict[str, dict[str, dict[str, float]]]:
    """{"walking", "running": {figure: parts}} (GaitErrors.figures) by the gait that was found. Single support is the
    other foot's swing, and no surer than that."""
    usual = {
        gait: styles.get("stance_percent", {"usual": 0.0})["usual"]
        for gait, styles in seen_gaits(takes).items()
    }

    def parts(name: str, persons: list[str], means: list[Judged]) -> dict[str, float]:
        count = np.array([mean.counts[0] for mean in means])
        unit = np.array([mean.leg if name in OF_LENGTH else 1.0 for mean in means])
        error = np.array([mean.found - mean.true for mean in means]) / unit
        each = 1 / count**2 if name in OF_LANDINGS else 1 / count
        squares, known = {"shared": np.ones(len(means)), "each": each}, {"most": _most(count)}
        if name in OF_LANDINGS:
            scatters = np.array([mean.scatter for mean in means])
            known["usual_scatter"] = float(np.nanmedian(scatters))
            squares["scatter"] = np.where(np.isfinite(scatters), scatters, known["usual_scatter"]) ** 2 * each
        alike: np.ndarray | float = 0.0
        if name in OF_LENGTH:
            alike = np.array([mean.share * mean.found for mean in means]) / unit
            squares["root"] = (np.array([mean.root_sd for mean in means]) / unit) ** 2 * each
        else:
            stance = np.array([mean.style.get("stance_percent", usual[mean.gait]) for mean in means])
            squares["apart"] = (stance - np.array([usual[mean.gait] for mean in means])) ** 2
        return _three_digits({**_deviations(persons, error, squares, alike), **known})

    figures = _fitted(takes, "", parts)
    for of_gait in figures.values():
        if {"single_support_percent", "swing_percent"} <= of_gait.keys():
            single, swing = of_gait["single_support_percent"], of_gait["swing_percent"]
            of_gait["single_support_percent"] = {part: max(single[part], swing[part]) for part in single}
    return figures


def fit_differences(takes: Sequence[JudgedGait]) -> dict[str, dict[str, dict[str, float]]]:
    """{"walking", "running": {figure: {"shared", "each", "depth", "most"}}} of right less left; lengths in lengths of a
    leg."""

    def parts(name: str, persons: list[str], found: list[Judged]) -> dict[str, float]:
        unit = np.array([one.leg if name in OF_LENGTH else 1.0 for one in found])
        error = np.array([one.found - one.true for one in found]) / unit
        count = np.array([1 / (1 / one.counts[0] + 1 / one.counts[1]) for one in found])
        depth = np.array([one.depth for one in found])
        squares = {"shared": np.ones(len(found)), "each": 1 / count, "depth": depth**2}
        return _three_digits({**_deviations(persons, error, squares), "most": _most(count)})

    return _fitted(takes, SIDES_APART, parts)


def _fitted(
    takes: Sequence[JudgedGait],
    behind: str,
    parts: Callable[[str, list[str], list[Judged]], dict[str, float]],
) -> dict[str, dict[str, dict[str, float]]]:
    """behind: what ends the names of the figures, "" of means. parts: of the error of one figure of one gait, with the
    person of each. Times and shares of runs of fewer than _FEWEST people are fitted together with those of walks: one
    runner says little of others."""
    found: dict[str, dict[str, list[tuple[str, Judged]]]] = {"walking": {}, "running": {}}
    for take in takes:
        for path, figures in take.figures.items():
            for label, one in figures.items():
                name = label.removesuffix(SIDES_APART)
                if label == name + behind and (path == TRUE or name in OF_LENGTH):
                    found[one.gait].setdefault(name, []).append((take.person, one))
    for name, of in found["running"].items():
        if name not in OF_LENGTH and len({person for person, _ in of}) < _FEWEST:
            found["running"][name] = of + found["walking"].get(name, [])
    return {
        gait: {
            name: parts(name, [who for who, _ in of], [one for _, one in of]) for name, of in figures.items()
        }
        for gait, figures in found.items()
    }


def _deviations(
    persons: Sequence[str], error: np.ndarray, squares: dict[str, np.ndarray], alike: np.ndarray | float = 0.0
) -> dict[str, float]:
    """{part: standard deviation per unit of it} under which errors (N,) are most likely, besides what is wrong in them
    by `alike` (N,), times the factor for nine in ten of strangers. squares: {part: (N,) its square}, "shared" and
    "each" first."""
    from scipy.optimize import minimize

    weight = np.array([1 / persons.count(person) for person in persons])
    weight /= weight.mean()
    usual = 1.4826 * _quantile(np.abs(error), weight, 0.5)
    cut = np.clip(error, -_CUT * usual, _CUT * usual)
    columns = np.stack([*squares.values()], axis=-1)

    def unlikely(logs: np.ndarray) -> float:
        whole = columns @ np.exp(2 * logs) + alike**2
        return float(weight @ (np.log(whole) + cut**2 / whole))

    largest = np.log(100 * usual)
    further = len(squares) - 2
    start = [np.log(usual)] * 2 + [np.log(0.5)] * further
    bounds = [(np.log(_LEAST), largest)] * 2 + [(np.log(_LEAST), 3.0)] * further
    found = np.exp(minimize(unlikely, start, bounds=bounds, method="L-BFGS-B").x)
    # Of the factor for each to be inside.
    square = np.maximum((error / SD_90) ** 2 - alike**2, 0.0) / (columns @ found**2)
    far = columns[:, -1] > np.median(columns[:, -1])
    halves = [half for half in (far, ~far) if half.any()]
    alone = np.ones(len(weight))  # takes of the same weight too: people with few walks say little
    covered = [_quantile(square[half], of[half], STRANGERS) for half in halves for of in (weight, alone)]
    return dict(zip(squares, np.sqrt(max(covered)) * found, strict=True))


def _quantile(values: np.ndarray, weight: np.ndarray, share: float) -> float:
    return float(np.quantile(values, share, method="inverted_cdf", weights=weight))


def _most(count: np.ndarray) -> float:
    """Of how many values a mean was, for all but a few: more may share what these did not tell."""
    return float(np.quantile(count, _COUNTED))


def _three_digits(parts: dict[str, float]) -> dict[str, float]:
    return {part: float(f"{value:.3g}") for part, value in parts.items()}


def learn(output: Path) -> None:
    """Write the errors that were fitted."""
    rectifier = load_rectifier("pcnet")
    clips = [clip for clip in read_clips("val") if data_set(clip) != "tennis" and len(clip) >= MIN_FRAMES]
    lifted, measured = [], []
    for question in (Question((rectifier,), seed=seed, bed=bed) for bed in BEDS for seed in range(_SEEDS)):
        for clip in each(clips, f"takes, {question.bed} cameras", len(clips)):
            seen = see(clip, question.seed, views=question.views)
            lifted.append(judge_both(question, LiftedTake(question.lift_seen(seen, seen.focal_px), seen)))
            if question.bed == "typical":  # cameras make no difference
                captured = seen.keypoints.with_(joints=seen.truth, frame=CAMERA, confidence=None)
                measured.append(judge(rectifier, LiftedTake(captured, seen), None))
    of_source = {
        source: [take for take in takes if take is not None and take.kind != "none"]
        for source, takes in (("lifted", lifted), ("measured", measured))
    }
    content = {
        "made_by": "python -m pcnet3d.models.lab.fits.refit",
        "fitted_on": f"{len(of_source['lifted'])} lifted and {len(of_source['measured'])} captured walks and runs of "
        "validation subjects",
        **{source: fit_all(takes, source == "lifted") for source, takes in of_source.items()},
    }
    write_text(output, json.dumps(content, indent=1) + "\n")
    print(json.dumps(content, indent=1))
