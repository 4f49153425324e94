"""Runs against the first, or against motion capture: by how much their measures differ, with which error, and if that
is not told, why; takes of one motion moment by moment, on one clock and in one heading. In figures, in words and as a
page."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from ....models.angle_error.joint_noise import made_by_the_built_in
from ....models.angle_error.repeatability import (
    MOVEMENTS,
    Between,
    difference_chance,
    difference_sd,
    differing,
    figure_of,
    same_part,
    same_place,
)
from ....pipeline.core.errors import InputError
from ....pipeline.core.figures import FIGURES, OF_LENGTH, UNITS, label_of
from ....pipeline.core.measures import SD_90, Measure, with_bar
from ....pipeline.core.messages import how_many
from ....pipeline.core.notices import Notice, grave, notice, verdict
from ....pipeline.core.pose import package_version
from ....pipeline.core.rotations import norm, turn_deg, turned
from ....pipeline.running.sentences import ERRORS_OF_ANGLES, NINE_IN_TEN
from ....pipeline.signals.angles import ANGLES, MIDLINE, OF_BOTH, sides_of
from ....pipeline.signals.filters import each_path
from ...drawing.charts import LEFT, MIDDLE, RIGHT, SOFT, Curve, over_time
from ...drawing.page import Cell, Soft, answer, box, bullets, charts, figure, joined, page, small, table
from .align import Align, Alignment, agreement, aligned, size_ratio
from .side import Side, one_clock

WHY = {
    "another-part": "in one of the takes a part of the movement was not seen",
    "poses-doubtful": "the poses of one of the takes are doubtful",
    "error-unknown": "the figure's error is not known in both takes",
    "in-one-take": "only one of the takes has the figure",
    "unit-unknown": "one of the takes is not in metres",
}
_MOST = 6  # differences that a sentence names
_OF_CHANGES = (
    "group", "item", "side", "unit", "reference", "value", "difference", "error", "mdc90", "within_error", "differs",
    "reason",
)  # fmt: skip
IF_ONE = "if both show one, give --align stamps, or --align correlate if they began apart"
_CHANCE = "Of the figures that are said to differ, at most one in ten does so by chance (Benjamini & Hochberg 1995)."
_OF_PAIRS = ("alignment", "turn_deg", "scale", "joints_mm", "same_place")
_WIDE = 2.6  # the reference's line, so that it is seen where both run together


class Change(NamedTuple):
    """A figure of two takes.

    group: "range_of_motion" or the movement's. side: "right", "left" or neither. reference, value: of the reference and
    of the other, with their errors. error: one standard deviation of their difference. All NaN where not known.
    differs: whether the difference is told from none, with all figures of the comparison tested at once; None of one
    that is not judged, for the reason whose code in WHY is `reason`.
    """

    group: str
    item: str
    side: str
    unit: str
    reference: float
    value: float
    errors: tuple[float, float]
    error: float
    reason: str = ""
    differs: bool | None = None

    @property
    def difference(self) -> float:
        """The other less the reference."""
        return self.value - self.reference

    @property
    def mdc90(self) -> float:
        """The minimal detectable change: beyond it lies one in ten differences of a figure that did not change."""
        return SD_90 * self.error

    @property
    def within_error(self) -> bool | None:
        """Whether zero lies in the 90 % band about the difference, by itself; None where that is not known."""
        return None if math.isnan(self.error) else abs(self.difference) <= self.mdc90

    @property
    def chance(self) -> float:
        """How often a figure that did not change differs by as much."""
        if self.error <= 0:
            return float(self.difference == 0)
        return float(difference_chance(np.array(self.difference / self.error)))

    @property
    def in_words(self) -> str:
        """The difference and its minimal detectable change, where that is known, with a sign and without a unit."""
        return signed(self.difference, self.error)

    def __str__(self) -> str:
        """What the figure is."""
        if self.group == "range_of_motion":
            return f"range of {label_of(self.item)}"
        if self.group == "walking":
            return self.item
        return f"{self.item} of {f'{self.side} ' if self.side else ''}{label_of(self.group)}"


def signed(by: float, error: float | None = None) -> str:
    """A difference and its error as people read them."""
    return f"{'+' * (by >= 0)}{with_bar(by, error)}"


def changes(side: Side, reference: Side, near: bool, doubtful: bool = False) -> list[Change]:
    """Of every range of motion, of walking and of how far knees bend and arms rise, that either run has; none of motion
    capture. near: whether both were filmed from about the same place. doubtful: whether the poses of one are, whose
    errors do not hold."""
    runs = [each.run for each in (reference, side) if each.run is not None]
    if len(runs) < 2:
        return []
    both = [run.figures for run in runs]
    gaits = [run.group("walking").text("gait") for run in both]
    # Lifts, with the errors that were judged, of the lifter whose differences are known as shares of these; others
    # count as independent.
    one_lifter = all(run.angle_errors == "judged" and made_by_the_built_in(run.need("poses")) for run in runs)
    between = ("again" if near else "elsewhere") if one_lifter else None
    metric = reference.metric and side.metric
    differences = []
    for group, path, item, name in _figures():
        groups = [run.group(group, *path) for run in both]
        rows = [each.figure(name) for each in groups]
        if rows[0] is None and rows[1] is None:
            continue
        values, errors = ((_known(rows[0], field), _known(rows[1], field)) for field in ("value", "error"))
        part = path[0] if path and group != "range_of_motion" else ""
        unit = UNITS[FIGURES[name].unit].page.format("m")
        error = _error(rows, errors, gaits, between)
        reasons = {
            "in-one-take": None in rows,
            "unit-unknown": FIGURES[name].unit in OF_LENGTH and not metric,
            "error-unknown": math.isnan(error),
            "another-part": not same_part(*groups),
            "poses-doubtful": doubtful,
        }
        reason = next((code for code, holds in reasons.items() if holds), "")
        error = error if reason in ("", "poses-doubtful") else float("nan")
        differences.append(Change(group, item, part, unit, *values, errors, error, reason))
    # Those that are told are tested against chance all at once.
    chances = [change.chance for change in differences if not change.reason]
    tested = iter(differing(np.array(chances or [1.0])))
    return [
        change if change.reason else change._replace(differs=bool(next(tested))) for change in differences
    ]


def _error(
    rows: Sequence[Measure | None], errors: tuple[float, float], gaits: Sequence[str], between: Between | None
) -> float:
    """One standard deviation of the difference of a figure. between: how takes of one lifter that share its errors were
    filmed; None of others, whose errors are independent."""
    figures = [figure_of(row, gait) for row, gait in zip(rows, gaits, strict=True) if row]
    if between is not None and figures[0] is not None and figures == figures[:1] * 2:
        return difference_sd(figures[0], errors, between)
    return math.hypot(*errors)


def _figures() -> Iterator[tuple[str, tuple[str, ...], str, str]]:
    """Group, what is in it, the item of a Change, and the measure's name, of all figures that are compared."""
    for angle in ANGLES:
        yield "range_of_motion", (angle,), angle, "p05_p95"
    for group, names in MOVEMENTS.items():
        for name in names:
            for side in ("right", "left") if group == "arm_raises" else ("",):
                yield group, (side,) if side else (), FIGURES[name].label, name


