"""What a report shows of joint angles: ranges of motion with both sides compared, and charts over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from ...models.angle_error.repeatability import difference_chance, differing
from ...pipeline.core.figures import COMPARED, FIGURES, WITHHELD, label_of
from ...pipeline.core.measures import Measures, with_bar
from ...pipeline.core.messages import how_many
from ...pipeline.core.take import AngleErrors, Take
from ...pipeline.running.sentences import spread
from ...pipeline.signals.angles import ALL_ANGLES, ALL_OF_BOTH, MIDLINE, REASONS, of_both, sides_of
from ..drawing.charts import BAND, SIDES, of_side, over_time
from ..drawing.facts import angle_bands
from ..drawing.page import Cell, Soft, beside, charts, figure, small, table


def ranges(measures: Measures, errors: AngleErrors | None) -> Markup:
    """HTML of the ranges of motion, right beside left. measures: the groups `range_of_motion` and `symmetry`; errors:
    how those of the take's angles are known."""
    ranges_of, symmetry = measures.group("range_of_motion"), measures.group("symmetry")
    lowest = {name: low for name, group in ranges_of.groups.items() if (low := group.figure("p05"))}
    angles, bars = [*lowest], any(low.error is not None for low in lowest.values())
    rows: list[list[Cell]] = [
        [
            label_of(both),
            *(range_words(ranges_of.group(f"{side}_{both}"), bars) for side in "rl"),
            _difference(symmetry.group(both), errors),
        ]
        for both in dict.fromkeys(of_both(name) for name in angles if name not in MIDLINE)
    ]  # fmt: skip
    middle: list[list[Cell]] = [
        [label_of(name), range_words(ranges_of.group(name))] for name in angles if name in MIDLINE
    ]
    if not angles:
        return Markup("")
    mdc = "; ± is its MDC90: if both are equal, nine in ten differences lie within it" if bars else ""
    unknown = "the error is not known"
    doubtful = f"the difference lies within ±, {unknown}" if bars else unknown
    return (
        small(
            f"From the 5th to the 95th percentile of the frames, in degrees. Difference: right minus left "
            f"range, divided by their mean{mdc}. Grey: {doubtful}, or some values are beyond what a joint reaches."
        )
        + beside(table(("", "right", "left", "difference"), rows), table(("", "range"), middle))
        + Markup("").join(map(small, _without_range(ranges_of)))
    )  # fmt: skip


def range_words(group: Measures, bars: bool = False) -> Cell:
    """A range of motion with the wider 90 % bar of its ends, broken before ± at most; None where unknown. In grey where
    some values are such as no joint reaches, and where it has no error beside others that have one. group: an
    angle's figures in `range_of_motion`; bars: whether others have errors."""
    low, high = (group.figure(name) for name in ("p05", "p95"))
    if low is None or high is None:
        return None
    shown = spread([low, high], unit=False).replace(" ", "\u00a0").replace("\u00a0±", " ±")
    if bars and low.bar is None:
        return Soft(f"{shown}, error not known")
    return Soft(shown) if group.value("beyond_anatomy_frames") else shown


def _without_range(ranges_of: Measures) -> list[str]:
    """Which angles have no range, and why. ranges_of: the group `range_of_motion`."""
    why = {name: reason for name, group in ranges_of.groups.items() if (reason := group.withheld())}
    angles: dict[str, list[str]] = {}
    for name, reason in why.items():
        alike = {why.get(f"{side}_{of_both(name)}") for side in "rl"} == {reason}
        angles.setdefault(reason, []).append(label_of(of_both(name) if alike else name))
    return [
        f"No range of {', '.join(dict.fromkeys(names))}: {WITHHELD[reason]}."
        for reason, names in angles.items()
    ]


def sides_compared(measures: Measures) -> list[str]:
    """Sentences on whether the sides differ, in ranges of motion and steps, told apart from the one difference in ten
    that chance makes; none where no error is stated. That they do not differ is said of a walk alone, in which both
    have the same to do: of who stands on one leg it would be untrue, however large the errors are. measures: of a take.
    """
    walking, symmetry = measures.group("walking"), measures.group("symmetry")
    indices = {
        f"range of {label_of(name)}": group.figure("symmetry_index")
        for name, group in symmetry.groups.items()
    }
    indices |= {FIGURES[name].label: walking.figure(f"{name}_symmetry_index") for name in COMPARED}
    stated = {
        figure_name: (index.value, index.error, index.bar)
        for figure_name, index in indices.items()
        if index and index.error and index.bar is not None
    }
    if not stated:
        return []
    differ = differing(difference_chance(np.array([value / error for value, error, _ in stated.values()])))
    apart = [
        f"{figure_name} {value:+z.0f} ± {bar:.0f} %"
        for (figure_name, (value, _, bar)), sure in zip(stated.items(), differ, strict=True)
        if sure
    ]
    if apart:
        compared = how_many(len(stated), "figure")
        return [
            f"Right and left differ in {', '.join(apart)} (right minus left; {compared} compared).",
        ]
    alike = any(FIGURES[name].label in stated for name in COMPARED)
    return ["No clear difference between right and left."] if alike else []


def _difference(symmetry: Measures, errors: AngleErrors | None) -> Cell:
    index = symmetry.figure("symmetry_index")
    if index is None:
        why = symmetry.withheld("symmetry_index")
        return Soft(WITHHELD[why]) if why else None
    bar = "" if index.bar is None else f" ±\u00a0{index.bar:.0f}"
    shown = f"{index.value:z.0f}{bar}\u00a0%"
    return Soft(shown) if index.within_error or (index.bar is None and errors is not None) else shown


def angle_charts(take: Take) -> Markup:
    """HTML of every angle over time, both sides in one chart, with its band; empty where the take has none."""
    columns, times = take.kinematics or {}, take.need("poses").times
    if len(times) < 2:  # a chart of one value is empty
        return _single_frame(columns)
    figures, bars = [], False
    for name in ALL_OF_BOTH:
        if (shown := angle_bands(take, name)) is None:
            continue
        values, margins = (each.T for each in shown)
        bars |= bool(np.isfinite(margins).any())
        names = [name] if name in MIDLINE else ["right", "left"]
        curves = [of_side(*curve) for curve in zip(names, values, margins, strict=True)]
        angle = ALL_ANGLES[sides_of(name)[0]]
        title = f"{label_of(name).capitalize()} (°)"
        about = f"{angle.definition[:1].upper()}{angle.definition[1:]}; positive: {angle.positive}."
        figures.append(figure(over_time(curves, times, f"{title} over time", about=about), title))
    if not figures:
        return Markup("")
    return small(f"{SIDES}{f' {BAND}' * bars} Where a curve breaks off there is no value.") + charts(figures)


def _single_frame(columns: Mapping[str, np.ndarray]) -> Markup:
    """The angles of a take of one frame, of one without a value the reason. columns: (1,) of its kinematics."""
    rows: list[list[Cell]] = []
    for name in ALL_ANGLES:
        for value in columns.get(f"{name}_deg", np.empty(0)):
            error = float(columns.get(f"{name}_sd_deg", np.full(1, np.nan))[0])
            why = REASONS[int(columns[f"{name}_reason"][0])]
            rows.append([label_of(name), with_bar(float(value), error) if np.isfinite(value) else Soft(why)])
    return table(("angle", "degrees"), rows)
