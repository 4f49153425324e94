"""A comparison as one HTML page: what came of it, then both over each other, in tables and charts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from markupsafe import Markup

from ....pipeline.core.measures import grouped, subgroup, with_bar
from ....pipeline.core.pose import package_version
from ....pipeline.signals.angles import ANGLES, MIDLINE, OF_BOTH, sides_of
from ...drawing.page import Cell, Soft, answer, box, bullets, heading, joined, page, small, table
from ...drawing.words import errors_of_angles, range_words, spoken
from .changes import Change, named
from .comparison import Comparison, Pair, result
from .curves import acceleration_rows, angle_rows, cycle_rows, thumbnails, wrist_paths
from .figures import JointAgreement
from .wrists import AXES, WRISTS, wrist_charts

_ERRORS = (
    'On this page ±, "within the errors" and 90 % mean the same: nine in ten true values lie in that range. '
    "Of the figures said to differ, at most a tenth does so by chance (Benjamini & Hochberg 1995)."
)
LOWER_BOUND = (
    "At least one of the two runs is off by half of the difference or more. Runs that agree may share errors."
)


def as_page(comparison: Comparison) -> str:
    """The comparison as one HTML page that needs no other file."""
    sections = []
    for pair in comparison.pairs:
        of = f": {pair.side.name}" if len(comparison.pairs) > 1 else ""
        sections += [(f"{name}{of}", section(pair)) for name, section in _SECTIONS.items()]
    # Of two, it says no more than their agreement.
    spread = _spread(comparison) if len(comparison.pairs) > 1 else Markup("")
    sections += [("View-consistency", spread), ("How they were aligned", _together(comparison))]
    names = " and ".join([comparison.reference.name, *(pair.side.name for pair in comparison.pairs)])
    about = [f"Reference: {comparison.reference.name} ({comparison.reference.about})"]
    about += [f"compared: {pair.side.name} ({pair.side.about})" for pair in comparison.pairs]
    said = [f"{line}." for pair in comparison.pairs for line in result(pair)]
    head = (
        small(" · ".join(about))
        + answer(said)
        + small(" ".join([_ERRORS, *_known(comparison)]))
        + box("Warnings", [each.text for each in comparison.notices], "warning")
    )
    return page(names, head, sections)


def _known(comparison: Comparison) -> Iterator[str]:
    """How the errors of each run's angles are known."""
    for side in (comparison.reference, *(pair.side for pair in comparison.pairs)):
        if side.run and side.run.angle_errors:
            yield f"{side.name}: {errors_of_angles(side.run.angle_errors)}"


def _moments(pair: Pair) -> Markup:
    if pair.alignment is None:
        return Markup("")
    words = (
        f"Grey: {pair.reference.name}. In colour: {pair.side.name}, orange its right, blue its left, at the same size. "
        "Each is turned to face you."
    )
    return small(words) + thumbnails(pair)


def _together(comparison: Comparison) -> Markup:
    lines = []
    for pair in comparison.pairs:
        how = pair.alignment
        if how is None:
            lines.append(
                f"{pair.side.name}: treated as another motion than {comparison.reference.name}'s, so only ranges and "
                "cycles are compared."
            )
            continue
        lines.append(
            f"{pair.side.name}: by {how.how}; {how.shift_s:+.3f} s added to its time (r of eight joint angles "
            f"{how.r:.3f}), LEVEL turned by {pair.turn_deg:.1f}° and scaled by {pair.scale:.3g} to "
            f"{comparison.reference.name}'s for the recording."
            + ("" if pair.joints_mm is None else f" Joints then differ by {pair.joints_mm:.0f} mm.")
        )
    sides = (comparison.reference, *(pair.side for pair in comparison.pairs))
    cutoffs = {side.cutoff_hz for side in sides}
    words = " and ".join(
        "unfiltered" if hz is None else f"{hz:g} Hz" for hz in sorted(cutoffs, key=lambda x: x or 0)
    )
    by = " and ".join(dict.fromkeys(side.run.need("rectified").method for side in sides if side.run))
    return bullets(
        [*lines, f"Rectified by {by}; low-pass of the joints: {words}.", f"pcnet3d {package_version()}."]
    )


def _agreement(pair: Pair) -> Markup:
    if not pair.agreement:
        return Markup("")
    head = ("difference (°)", "RMSE (°)", "r", "within error")
    return small(
        f"{pair.side.name} minus {pair.reference.name}: bias, and in brackets the limits of agreement, 1.96 standard "
        "deviations of the differences to each side of it (Bland & Altman 1986), of this take's frames. Within "
        "error: share of frames whose difference is what the stated standard errors allow in nine of ten. All "
        "figures are in compare.json."
    ) + _by_angle({name: _agreed(of) for name, of in pair.agreement.items()}, head)


