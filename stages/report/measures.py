"""A take's measures as tables and charts, whatever they are called."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from markupsafe import Markup

from ...pipeline.core.measures import (
    SD_90,
    UNITS,
    WITHHELD,
    Curves,
    Group,
    Measure,
    Moments,
    Remark,
    Row,
    grouped,
    half_bar,
    moments,
    subgroup,
    text,
    value,
)
from ...pipeline.core.measures import Curve as MeanCurve
from ...pipeline.core.messages import how_many
from ..drawing.charts import LEFT, MIDDLE, RIGHT, Curve, over_time
from ..drawing.page import (
    Cell,
    Soft,
    Told,
    charts,
    figure,
    heading,
    joined,
    small,
    table,
    told,
)
from ..drawing.words import spoken
from .glossary import explained

_WORDS = {
    "p05": "5th percentile", "p95": "95th percentile", "p05_p95": "range between them",
    "usual_error": "usual ±", "beyond_anatomy_frames": "frames beyond anatomy",
    "walking_speed": "speed", "walks": "walks or runs",
    "mean_stance": "mean stance phase", "mean_swing": "mean swing phase", "landings": "initial contacts",
    "toe_offs": "toe-offs", "stride_start": "strides begin", "stride_stop": "strides end",
    "steps_by_knees": "steps told by the knees", "walked": "time walked",
    "peak_at": "peak at", "take_off_feet": "feet at take-off", "landing_feet": "feet at landing",
    "thigh_trunk_lowest": "thigh furthest back",
    "peak_mdc90": "MDC90 from peak to peak",
    "nan_share": "share without a value", "observable": "could be judged",
}  # fmt: skip
_ABOUT = "Click a figure to see what it is. SD: standard deviation."
_ERRORS = (
    f"The true figure lies within ± in nine of ten cases; without ± the error is not known. {_ABOUT} "
    "Grey: a difference within its ±, which is its MDC90: if nothing differs, nine in ten differences lie within it."
)
_ORDER = {"walking": -1}  # of the groups
_ELSEWHERE = ("range_of_motion", "symmetry", "paths", "off_keypoints")  # beside the angles and the speeds
_RANGES = ("lowest", "highest", "full_range", "p05_p95")
# What a reader of the page needs a textbook for: summary.json and measures.csv have it.
FOR_FILES = ("sd_withheld",)
_LARGE = ("walking_speed", "cadence", "mean_step_length")  # of a walk: the figures to be read first
_FEW = 3  # members, which are a table's columns
_MANY = 20  # a list of more is too long for a table
_SIDES = {"r_": ("right", RIGHT), "l_": ("left", LEFT)}


def happened(rows: Iterable[Row], length: str) -> Markup:
    """HTML of the movements that were recognised, each under its name. rows: a take's, whatever groups there are.
    length: the unit of lengths, "m" or "units"."""
    measures = grouped(rows)
    parts = []
    for name, group in sorted(measures.items(), key=lambda one: _ORDER.get(one[0], 0)):
        if name not in _ELSEWHERE and isinstance(group, dict) and _found(group):
            shown = gait(group, length) if name == "walking" else measure_tables(group, length, level=3)
            parts.append(heading(_title(name, group)) + shown)
    single: Group = {name: leaf for name, leaf in measures.items() if not isinstance(leaf, dict)}
    shown = measure_tables(single, length) + joined(parts)
    if not shown:
        return shown
    return small(_ERRORS if "±" in shown else f"No error of a figure is known. {_ABOUT}") + shown


def _found(group: Group) -> bool:
    """Whether there is more in it than how much could be judged, or why there is nothing."""
    return any(
        _found(leaf)
        if isinstance(leaf, dict)
        else name not in ("observable", "withheld", "frames", "nan_share")
        for name, leaf in group.items()
    )


def _title(name: str, group: Group) -> str:
    if name == "walking":
        return text(group, "gait") or name
    every = name == "knee_bends" and value(group, "squats") == value(group, "count")
    return "squats" if every else worded(name)


_CYCLE = (
    "Means over strides, from a foot's initial contact (0 %) to its next (100 %). Vertical line: the mean toe-off, "
    "where stance ends and swing begins."
)


def gait(walking: Group, length: str) -> Markup:
    """HTML of a walk or a run: its figures, and curves over the gait cycle with the toe-off of each side."""
    plain: Group = {name: leaf for name, leaf in walking.items() if name != "cycles"}
    stance = {side: value(subgroup(walking, words), "mean_stance") for side, (words, _) in _SIDES.items()}
    toe_off = {side: percent for side, percent in stance.items() if percent is not None}
    cycles = walking.get("cycles")
    shown = cycle_charts(cycles.of if isinstance(cycles, Curves) else (), "gait cycle (%)", toe_off)
    curves = heading("Gait cycle", 4) + small(_CYCLE) + shown if shown else Markup("")
    return measure_tables(plain, length, level=3) + curves


def measure_tables(measures: Group, length: str = "m", level: int = 2) -> Markup:
    """HTML of measures by their groups: curves over a cycle as charts, both sides in one; the rest as figures and
    tables. Each group of the first level has a heading; below, groups that hold no others are the rows of one table, or
    its columns where they are few. length: the unit of lengths, "m" or "units". level: of the heading that this stands
    under; 3 where the measures are one group's."""
    own = {
        name: _in_cm(leaf) if name == "jump_height" and isinstance(leaf, list) else leaf
        for name, leaf in measures.items()
        if not isinstance(leaf, dict | Curves)
        and not (name == "jump_height" and length != "m")  # beside the one in cm
    }
    groups = {name: leaf for name, leaf in measures.items() if isinstance(leaf, dict | Curves)}
    flat = {name: leaf for name, leaf in groups.items() if level > 2 and _is_flat(leaf)}
    said = {name: leaf for name, leaf in own.items() if isinstance(leaf, Remark) and name not in FOR_FILES}
    running = "running" in text(own, "gait")  # or walking: nobody knows
    hidden = {*said, "frames", "nan_share", "observable", *_repeated(own), *FOR_FILES}
    return (
        joined(
            small(f"{worded(name).capitalize()}: {_in_words(leaf.text)}.")
            for name, leaf in said.items()
            if name != "gait"
        )
        + told(_told(leaf, length, running) for name, leaf in own.items() if name not in hidden)
        + _repetitions(own, length)
        + _rows(flat, length)
        + _basis(own)
        + joined(
            heading(worded(name), min(level + 1, 4))
            + (cycle_charts(leaf.of) if isinstance(leaf, Curves) else measure_tables(leaf, length, level + 1))
            for name, leaf in groups.items()
            if name not in flat
        )
    )


