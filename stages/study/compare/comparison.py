"""Runs against the first, or against motion capture: brought to one clock and one heading, in figures and in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from ....models.common.metrics import joint_error
from ....pipeline.core.errors import InputError
from ....pipeline.core.figures import label_of
from ....pipeline.core.messages import how_many
from ....pipeline.core.notices import Notice, grave, notice, verdict
from ....pipeline.core.rotations import turn_deg, turned
from ....pipeline.signals.angles import ANGLES
from ....pipeline.signals.filters import rate as frame_rate
from ..rates import is_lifted, rates_apart
from .align import (
    AMBIGUOUS,
    CLEARLY,
    NARROW,
    UNUSUAL,
    WEAK,
    Alignment,
    correlated,
    mirrored,
    size_ratio,
    stamped,
)
from .changes import Change, as_figures, changes, from_same_place, summary
from .cycles import Cycles, cycles
from .figures import JointAgreement, agreement, joint_agreement, view_spread
from .side import Side, one_clock

Align = Literal["auto", "stamps", "correlate", "cycles"]
_MOSTLY = 0.9  # of the longer take: two cameras that were started by hand lack a second or two of each other


@dataclass(frozen=True, eq=False)
class Pair:
    """A side against the reference. one_recording: whether both read the same one, so that their errors are not
    independent. same_place: whether both were filmed from about the same place, False where that is not known.
    changes: of the measures of both.

    Of takes of one motion only: times: (T,) the side's rows on the reference's clock. at_reference, sd: by angle (T,)
    the reference's value at the side's rows, and the standard error of the difference. agreement: of figures.agreement
    by angle. turn_deg, scale: what brought the side's LEVEL to the reference's. joints_mm: mean distance of the joints
    in LEVEL then.
    """

    side: Side
    reference: Side
    one_recording: bool
    same_place: bool
    changes: list[Change]
    cycles: list[Cycles]
    alignment: Alignment | None
    times: np.ndarray
    at_reference: dict[str, np.ndarray] = field(default_factory=dict)
    sd: dict[str, np.ndarray] = field(default_factory=dict)
    agreement: dict[str, dict[str, float | int]] = field(default_factory=dict)
    turn_deg: float = 0.0
    scale: float = 1.0
    joints_mm: float | None = None
    joints: JointAgreement = field(default_factory=dict)

    @property
    def level(self) -> np.ndarray:
        """(T, 17, 3) the side's joints in the heading and the size of the reference's LEVEL."""
        return self.scale * turned(self.side.level, self.turn_deg)


@dataclass(frozen=True, eq=False)
class Comparison:
    """spread: by angle the view-consistency of all runs of one motion."""

    reference: Side
    pairs: tuple[Pair, ...]
    spread: dict[str, float]
    notices: tuple[Notice, ...]


def compared(
    sides: list[Side], align: Align = "auto", offset_s: float = 0.0, search_s: float = 5.0
) -> Comparison:
    """Every side against the first, which is motion capture when it has no run. InputError for fewer than two sides, or
    for takes that do not overlap."""
    if len(sides) < 2:
        raise InputError(
            "needs-input", "Expected two or more runs, or a run and motion capture (--truth FILE), got one."
        )
    reference, *others = sides
    doubts = {side.name: grave(side.run.judged) for side in sides if side.run}
    notices = [*_of_all(sides)]
    notices += [
        notice("run-doubtful", run=name, verdict=verdict(found), why=found[0].text.rstrip("."))
        for name, found in doubts.items()
        if found
    ]
    pairs = []
    for side in others:
        near = from_same_place(side, reference)
        doubtful = bool(doubts.get(side.name) or doubts.get(reference.name))
        differences = changes(side, reference, near, doubtful)
        how, said = _aligned(side, reference, align, offset_s, search_s)
        pair = Pair(
            side=side,
            reference=reference,
            one_recording=one_clock(side, reference),
            same_place=near,
            changes=differences,
            cycles=cycles(side, reference, how and how.shift_s),
            alignment=how,
            times=side.time_s + (how.shift_s if how else 0.0),
        )
        pairs.append(pair if how is None else _moment_by_moment(pair))
        notices += [*said, *_beyond(pairs[-1])]
    return Comparison(reference, tuple(pairs), _spread(reference, pairs), tuple(notices))


def _of_all(sides: Sequence[Side]) -> Iterator[Notice]:
    for side in sides:
        yield from side.notices
    cutoffs = {"none" if side.cutoff_hz is None else f"{side.cutoff_hz:g} Hz" for side in sides}
    if len(cutoffs) > 1:
        yield notice("cutoffs-differ", cutoffs=", ".join(sorted(cutoffs)))
    rates = [frame_rate(side.time_s) for side in sides if side.run and is_lifted(side.run)]
    yield from rates_apart("runs", rates)


def _aligned(
    side: Side, reference: Side, align: Align, offset_s: float, search_s: float
) -> tuple[Alignment | None, list[Notice]]:
    """How the side's clock is brought to the reference's, None for takes of different motions, and doubts."""
    together = one_clock(side, reference)
    if align == "auto":
        align = "stamps" if together else "correlate" if reference.run is None else "cycles"
    if align == "cycles":
        if reference.run is None:
            raise InputError(
                "files-apart",
                "Motion capture of another motion is no reference; give that of the take itself.",
            )
        return None, []

    def aligned(of: Side) -> Alignment:
        if align == "stamps":
            return stamped(of, reference, offset_s)
        return correlated(of, reference, offset_s, search_s)

    how, doubts = aligned(side), list[Notice]()
    both: dict[str, Any] = {"run": side.name, "other": reference.name}
    if not how.r >= WEAK:
        doubts.append(notice("angles-weak", **both, r=how.r))
    elif how.runner_up > AMBIGUOUS * how.r:
        values: dict[str, Any] = {"r": how.r, "runner_up": how.runner_up, "offset_s": offset_s}
        so = f"The shift nearest to {offset_s:g} s (--offset) was used: {NARROW}."
        doubts.append(notice("shift-ambiguous", run=side.name, **values, so=so))
    elif how.r < UNUSUAL and not together:
        doubts.append(notice("angles-weak", **both, r=how.r))
    with suppress(InputError):  # where one side of the body alone is known
        if (of_image := aligned(mirrored(side)).r) > UNUSUAL and of_image > how.r + CLEARLY:
            doubts.append(notice("mirror-images", **both, r=how.r, of_image=of_image))
    return how, doubts


def _moment_by_moment(pair: Pair) -> Pair:
    side, reference = pair.side, pair.reference
    at_reference = {name: reference.at(name, pair.times) for name in ANGLES}
    sd = {name: _sd(side, reference, name, pair.times) for name in ANGLES}
    agreements = {name: agreement(side.angles[name], at_reference[name], sd[name]) for name in ANGLES}
    joints = reference.joints_at(pair.times)
    turn, scale = turn_deg(side.level, joints), size_ratio(side.level, joints)
    level = scale * turned(side.level, turn)
    off = joint_error(level, joints)
    return replace(
        pair,
        at_reference=at_reference,
        sd=sd,
        agreement={name: of for name, of in agreements.items() if of is not None},
        turn_deg=turn,
        scale=scale,
        joints_mm=float(1000 * np.nanmean(off)) if reference.metric and np.isfinite(off).any() else None,
        joints=joint_agreement(level, joints, reference.metric),
    )


def _sd(side: Side, reference: Side, name: str, times: np.ndarray) -> np.ndarray:
    """(T,) standard error of the difference of an angle: of both runs together; motion capture has none."""
    if reference.run is None:
        return side.sd[name]
    row = np.clip(np.searchsorted(reference.time_s, times), 0, len(reference.time_s) - 1)
    return np.hypot(side.sd[name], reference.sd[name][row])


def _beyond(pair: Pair) -> list[Notice]:
    """A doubt about the measures of one motion, of which one take shows more than the other."""
    if pair.alignment is None or not any(np.isfinite(change.by) for change in pair.changes):
        return []
    spans = np.array([times[[0, -1]] for times in (pair.times, pair.reference.time_s)])
    common_s, longest_s = spans[:, 1].min() - spans[:, 0].max(), np.ptp(spans, axis=1).max()
    if common_s >= _MOSTLY * longest_s:
        return []
    both: dict[str, Any] = {"run": pair.side.name, "other": pair.reference.name}
    return [notice("partly-common", **both, common_s=float(common_s), longest_s=float(longest_s))]


def _spread(reference: Side, pairs: list[Pair]) -> dict[str, float]:
    """View-consistency by angle of all runs that show one motion."""
    runs = [(pair.side, pair.alignment.shift_s) for pair in pairs if pair.alignment]
    if reference.run:
        runs.insert(0, (reference, 0.0))
    if len(runs) < 2:
        return {}
    times = runs[0][0].time_s + runs[0][1]
    spreads = {name: view_spread([side.at(name, times - shift) for side, shift in runs]) for name in ANGLES}
    return {name: spread for name, spread in spreads.items() if spread is not None}


def result(pair: Pair) -> Iterator[str]:
    """What came of a pair: whether they are compared as one motion, by how much their angles differ, also beside the
    errors that are stated, and which measures of two recordings differ by more than their errors."""
    against = f"{pair.side.name} against {pair.reference.name}"
    if pair.alignment is None or not pair.agreement:
        yield (
            f"{against}: compared as two motions; if both show one, give --align stamps, or --align correlate if they "
            "began apart"
        )
    else:
        how = pair.alignment
        yield f"{against}: one motion, by {how.how} shifted by {how.shift_s:+z.3f} s (correlation {how.r:.2f})"
        yield _angles_apart(pair)
    if not pair.one_recording:
        yield from summary(pair.changes, f"{pair.side.name} minus {pair.reference.name}")


def _angles_apart(pair: Pair) -> str:
    rmse = {name: of["rmse_deg"] for name, of in pair.agreement.items()}
    worst = max(rmse, key=lambda name: rmse[name])
    inside = [of["within_band"] for of in pair.agreement.values() if "within_band" in of]
    share = f"{100 * np.mean(inside):.0f} % of the differences are within the stated errors" if inside else ""
    return (
        f"{how_many(len(rmse), 'angle')} differ by {np.median(list(rmse.values())):.1f} degrees in the median, "
        f"{label_of(worst)} most, by {rmse[worst]:.1f} (root mean square)"
        f"{f'; {share} (90 % expected)' if share else ''}"
    )


def figures(comparison: Comparison) -> dict[str, Any]:
    """Everything but the curves, for JSON."""
    sides: Sequence[Side] = (comparison.reference, *(pair.side for pair in comparison.pairs))
    return {
        "reference": comparison.reference.name,
        "sides": {
            side.name: {
                "about": side.about,
                "inputs": list(side.sources),
                "angle_errors": side.run and side.run.angle_errors,
            }
            for side in sides
        },
        "pairs": {
            pair.side.name: {
                "alignment": None if pair.alignment is None else vars(pair.alignment),
                "turn_deg": pair.turn_deg,
                "scale": pair.scale,
                "joints_mm": pair.joints_mm,
                "joints": pair.joints,
                "angles": pair.agreement,
                "same_place": pair.same_place,
                "changes": as_figures(pair.changes),
                "cycles": [cycle.figures() for cycle in pair.cycles],
            }
            for pair in comparison.pairs
        },
        "view_spread_deg": comparison.spread,
        "notices": [each.as_dict() for each in comparison.notices],
    }