def _agreed(of: Mapping[str, float | int]) -> list[Cell]:
    words = f"{of['bias_deg']:+z.1f} ({of['lower_deg']:z.0f} to {of['upper_deg']:z.0f})"
    r = f"{of['r']:.2f}" if np.isfinite(of["r"]) else None
    inside = f"{100 * of['within_band']:.0f} %" if "within_band" in of else None
    return [words, f"{of['rmse_deg']:.1f}", r, inside]


def _by_angle(cells: Mapping[str, list[Cell]], head: Sequence[str]) -> Markup:
    """Tables of angles: both sides on one row, then those of the midline. cells: by angle, one for each of head."""
    none: list[Cell] = [None] * len(head)
    rows: list[list[Cell]] = [
        [spoken(both), *(cell for name in sides_of(both) for cell in cells.get(name, none))]
        for both in OF_BOTH
        if both not in MIDLINE and any(name in cells for name in sides_of(both))
    ]
    middle: list[list[Cell]] = [[spoken(name), *cells[name]] for name in MIDLINE if name in cells]
    names = (f"{side}: {word}" for side in ("right", "left") for word in head)
    return table(("", *names), rows) + table(("", *head), middle)


def _joints(agreement: JointAgreement, truth: bool) -> Markup:
    """truth: whether the reference is motion capture."""
    if not agreement:
        return Markup("")
    named = {
        "p50_percent": "median (%)", "rms_percent": "root mean square (%)", "p95_percent": "95 % of frames below (%)",
        "rms_mm": "root mean square (mm)",
    }  # fmt: skip
    keys = [key for key in named if all(key in of for of in agreement.values())]
    rows: list[list[Cell]] = [[spoken(joint), *(of[key] for key in keys)] for joint, of in agreement.items()]
    words = (
        "Distance in one LEVEL and at one size, from the pelvis, in per cent of the person's size (root mean square "
        "distance of the joints from the pelvis)."
    )
    return small(words if truth else f"{words} {LOWER_BOUND}") + table(
        ("joint", *(named[key] for key in keys)), rows
    )


def _ranges(pair: Pair) -> Markup:
    """Of two runs, as their measures have them."""
    both = [subgroup(grouped(side.measures), "range_of_motion") for side in (pair.reference, pair.side)]
    if not all(both):
        return Markup("")
    by = {change.item: _by(change) for change in pair.changes if change.group == "range_of_motion"}

    cells: dict[str, list[Cell]] = {
        name: [*(range_words(subgroup(of, name)) for of in both), by.get(name)] for name in ANGLES
    }
    words = (
        "From the 5th to the 95th percentile of each whole take, in degrees; the truth lies within ± in nine of ten. "
        f"Difference: {pair.side.name} minus {pair.reference.name}, of the width of the range. {_of_changes(pair)} "
        "Grey too: a range with values that no joint reaches."
    )
    return small(words) + _by_angle(cells, (pair.reference.name, pair.side.name, "difference (± MDC90)"))


def _of_changes(pair: Pair) -> str:
    place = (
        "about the same place, according to the person's heading and the camera's pitch"
        if pair.same_place
        else "different or unknown places"
    )
    return (
        "± of a difference is its MDC90, the minimal detectable change: if nothing changed, one difference in ten is "
        f"larger. Both were filmed from {place}. Grey: a difference within its ±; this judges a figure that was "
        "chosen beforehand. *: a difference that is certain even with all figures looked at."
    )


def _movements(pair: Pair) -> Markup:
    """Of two runs: what else both state with an error."""
    rows: list[list[Cell]] = [
        [
            f"{named(change)} ({change.unit})",
            *(with_bar(value, sd) for value, sd in zip(change.values, change.errors, strict=True)),
            _by(change),
        ]
        for change in pair.changes
        if change.group != "range_of_motion"
    ]
    head = ("", pair.reference.name, pair.side.name, "difference (± MDC90)")
    return table(head, rows) + small(_of_changes(pair)) if rows else Markup("")


def _by(change: Change) -> Cell:
    if not change.same_part:
        return Soft("another part seen")
    words = f"{change.words} *" if change.differs else change.words
    return Soft(words) if change.within_error and not change.differs else words


def _angles(pair: Pair) -> Markup:
    if not pair.agreement:
        return Markup("")
    words = (
        f"Grey: {pair.reference.name}. In colour: {pair.side.name}, orange its right, blue its left; its band holds "
        "the grey curve in nine of ten frames, if the stated errors of both are right. Each row ends with "
        "the differences over the mean of both; lines: bias, and dashed the limits of agreement."
    )
    return small(words) + angle_rows(pair)