def _in_cm(leaf: list[Measure]) -> list[Measure]:
    return [replace(m, value=100 * m.value, error=m.error and 100 * m.error, unit="cm") for m in leaf]


def worded(name: str) -> str:
    """The name of a figure or a group in words."""
    if name in _WORDS:
        return _WORDS[name]
    for prefix, words in (("mean_", "mean"), ("sd_", "SD of")):
        if name.startswith(prefix):
            return f"{words} {worded(name.removeprefix(prefix))}"
    if name.endswith("_withheld"):
        return f"why no {spoken(name.removesuffix('_withheld'))}"
    return spoken(name)


def named(leaf: Any, length: str = "m") -> str:
    """A figure's name in words with its unit, such as "range of motion (°)"."""
    words, unit = worded(_name(leaf)), unit_of(leaf, length)
    return f"{words} ({unit})" if unit else words


def unit_of(leaf: Any, length: str = "m") -> str:
    """As pages write it; empty for none. length: the unit of lengths."""
    if isinstance(leaf, Moments):
        return UNITS["s"].page
    one = leaf[0] if isinstance(leaf, list) else leaf
    return UNITS[one.unit].page.format(length) if isinstance(one, Measure) else ""


def _name(leaf: Any) -> str:
    return leaf[0].name if isinstance(leaf, list) else leaf.name


def _is_flat(leaf: Any) -> bool:
    return isinstance(leaf, dict) and not any(isinstance(one, dict | Curves) for one in leaf.values())


def _basis(own: Mapping[str, Any]) -> Markup:
    frames, share, judged = (value(own, name) for name in ("frames", "nan_share", "observable"))
    if judged is not None and judged < 99.5:
        return small(f"{judged:.0f} % of the take could be judged.")
    if frames is None:
        return Markup("")
    lost = f"; {_percent(share)} of the take have no value" if share else ""
    return small(f"From {how_many(int(frames), 'frame')}{lost}.")


