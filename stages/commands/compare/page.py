"""A comparison as one HTML page: agreement in tables and charts, cycles, view-consistency, wrists."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from ....pipeline.messages import how_many
from ....pipeline.motion.angles import ANGLES, near
from ....pipeline.pose import package_version
from ...drawing.charts import Curve, over_time
from ...drawing.page import (
    Cell,
    box,
    bullets,
    charts,
    figure,
    glance,
    heading,
    joined,
    page,
    picture,
    small,
    table,
)
from ...report.sections import spoken
from .align import Alignment
from .cycles import Cycles
from .joints import JointAgreement, joint_table
from .plots import svg
from .side import Side
from .wrists import AXES, WRISTS, Wrists, draw

if TYPE_CHECKING:
    from matplotlib.axes import Axes

REFERENCE = "#3c434b"
COLOURS = (
    "#d55e00",
    "#0072b2",
    "#009e73",
    "#cc79a7",
    "#e69f00",
)  # of Okabe and Ito's palette, in the sides' order
_DOTS = 350  # of a scatter
_LEAST_HEIGHT_DEG = 1.0  # of its axis


@dataclass(frozen=True, eq=False)
class Pair:
    """A side against the reference. shift_s and the rest as in Alignment, None for takes of different motions.

    at_reference: {angle: (T,)} the reference's angles at the side's rows. agreement: of _compare_figures.agreement by
    angle, with "joints_mm", the mean distance of the joints in LEVEL, beside it. turn_deg, scale: what brought the
    side's LEVEL to the reference's.
    """

    side: Side
    alignment: Alignment | None
    at_reference: dict[str, np.ndarray]
    agreement: dict[str, dict[str, float | int]]
    cycles: list[Cycles]
    turn_deg: float = 0.0
    scale: float = 1.0
    joints_mm: float | None = None
    joints: JointAgreement = field(default_factory=dict)
    wrists: Wrists | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """spread, spread_unrectified: by angle the view-consistency of all runs, and what it would be if their cameras were
    taken as level, for angles that depend on gravity."""

    reference: Side
    pairs: tuple[Pair, ...]
    spread: dict[str, float]
    spread_unrectified: dict[str, float]
    warnings: tuple[str, ...]


def as_page(found: Comparison) -> str:
    """The comparison as one HTML page that needs no other file."""
    several = len(found.pairs) > 1
    sections = [("How they were brought together", _together(found))]
    for pair in found.pairs:
        of = f": {pair.side.name}" if several else ""
        sections += [
            (f"Wrists against motion capture{of}", _wrists(pair)),
            (f"Agreement of the angles{of}", _agreement(pair, found.reference)),
            (f"Agreement of the joints{of}", joint_table(pair.joints, found.reference.run is None)),
            (f"Cycles{of}", _cycles(pair, found.reference)),
            (f"Angles over time and differences{of}", _charts(pair, found.reference)),
        ]
    sections.append(("View-consistency", _spread(found)))
    names = " and ".join([pair.side.name for pair in found.pairs] + [found.reference.name])
    head = glance(
        [("Reference", f"{found.reference.name}: {found.reference.about}")]
        + [("Compared", f"{pair.side.name}: {pair.side.about}") for pair in found.pairs]
    )
    return page(names, head + box("Warnings", list(found.warnings), "warning"), sections)


def _together(found: Comparison) -> Markup:
    lines = []
    for pair in found.pairs:
        how = pair.alignment
        if how is None:
            lines.append(
                f"{pair.side.name}: another motion than {found.reference.name}'s, so only cycles are compared."
            )
            continue
        lines.append(
            f"{pair.side.name}: by {how.how}; {how.shift_s:+.3f} s added to its time (r of eight joint angles "
            f"{how.r:.3f}), LEVEL turned by {pair.turn_deg:.1f}° and scaled by {pair.scale:.3g} to "
            f"{found.reference.name}'s for the recording."
            + ("" if pair.joints_mm is None else f" Joints then differ by {pair.joints_mm:.0f} mm.")
        )
    cutoffs = {side.cutoff_hz for side in (found.reference, *(pair.side for pair in found.pairs))}
    words = " and ".join(
        "unfiltered" if hz is None else f"{hz:g} Hz" for hz in sorted(cutoffs, key=lambda x: x or 0)
    )
    return bullets([*lines, f"Low-pass of the joints: {words}.", f"pcnet3d {package_version()}."])


def _agreement(pair: Pair, reference: Side) -> Markup:
    if not pair.agreement:
        return Markup("")
    rows: list[list[Cell]] = []
    keys = ("bias_deg", "lower_deg", "upper_deg", "rmse_deg", "r", "slope", "rom_deg", "rom_reference_deg")
    for name, of in pair.agreement.items():
        inside = of.get("within_band")
        shown: list[Cell] = [_cell(of.get(key)) for key in keys]
        rows.append([spoken(name), *shown, None if inside is None else 100 * inside, of["frames"]])
    head = (
        "angle", "bias (°)", "lower limit (°)", "upper limit (°)", "RMSE (°)", "r", "slope",
        f"range of {pair.side.name} (°)", f"range of {reference.name} (°)", "inside the 90 % band (%)", "frames",
    )  # fmt: skip
    return table(head, rows) + small(
        f"Differences are {pair.side.name} less {reference.name}. Limits of agreement: bias and 1.96 standard "
        "deviations of the differences to each side (Bland & Altman 1986), of this take's frames. Slope: of the "
        "difference over the mean of both. Range: 5th to 95th percentile. Inside the band: share of frames "
        "whose difference is what the stated standard errors allow in nine of ten."
    )


def _charts(pair: Pair, reference: Side) -> Markup:
    figures = []
    for name in pair.agreement:
        title = f"{spoken(name).capitalize()} (°)"
        values, other = pair.side.angles[name], pair.at_reference[name]
        curves = [Curve(reference.name, other, REFERENCE), Curve(pair.side.name, values, COLOURS[0])]
        figures.append(figure([over_time(curves, pair.side.time_s, f"{title} of both over time")], title))
        off = picture(
            bland_altman(values, other, pair.agreement[name]), "svg", f"{title}: difference over the mean"
        )
        figures.append(
            figure([off], f"{title}: difference", "Over the mean of both; lines: bias and limits.")
        )
    if not figures:
        return Markup("")
    return small(f"Dark grey: {reference.name}. Orange: {pair.side.name}.") + charts(figures)


def bland_altman(values: np.ndarray, reference: np.ndarray, of: Mapping[str, float | int]) -> bytes:
    """An SVG of the differences of two angles (T,) in degrees over their means, at most 350 of the frames, with the
    bias and the limits. of: figures.agreement of the two."""
    off = near(values - reference, 0.0)
    rows = np.flatnonzero(np.isfinite(off))
    rows = rows[:: -(-len(rows) // _DOTS)]

    def plot(axes: Axes) -> None:
        axes.plot((reference + off / 2)[rows], off[rows], ".", ms=2.5, color=COLOURS[1], alpha=0.6)
        for key, dashes in (("bias_deg", "-"), ("lower_deg", "--"), ("upper_deg", "--")):
            axes.axhline(of[key], color=REFERENCE, lw=1.0, ls=dashes)
        axes.set_xlabel("mean (°)", labelpad=1)
        low, high = axes.get_ylim()
        # Rounding errors are not to look like differences.
        room = max(0.0, _LEAST_HEIGHT_DEG - (high - low)) / 2
        axes.set_ylim(low - room, high + room)

    return svg(plot, (4.1, 2.0), (0.115, 0.2, 0.865, 0.77))


def _cycles(pair: Pair, reference: Side) -> Markup:
    if not pair.cycles:
        return Markup("")
    rows: list[list[Cell]] = []
    figures = []
    for found in pair.cycles:
        of = found.agreement
        interval = (
            f"{of['lower_deg']:+.1f} to {of['upper_deg']:+.1f}" if np.isfinite(of["lower_deg"]) else "–"
        )
        counts = f"{of['cycles']} and {of['cycles_reference']}"
        keys = ("difference_deg", "largest_deg", "rom_deg", "rom_reference_deg", "rom_change_deg")
        rows.append(
            [f"{found.kind}: {spoken(found.angle)}", counts, *(_cell(of[key]) for key in keys), interval]
        )
        curves = [
            Curve(side.name, values.mean(axis=0), colour, values.std(axis=0, ddof=1))
            for side, values, colour in (
                (reference, found.reference, REFERENCE),
                (pair.side, found.curves, COLOURS[0]),
            )
        ]
        title = f"{found.kind.capitalize()}: {spoken(found.angle)} (°)"
        chart = over_time(curves, np.linspace(0, 100, 101), f"{title} over a cycle", "cycle (%)")
        figures.append(figure([chart], title, "Mean over the cycles; band: one standard deviation."))
    head = (
        "cycles of", "how many", "mean curves differ by (°)", "at most by (°)", f"range of {pair.side.name} (°)",
        f"range of {reference.name} (°)", "change of range (°)", "95 % interval (°)",
    )  # fmt: skip
    return (
        table(head, rows)
        + small(
            "Each cycle is brought to 0 to 100 %. Range: of motion within a cycle, mean. The interval of its change "
            "takes cycles for independent cases (Welch's t, or paired where both show the same cycles); it does "
            "not hold errors that all cycles of a take share."
        )
        + charts(figures)
    )


def _spread(found: Comparison) -> Markup:
    if not found.spread:
        return Markup("")
    rows: list[list[Cell]] = [
        [spoken(name), found.spread[name], _cell(found.spread_unrectified.get(name))]
        for name in ANGLES
        if name in found.spread
    ]
    return table(("angle", "between the runs (°)", "cameras taken as level (°)"), rows) + small(
        "Root mean square over frames of the standard deviation between the runs: 0 when all give the same angle. The "
        "last column is the same without rectification, for angles to gravity; the others do not depend on it."
    )


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
    figures = [
        heading(spoken(wrist))
        + Markup('<div class="wide">')
        + figure([picture(draw(pair.wrists, wrist), "svg", f"{wrist} by every method")], "")
        + Markup("</div>")
        for wrist in WRISTS
    ]
    return (
        small(
            "From the pelvis, in BODY: x back, y right, z up, unfiltered, over the person's size (root mean square "
            f"distance of the limbs' joints from the pelvis, {pair.wrists.size_m:.3f} m), each method at motion "
            "capture's size by one factor. Raw 2D and camera axes stand for a level camera in front of a person who "
            "faces it; 2D has no depth. No r along an axis on which the wrist hardly moves."
        )
        + table(head, rows)
        + joined(figures)
    )


def as_text(found: Comparison) -> Iterator[str]:
    """The main figures, a line each."""
    for pair in found.pairs:
        if pair.alignment:
            yield (
                f"{pair.side.name} against {found.reference.name}: {pair.alignment.how}, "
                f"{pair.alignment.shift_s:+.3f} s added, r {pair.alignment.r:.3f}"
            )
        if pair.agreement:
            yield f"{'angle':<26}{'bias':>8}{'limits of agreement':>22}{'RMSE':>8}{'r':>8}  (degrees)"
        for name, of in pair.agreement.items():
            limits = f"{of['lower_deg']:z.1f} to {of['upper_deg']:z.1f}"
            yield f"{name:<26}{of['bias_deg']:>z8.1f}{limits:>22}{of['rmse_deg']:>8.1f}{of['r']:>8.3f}"
        for method, wrists in pair.wrists.agreement.items() if pair.wrists else ():
            for wrist, axes in wrists.items():
                said = ", ".join(f"{a} r {v['r']:.3f} RMSE {v['rmse_mm']:.0f} mm" for a, v in axes.items())
                yield f"{wrist}, {method}: {said}"
        for cycle in pair.cycles:
            of = cycle.agreement
            yield (
                f"{cycle.kind}, {cycle.angle}: {of['cycles']} and {how_many(int(of['cycles_reference']), 'cycle')}, "
                f"range {of['rom_deg']:.1f} against {of['rom_reference_deg']:.1f} degrees"
            )


def result(pair: Pair, reference: str) -> Iterator[str]:
    """What came of a pair in two lines: whether they move alike, and by how much their angles differ."""
    against = f"{pair.side.name} against {reference}"
    if pair.alignment is None or not pair.agreement:
        kinds = len({cycle.kind for cycle in pair.cycles})
        yield f"{against}: two motions, not one"
        yield f"{how_many(kinds, 'kind')} of cycle compared" if kinds else "nothing could be compared"
        return
    rmse = {name: of["rmse_deg"] for name, of in pair.agreement.items()}
    worst = max(rmse, key=lambda name: rmse[name])
    yield f"{against}: one motion, shifted by {pair.alignment.shift_s:+.3f} s (correlation {pair.alignment.r:.2f})"
    yield (
        f"{how_many(len(rmse), 'angle')} differ by {np.median(list(rmse.values())):.1f} degrees in the median, most "
        f"{spoken(worst)} by {rmse[worst]:.1f} (root mean square)"
    )


def figures(found: Comparison) -> dict[str, Any]:
    """Everything but the curves, for JSON."""
    sides: Sequence[Side] = (found.reference, *(pair.side for pair in found.pairs))
    return {
        "reference": found.reference.name,
        "sides": {side.name: {"about": side.about, "inputs": list(side.sources)} for side in sides},
        "pairs": {
            pair.side.name: {
                "alignment": None if pair.alignment is None else vars(pair.alignment),
                "turn_deg": pair.turn_deg,
                "scale": pair.scale,
                "joints_mm": pair.joints_mm,
                "joints": pair.joints,
                "angles": pair.agreement,
                "cycles": [{"kind": c.kind, "angle": c.angle, **c.agreement} for c in pair.cycles],
                "wrists": None
                if pair.wrists is None
                else {"size_m": pair.wrists.size_m, "methods": pair.wrists.agreement},
            }
            for pair in found.pairs
        },
        "view_spread_deg": found.spread,
        "view_spread_unrectified_deg": found.spread_unrectified,
        "warnings": list(found.warnings),
    }


def _cell(value: float | int | None) -> Cell:
    return None if value is None or not np.isfinite(value) else value
