"""A take's measures as tables and charts, whatever they are called: names and units are those of their keys,
but for lengths and speeds, which have the take's unit of length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from ...pipeline.core.messages import how_many
from ..drawing.charts import LEFT, MIDDLE, RIGHT, Curve, over_time
from ..drawing.page import (
    Cell,
    Soft,
    Told,
    bullets,
    charts,
    details,
    figure,
    heading,
    joined,
    small,
    table,
    told,
)
from ..drawing.words import spoken
from ..measures.figures import decimals, error_key, of_length
from .glossary import explained

_UNITS = {
    "_deg": "°", "_degps": "°/s", "_m": "m", "_mps": "m/s", "_mps2": "m/s²", "_au": "au", "_aups": "au/s", "_s": "s",
    "_hz": "Hz", "_percent": "%", "_spm": "steps/min",
}  # fmt: skip
_WORDS = {
    "p05": "5th percentile", "p95": "95th percentile", "p05_p95": "range between them",
    "sd": "stated standard deviation", "beyond_anatomy_frames": "frames beyond anatomy",
    "mean_stance": "mean stance phase", "mean_swing": "mean swing phase", "landings": "initial contacts",
    "toe_offs": "toe-offs", "stride_start": "strides begin", "stride_stop": "strides end",
    "count_reason": "there may be more",
    "nan_share": "share without a value", "sparc_up": "SPARC up", "sparc_down": "SPARC down",
}  # fmt: skip
_ERRORS = (
    "± is one standard deviation (SD) of the figure before it; a click on a figure says what it is. Grey: a difference "
    "that lies within its error (90 %)."
)
_ORDER = {"walking": -1, "floor": 1}  # of the groups; the others are between
_ELSEWHERE = ("range_of_motion", "symmetry", "paths")  # beside the angles and the speeds
_MOMENTS = ("start_s", "stop_s", "stride_start_s", "stride_stop_s", "landings_s", "toe_offs_s")
_FEW = 3  # members, which are a table's columns
_MANY = 20  # a list of more is a curve, or too long for a table
_SIDES = {"r_": ("right", RIGHT), "l_": ("left", LEFT)}


def happened(measures: Mapping[str, Any], length: str) -> Markup:
    """HTML of the movements that were recognised, each under its name, and on demand of what was not found and why.
    measures: as of stages/measures/stage.py, and whatever other groups there are. length: the unit of lengths, "m" or
    "au"."""
    parts, absent = [], []
    for name, group in sorted(measures.items(), key=lambda one: _ORDER.get(one[0], 0)):
        if name in _ELSEWHERE or not isinstance(group, Mapping):
            continue
        if _found(group):
            shown = gait(group, length) if name == "walking" else measure_tables(group, length, level=3)
            parts.append(heading(_title(name, group)) + shown)
        else:
            absent.append(f"{named(name).capitalize()}: {group.get('reason', 'none')}.")
    single = {key: value for key, value in measures.items() if not isinstance(value, Mapping)}
    shown = measure_tables(single, length) + joined(parts)
    none = small("No movement that is counted was recognised.") if absent else Markup("")
    return (small(_ERRORS) + shown if shown else none) + details(
        "What was looked for and not found", bullets(absent)
    )


def _found(group: Mapping[str, Any]) -> bool:
    """Whether there is more in it than a count of nothing, or a reason."""
    for key in ("steps", "count"):
        if key in group:
            return bool(group[key])
    inner = [value for value in group.values() if isinstance(value, Mapping)]
    return any(map(_found, inner)) if inner else bool(group) and "reason" not in group


def _title(name: str, group: Mapping[str, Any]) -> str:
    if name == "walking":
        return str(group.get("gait", name))
    every = name == "knee_bends" and group.get("squats") == group.get("count")
    return "squats" if every else named(name)


_CYCLE = (
    "Means over strides, from a foot's initial contact (0 %) to its next (100 %). Upright line: its mean toe-off, "
    "where stance ends and swing begins."
)


def gait(walking: Mapping[str, Any], length: str) -> Markup:
    """HTML of a walk or a run: its figures, and curves over the gait cycle with the toe-off of each side."""
    plain = {key: value for key, value in walking.items() if key not in ("gait", "cycles")}
    toe_off = {
        side: walking[words]["mean_stance_percent"]
        for side, (words, _) in _SIDES.items()
        if "mean_stance_percent" in walking.get(words, {})
    }
    shown = cycle_charts(walking.get("cycles", {}), "gait cycle (%)", toe_off)
    curves = heading("Gait cycle", 4) + small(_CYCLE) + shown if shown else Markup("")
    return measure_tables(plain, length, level=3) + curves


def measure_tables(measures: Mapping[str, Any], length: str = "m", level: int = 2) -> Markup:
    """HTML of nested measures: what has curves over a cycle (lists `mean_deg` and `sd_deg`, 0 to 100 %) as charts, both
    sides in one; the rest as figures and tables. Each group of the first level has a heading; below, groups that hold
    no others are the rows of one table, or its columns where they are few, and so are the members of a list of groups.
    length: the unit of lengths, "m"
    or "au". level: of the heading that this stands under; 3 where the measures are one group's."""
    return _group("take", _with_units(measures, length), level)


