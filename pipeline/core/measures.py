"""A take's measures: rows that say what they are, in which unit, of which side and how uncertain.

Files and pages are made from these rows: the keys of summary.json and of measures.csv by `nested` and `Measure.key`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

Side = Literal["", "right", "left"]
SD_90 = 1.645  # standard deviations of a Gaussian to each side that hold nine in ten
# Names of all Moments.
MOMENTS = ("start", "stop", "peak_at", "stride_start", "stride_stop", "landings", "toe_offs")


class Unit(NamedTuple):
    """How a unit is written: at the end of keys and columns, in tables, on pages. {} stands for the take's unit of
    length, which keys do not name."""

    ending: str = ""
    table: str = ""
    page: str = ""


UNITS = {
    "": Unit(),
    "deg": Unit("_deg", "deg", "°"),
    "degps": Unit("_degps", "deg/s", "°/s"),
    "s": Unit("_s", "s", "s"),
    "cm": Unit("_cm", "cm", "cm"),
    "px": Unit("_px", "px", "px"),
    "percent": Unit("_percent", "%", "%"),
    "spm": Unit("_spm", "1/min", "steps/min"),
    "length": Unit("", "{}", "{}"),
    "speed": Unit("", "{}/s", "{}/s"),
}
OF_LENGTH = ("length", "speed")  # units that say something only where the take has a scale
# Why a figure, or all figures of a group, are not given: the text of the remark `withheld`, and what pages say of it.
WITHHELD = {
    "camera-moves": "the camera moves",
    "detector-unsure": "the detector is unsure of its joints",
    "error-too-large": "its error is too large",
    "error-unknown": "its error is not known",
    "few-frames": "too few frames have it",
    "few-strides": "too few strides",
    "few-values": "too few values",
    "frames-missing": "frames without a value may show more",
    "no-paths": "the stage trajectories has not run",
    "not-levelled": "the take is not levelled",
    "place-unknown": "where the person is in the room is not known",
    "range-too-small": "both ranges are too small",
    "side-missing": "one side has no range",
    "sides-doubtful": "left and right are doubtful",
    "sides-unlike": "each side was seen in another part of the movement",
    "take-too-short": "the take is too short",
}


@dataclass(frozen=True)
class Measure:
    """One figure.

    group: names of what it belongs to, the outermost first, such as ("walking", "right"). name: without a unit. value:
    unrounded, as in files; pages show it `with_bar`. unit: one of UNITS. error: one standard deviation, None if it is
    not known. number: number of its repetition, from 0; None for a figure of the whole take. within_error: for a
    difference of the sides, whether zero lies in its 90 % band; None if its error is not known, and for other figures.
    at_least: of a count, whether there may be more, for an end of the take or a gap cuts one.
    """

    name: str
    value: float
    unit: str = ""
    error: float | None = None
    side: Side = ""
    number: int | None = None
    within_error: bool | None = None
    at_least: bool = False
    group: tuple[str, ...] = ()

    @property
    def bar(self) -> float | None:
        """`half_bar` of its error, None where that is not known."""
        return None if self.error is None else half_bar(self.error)

    def in_words(self, unit: str = "") -> str:
        """With its bar, as people read it; without an error in two digits. unit: to be written behind it."""
        words = without_error(self.value) if self.error is None else with_bar(self.value, self.error)
        return f"{words} {unit}".rstrip()

    @property
    def key(self) -> str:
        """`cadence_spm`: as in files."""
        return self.name + UNITS[self.unit].ending

    @property
    def error_key(self) -> str:
        """`cadence_error_spm`: the unit stays at the end."""
        return f"{self.name}_error{UNITS[self.unit].ending}"

    @property
    def judged(self) -> dict[str, bool]:
        """What files say of it beside it: `step_time_within_error` of `step_time_symmetry_index`, `count_at_least`."""
        said = {f"{self.name}_at_least": True} if self.at_least else {}
        if self.within_error is not None:
            said[self.name.replace("symmetry_index", "within_error")] = self.within_error
        return said


@dataclass(frozen=True)
class Remark:
    """A text about a group: `gait`, `counted`, and others; or of `withheld` a code."""

    name: str
    text: str
    side: Side = ""
    group: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        return self.name


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
        return self.name + UNITS["s"].ending


@dataclass(frozen=True)
class Curve:
    """An angle over 0 to 100 % of a movement's cycles: (101,) mean and, of six cycles or more, standard deviation."""

    angle: str
    count: int
    mean_deg: tuple[float, ...]
    sd_deg: tuple[float, ...] | None = None

    @property
    def side(self) -> Side:
        return side_of(self.angle)

    def fields(self) -> dict[str, Any]:
        """For summary.json."""
        sd = {} if self.sd_deg is None else {"sd_deg": list(self.sd_deg)}
        return {"count": self.count, "mean_deg": list(self.mean_deg), **sd}