def _known(row: Measure | None, name: str) -> float:
    """A measure's value or error; NaN where there is none."""
    stated = None if row is None else getattr(row, name)
    return float("nan") if stated is None else stated


def summary(changes: list[Change], against: str) -> Iterator[str]:
    """Sentences on which figures differ, all tested at once, and why others are not judged. against: "B less A"."""
    tested = [change for change in changes if not change.reason]
    if tested:
        differ = sorted((change for change in tested if change.differs), key=lambda change: change.chance)
        named = [
            f"{change} {change.in_words} {change.unit}".rstrip().replace(" °", "°")
            for change in differ[:_MOST]
        ]
        named += [f"{len(differ) - _MOST} more"] * (len(differ) > _MOST)
        which = f"; {against}: {', '.join(named)}" if named else ""
        are = "differ" if len(differ) > 1 else "differs"
        yield f"{len(differ) or 'none'} of {how_many(len(tested), 'figure')} {are} by more than chance{which}"
    if reasons := Counter(change.reason for change in changes if change.reason):
        why = ", ".join(f"{WHY[code]} ({many})" for code, many in reasons.items())
        yield f"{how_many(reasons.total(), 'difference')} not judged: {why}"


def as_figures(changes: list[Change]) -> list[dict[str, Any]]:
    """For JSON: those that are told first."""
    listed = sorted(changes, key=lambda change: math.isnan(change.error) and change.reason != "another-part")
    return [{name: getattr(change, name) for name in _OF_CHANGES} for change in listed]


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
    notices = [each for side in sides for each in side.notices]
    notices += [
        notice("run-doubtful", run=name, verdict=verdict(findings), why=findings[0].text.rstrip("."))
        for name, findings in doubtful.items()
        if findings
    ]
    pairs = []
    for side in others:
        runs = [each.run for each in (side, reference) if each.run]
        near = len(runs) == 2 and same_place(*(run.need("rectified") for run in runs))
        either_doubtful = bool(doubtful.get(side.name) or doubtful.get(reference.name))
        differences = changes(side, reference, near, either_doubtful)
        how, doubts = aligned(side, reference, align, offset_s, search_s)
        pair = Pair(side, reference, one_clock(side, reference), near, differences, how)
        pairs.append(pair if how is None else _moment_by_moment(pair, side.time_s + how.shift_s))
        notices += doubts
    return Comparison(tuple(sides), tuple(pairs), tuple(notices))


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
    off = norm(level - joints).mean(axis=-1)
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
                **{name: getattr(pair, name) for name in _OF_PAIRS},
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
