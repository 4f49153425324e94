"""A take's measures: rows that say what they are, of which side and how uncertain, and one value that holds them.

What a figure is called, its unit and its definition are in the catalogue (figures.toml). The keys of summary.json and
of measures.csv are made of these rows, `nested` and `Measure.key`; `read_measures` takes them apart again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal

from .errors import InputError
from .figures import FIGURES, GROUPS, TOGETHER, WITHHELD, Figure

Side = Literal["", "right", "left"]
SD_90 = 1.645  # standard deviations of a Gaussian to each side that hold nine in ten


@dataclass(frozen=True)
class Measure:
    """One figure.

    value: unrounded, as in files; pages show it `with_bar`. error: one standard deviation, None if it is not known.
    number: number of its repetition, from 0; None for a figure of the whole take. within_error: for a difference of the
    sides, whether zero lies in its 90 % band; None if its error is not known, and for other figures. at_least: of a
    count, whether there may be more, for an end of the take or a gap cuts one. group: names of what it belongs to, the
    outermost first, such as ("walking", "right").
    """

    name: str
    value: float
    error: float | None = None
    side: Side = ""
    number: int | None = None
    within_error: bool | None = None
    at_least: bool = False
    group: tuple[str, ...] = ()

    @property
    def about(self) -> Figure:
        """What the catalogue says of it."""
        return FIGURES[self.name]

    @property
    def unit(self) -> str:
        """One of UNITS."""
        return self.about.unit

    @property
    def bar(self) -> float | None:
        """`half_bar` of its error, None where that is not known."""
        return None if self.error is None else half_bar(self.error)

    def in_words(self, unit: str = "") -> str:
        """`with_bar`, as people read it. unit: to be written behind it."""
        return f"{with_bar(self.value, self.error)} {unit}".rstrip()

    @property
    def key(self) -> str:
        """`cadence_spm`: as in files."""
        return self.about.key

    @property
    def judged(self) -> dict[str, bool]:
        """What files say of it beside it: `step_time_within_error` of `step_time_symmetry_index`, `count_at_least`."""
        flags = {f"{self.name}_at_least": True} if self.at_least else {}
        if self.within_error is not None:
            flags[self.about.within_key] = self.within_error
        return flags


@dataclass(frozen=True)
class Remark:
    """A text about a group: `gait`, `counted`, and others; or of `withheld` a code."""

    name: str
    text: str
    side: Side = ""
    group: tuple[str, ...] = ()


@dataclass(frozen=True)
class Moments:
    """Seconds of the take's clock at which something happens. `start`, `stop` and `peak_at` in a group are
    those of the repetitions that its numbered figures are of."""

    name: str
    at_s: tuple[float, ...]
    side: Side = ""
    group: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        return FIGURES[self.name].key


@dataclass(frozen=True)
class Curve:
    """An angle over 0 to 100 % of the cycles of a movement, which is the group: (101,) mean and, of six cycles or more,
    standard deviation."""

    angle: str
    count: int
    mean_deg: tuple[float, ...]
    sd_deg: tuple[float, ...] | None = None
    side: Side = ""
    group: tuple[str, ...] = ()
    name: ClassVar[str] = "cycles"

    def fields(self) -> dict[str, Any]:
        """For summary.json."""
        sd = {} if self.sd_deg is None else {"sd_deg": list(self.sd_deg)}
        return {"count": self.count, "mean_deg": list(self.mean_deg), **sd}


Row = Measure | Remark | Moments | Curve
_NAMES = {*FIGURES, Curve.name, "withheld", *(f"{name}_withheld" for name in (*FIGURES, *TOGETHER))}


@dataclass(frozen=True)
class Measures:
    """The rows of a take, in the order of files, or those of one of its groups; it iterates them. path: the group's
    names, the outermost first; empty of a take. KeyError for rows whose name or group is not in the catalogue."""

    rows: tuple[Row, ...] = ()
    path: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        groups = {row.group[0] for row in self.rows if row.group}
        if unknown := ({row.name for row in self.rows} - _NAMES) | (groups - GROUPS.keys()):
            raise KeyError(f"{', '.join(sorted(unknown))}: not in the catalogue of figures (figures.toml)")

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def groups(self) -> dict[str, Measures]:
        """The groups inside this one by their names, in order."""
        inner: dict[str, list[Row]] = {}
        depth = len(self.path)
        for row in self.rows:
            if len(row.group) > depth:
                inner.setdefault(row.group[depth], []).append(row)
        return {name: Measures(tuple(rows), (*self.path, name)) for name, rows in inner.items()}

    @cached_property
    def own(self) -> dict[str, tuple[Row, ...]]:
        """The rows of no group inside this one by their names, in order; of a figure of repetitions all."""
        rows: dict[str, tuple[Row, ...]] = {}
        for row in self.rows:
            if len(row.group) == len(self.path):
                rows[row.name] = (*rows.get(row.name, ()), row)
        return rows

    def group(self, *names: str) -> Measures:
        """The group inside by these names, the outermost first; empty where there is none."""
        inner = self
        for name in names:
            inner = inner.groups.get(name, Measures((), (*inner.path, name)))
        return inner

    def figure(self, name: str) -> Measure | None:
        """The figure of this group by that name, None where there is none."""
        rows = [row for row in self.own.get(name, ()) if isinstance(row, Measure) and row.number is None]
        return rows[0] if rows else None

    def value(self, name: str) -> float | None:
        """That figure's value."""
        figure = self.figure(name)
        return None if figure is None else figure.value

    def count(self, name: str = "count") -> int:
        """That figure's value as a whole number, 0 where there is none."""
        return int(self.value(name) or 0)

    def repetitions(self, name: str) -> tuple[Measure, ...]:
        """The figures of this group's repetitions by that name, in order."""
        return tuple(
            row for row in self.own.get(name, ()) if isinstance(row, Measure) and row.number is not None
        )

    def text(self, name: str) -> str:
        """The remark of this group by that name, "" where there is none."""
        return next((row.text for row in self.own.get(name, ()) if isinstance(row, Remark)), "")

    def withheld(self, name: str = "") -> str:
        """The code of WITHHELD for which a figure of this group, or all of it, is not given; "" where it is."""
        return self.text(f"{name}_withheld" if name else "withheld")

    def times(self, name: str) -> tuple[float, ...]:
        """Seconds by that name, none where there are none."""
        return next((row.at_s for row in self.own.get(name, ()) if isinstance(row, Moments)), ())

    @property
    def spans(self) -> list[tuple[float, float]]:
        """From when to when each repetition, stride or stretch of this group lasts."""
        start, stop = ("stride_start", "stride_stop") if "stride_start" in self.own else ("start", "stop")
        return list(zip(self.times(start), self.times(stop), strict=False))

    @property
    def curves(self) -> tuple[Curve, ...]:
        """Over the cycles of this group."""
        return tuple(row for row in self.own.get(Curve.name, ()) if isinstance(row, Curve))