def _with_units(value: Any, length: str) -> Any:
    """The same with the unit in the keys of lengths and speeds too."""
    if isinstance(value, list | tuple):
        return [_with_units(item, length) for item in value]
    if not isinstance(value, Mapping):
        return value
    suffixes = {key: f"_{length}{'ps' if 'speed' in key else ''}" if of_length(key) else "" for key in value}
    return {key + suffixes[key]: _with_units(item, length) for key, item in value.items()}


def named(key: str) -> str:
    """`range_of_motion_deg` as "range of motion (°)"."""
    words, unit = words_and_unit(key)
    return f"{words} ({unit})" if unit else words


def _suffix(key: str) -> str:
    return max((end for end in _UNITS if key.endswith(end)), key=len, default="")


def words_and_unit(key: str) -> tuple[str, str]:
    """`mean_step_time_s` as "mean step time" and "s"; the unit is empty where the key names none."""
    suffix = _suffix(key)
    name = key.removesuffix(suffix)
    if name not in _WORDS and name.startswith("sd_"):
        return f"SD of {spoken(name.removeprefix('sd_'))}", _UNITS.get(suffix, "")
    return _WORDS.get(name, spoken(name)), _UNITS.get(suffix, "")


def _group(name: str, group: Mapping[str, Any], level: int) -> Markup:
    groups = {key: members for key, value in group.items() if (members := _members(value)) is not None}
    flat = {key: value for key, value in groups.items() if level > 2 and not _holds_groups(value)}
    own = {key: value for key, value in group.items() if key not in groups}
    said = {key: value for key, value in own.items() if isinstance(value, str)}
    hidden = {*said, *_hidden(own), "frames", "nan_share", *_repeated(own)}
    return (
        joined(small(f"{named(key).capitalize()}: {value}.") for key, value in said.items())
        + told(_told(key, own) for key, value in own.items() if not (key in hidden or _is_curve(key, value)))
        + _repetitions(own)
        + _rows({key: value for key, value in flat.items() if not _has_curve(value)})
        + cycle_charts({name: own, **flat})
        + _basis(own)
        + joined(
            heading(named(key), min(level + 1, 4)) + _group(key, value, level + 1)
            for key, value in groups.items()
            if key not in flat
        )
    )


def _basis(own: Mapping[str, Any]) -> Markup:
    if "frames" not in own:
        return Markup("")
    lost = f"; {_percent(own['nan_share'])} of the take have no value" if own.get("nan_share") else ""
    return small(f"From {how_many(int(own['frames']), 'frame')}{lost}.")


def _repeated(own: Mapping[str, Any]) -> list[str]:
    """Keys with a value for each repetition, where there are not too many of these."""
    starts = own.get("start_s")
    if not isinstance(starts, list) or len(starts) > _MANY:
        return []
    return [key for key, value in own.items() if isinstance(value, list) and len(value) == len(starts)]


def _repetitions(own: Mapping[str, Any]) -> Markup:
    keys = [key for key in _repeated(own) if key not in _hidden(own)]
    rows: list[list[Cell]] = [
        [str(i + 1), *(_both(key, own[key][i], own.get(error_key(key), [None] * (i + 1))[i]) for key in keys)]
        for i in range(len(own[keys[0]]) if keys else 0)
    ]
    return table(("", *map(named, keys)), rows)


def _members(value: Any) -> Mapping[str, Any] | None:
    """A group, or a list of groups as one that is named by numbers; None for anything else."""
    if isinstance(value, list | tuple) and value and all(isinstance(item, Mapping) for item in value):
        return {str(number): item for number, item in enumerate(value, 1)}
    return value if isinstance(value, Mapping) else None


def _holds_groups(group: Mapping[str, Any]) -> bool:
    return any(_members(value) is not None for value in group.values())


def _has_curve(group: Mapping[str, Any]) -> bool:
    return any(_is_curve(key, value) for key, value in group.items())


def _is_curve(key: str, value: Any) -> bool:
    return key.startswith(("mean_", "sd_")) and isinstance(value, Sequence) and len(value) > _MANY


def _hidden(group: Mapping[str, Any]) -> set[str]:
    """Keys that stand with another figure: its error, that it lies within it, and that nothing is missing."""
    errors = {error_key(key) for key in group}
    return {
        key
        for key, value in group.items()
        if key in errors or key.endswith("within_error") or (key == "nan_share" and not value)
    }


def _told(key: str, own: Mapping[str, Any]) -> Told:
    """A figure that stands alone: its name, and it with its error and unit, in grey where it lies within that."""
    value, error = own[key], own.get(error_key(key))
    words, unit = words_and_unit(key)
    about = explained(key.removesuffix(_suffix(key)))
    if isinstance(value, Sequence) and len(value) > _MANY:
        return Told(words, _shown(value), about)
    both = f"{_both(key, value, error)}{'' if unit.startswith('°') else ' '}{unit}".rstrip()
    within = own.get(key.replace("symmetry_index_percent", "within_error")) is True
    return Told(words, f"{both}, within its error" if within else both, about, within)


