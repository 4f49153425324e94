"""A take's movements as figures, tables and charts, from its measures and the catalogue of figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from markupsafe import Markup

from ...pipeline.core.figures import FIGURES, GROUPS, OF_LENGTH, TOGETHER, UNITS, WITHHELD, label_of
from ...pipeline.core.measures import SD_90, Measure, Measures, Moments, Remark
from ..drawing.charts import Curve, of_side, over_time
from ..drawing.page import Cell, Soft, Tile, charts, figure, heading, joined, small, table, tiles

_ABOUT = "Click a figure to see what it is. SD: standard deviation. Grey: a difference within its ±."
_CYCLE = (
    "Means over strides, from a foot's initial contact (0 %) to its next (100 %). Vertical line: the mean toe-off, "
    "where stance ends and swing begins."
)
_MOST = 20  # repetitions; more are too long for a table
_SIDES = ("right", "left")


def happened(measures: Measures, metric: bool) -> Markup:
    """HTML of the movements of a take that were recognised, each under its name. metric: whether lengths are in metres;
    without, they and speeds are in files alone."""
    parts = [
        heading(_title(name, own)) + movement(own, metric)
        for name in GROUPS
        if GROUPS[name].movement
        and (own := measures.group(name))
        and any(row.name != "observable" for row in own)
    ]
    return small(_ABOUT) + joined(parts) if parts else Markup("")


def _title(name: str, group: Measures) -> str:
    if name == "walking":
        return group.text("gait") or name
    every = name == "knee_bends" and group.count() and group.count("squats") == group.count()
    return "squats" if every else label_of(name)


def movement(group: Measures, metric: bool) -> Markup:
    """HTML of the figures of a group: those of the take; of each repetition; both sides beside each other; curves over
    a cycle; and the groups inside."""
    sides = {side: group.group(side) for side in _SIDES if side in group.groups}
    inner = {name: inside for name, inside in group.groups.items() if name not in sides}
    return (
        joined(map(small, _remarks(group)))
        + tiles(_tile(row) for row in _figures(group, metric))
        + _repetitions(group, metric)
        + _beside(sides, metric)
        + joined(
            heading(side, 4) + shown for side, own in sides.items() if (shown := _repetitions(own, metric))
        )
        + _curves(group)
        + joined(heading(label_of(name), 4) + movement(inside, metric) for name, inside in inner.items())
    )


def _remarks(group: Measures) -> Iterator[str]:
    """What the group says in words, and why it lacks figures."""
    for row in (row for rows in group.own.values() for row in rows if isinstance(row, Remark)):
        name = row.name.removesuffix("withheld").rstrip("_")
        if name != row.name:
            why = TOGETHER.get(name) or (FIGURES[name].label if name else "figures")
            yield f"No {why}: {WITHHELD[row.text]}."
        elif FIGURES[name].audience != "files":
            yield f"{FIGURES[name].label.capitalize()}: {row.text}."


def _figures(group: Measures, metric: bool) -> list[Measure]:
    """Those of the whole take that a page shows; how much could be judged, only where that is not all."""
    rows = [
        row for rows in group.own.values() for row in rows if isinstance(row, Measure) and row.number is None
    ]
    return [row for row in rows if _shows(row, metric) and (row.name != "observable" or row.value < 99.5)]


def _shows(row: Measure, metric: bool) -> bool:
    return row.about.audience != "files" and (metric or row.unit not in OF_LENGTH)


def _tile(row: Measure) -> Tile:
    """A figure that stands alone, in grey where it lies within its error."""
    unknown = row.error is None and row.about.error in ("angle", "gait", "repeated", "flight")
    behind = ", within its error" if row.within_error else ", error not known" if unknown else ""
    return Tile(row.about.label, words(row) + behind, row.about.definition, bool(row.within_error) or unknown)


def words(row: Measure) -> str:
    """A figure with its error and unit, such as "at least 12", "98 ± 3 steps/min"."""
    unit = UNITS[row.unit].page.format("m")
    gap = "" if unit.startswith("°") else " "
    return f"{'at least ' * row.at_least}{row.in_words()}{gap}{unit}".rstrip()


def _repetitions(group: Measures, metric: bool) -> Markup:
    """A line for each, where there are not too many."""
    count = len(group.times("start"))
    if not 0 < count <= _MOST:
        return Markup("")
    head, columns = [""], [[str(i + 1) for i in range(count)]]
    for name, rows in group.own.items():
        if isinstance(rows[0], Moments):
            cells = dict(enumerate(f"{at_s:.2f}" for at_s in rows[0].at_s))
        else:
            cells = {row.number: row.in_words() for row in group.repetitions(name) if _shows(row, metric)}
        if cells:
            head.append(FIGURES[name].label_with_unit())
            columns.append([cells.get(i, "–") for i in range(count)])
    return table(head, [*zip(*columns, strict=True)])


def _beside(sides: Mapping[str, Measures], metric: bool) -> Markup:
    """The figures of the right and the left side in a line each."""
    by_side = {side: {row.name: row for row in _figures(group, metric)} for side, group in sides.items()}
    names = dict.fromkeys(name for figures in by_side.values() for name in figures)
    rows: list[list[Cell]] = [
        [FIGURES[name].label_with_unit(), *(_cell(figures.get(name)) for figures in by_side.values())]
        for name in names
    ]
    return table(("", *sides), rows)


def _cell(row: Measure | None) -> Cell:
    if row is None:
        return None
    shown = f"{'at least ' * row.at_least}{row.in_words()}"
    return Soft(shown) if row.within_error else shown


def _curves(group: Measures) -> Markup:
    """A chart of each angle's mean curve over a cycle and the band that holds nine in ten, both sides in one; of a walk
    with the toe-off of each side."""
    walks = group.path == ("walking",)
    drawn: dict[str, list[tuple[Curve, str]]] = {}
    for each in group.curves:
        side = each.side or label_of(each.angle)
        margin = None if each.sd_deg is None else SD_90 * np.array(each.sd_deg, dtype=np.float64)
        mean = np.array(each.mean_deg, dtype=np.float64)
        toe_off = group.group(side).value("mean_stance") if walks and each.side else None
        curve = of_side(side, mean, margin, toe_off)
        both = each.angle[2:] if each.side else each.angle
        drawn.setdefault(both, []).append((curve, f"{side}: n = {each.count}"))
    figures = []
    for name, parts in drawn.items():
        both = [curve for curve, _ in parts]
        title = f"{label_of(name)} (°)".capitalize()
        share = np.linspace(0, 100, len(both[0].values))
        over = "gait cycle (%)" if walks else "cycle (%)"
        chart = over_time(both, share, f"{title} over a cycle", over)
        about = "; ".join(sentence for _, sentence in parts)
        spread = any(curve.margin is not None for curve in both)
        band = f"; band: nine in ten of them ({SD_90} standard deviations)" if spread else ""
        figures.append(figure(chart, title, f"Mean ({about}){band}."))
    shown = charts(figures)
    return heading("Gait cycle", 4) + small(_CYCLE) + shown if shown and walks else shown
