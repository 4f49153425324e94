"""The measures of two takes side by side: by how much each figure differs, and whether by more than its error."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ....models.common.metrics import SD_90
from ....pipeline.core.measures import OF_LENGTH, Group, Measure, grouped, measure, subgroup
from ....pipeline.signals.angles import ANGLES
from ...drawing.words import spoken
from ...measures.figures import rounded
from ...report.measures import unit_of, worded
from .side import Side

_MOST = 6  # changes that a sentence names
_MOVEMENTS = {  # figures that do not follow from each other
    "walking": (
        "walking_speed", "cadence", "mean_step_length", "mean_step_width", "mean_stance", "mean_double_support",
    ),
    "knee_bends": ("mean_rise",),
    "arm_raises": ("mean_rise",),
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
    before, after = grouped(reference.measures), grouped(side.measures)
    return [*_ranges(before, after), *_movements(before, after, reference.metric and side.metric)]


def other_cadence(changes: list[Change]) -> bool:
    """Whether the walks of two takes have cadences that differ by more than their errors, so that they are two walks:
    of 110 pairs of cameras that saw one captured walk (lifted) none had."""
    return any(c.item == "cadence" and not c.within_error for c in changes)


def told(changes: list[Change], against: str) -> Iterator[str]:
    """A sentence on how many figures differ by more than their errors, and which. against: "B less A"."""
    if not changes:
        return
    apart = sorted(
        (change for change in changes if not change.within_error),
        key=lambda change: -abs(change.values[1] - change.values[0]) / change.error,
    )
    if not apart:
        yield f"None of {len(changes)} ranges of motion and figures of movements differs by more than its error (90 %)"
        return
    words = [f"{named(change)} {change.words}{_gap(change.unit)}{change.unit}" for change in apart[:_MOST]]
    more = f" and {len(apart) - _MOST} more" if len(apart) > _MOST else ""
    yield (
        f"{len(apart)} of {len(changes)} ranges of motion and figures of movements differ by more than the error "
        f"(90 %), {against}: {', '.join(words)}{more}"
    )


def as_figures(changes: list[Change]) -> list[dict[str, Any]]:
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
        for change in changes
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


def _ranges(before: Group, after: Group) -> Iterator[Change]:
    for angle in ANGLES:
        both = (measure(subgroup(of, "range_of_motion", angle), "p05_p95") for of in (before, after))
        yield from _change("range_of_motion", angle, "", *both)


def _movements(before: Group, after: Group, metric: bool) -> Iterator[Change]:
    for group, names in _MOVEMENTS.items():
        for name, side in product(names, ("right", "left") if group == "arm_raises" else ("",)):
            path = (group, side) if side else (group,)
            both = [measure(subgroup(of, *path), name) for of in (before, after)]
            if metric or not any(of and of.unit in OF_LENGTH for of in both):
                yield from _change(group, worded(name), side, *both)


def _change(
    group: str, item: str, side: str, before: Measure | None, after: Measure | None
) -> Iterator[Change]:
    """Of two figures that both have an error; nothing else."""
    if before and after and before.error is not None and after.error is not None:
        values, errors = (before.value, after.value), (before.error, after.error)
        yield Change(group, item, side, unit_of(after), values, errors)