def _repeated(own: Mapping[str, Any]) -> list[str]:
    """Names of what has a value for each repetition, or numbers them, where there are not too many of these."""
    count = len(moments(own, "start"))
    if not 0 < count <= _MANY:
        return []
    return [name for name, leaf in own.items() if _many(leaf) == count or isinstance(leaf, list)]


def _many(leaf: Any) -> int:
    """How many moments or numbered figures; 0 of others."""
    return len(leaf.at_s) if isinstance(leaf, Moments) else len(leaf) if isinstance(leaf, list) else 0


def _repetitions(own: Mapping[str, Any], length: str) -> Markup:
    columns = [(own[name], _each(own[name], len(moments(own, "start")))) for name in _repeated(own)]
    each = zip(*(cells for _, cells in columns), strict=True)
    rows: list[list[Cell]] = [[str(i + 1), *cells] for i, cells in enumerate(each)]
    return table(("", *(named(leaf, length) for leaf, _ in columns)), rows)


def _told(leaf: Any, length: str, running: bool) -> Told:
    """A figure that stands alone: its name, and it with its error and unit, in grey where it lies within that."""
    words, unit = worded(_name(leaf)), unit_of(leaf, length)
    about = explained(_name(leaf), running, length == "m")
    if _many(leaf) > _MANY:
        return Told(words, _both(leaf), about)
    least = "at least " * (isinstance(leaf, Measure) and leaf.at_least)
    both = f"{least}{_both(leaf)}{'' if unit.startswith('°') else ' '}{unit}".rstrip()
    within = isinstance(leaf, Measure) and leaf.within_error is True
    of_walk = _name(leaf) == "walking_speed" or _name(leaf).startswith("mean_")
    unknown = (
        isinstance(leaf, Measure) and leaf.error is None and leaf.unit in ("length", "speed") and of_walk
    )
    behind = ", within its error" if within else ", error not known" if unknown else ""
    return Told(words, both + behind, about, within or unknown, _name(leaf) in _LARGE)


def _rows(members: Mapping[str, Any], length: str) -> Markup:
    """A table with a row for each member and a column for each of their figures; of few members the other way round."""
    shown = {name: leaf for member in reversed([*members.values()]) for name, leaf in member.items()}
    order = dict.fromkeys(
        name
        for member in members.values()
        for name in member
        if name not in FOR_FILES
        and (name != "nan_share" or value(member, name))
        and (name != "observable" or round(value(member, name) or 0) < 100)
        and not _of_one(members, name)
    )
    columns = [_whole([_cell_of(member, name) for member in members.values()]) for name in order]
    if not order:
        return Markup("")
    alike = {name: {text(member, name) for member in members.values()} for name in order}
    said = [name for name, texts in alike.items() if len(texts) == 1 and "" not in texts]
    if said and len(members) > 1:
        once = joined(
            small(f"{worded(name).capitalize()}: {WITHHELD.get(which := alike[name].pop(), which)}.")
            for name in said
        )
        rest = {key: {name: of[name] for name in of if name not in said} for key, of in members.items()}
        return once + _rows(rest, length)
    names = [named(shown[name], length) for name in order]
    if len(members) <= _FEW < len(order):
        rows = [[name, *map(_worded, cells)] for name, cells in zip(names, columns, strict=True)]
        return table(("", *map(worded, members)), rows)
    rows = [[worded(name), *cells] for name, *cells in zip(members, *columns, strict=True)]
    return table(("", *names), rows)


def _of_one(members: Mapping[str, Any], name: str) -> bool:
    """Whether a figure is the mean of one figure that stands beside it, in each member that has it."""
    single = [member.get(name.removeprefix("mean_")) for member in members.values() if name in member]
    return name.startswith("mean_") and all(isinstance(leaf, list) and len(leaf) == 1 for leaf in single)


def _worded(cell: Cell) -> Cell:
    """As it stands in a row of unlike figures, which have no decimals in common."""
    return _shown(cell) if isinstance(cell, int | float) else cell


