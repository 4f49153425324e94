"""Runs against the first, or against motion capture: brought to one clock and one heading, in figures and in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ....models.common.metrics import joint_error
from ....pipeline.core.errors import InputError
from ....pipeline.core.figures import label_of
from ....pipeline.core.messages import how_many
from ....pipeline.core.notices import Notice, grave, notice, verdict
from ....pipeline.core.rotations import turn_deg, turned
from ....pipeline.signals.angles import ANGLES
from ....pipeline.signals.filters import rate as frame_rate
from .align import Align, Alignment, agreement, aligned, size_ratio
from .changes import Change, as_figures, changes, from_same_place, summary
from .side import Side, one_clock

IF_ONE = "if both show one, give --align stamps, or --align correlate if they began apart"
_MOSTLY = 0.9  # of the longer take: two cameras that were started by hand lack a second or two of each other
# Of the higher rate to the lower one, and from which rate on all are lifted alike. Ranges of the built-in walker's knee
# from five sides: 24 and 30 a second are 0 to 2 degrees apart (1 on average), 60 and 120 by 0.2 at most.
_APART, _ALIKE_HZ = 1.5, 60.0


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
    alignment: Alignment | None
    times: np.ndarray
    at_reference: dict[str, np.ndarray] = field(default_factory=dict)
    sd: dict[str, np.ndarray] = field(default_factory=dict)
    agreement: dict[str, dict[str, float | int]] = field(default_factory=dict)
    turn_deg: float = 0.0
    scale: float = 1.0
    joints_mm: float | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """All sides against the first, and what is to be doubted of them."""

    reference: Side
    pairs: tuple[Pair, ...]
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
    doubtful = {side.name: grave(side.run.judged) for side in sides if side.run}
    notices = [*_of_all(sides)]
    notices += [
        notice("run-doubtful", run=name, verdict=verdict(findings), why=findings[0].text.rstrip("."))
        for name, findings in doubtful.items()
        if findings
    ]
    pairs = []
    for side in others:
        near = from_same_place(side, reference)
        either_doubtful = bool(doubtful.get(side.name) or doubtful.get(reference.name))
        differences = changes(side, reference, near, either_doubtful)
        how, doubts = aligned(side, reference, align, offset_s, search_s)
        pair = Pair(
            side=side,
            reference=reference,
            one_recording=one_clock(side, reference),
            same_place=near,
            changes=differences,
            alignment=how,
            times=side.time_s + (how.shift_s if how else 0.0),
        )
        pairs.append(pair if how is None else _moment_by_moment(pair))
        notices += [*doubts, *_beyond(pairs[-1])]
    return Comparison(reference, tuple(pairs), tuple(notices))


def _of_all(sides: Sequence[Side]) -> Iterator[Notice]:
    for side in sides:
        yield from side.notices
    cutoffs = {"none" if side.cutoff_hz is None else f"{side.cutoff_hz:g} Hz" for side in sides}
    if len(cutoffs) > 1:
        yield notice("cutoffs-differ", cutoffs=", ".join(sorted(cutoffs)))
    lifted = [side for side in sides if side.run and side.run.need("poses").made_by.in_run]
    rates = sorted(rate for side in lifted if np.isfinite(rate := frame_rate(side.time_s)))
    if rates and min(rates[-1], _ALIKE_HZ) > _APART * rates[0]:
        yield notice("rates-differ", least_fps=rates[0], most_fps=rates[-1])


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
    )


def _sd(side: Side, reference: Side, name: str, times: np.ndarray) -> np.ndarray:
    """(T,) standard error of the difference of an angle: of both runs together; motion capture has none."""
    if reference.run is None:
        return side.sd[name]
    row = np.clip(np.searchsorted(reference.time_s, times), 0, len(reference.time_s) - 1)
    return np.hypot(side.sd[name], reference.sd[name][row])


def _beyond(pair: Pair) -> list[Notice]:
    """A doubt about the measures of one motion, of which one take shows more than the other."""
    if pair.alignment is None or not any(np.isfinite(change.difference) for change in pair.changes):
        return []
    spans = np.array([times[[0, -1]] for times in (pair.times, pair.reference.time_s)])
    common_s, longest_s = float(spans[:, 1].min() - spans[:, 0].max()), float(np.ptp(spans, axis=1).max())
    if common_s >= _MOSTLY * longest_s:
        return []
    names = (pair.side.name, pair.reference.name)
    return [notice("partly-common", run=names[0], other=names[1], common_s=common_s, longest_s=longest_s)]


def result(pair: Pair) -> Iterator[str]:
    """What came of a pair, and how it was compared."""
    yield from conclusion(pair)
    yield shift_in_words(pair)


def shift_in_words(pair: Pair) -> str:
    """Whether a pair was compared as one motion, and how one was brought to the other."""
    how, against = pair.alignment, f"{pair.side.name} against {pair.reference.name}"
    if how is None or not pair.agreement:
        return f"{against}: compared as two motions; {IF_ONE}"
    apart = "" if pair.joints_mm is None else f"; joints then differ by {pair.joints_mm:.0f} mm"
    return (
        f"{against}: one motion, by {how.how} shifted by {how.shift_s:+z.3f} s (correlation {how.r:.2f}), LEVEL turned "
        f"by {pair.turn_deg:.0f} degrees and scaled by {pair.scale:.3g}{apart}"
    )


def conclusion(pair: Pair) -> Iterator[str]:
    """By how much the angles of one motion differ, also beside the errors that are stated; which measures of two
    recordings differ by more than their errors."""
    if pair.alignment is not None and pair.agreement:
        yield _angles_apart(pair)
    if not pair.one_recording:
        yield from summary(pair.changes, f"{pair.side.name} minus {pair.reference.name}")


def _angles_apart(pair: Pair) -> str:
    rmse = {name: of["rmse_deg"] for name, of in pair.agreement.items()}
    worst = max(rmse, key=lambda name: rmse[name])
    inside = [of["within_band"] for of in pair.agreement.values() if "within_band" in of]
    share = f"{100 * np.mean(inside):.0f} % of the differences are within the stated errors" if inside else ""
    return (
        f"{how_many(len(rmse), 'angle')} of {pair.side.name} and {pair.reference.name} differ by "
        f"{np.median(list(rmse.values())):.1f} degrees in the median, {label_of(worst)} most, by {rmse[worst]:.1f} "
        f"(root mean square){f'; {share} (90 % expected)' if share else ''}"
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
                "angles": pair.agreement,
                "same_place": pair.same_place,
                "changes": as_figures(pair.changes),
            }
            for pair in comparison.pairs
        },
        "notices": [each.as_dict() for each in comparison.notices],
    }
