"""The measures of two takes side by side: by how much each figure differs, and whether by more than its error."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ....models.common.metrics import SD_90
from ....pipeline.signals.angles import ANGLES
from ...drawing.words import spoken
from ...measures.figures import error_key, of_length, rounded
from ...report.measures import words_and_unit
from .side import Side

_MOST = 6  # changes that a sentence names
_MOVEMENTS = {  # figures that do not follow from each other
    "walking": (
        "walking_speed", "cadence_spm", "mean_step_length", "mean_step_width", "mean_stance_percent",
        "mean_double_support_percent",
    ),
    "knee_bends": ("mean_rise_deg",),
    "arm_raises": ("mean_rise_deg",),
}  # fmt: skip


class Change(NamedTuple):
    """A figure of two takes. group: "range_of_motion" or the movement's; side: "right", "left" or neither; values,
    errors: of the reference and of the other, whose errors are taken for independent."""

    group: str
    item: str
    side: str
    unit: str
    values: tuple[float, float]
    errors: tuple[float, float]

    @property
    def by(self) -> float:
        """The other less the reference, to the first digit of its error."""
        return rounded(self.values[1] - self.values[0], self.error)

    @property
    def error(self) -> float:
        """One standard deviation of the difference."""
        return float(np.hypot(*self.errors))

    @property
    def within_error(self) -> bool:
        """Whether no difference can be told: zero lies in the 90 % band about it."""
        return abs(self.values[1] - self.values[0]) <= SD_90 * self.error

    @property
    def words(self) -> str:
        """The difference and its error, with a sign and without a unit."""
        return f"{self.by:+g} ± {self.error:.2g}"


def changes(side: Side, reference: Side) -> list[Change]:
    """Of every range of motion, of walking and of how far knees bend and arms rise, where both takes state an error.
    Lengths and speeds only where both are in metres."""
    before, after = reference.measures, side.measures
    return [*_ranges(before, after), *_movements(before, after, reference.metric and side.metric)]


def other_cadence(found: list[Change]) -> bool:
    """Whether the walks of two takes have cadences that differ by more than their errors, so that they are two walks:
    of 110 pairs of cameras that saw one captured walk (lifted) none had."""
    return any(c.item == "cadence" and not c.within_error for c in found)


def told(found: list[Change], against: str) -> Iterator[str]:
    """A sentence on how many figures differ by more than their errors, and which. against: "B less A"."""
    if not found:
        return
    apart = sorted(
        (change for change in found if not change.within_error),
        key=lambda change: -abs(change.values[1] - change.values[0]) / change.error,
    )
    if not apart:
        yield f"None of {len(found)} ranges of motion and figures of movements differs by more than its error (90 %)"
        return
    words = [f"{named(change)} {change.words}{_gap(change.unit)}{change.unit}" for change in apart[:_MOST]]
    more = f" and {len(apart) - _MOST} more" if len(apart) > _MOST else ""
    yield (
        f"{len(apart)} of {len(found)} ranges of motion and figures of movements differ by more than the error (90 %), "
        f"{against}: {', '.join(words)}{more}"
    )


def as_figures(found: list[Change]) -> list[dict[str, Any]]:
    """For JSON."""
    return [
        {
            "group": change.group,
            "item": change.item,
            "side": change.side,
            "unit": change.unit,
            "reference": change.values[0],
            "value": change.values[1],
            "difference": change.by,
            "error": float(f"{change.error:.2g}"),
            "within_error": change.within_error,
        }
        for change in found
    ]


def named(change: Change) -> str:
    """What the figure is, in words."""
    if change.group == "range_of_motion":
        return f"range of {spoken(change.item)}"
    if change.group == "walking":
        return change.item
    return f"{change.item} of {f'{change.side} ' if change.side else ''}{spoken(change.group)}"


def _gap(unit: str) -> str:
    return "" if unit.startswith("°") else " "


def _ranges(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Change]:
    key = "p05_p95_deg"
    both = [side.get("range_of_motion", {}) for side in (before, after)]
    for angle in ANGLES:
        found = _figure(key, *(of.get(angle, {}) for of in both))
        if found is not None:
            yield Change("range_of_motion", angle, "", "°", *found)


def _movements(before: Mapping[str, Any], after: Mapping[str, Any], metric: bool) -> Iterator[Change]:
    for name, keys in _MOVEMENTS.items():
        groups = [side.get(name) or {} for side in (before, after)]
        for key, side in product(keys, ("right", "left") if name == "arm_raises" else ("",)):
            of = [group.get(side, {}) if side else group for group in groups]
            if (found := _figure(key, *of)) is not None and (metric or not of_length(key)):
                words, unit = words_and_unit(key)
                length = "m/s" if key.endswith("_speed") else "m"
                yield Change(name, words, side, length if of_length(key) else unit, *found)


def _figure(
    key: str, before: Mapping[str, Any], after: Mapping[str, Any]
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Values and errors of both; None where one is not stated."""
    numbers = [of.get(name) for name in (key, error_key(key)) for of in (before, after)]
    values = [float(number) for number in numbers if isinstance(number, float | int)]
    if len(values) < len(numbers):
        return None
    return (values[0], values[1]), (values[2], values[3])