def _whole(cells: list[Cell]) -> list[Cell]:
    """A column of whole numbers without decimals: its figures end there."""
    if all(cell.is_integer() for cell in cells if isinstance(cell, float)):
        return [int(cell) if isinstance(cell, float) else cell for cell in cells]
    return cells


def _each(leaf: Any, of: int = 0) -> list[str]:
    """Moments, finer than frames, or figures with their errors; a dash for each of so many repetitions without one."""
    if isinstance(leaf, Moments):
        return [f"{at_s:.2f}" for at_s in leaf.at_s]
    shown = {
        one.number or 0: _unknown(one) if one.error is None else one.in_words()
        for one in (leaf if isinstance(leaf, list) else [leaf])
    }
    return [shown.get(i, "–") for i in range(max(of, *(i + 1 for i in shown)))]


def _unknown(one: Measure) -> str:
    """A figure whose error is not known, or that has none: two digits, but whole degrees and counts."""
    if one.unit == "deg":
        return f"{one.value:z.0f}"
    if not one.unit or float(one.value).is_integer():
        return _shown(one.value)
    return one.in_words()


def _both(leaf: Any, of: int = 0) -> str:
    """A figure, or each of several, with its error; of: as in `_each`."""
    return f"{_many(leaf)} values, in summary.json" if _many(leaf) > _MANY else ", ".join(_each(leaf, of))


def _cell_of(member: Mapping[str, Any], name: str) -> Cell:
    """A figure of a group and its error, grey where it says nothing."""
    leaf = member.get(name)
    if name == "nan_share":
        return _percent(value(member, name) or 0)
    if leaf is None or isinstance(leaf, Remark):
        return None if leaf is None else _in_words(leaf.text)
    if name == "usual_error" and isinstance(leaf, Measure):
        return _shown(half_bar(leaf.value))
    whole = isinstance(leaf, Measure) and not leaf.unit  # a count
    of = len(moments(member, "start"))
    if isinstance(leaf, Measure) and leaf.at_least:
        return f"at least {_shown(leaf.value)}"
    cell = _cell(leaf.value) if whole else _both(leaf, of * isinstance(leaf, list))
    if (isinstance(leaf, Measure) and leaf.within_error) or (
        name in _RANGES and value(member, "beyond_anatomy_frames")
    ):
        return Soft(cell if isinstance(cell, str) else _shown(cell))
    return cell


def _in_words(text: str) -> str:
    """What a remark says."""
    return WITHHELD.get(text, text)


def _percent(share: float) -> str:
    return f"{float(f'{100 * share:.2g}'):g} %"


def cycle_charts(
    curves: Iterable[MeanCurve], over: str = "cycle (%)", marks: Mapping[str, float] | None = None
) -> Markup:
    """A chart of each angle's mean curve and the band that holds nine in ten, both sides in one. over: what the curves
    run over; marks: where on that an upright line stands, by side "r_" and "l_"."""
    drawn: dict[str, list[tuple[Curve, str]]] = {}
    for one in curves:
        of = one.angle[:2]
        side, colour = _SIDES.get(of, (spoken(one.angle), MIDDLE))
        margin = None if one.sd_deg is None else SD_90 * np.array(one.sd_deg, dtype=np.float64)
        mean = np.array(one.mean_deg, dtype=np.float64)
        curve = Curve(side, mean, colour, margin, of == "l_", mark=(marks or {}).get(of))
        drawn.setdefault(one.angle[2:] if of in _SIDES else one.angle, []).append(
            (curve, f"{side}: n = {one.count}")
        )
    figures = []
    for name, parts in drawn.items():
        both = [curve for curve, _ in parts]
        title = f"{spoken(name)} (°)".capitalize()
        share = np.linspace(0, 100, len(both[0].values))
        chart = over_time(both, share, f"{title} over a cycle", over)
        about = "; ".join(words for _, words in parts)
        spread = any(curve.margin is not None for curve in both)
        band = f"; band: nine in ten of them ({SD_90} standard deviations)" if spread else ""
        figures.append(figure([chart], title, f"Mean ({about}){band}."))
    return charts(figures)


def _shown(value: Any) -> str:
    """Beside unlike things: each number with digits of its own."""
    cell = _cell(value)
    return "–" if cell is None else f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def _cell(value: Any) -> Cell:
    return None if isinstance(value, float) and not np.isfinite(value) else value