@dataclass(frozen=True)
class Curves:
    """All curves over the cycles of a movement, which is the group."""

    of: tuple[Curve, ...]
    group: tuple[str, ...] = ()
    side: Side = ""
    name: str = "cycles"


Row = Measure | Remark | Moments | Curves


def withheld(code: str, figure: str = "") -> Remark:
    """That a figure of a group is not given, or all of it. code: of WITHHELD, else KeyError."""
    if code not in WITHHELD:
        raise KeyError(code)
    return Remark(f"{figure}_withheld" if figure else "withheld", code)


# Rows by name; what is numbered in a list.
Group = dict[str, "Group | Row | list[Measure]"]


def half_bar(error: float) -> float:
    """Of a standard deviation, half the width of the bar that holds nine in ten, in two digits: what stands behind "±"
    and "within" wherever people read, where files have the standard deviation."""
    return float(f"{SD_90 * error:.2g}")


def decimals(error: float) -> int:
    """How many decimals a figure is shown with whose error is that, more than 0: to its first digit (JCGM 100:2008,
    7.2.6)."""
    return max(0, -math.floor(math.log10(error)))


def shown(value: float, error: float) -> str:
    """A figure with the decimals that its error leaves; counts and figures without an error in six digits."""
    return f"{value:z.{decimals(error)}f}" if error > 0 and isinstance(value, float) else f"{value:g}"


def with_bar(value: float, error: float) -> str:
    """A figure and the half width of its 90 % bar, as people read them."""
    return f"{shown(value, error)} ± {half_bar(error):g}"


def without_error(value: float) -> str:
    """A figure whose error is not known, in two digits, wherever people read."""
    return f"{float(f'{value:.2g}'):g}"


def side_of(name: str) -> Side:
    """Of a joint or an angle by its name: "right" of `r_knee`."""
    sides: dict[str, Side] = {"r_": "right", "l_": "left"}
    return sides.get(name[:2], "")


def within(group: str, rows: Iterable[Row], side: Side = "") -> list[Row]:
    """The rows as part of a group. side: of all that have none of their own."""
    return [replace(row, group=(group, *row.group), side=row.side or side) for row in rows]


def grouped(rows: Iterable[Row]) -> Group:
    """The rows by the names of their groups and their own."""
    result: Group = {}
    for row in rows:
        place: Any = result
        for name in row.group:
            place = place.setdefault(name, {})
        if isinstance(row, Measure) and row.number is not None:
            place.setdefault(row.name, []).append(row)
        else:
            place[row.name] = row
    return result


def subgroup(of: Mapping[str, Any], *names: str) -> Group:
    """The group in a group by these names, the outermost first; empty where there is none."""
    for name in names:
        of = of.get(name, {})
    return dict(of) if isinstance(of, Mapping) else {}


def measure(of: Mapping[str, Any], name: str) -> Measure | None:
    """The single figure of a group by that name, None where there is none."""
    found = of.get(name)
    return found if isinstance(found, Measure) else None


def value(of: Mapping[str, Any], name: str) -> float | None:
    """That figure's value."""
    found = measure(of, name)
    return None if found is None else found.value


def numbered(of: Mapping[str, Any], name: str) -> list[Measure]:
    """The figures of a group's repetitions by that name, in order."""
    found = of.get(name)
    return found if isinstance(found, list) else []


def text(of: Mapping[str, Any], name: str) -> str:
    """The remark of a group by that name, "" where there is none."""
    found = of.get(name)
    return found.text if isinstance(found, Remark) else ""


def moments(of: Mapping[str, Any], name: str) -> tuple[float, ...]:
    """Seconds by that name, none where there are none."""
    found = of.get(name)
    return found.at_s if isinstance(found, Moments) else ()


def nested(rows: Iterable[Row]) -> dict[str, Any]:
    """The rows as plain nested dicts, as summary.json has them: units end the keys, an error stands behind its figure,
    numbered figures are lists, None for a repetition that has none."""
    return _fields(grouped(rows))


def _fields(group: Mapping[str, Any]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for name, leaf in group.items():
        if isinstance(leaf, Mapping):
            result[name] = _fields(leaf)
        elif isinstance(leaf, Remark):
            result[leaf.key] = leaf.text
        elif isinstance(leaf, Moments):
            result[leaf.key] = list(leaf.at_s)
        elif isinstance(leaf, Curves):
            result[name] = {curve.angle: curve.fields() for curve in leaf.of}
        else:
            result |= _with_error(leaf)
    return result


def _with_error(of: Measure | Sequence[Measure]) -> dict[str, Any]:
    if not isinstance(of, Measure):
        one, by = of[0], {each.number: each for each in of}
        every = [by.get(number) for number in range(max(number or 0 for number in by) + 1)]
        stated = (
            {} if None in (each.error for each in of) else {one.error_key: [e and e.error for e in every]}
        )
        return {one.key: [each and each.value for each in every], **stated}
    stated = {} if of.error is None else {of.error_key: of.error}
    return {of.key: of.value, **stated, **of.judged}
