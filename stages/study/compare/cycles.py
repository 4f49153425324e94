"""The cycles of two takes over each other: the repetitions and strides that a run's measures found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.signals.angles import ANGLES, unwrapped
from ...measures.cycles import POINTS, alike, normalised
from .figures import cycles_agree
from .side import Side


@dataclass(frozen=True, eq=False)
class Cycles:
    """One angle over one kind of cycle: curves (N, 101) and (M, 101), degrees, and how they agree."""

    kind: str
    angle: str
    curves: np.ndarray
    reference: np.ndarray
    agreement: dict[str, float | int]


def cycles(side: Side, reference: Side, shift_s: float | None) -> list[Cycles]:
    """Of every angle that a cycle is shown for.

    shift_s: of takes of one motion, what is to be added to the side's time: then both are cut at the same moments,
    those of the side (motion capture has none of its own). None for takes of different motions, each cut at its own.
    """
    found = []
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
        if len(curves) and len(before):
            together = alike(np.concatenate([before, curves]), ANGLES[angle].centre_deg)
            before, curves = together[: len(before)], together[len(before) :]
        agreement = cycles_agree(curves, before, paired=shift_s is not None)
        if agreement is not None:
            found.append(Cycles(kind, angle, curves, before, agreement))
    return found


def _cut(side: Side, angle: str, cut: np.ndarray) -> np.ndarray:
    """(N, 101) an angle over each of the spans (N, 2) of the side's time, NaN where any of it is missing."""
    curves = np.full((len(cut), POINTS), np.nan)
    for i, span in enumerate(cut):
        whole = normalised(unwrapped(side.angles[angle]), side.time_s, span[None], side.seams)
        if len(whole):
            curves[i] = whole[0]
    return curves


def spans(measures: dict[str, Any] | None) -> dict[tuple[str, str], np.ndarray]:
    """(N, 2) seconds at which to cut, by kind of cycle and angle, from a run's measures (stages/measures/stage.py)."""
    return {(kind, angle): cut for kind, angle, cut in _spans(measures or {}) if angle in ANGLES and len(cut)}


def _spans(measures: dict[str, Any]) -> Iterator[tuple[str, str, np.ndarray]]:
    bends, raises, walking = (measures.get(name) or {} for name in ("knee_bends", "arm_raises", "walking"))
    for angle in bends.get("cycles", {}):
        yield "knee bends", angle, _starts_and_stops(bends)
    for name, group in (measures.get("repetitions") or {}).items():
        yield "repetitions", name, _starts_and_stops(group)
    for side in ("right", "left"):
        for angle in raises.get("cycles", {}):
            if angle[0] == side[0]:
                yield "arm raises", angle, _starts_and_stops(raises.get(side, {}))
        for angle in walking.get("cycles", {}):
            if angle[0] == side[0]:
                yield "strides", angle, _starts_and_stops(walking.get(side, {}), "stride_")


def _starts_and_stops(group: dict[str, Any], of: str = "") -> np.ndarray:
    both = [group.get(f"{of}start_s", []), group.get(f"{of}stop_s", [])]
    return np.array(both, dtype=np.float64).T.reshape(-1, 2)
