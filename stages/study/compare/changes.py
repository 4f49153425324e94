"""The measures of two takes side by side: by how much each figure differs, and whether by more than its error."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ....models.angle_error.repeatability import (
    MOVEMENTS,
    difference_chance,
    difference_sd,
    differing,
    figure_of,
    judged,
    same_part,
    same_place,
)
from ....models.common.metrics import SD_90
from ....pipeline.core.measures import OF_LENGTH, Group, Measure, grouped, measure, subgroup, text, with_bar
from ....pipeline.core.messages import how_many
from ....pipeline.signals.angles import ANGLES
from ...drawing.words import spoken
from ...report.measures import unit_of, worded
from .side import Side

_MOST = 6  # changes that a sentence names
_OTHER_CADENCE = 0.1  # share by which cadences differ that are of two walks, where their errors are not known
_BEYOND = 0.1  # of the figures that did not change, of each by itself: SD_90
# Times as many and more: of ten figures, if their errors were independent, in one of 80 pairs of takes.
_MANY = 3


class Change(NamedTuple):
    """A figure of two takes. group: "range_of_motion" or the movement's; side: "right", "left" or neither; values,
    errors: of the reference and of the other; error: one standard deviation of their difference; same_part: whether
    both takes show about as much of the movement, without which they are not compared; differs: whether the difference
    is told from none, with all figures of the comparison tested at once; None of one that is not compared, and of
    doubtful poses."""

    group: str
    item: str
    side: str
    unit: str
    values: tuple[float, float]
    errors: tuple[float, float]
    error: float
    same_part: bool = True
    differs: bool | None = None

    @property
    def by(self) -> float:
        """The other less the reference."""
        return self.values[1] - self.values[0]

    @property
    def mdc90(self) -> float:
        """The minimal detectable change: beyond it lies one in ten differences of a figure that did not change."""
        return SD_90 * self.error

    @property
    def within_error(self) -> bool:
        """Whether zero lies in the 90 % band about the difference, looked at by itself."""
        return abs(self.by) <= self.mdc90

    @property
    def chance(self) -> float:
        """How often a figure that did not change differs by as much."""
        if self.error <= 0:
            return float(self.by == 0)
        return float(difference_chance(np.array(self.by / self.error)))

    @property
    def words(self) -> str:
        """The difference and its minimal detectable change, with a sign and without a unit."""
        return f"{'+' * (self.by >= 0)}{with_bar(self.by, self.error)}"


def changes(side: Side, reference: Side, near: bool) -> list[Change]:
    """Of every range of motion, of walking and of how far knees bend and arms rise, where both takes state an error.
    Lengths and speeds only where both are in metres. near: whether both were filmed from about the same place."""
    before, after = grouped(reference.measures), grouped(side.measures)
    alike = _one_lifter(side, reference)
    found = [*_ranges(before, after), *_movements(before, after, reference.metric and side.metric)]
    gaits = [text(subgroup(of, "walking"), "gait") for of in (before, after)]
    return _tested([_change(each, gaits, near if alike else None) for each in found])


def from_same_place(side: Side, reference: Side) -> bool:
    """Whether both runs were filmed from about the same place; False where that is not known."""
    if side.run is None or reference.run is None:
        return False
    return same_place(side.run.need("rectified"), reference.run.need("rectified"))


def other_cadence(side: Side, reference: Side) -> bool:
    """Whether the walks of two takes have cadences that differ by more than both takes' errors, or, where these are
    not known, by a tenth, so that they are two walks: of 110 pairs of cameras that saw one captured walk (lifted)
    none had."""
    found = [measure(subgroup(grouped(of.measures), "walking"), "cadence") for of in (side, reference)]
    if found[0] is None or found[1] is None:
        return False
    values = [of.value for of in found if of]
    errors = [of.error for of in found if of and of.error is not None]
    bound = SD_90 * math.hypot(*errors) if len(errors) == 2 else _OTHER_CADENCE * min(values)
    return bool(abs(values[1] - values[0]) > bound)


def told(changes: list[Change], against: str) -> Iterator[str]:
    """A sentence on how many figures differ, which, and how many chance makes seem so. against: "B less A"."""
    tested = [change for change in changes if change.same_part]
    if len(tested) < len(changes):
        many, parts = len(changes) - len(tested), "in one of the takes a part of the movement was not seen"
        yield f"{how_many(many, 'figure')} {'is' if many == 1 else 'are'} not compared: {parts}"
    if not tested:
        return
    beyond = sum(not change.within_error for change in tested)
    if all(change.differs is None for change in tested):
        are = f"{beyond} of {how_many(len(tested), 'difference')} {'exceeds its' if beyond == 1 else 'exceed their'}"
        yield f"{are} MDC90; whether any is real cannot be told of doubtful poses"
        return
    apart = sorted((change for change in tested if change.differs), key=lambda change: change.chance)
    are = "are beyond their" if beyond > 1 else "is beyond its"
    own = f"{beyond or 'none'} {are} own MDC90, where {_BEYOND * len(tested):.2g} would be by chance alone"
    figures = f"of {len(tested)} ranges of motion and figures of movements"
    more_than = "by more than may be chance among so many"
    if not apart:
        many = beyond > max(1, _MANY * _BEYOND * len(tested))
        some = "; some of these may well have changed" * many
        yield f"None {figures} alone differs {more_than}; {own}{some}"
        return
    words = [f"{named(change)} {change.words}{_gap(change.unit)}{change.unit}" for change in apart[:_MOST]]
    more = f" and {len(apart) - _MOST} more" if len(apart) > _MOST else ""
    yield (
        f"{len(apart)} {figures} {'differs' if len(apart) == 1 else 'differ'} {more_than}, {against}: "
        f"{', '.join(words)}{more}; {own}"
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
            "error": change.error if change.same_part else None,
            "mdc90": change.mdc90 if change.same_part else None,
            "within_error": change.within_error if change.same_part else None,
            "differs": change.differs,
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


# Group, item, side, of the reference, of the other, same_part.
_Found = tuple[str, str, str, Measure, Measure, bool]


def _ranges(before: Group, after: Group) -> Iterator[_Found]:
    for angle in ANGLES:
        both = (subgroup(of, "range_of_motion", angle) for of in (before, after))
        yield from _with_errors("range_of_motion", angle, "", "p05_p95", *both)


def _movements(before: Group, after: Group, metric: bool) -> Iterator[_Found]:
    for group, names in MOVEMENTS.items():
        for name, side in product(names, ("right", "left") if group == "arm_raises" else ("",)):
            path = (group, side) if side else (group,)
            both = [subgroup(of, *path) for of in (before, after)]
            rows = [measure(of, name) for of in both]
            if metric or not any(row and row.unit in OF_LENGTH for row in rows):
                yield from _with_errors(group, worded(name), side, name, *both)


def _with_errors(
    group: str, item: str, side: str, name: str, before: Group, after: Group
) -> Iterator[_Found]:
    """Two figures that both have an error; nothing else."""
    one, other = measure(before, name), measure(after, name)
    if one and other and one.error is not None and other.error is not None:
        yield group, item, side, one, other, same_part(before, after)


def _change(found: _Found, gaits: Sequence[str], near: bool | None) -> Change:
    """gaits: of both takes' steps. near: whether both were filmed from about the same place, None for errors that are
    independent."""
    group, item, side, before, after, alike = found
    assert before.error is not None
    assert after.error is not None
    values, errors = (before.value, after.value), (before.error, after.error)
    error, figure = float(np.hypot(*errors)), figure_of(after, gaits[1])
    if near is not None and figure is not None and figure == figure_of(before, gaits[0]):
        error = difference_sd(figure, errors, "again" if near else "elsewhere")
    return Change(group, item, side, unit_of(after), values, errors, error, alike)


def _tested(found: list[Change]) -> list[Change]:
    """The same, and which of those that are compared differ, by Benjamini and Hochberg's procedure over all of them."""
    chances = [change.chance for change in found if change.same_part]
    differ = iter(differing(np.array(chances)) if chances else ())
    return [change._replace(differs=bool(next(differ))) if change.same_part else change for change in found]


def _one_lifter(side: Side, reference: Side) -> bool:
    """Whether both are lifts, with the errors that were judged, of the lifter whose differences are known as shares of
    these; others count as independent."""
    runs = [each.run for each in (side, reference)]
    return all(run is not None and run.angle_errors == "judged" and judged(run.need("poses")) for run in runs)
