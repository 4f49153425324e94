"""Runs against the first, or against motion capture: brought to one clock and one heading, in figures, in words and as
a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from markupsafe import Markup

from ....models.common.metrics import joint_error
from ....pipeline.core.errors import InputError
from ....pipeline.core.figures import label_of
from ....pipeline.core.measures import SD_90, with_bar
from ....pipeline.core.messages import how_many
from ....pipeline.core.notices import Notice, grave, notice, verdict
from ....pipeline.core.pose import package_version
from ....pipeline.core.rotations import turn_deg, turned
from ....pipeline.running.sentences import ERRORS_OF_ANGLES, NINE_IN_TEN
from ....pipeline.signals.angles import ANGLES, MIDLINE, OF_BOTH, sides_of
from ....pipeline.signals.filters import each_path
from ....pipeline.signals.filters import rate as frame_rate
from ...drawing.charts import LEFT, MIDDLE, RIGHT, SOFT, Curve, over_time
from ...drawing.page import Cell, Soft, answer, box, bullets, charts, figure, joined, page, small, table
from .align import Align, Alignment, agreement, aligned, size_ratio
from .changes import Change, as_figures, changes, from_same_place, signed, summary
from .side import Side, one_clock

IF_ONE = "if both show one, give --align stamps, or --align correlate if they began apart"
_MOSTLY = 0.9  # of the longer take: two cameras that were started by hand lack a second or two of each other
# Of the higher rate to the lower one, and from which rate on all are lifted alike. Ranges of the built-in walker's knee
# from five sides: 24 and 30 a second are 0 to 2 degrees apart (1 on average), 60 and 120 by 0.2 at most.
_APART, _ALIKE_HZ = 1.5, 60.0
_CHANCE = "Of the figures that are said to differ, at most one in ten does so by chance (Benjamini & Hochberg 1995)."
_IN_FILES = ("alignment", "turn_deg", "scale", "joints_mm", "same_place")  # of a pair
_WIDE = 2.6  # the reference's line, so that it is seen where both run together


@dataclass(frozen=True, eq=False)
class Pair:
    """A side against the reference. one_recording: whether both read the same one, so that their errors are not
    independent. same_place: whether both were filmed from about the same place, False where that is not known.
    changes: of the measures of both.

    Of takes of one motion only: times: (T,) the side's rows on the reference's clock. at_reference, sd: by angle (T,)
    the reference's value at the side's rows, and the standard error of the difference. agreement: of align.agreement
    by angle. turn_deg, scale: what brought the side's LEVEL to the reference's. joints_mm: mean distance of the joints
    in LEVEL then.
    """

    side: Side
    reference: Side
    one_recording: bool
    same_place: bool
    changes: list[Change]
    alignment: Alignment | None
    times: np.ndarray = field(default_factory=lambda: np.empty(0))
    at_reference: dict[str, np.ndarray] = field(default_factory=dict)
    sd: dict[str, np.ndarray] = field(default_factory=dict)
    agreement: dict[str, dict[str, float | int]] = field(default_factory=dict)
    turn_deg: float = 0.0
    scale: float = 1.0
    joints_mm: float | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """All sides, each but the first against that, and what is to be doubted of them."""

    sides: tuple[Side, ...]
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
    notices = _of_all(sides)
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
        pair = Pair(side, reference, one_clock(side, reference), near, differences, how)
        pairs.append(pair if how is None else _moment_by_moment(pair, side.time_s + how.shift_s))
        notices += [*doubts, *_beyond(pairs[-1])]
    return Comparison(tuple(sides), tuple(pairs), tuple(notices))


def _of_all(sides: Sequence[Side]) -> list[Notice]:
    notices = [each for side in sides for each in side.notices]
    cutoffs = {"none" if side.cutoff_hz is None else f"{side.cutoff_hz:g} Hz" for side in sides}
    if len(cutoffs) > 1:
        notices.append(notice("cutoffs-differ", cutoffs=", ".join(sorted(cutoffs))))
    lifted = [side for side in sides if side.run and side.run.need("poses").made_by.in_run]
    rates = sorted(rate for side in lifted if np.isfinite(rate := frame_rate(side.time_s)))
    if rates and min(rates[-1], _ALIKE_HZ) > _APART * rates[0]:
        notices.append(notice("rates-differ", least_fps=rates[0], most_fps=rates[-1]))
    return notices


def _moment_by_moment(pair: Pair, times: np.ndarray) -> Pair:
    """times: (T,) as of Pair."""
    side, reference = pair.side, pair.reference
    at_reference = {name: reference.at(name, times) for name in ANGLES}
    sd = side.sd
    if reference.run is not None:  # motion capture has no error
        row = np.clip(np.searchsorted(reference.time_s, times), 0, len(reference.time_s) - 1)
        sd = {name: np.hypot(side.sd[name], reference.sd[name][row]) for name in ANGLES}
    agreements = {name: agreement(side.angles[name], at_reference[name], sd[name]) for name in ANGLES}
    joints = each_path(partial(reference.resampled, time_s=times), reference.level, len(times))
    turn, scale = turn_deg(side.level, joints), size_ratio(side.level, joints)
    level = scale * turned(side.level, turn)
    off = joint_error(level, joints)
    return replace(
        pair,
        times=times,
        at_reference=at_reference,
        sd=sd,
        agreement={name: each for name, each in agreements.items() if each is not None},
        turn_deg=turn,
        scale=scale,
        joints_mm=float(1000 * np.nanmean(off)) if reference.metric and np.isfinite(off).any() else None,
    )


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
    rmse = {name: agreed["rmse_deg"] for name, agreed in pair.agreement.items()}
    worst = max(rmse, key=lambda name: rmse[name])
    inside = [agreed["within_band"] for agreed in pair.agreement.values() if "within_band" in agreed]
    share = f"{100 * np.mean(inside):.0f} % of the differences are within the stated errors" if inside else ""
    return (
        f"{how_many(len(rmse), 'angle')} of {pair.side.name} and {pair.reference.name} differ by "
        f"{np.median(list(rmse.values())):.1f} degrees in the median, {label_of(worst)} most, by {rmse[worst]:.1f} "
        f"(root mean square){f'; {share} (90 % expected)' if share else ''}"
    )


def figures(comparison: Comparison) -> dict[str, Any]:
    """Everything but the curves, for JSON."""
    return {
        "reference": comparison.sides[0].name,
        "sides": {
            side.name: {
                "about": side.about,
                "inputs": list(side.sources),
                "angle_errors": side.run and side.run.angle_errors,
            }
            for side in comparison.sides
        },
        "pairs": {
            pair.side.name: {
                **{name: getattr(pair, name) for name in _IN_FILES},
                "angles": pair.agreement,
                "changes": as_figures(pair.changes),
            }
            for pair in comparison.pairs
        },
        "notices": [each.as_dict() for each in comparison.notices],
    }


def as_page(comparison: Comparison) -> str:
    """HTML that needs no other file: what came of it, one table of all differences, then both over each other."""
    sections = []
    for pair in comparison.pairs:
        whose = f": {pair.side.name}" if len(comparison.pairs) > 1 else ""
        sections += [
            (f"Differences{whose}", _differences(pair)),
            (f"Angles over time{whose}", _angles(pair)),
        ]
    sections.append(("How they were aligned", bullets(_together(comparison))))
    reference, *others = sides = comparison.sides
    about = [f"Reference: {reference.name} ({reference.about})"]
    about += [f"compared: {side.name} ({side.about})" for side in others]
    by_errors: dict[str, list[str]] = {}
    for side in sides:
        if side.run and side.run.angle_errors:
            by_errors.setdefault(ERRORS_OF_ANGLES[side.run.angle_errors], []).append(side.name)
    errors = [f"Errors of the angles of {' and '.join(names)}: {how}." for how, names in by_errors.items()]
    head = (
        small(" · ".join(about))
        + answer([f"{line[:1].upper()}{line[1:]}." for pair in comparison.pairs for line in conclusion(pair)])
        + small(" ".join([NINE_IN_TEN, _CHANCE, *errors]))
        + box("Warnings", [each.text for each in comparison.notices], "warning")
    )
    return page(" and ".join(side.name for side in sides), head, sections)


def _differences(pair: Pair) -> Markup:
    """A row for each angle and each figure of a movement."""
    ranges = {change.item: change for change in pair.changes if change.group == "range_of_motion"}
    others = [change for change in pair.changes if change.group != "range_of_motion"]
    rows = [
        [f"range of {label_of(name)} (°)", *_of(pair, ranges.get(name), name), *_agreed(pair, name)]
        for name in ANGLES
        if name in ranges or name in pair.agreement
    ]
    rows += [
        [f"{change} ({change.unit})" if change.unit else str(change), *_of(pair, change, ""), *[None] * 4]
        for change in others
    ]
    head = ["", pair.reference.name, pair.side.name, "difference (± MDC90)"]
    head += ["bias (°)", "RMSE (°)", "r", "within error"]
    filled = [i for i in range(len(head)) if i < 4 or any(row[i] is not None for row in rows)]
    shown = table([head[i] for i in filled], [[row[i] for i in filled] for row in rows])
    return shown + small(_about_differences(pair)) if rows else Markup("")


def _about_differences(pair: Pair) -> str:
    """What the columns of the table are."""
    place = "about the same place" if pair.same_place else "different or unknown places"
    about = f"Difference: {pair.side.name} minus {pair.reference.name}, of the whole takes."
    if pair.changes:
        about += (
            " Its ± is its MDC90, the minimal detectable change: if nothing changed, one difference in ten is larger. "
            f"Both were filmed from {place}, by the person's heading and the camera's pitch. Grey: a difference within "
            "its ±; this judges a figure that was chosen beforehand. *: a difference that is certain even with all "
            "figures looked at."
        )
    if pair.agreement:
        about += (
            " Bias, root mean square (RMSE) and r: of the angles moment by moment. Within error: share of frames whose "
            "difference is what the stated standard errors allow in nine of ten."
        )
    return about


def _of(pair: Pair, change: Change | None, angle: str) -> list[Cell]:
    """Both takes' figures and their difference; of motion capture the ranges of what both know."""
    if change is None:
        both = [pair.agreement[angle][key] for key in ("rom_reference_deg", "rom_deg")]
        return [*(with_bar(value, None) for value in both), signed(both[1] - both[0])]
    figures = zip((change.reference, change.value), change.errors, strict=True)
    values = [None if np.isnan(value) else with_bar(value, error) for value, error in figures]
    if change.reason:
        by = f"{change.in_words}; " if np.isfinite(change.difference) else ""
        return [*values, Soft(f"{by}not judged: {change.reason.replace('-', ' ')}")]
    if change.differs:
        return [*values, f"{change.in_words} *"]
    return [*values, Soft(change.in_words) if change.within_error else change.in_words]