def _cycles(pair: Pair) -> Markup:
    if not pair.cycles:
        return Markup("")
    rows: list[list[Cell]] = []
    for cycle in pair.cycles:
        of = cycle.agreement
        interval = (
            f"{of['lower_deg']:+.1f} to {of['upper_deg']:+.1f}" if np.isfinite(of["lower_deg"]) else "–"
        )
        counts = f"{of['cycles']} and {of['cycles_reference']}"
        keys = ("difference_deg", "largest_deg", "rom_deg", "rom_reference_deg", "rom_change_deg")
        rows.append(
            [f"{cycle.kind}: {spoken(cycle.angle)}", counts, *(_cell(of[key]) for key in keys), interval]
        )
    head = (
        "cycles of", "how many", "mean curves differ by (°)", "at most by (°)", f"range of {pair.side.name} (°)",
        f"range of {pair.reference.name} (°)", "change of range (°)", "95 % interval (°)",
    )  # fmt: skip
    return (
        table(head, rows)
        + small(
            "Each cycle is brought to 0 to 100 %. Range: of motion within a cycle, mean. The interval of its change "
            "treats cycles as independent (Welch's t, or paired where both show the same cycles); it does not "
            "include errors that all cycles of a take share."
        )
        + small(f"Mean over the cycles; band: one standard deviation. Grey: {pair.reference.name}.")
        + cycle_rows(pair)
    )


def _motion(pair: Pair) -> Markup:
    """Of two runs of one motion."""
    if pair.accelerations is None:
        return Markup("")
    unit = "m" if pair.reference.metric else "units"
    rows: list[list[Cell]] = [
        [spoken(joint), of["rmse"], _cell(of["r"])]
        for joint, of in sorted(pair.accelerations.agreement.items(), key=lambda one: one[0][1:])
    ]
    words = (
        f"Relative to the pelvis, unfiltered, in {pair.reference.name}'s LEVEL; {pair.side.name} is turned by "
        f"{pair.turn_deg:.1f}° and scaled by {pair.scale:.3g} to it. The cross is the pelvis."
    )
    about = (
        "Accelerations of the smoothed paths, relative to the pelvis; the band holds the grey curve in nine of ten "
        "frames, if the stated errors of both are right. Values smaller than their error are left out."
    )
    return (
        small(words)
        + wrist_paths(pair, unit)
        + heading("Accelerations")
        + small(about)
        + table(("", f"RMSE ({unit}/s²)", "r"), rows)
        + acceleration_rows(pair, unit)
    )


def _spread(comparison: Comparison) -> Markup:
    if not comparison.spread:
        return Markup("")
    rows: list[list[Cell]] = [
        [spoken(name), comparison.spread[name], _cell(comparison.spread_unrectified.get(name))]
        for name in ANGLES
        if name in comparison.spread
    ]
    words = small(
        "Root mean square over frames of the standard deviation between the runs: 0 when all give the same angle. The "
        "last column is the same without rectification, for angles to gravity; the others do not depend on it."
    )
    return table(("angle", "between the runs (°)", "cameras taken as level (°)"), rows) + words


def _wrists(pair: Pair) -> Markup:
    if pair.wrists is None:
        return Markup("")
    rows: list[list[Cell]] = []
    for method, of in pair.wrists.agreement.items():
        for wrist in WRISTS:
            axes = of.get(wrist, {})
            cells = [_cell(axes.get(axis, {}).get(key)) for key in ("r", "rmse", "rmse_mm") for axis in AXES]
            rows.append([f"{method}, {spoken(wrist)}", *cells])
    head = ["method", *(f"{key} {axis}" for key in ("r", "RMSE", "RMSE (mm)") for axis in AXES)]
    return (
        small(
            "From the pelvis, in BODY: x back, y right, z up, unfiltered, over the person's size (root mean square "
            f"distance of the limbs' joints from the pelvis, {pair.wrists.size_m:.3f} m), each method at motion "
            "capture's size by one factor. Raw 2D and camera axes assume a level camera that the person faces; 2D "
            "has no depth. No r along an axis on which the wrist hardly moves."
        )
        + table(head, rows)
        + joined(wrist_charts(pair.wrists, wrist, pair.times) for wrist in WRISTS)
    )


def _cell(value: float | int | None) -> Cell:
    return None if value is None or not np.isfinite(value) else value


_SECTIONS: dict[str, Callable[[Pair], Markup]] = {
    "At the same moments": _moments,
    "Ranges of motion": _ranges,
    "Walking and repetitions": _movements,
    "Agreement of the angles": _agreement,
    "Agreement of the joints": lambda pair: _joints(pair.joints, pair.reference.run is None),
    "Cycles": _cycles,
    "Angles over time and differences": _angles,
    "Wrists against motion capture": _wrists,
    "Wrist paths and accelerations": _motion,
}
