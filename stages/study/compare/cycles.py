"""The cycles of two takes over each other: the repetitions and strides that a run's measures found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ....pipeline.core.measures import Curve, Curves, Group, Row, grouped, moments, subgroup
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


def spans(measures: Iterable[Row]) -> dict[tuple[str, str], np.ndarray]:
    """(N, 2) seconds at which to cut, by kind of cycle and angle, from a run's measures (stages/measures/stage.py)."""
    groups = _spans(grouped(measures))
    return {(kind, angle): cut for kind, angle, cut in groups if angle in ANGLES and len(cut)}


def _spans(measures: Group) -> Iterator[tuple[str, str, np.ndarray]]:
    bends, raises, walking = (subgroup(measures, name) for name in ("knee_bends", "arm_raises", "walking"))
    for curve in _curves(bends):
        yield "knee bends", curve.angle, _starts_and_stops(bends)
    for name, group in subgroup(measures, "repetitions").items():
        if isinstance(group, dict):
            yield "repetitions", name, _starts_and_stops(group)
    for side in ("right", "left"):
        for curve in _curves(raises):
            if curve.side == side:
                yield "arm raises", curve.angle, _starts_and_stops(subgroup(raises, side))
        for curve in _curves(walking):
            if curve.side == side:
                yield "strides", curve.angle, _starts_and_stops(subgroup(walking, side), "stride_")


def _curves(group: Group) -> tuple[Curve, ...]:
    curves = group.get("cycles")
    return curves.of if isinstance(curves, Curves) else ()


def _starts_and_stops(group: Group, of: str = "") -> np.ndarray:
    both = [moments(group, f"{of}start"), moments(group, f"{of}stop")]
    return np.array(both, dtype=np.float64).T.reshape(-1, 2)