def _rows(members: Mapping[str, Mapping[str, Any]]) -> Markup:
    """A table with a row for each member and a column for each of their figures; of few members the other way round."""
    shown = dict.fromkeys(key for member in members.values() for key in member if key not in _hidden(member))
    columns = [_whole([_with_error(member, key) for member in members.values()]) for key in shown]
    if not shown:
        return Markup("")
    if len(members) <= _FEW < len(shown):
        rows = [[named(key), *map(_worded, cells)] for key, cells in zip(shown, columns, strict=True)]
        return table(("", *map(named, members)), rows)
    rows = [[named(name), *cells] for name, *cells in zip(members, *columns, strict=True)]
    return table(("", *map(named, shown)), rows)


def _worded(cell: Cell) -> Cell:
    """As it stands in a row of unlike figures, which have no decimals in common."""
    return _shown(cell) if isinstance(cell, int | float) else cell


def _whole(cells: list[Cell]) -> list[Cell]:
    """A column of whole numbers without decimals: its figures end there."""
    if all(cell.is_integer() for cell in cells if isinstance(cell, float)):
        return [int(cell) if isinstance(cell, float) else cell for cell in cells]
    return cells


def _both(key: str, value: Any, error: Any) -> str:
    """A figure, or each of a list, with its error; moments to a hundredth of a second, finer than frames."""
    if isinstance(value, list) and len(value) > _MANY:
        return _shown(value)
    values = value if isinstance(value, list) else [value]
    errors = error if isinstance(error, list) else [error] * len(values)
    shown = [
        f"{one:.2f}" if key in _MOMENTS and isinstance(one, float)
        else f"{one:.{decimals(off)}f}" if isinstance(one, float) and off else _shown(one)
        for one, off in zip(values, errors, strict=True)
    ]  # fmt: skip
    margins = ["" if off is None else f" ± {_shown(off)}" for off in errors]
    return ", ".join(one + margin for one, margin in zip(shown, margins, strict=True))


def _with_error(member: Mapping[str, Any], key: str) -> Cell:
    """A figure and its error, grey where it says nothing."""
    value, error = member.get(key), member.get(error_key(key))
    if key == "nan_share":
        return _percent(value or 0)
    plain = error is None and not (key in _MOMENTS and isinstance(value, list))
    cell = _cell(value) if plain else _both(key, value, error)
    lies_within = key == "symmetry_index_percent" and member.get("within_error")
    beyond = key.endswith("range_deg") or key in ("lowest_deg", "highest_deg", "p05_p95_deg")
    if lies_within or (beyond and member.get("beyond_anatomy_frames")):
        return Soft(cell if isinstance(cell, str) else _shown(value))
    return cell


def _percent(share: float) -> str:
    return f"{float(f'{100 * share:.2g}'):g} %"


def cycle_charts(
    members: Mapping[str, Mapping[str, Any]],
    over: str = "cycle (%)",
    marks: Mapping[str, float] | None = None,
) -> Markup:
    """A chart of the mean curve and its standard deviation for each member that has them, both sides in one. over: what
    the curves run over; marks: where on that an upright line stands, by side "r_" and "l_"."""
    drawn: dict[tuple[str, str], list[tuple[Curve, str]]] = {}
    for name, member in members.items():
        side, colour = _SIDES.get(name[:2], (spoken(name), MIDDLE))
        more = [
            f"{'n =' if k == 'count' else named(k)} {_shown(v)}"
            for k, v in member.items()
            if not isinstance(v, Sequence)
        ]
        words = f"{side}: {', '.join(more)}" if more else ""
        for key, value in member.items():
            if not (key.startswith("mean_") and _is_curve(key, value)):
                continue
            spread = member.get(f"sd{key.removeprefix('mean')}")
            margin = None if spread is None else _numbers(spread)
            curve = Curve(
                side, _numbers(value), colour, margin, name[:2] == "l_", mark=(marks or {}).get(name[:2])
            )
            both = name[2:] if name[:2] in _SIDES else name
            drawn.setdefault((both, key.removeprefix("mean_")), []).append((curve, words))
    figures = []
    for (name, unit), parts in drawn.items():
        curves = [curve for curve, _ in parts]
        title = named(f"{name}_{unit}").capitalize()
        share = np.linspace(0, 100, len(curves[0].values))
        chart = over_time(curves, share, f"{title} over a cycle", over)
        about = "; ".join(words for _, words in parts if words)
        band = "; band: one standard deviation" if any(curve.margin is not None for curve in curves) else ""
        figures.append(figure([chart], title, f"Mean{f' ({about})' if about else ''}{band}."))
    return charts(figures)


def _numbers(values: Sequence[Any]) -> np.ndarray:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _shown(value: Any) -> str:
    """Beside unlike things: each number with digits of its own."""
    cell = _cell(value)
    return "–" if cell is None else f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def _cell(value: Any) -> Cell:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if value is None or isinstance(value, int | float | str):
        return value
    if len(value) > _MANY:
        return f"{len(value)} values, in summary.json"
    return ", ".join(f"{item:.4g}" if isinstance(item, float) else str(item) for item in value)