def withheld(code: str, figure: str = "") -> Remark:
    """That a figure of a group is not given, or all of it. code: of WITHHELD, else KeyError."""
    WITHHELD[code]
    return Remark(f"{figure}_withheld" if figure else "withheld", code)


def half_bar(error: float) -> float:
    """Of a standard deviation, half the width of the bar that holds nine in ten, in two digits: what stands behind "±"
    and "within" wherever people read, where files have the standard deviation."""
    return float(f"{SD_90 * error:.2g}")


def with_bar(value: float, error: float | None) -> str:
    """A figure wherever people read it: with the half width of its 90 % bar, both to the first digit of its error (JCGM
    100:2008, 7.2.6). Where that is not known (None or NaN), in two digits, or whole as it was counted."""
    if error is None or math.isnan(error):
        return f"{value:g}" if float(value).is_integer() else f"{float(f'{value:.2g}'):g}"
    if error == 0:
        return f"{value:g} ± 0"
    places = max(0, -math.floor(math.log10(error)))
    return f"{value:z.{places}f} ± {SD_90 * error:.{places}f}"


def side_of(name: str) -> Side:
    """Of a joint or an angle by its name: "right" of `r_knee`."""
    sides: dict[str, Side] = {"r_": "right", "l_": "left"}
    return sides.get(name[:2], "")


def within(group: str, rows: Iterable[Row], side: Side = "") -> list[Row]:
    """The rows as part of a group. side: of all that have none of their own."""
    return [replace(row, group=(group, *row.group), side=row.side or side) for row in rows]


