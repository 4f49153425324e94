"""What a finished take says of repeated movements, each with its error against the same of the captured joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....pipeline.core.measures import Measures
from ...common.metrics import SD_90
from ..evaluation.finished import Finished
from .judge import Stated, joined

_GROUPS = {
    "knee bends": [("knee_bends",)],
    "arm raises": [("arm_raises", side) for side in ("right", "left")],
}
_MEANS = {"mean_rise": "mean rise, deg", "mean_duration": "mean duration, s"}


def movements(finished: Finished) -> Iterator[Stated]:
    """Peaks of repetitions that are true ones too, and means where each true one is found, and no other. Of static
    cameras, for nobody knows the true figures of others."""
    take, truth = finished.take, finished.truth
    if take is None or take.need("poses").made_by.kind != "estimated" or truth.up.ndim > 1:
        return
    found = take.figures
    if not any(found.group(*names).spans for of in _GROUPS.values() for names in of):
        return
    true = finished.captured().figures
    for movement, groups in _GROUPS.items():
        parts: dict[str, list[Stated]] = {}
        for names in groups:
            pairs = compared(found.group(*names), true.group(*names))
            for figure, (error, half) in pairs.items():
                one = Stated(f"{movement}: {figure}", truth.subject, error, half)
                parts.setdefault(figure, []).append(one)
        for sides in parts.values():
            yield joined(sides).judged()


def compared(found: Measures, true: Measures) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """{figure: (errors (N,), half bars (N,))} of the repetitions of one movement, found and true; a peak is that of the
    repetition that shares the most time with it."""
    spans, true_spans = (np.array(of.spans) for of in (found, true))
    if not len(spans) or not len(true_spans):
        return {}
    shared = np.minimum(spans[:, None, 1], true_spans[:, 1]) - np.maximum(spans[:, None, 0], true_spans[:, 0])
    true_peaks = {peak.number: peak for peak in true.repetitions("peak")}  # one that a gap hides has none
    rows = [(peak, shared[peak.number or 0]) for peak in found.repetitions("peak")]
    pairs = [
        (peak, true_peaks[nearest])
        for peak, row in rows
        if row.max() > 0 and (nearest := int(row.argmax())) in true_peaks
    ]
    figures = {"peak, deg": pairs}
    same = shared.max(axis=1).min() > 0 and np.array_equal(shared.argmax(axis=1), np.arange(len(true_spans)))
    for name, figure in _MEANS.items():
        one, other = found.figure(name), true.figure(name)
        if same and one is not None and other is not None:
            figures[figure] = [(one, other)]
    return {
        figure: (
            np.array([one.value - other.value for one, other in pairs]),
            np.array([np.nan if one.error is None else SD_90 * one.error for one, _ in pairs]),
        )
        for figure, pairs in figures.items()
    }
