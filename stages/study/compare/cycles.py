"""The cycles of two takes over each other: the repetitions and strides that a run's measures found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ....pipeline.core.measures import Measures
from ....pipeline.signals.angles import ANGLES, unwrapped
from ...measures.cycles import POINTS, alike, normalised
from .side import Side


@dataclass(frozen=True, eq=False)
class Cycles:
    """One angle over one kind of cycle: curves (N, 101) and (M, 101), degrees, two of each at least."""

    kind: str
    angle: str
    curves: np.ndarray
    reference: np.ndarray

    def figures(self) -> dict[str, str | int | float]:
        """For JSON. difference_deg: root mean square between the mean curves."""
        off = self.curves.mean(axis=0) - self.reference.mean(axis=0)
        return {
            "kind": self.kind,
            "angle": self.angle,
            "cycles": len(self.curves),
            "cycles_reference": len(self.reference),
            "difference_deg": float(np.sqrt((off**2).mean())),
        }


def cycles(side: Side, reference: Side, shift_s: float | None) -> list[Cycles]:
    """Of every angle that a cycle is shown for.

    shift_s: of takes of one motion, what is to be added to the side's time: then both are cut at the same moments,
    those of the side (motion capture has none of its own). None for takes of different motions, each cut at its own.
    """
    result = []
    own, others = spans(side.measures), spans(reference.measures)
    for (kind, angle), cut in own.items():
        cut_reference = others.get((kind, angle)) if shift_s is None else cut + shift_s
        if cut_reference is None:
            continue
        curves, before = _cut(side, angle, cut), _cut(reference, angle, cut_reference)
        if shift_s is not None:  # the same cycles, one by one
            both = np.isfinite(curves).all(axis=1) & np.isfinite(before).all(axis=1)
            curves, before = curves[both], before[both]
        curves, before = (each[np.isfinite(each).all(axis=1)] for each in (curves, before))
        if min(len(curves), len(before)) >= 2:
            together = alike(np.concatenate([before, curves]), ANGLES[angle].centre_deg)
            result.append(Cycles(kind, angle, together[len(before) :], together[: len(before)]))
    return result


def _cut(side: Side, angle: str, cut: np.ndarray) -> np.ndarray:
    """(N, 101) an angle over each of the spans (N, 2) of the side's time, NaN where any of it is missing."""
    curves = np.full((len(cut), POINTS), np.nan)
    for i, span in enumerate(cut):
        whole = normalised(unwrapped(side.angles[angle]), side.time_s, span[None], side.seams)
        if len(whole):
            curves[i] = whole[0]
    return curves


def spans(measures: Measures) -> dict[tuple[str, str], np.ndarray]:
    """(N, 2) seconds at which to cut, by kind of cycle and angle, from a run's measures (stages/measures/stage.py)."""
    cuts = [
        *_cuts("knee bends", measures.group("knee_bends"), ""),
        *(("repetitions", angle, of) for angle, of in measures.group("repetitions").groups.items()),
        *_cuts("arm raises", measures.group("arm_raises"), "right"),
        *_cuts("strides", measures.group("walking"), "right"),
        *_cuts("arm raises", measures.group("arm_raises"), "left"),
        *_cuts("strides", measures.group("walking"), "left"),
    ]
    return {(kind, angle): np.array(of.spans) for kind, angle, of in cuts if angle in ANGLES and of.spans}


def _cuts(kind: str, of: Measures, side: str) -> Iterator[tuple[str, str, Measures]]:
    """Kind, angle and group with the times of every angle that a movement's curves show. side: of those of one side."""
    for curve in of.curves:
        if side in ("", curve.side):
            yield kind, curve.angle, of.group(*filter(None, [side]))
