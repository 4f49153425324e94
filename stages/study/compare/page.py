"""A comparison as one HTML page: what came of it, one table of all differences, then both over each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from markupsafe import Markup

from ....pipeline.core.figures import label_of
from ....pipeline.core.measures import SD_90, with_bar
from ....pipeline.core.pose import package_version
from ....pipeline.running.sentences import ERRORS_OF_ANGLES, NINE_IN_TEN
from ....pipeline.signals.angles import ANGLES, MIDLINE, OF_BOTH, sides_of
from ...drawing.charts import LEFT, MIDDLE, RIGHT, SOFT, Curve, over_time
from ...drawing.page import Cell, Soft, answer, box, bullets, charts, figure, joined, page, small, table
from .changes import Change, signed
from .comparison import Comparison, Pair, conclusion, shift_in_words

_CHANCE = "Of the figures that are said to differ, at most one in ten does so by chance (Benjamini & Hochberg 1995)."
_WIDE = 2.6  # the reference's line, so that it is seen where both run together


def as_page(comparison: Comparison) -> str:
    """The comparison as one HTML page that needs no other file."""
    sections = []
    for pair in comparison.pairs:
        of = f": {pair.side.name}" if len(comparison.pairs) > 1 else ""
        sections += [
            (f"Differences{of}", _differences(pair)),
            (f"Angles over time{of}", _angles(pair)),
        ]
    sections.append(("How they were aligned", bullets(_together(comparison))))
    reference, *others = sides = [comparison.reference, *(pair.side for pair in comparison.pairs)]
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
    of = pair.agreement[name]
    r = f"{of['r']:.2f}" if np.isfinite(of["r"]) else None
    inside = f"{100 * of['within_band']:.0f} %" if "within_band" in of else None
    return [f"{of['bias_deg']:+z.1f}", f"{of['rmse_deg']:.1f}", r, inside]


def _angles(pair: Pair) -> Markup:
    """A row of charts for every angle, right beside left."""
    rows = []
    for both in OF_BOTH:
        shown = []
        for name in (name for name in sides_of(both) if name in pair.agreement):
            margin = SD_90 * pair.sd[name] if np.isfinite(pair.sd[name]).any() else None
            curves = [
                Curve(pair.reference.name, pair.at_reference[name], SOFT, width=_WIDE),
                Curve(pair.side.name, pair.side.angles[name], _colour(name), margin),
            ]
            title = f"{label_of(name).capitalize()} (°)"
            shown.append(figure([over_time(curves, pair.times, f"{title} of both over time")], title))
        rows.append(charts(shown))
    about = (
        f"Grey: {pair.reference.name}. In colour: {pair.side.name}, orange its right, blue its left; its band holds "
        "the grey curve in nine of ten frames, if the errors of both are right."
    )
    return small(about) + joined(rows) if pair.agreement else Markup("")


def _colour(name: str) -> str:
    """Of an angle's side."""
    return MIDDLE if name in MIDLINE else RIGHT if name.startswith("r_") else LEFT


def _together(comparison: Comparison) -> Iterator[str]:
    yield from (f"{shift_in_words(pair)}." for pair in comparison.pairs)
    sides = (comparison.reference, *(pair.side for pair in comparison.pairs))
    cutoffs = sorted({side.cutoff_hz or 0.0 for side in sides})
    filters = " and ".join(f"{hz:g} Hz" if hz else "unfiltered" for hz in cutoffs)
    by = " and ".join(dict.fromkeys(side.run.need("rectified").method for side in sides if side.run))
    yield f"Rectified by {by}; low-pass of the joints: {filters}."
    yield f"pcnet3d {package_version()}."