def _agreed(pair: Pair, name: str) -> list[Cell]:
    if name not in pair.agreement:
        return [None] * 4
    agreed = pair.agreement[name]
    r = f"{agreed['r']:.2f}" if np.isfinite(agreed["r"]) else None
    inside = f"{100 * agreed['within_band']:.0f} %" if "within_band" in agreed else None
    return [f"{agreed['bias_deg']:+z.1f}", f"{agreed['rmse_deg']:.1f}", r, inside]


def _angles(pair: Pair) -> Markup:
    """A row of charts for every angle, right beside left."""
    rows = []
    for both in OF_BOTH:
        shown = []
        for name in (name for name in sides_of(both) if name in pair.agreement):
            margin = SD_90 * pair.sd[name] if np.isfinite(pair.sd[name]).any() else None
            colour = MIDDLE if name in MIDLINE else RIGHT if name.startswith("r_") else LEFT
            curves = [
                Curve(pair.reference.name, pair.at_reference[name], SOFT, width=_WIDE),
                Curve(pair.side.name, pair.side.angles[name], colour, margin),
            ]
            title = f"{label_of(name).capitalize()} (°)"
            shown.append(figure(over_time(curves, pair.times, f"{title} of both over time"), title))
        rows.append(charts(shown))
    about = (
        f"Grey: {pair.reference.name}. In colour: {pair.side.name}, orange its right, blue its left; its band holds "
        "the grey curve in nine of ten frames, if the errors of both are right."
    )
    return small(about) + joined(rows) if pair.agreement else Markup("")


def _together(comparison: Comparison) -> Iterator[str]:
    yield from (f"{shift_in_words(pair)}." for pair in comparison.pairs)
    cutoffs = sorted({side.cutoff_hz or 0.0 for side in comparison.sides})
    filters = " and ".join(f"{hz:g} Hz" if hz else "unfiltered" for hz in cutoffs)
    by = " and ".join(
        dict.fromkeys(side.run.need("rectified").method for side in comparison.sides if side.run)
    )
    yield f"Rectified by {by}; low-pass of the joints: {filters}."
    yield f"pcnet3d {package_version()}."