def nested(rows: Iterable[Row]) -> dict[str, Any]:
    """The rows as plain nested dicts, as summary.json has them: units end the keys, an error stands behind its figure,
    numbered figures are lists, None for a repetition that has none."""
    rows = tuple(rows)
    numbered: dict[tuple[tuple[str, ...], str], list[Measure]] = {}
    for row in rows:
        if isinstance(row, Measure) and row.number is not None:
            numbered.setdefault((row.group, row.name), []).append(row)
    result: dict[str, Any] = {}
    for row in rows:
        place = result
        for name in row.group:
            place = place.setdefault(name, {})
        if isinstance(row, Remark):
            place[row.name] = row.text
        elif isinstance(row, Moments):
            place[row.key] = list(row.at_s)
        elif isinstance(row, Curve):
            place.setdefault(row.name, {})[row.angle] = row.fields()
        elif row.number is None:
            stated = {} if row.error is None else {row.about.error_key: row.error}
            place |= {row.key: row.value, **stated, **row.judged}
        elif (row.group, row.name) in numbered:
            place |= _listed(numbered.pop((row.group, row.name)))
    return result


def _listed(rows: Sequence[Measure]) -> dict[str, Any]:
    """A figure of repetitions, with its errors where the first has one, as then all have."""
    by, about = {row.number: row for row in rows}, rows[0].about
    every = [by.get(number) for number in range(max(number or 0 for number in by) + 1)]
    stated = {} if rows[0].error is None else {about.error_key: [row and row.error for row in every]}
    return {about.key: [row and row.value for row in every], **stated}


_BY_KEY = {figure.key: figure for figure in FIGURES.values()}
_SIDES: dict[str, Side] = {"right": "right", "left": "left"}
# What stands beside a figure and is read with it.
_BESIDE = {
    key
    for figure in FIGURES.values()
    for key in (figure.error_key, figure.within_key, f"{figure.name}_at_least")
    if key not in _BY_KEY
}


def read_measures(figures: Mapping[str, Any]) -> Measures:
    """The measures whose `nested` is that; InputError for what is not a run's."""
    try:
        return Measures(tuple(_rows(figures)))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        what = f"its measures are not as this version writes them: {error}"
        raise InputError("file-damaged", what) from None


def _rows(figures: Mapping[str, Any], group: tuple[str, ...] = ()) -> Iterator[Row]:
    # Of a group: it is one side's, or an angle's, a joint's or a limb's.
    sides: list[Side] = [own for name in group if (own := _SIDES.get(name) or side_of(name))]
    side: Side = sides[0] if sides else ""
    for key, content in figures.items():
        if key == Curve.name:
            yield from (_curve(angle, group, **fields) for angle, fields in content.items())
        elif isinstance(content, Mapping):
            yield from _rows(content, (*group, key))
        elif isinstance(content, str):
            yield Remark(key, content, side, group)
        elif key not in _BESIDE:
            yield from _figures(key, content, figures, side, group)


def _figures(
    key: str, content: Any, figures: Mapping[str, Any], side: Side, group: tuple[str, ...]
) -> Iterator[Row]:
    about = _BY_KEY[key]
    if about.unit == "moments":
        yield Moments(about.name, tuple(map(float, content)), side, group)
        return
    errors = figures.get(about.error_key)
    if not isinstance(content, Sequence):
        within, least = figures.get(about.within_key), figures.get(f"{about.name}_at_least", False)
        yield Measure(about.name, _number(content), _error(errors), side, None, within, least, group)
        return
    for number, each in enumerate(content):
        if each is not None:
            error = None if errors is None else _error(errors[number])
            yield Measure(about.name, _number(each), error, side, number, group=group)


def _curve(
    angle: str,
    group: tuple[str, ...],
    count: int,
    mean_deg: Sequence[float],
    sd_deg: Sequence[float] | None = None,
) -> Curve:
    sd = None if sd_deg is None else tuple(map(float, sd_deg))
    return Curve(angle, int(count), tuple(map(float, mean_deg)), sd, side_of(angle), group)


def _number(content: Any) -> float:
    if isinstance(content, bool) or not isinstance(content, int | float):
        raise TypeError(content)
    return content


def _error(content: Any) -> float | None:
    return None if content is None else float(_number(content))
