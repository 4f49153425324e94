"""The differences of two takes' measures: by how much, with which error, whether they are told, and if not, why."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ....models.angle_error.joint_noise import made_by_the_built_in
from ....models.angle_error.repeatability import (
    MOVEMENTS,
    Between,
    difference_chance,
    difference_sd,
    differing,
    figure_of,
    same_part,
    same_place,
)
from ....pipeline.core.figures import FIGURES, OF_LENGTH, UNITS, label_of
from ....pipeline.core.measures import SD_90, Measure, with_bar
from ....pipeline.core.messages import how_many
from ....pipeline.signals.angles import ANGLES
from .side import Side

WHY = {
    "another-part": "in one of the takes a part of the movement was not seen",
    "poses-doubtful": "the poses of one of the takes are doubtful",
    "error-unknown": "the figure's error is not known in both takes",
    "in-one-take": "only one of the takes has the figure",
    "unit-unknown": "one of the takes is not in metres",
}
_MOST = 6  # differences that a sentence names
_IN_FILES = (
    "group", "item", "side", "unit", "reference", "value", "difference", "error", "mdc90", "within_error", "differs",
    "reason",
)  # fmt: skip


class Change(NamedTuple):
    """A figure of two takes.

    group: "range_of_motion" or the movement's. side: "right", "left" or neither. reference, value: of the reference and
    of the other, with their errors. error: one standard deviation of their difference. All NaN where not known.
    differs: whether the difference is told from none, with all figures of the comparison tested at once; None of one
    that is not judged, for the reason whose code in WHY is `reason`.
    """

    group: str
    item: str
    side: str
    unit: str
    reference: float
    value: float
    errors: tuple[float, float]
    error: float
    reason: str = ""
    differs: bool | None = None

    @property
    def difference(self) -> float:
        """The other less the reference."""
        return self.value - self.reference

    @property
    def mdc90(self) -> float:
        """The minimal detectable change: beyond it lies one in ten differences of a figure that did not change."""
        return SD_90 * self.error

    @property
    def within_error(self) -> bool | None:
        """Whether zero lies in the 90 % band about the difference, by itself; None where that is not known."""
        return None if math.isnan(self.error) else abs(self.difference) <= self.mdc90

    @property
    def chance(self) -> float:
        """How often a figure that did not change differs by as much."""
        if self.error <= 0:
            return float(self.difference == 0)
        return float(difference_chance(np.array(self.difference / self.error)))

    @property
    def in_words(self) -> str:
        """The difference and its minimal detectable change, where that is known, with a sign and without a unit."""
        return signed(self.difference, self.error)

    def __str__(self) -> str:
        """What the figure is."""
        if self.group == "range_of_motion":
            return f"range of {label_of(self.item)}"
        if self.group == "walking":
            return self.item
        return f"{self.item} of {f'{self.side} ' if self.side else ''}{label_of(self.group)}"


def signed(by: float, error: float | None = None) -> str:
    """A difference and its error as people read them."""
    return f"{'+' * (by >= 0)}{with_bar(by, error)}"


def changes(side: Side, reference: Side, near: bool, doubtful: bool = False) -> list[Change]:
    """Of every range of motion, of walking and of how far knees bend and arms rise, that either run has; none of motion
    capture. near: whether both were filmed from about the same place. doubtful: whether the poses of one are, whose
    errors do not hold."""
    runs = [each.run for each in (reference, side) if each.run is not None]
    if len(runs) < 2:
        return []
    both = [run.figures for run in runs]
    gaits = [run.group("walking").text("gait") for run in both]
    # Lifts, with the errors that were judged, of the lifter whose differences are known as shares of these; others
    # count as independent.
    one_lifter = all(run.angle_errors == "judged" and made_by_the_built_in(run.need("poses")) for run in runs)
    between = ("again" if near else "elsewhere") if one_lifter else None
    metric = reference.metric and side.metric
    differences = []
    for group, path, item, name in _figures():
        groups = [run.group(group, *path) for run in both]
        rows = [each.figure(name) for each in groups]
        if rows[0] is None and rows[1] is None:
            continue
        values, errors = ((_known(rows[0], field), _known(rows[1], field)) for field in ("value", "error"))
        part = path[0] if path and group != "range_of_motion" else ""
        unit = UNITS[FIGURES[name].unit].page.format("m")
        error = _error(rows, errors, gaits, between)
        reasons = {
            "in-one-take": None in rows,
            "unit-unknown": FIGURES[name].unit in OF_LENGTH and not metric,
            "error-unknown": math.isnan(error),
            "another-part": not same_part(*groups),
            "poses-doubtful": doubtful,
        }
        reason = next((code for code, holds in reasons.items() if holds), "")
        error = error if reason in ("", "poses-doubtful") else float("nan")
        differences.append(Change(group, item, part, unit, *values, errors, error, reason))
    # Those that are told are tested against chance all at once.
    chances = [change.chance for change in differences if not change.reason]
    tested = iter(differing(np.array(chances or [1.0])))
    return [
        change if change.reason else change._replace(differs=bool(next(tested))) for change in differences
    ]


def _error(
    rows: Sequence[Measure | None], errors: tuple[float, float], gaits: Sequence[str], between: Between | None
) -> float:
    """One standard deviation of the difference of a figure. between: how takes of one lifter that share its errors were
    filmed; None of others, whose errors are independent."""
    figures = [figure_of(row, gait) for row, gait in zip(rows, gaits, strict=True) if row]
    if between is not None and figures[0] is not None and figures == figures[:1] * 2:
        return difference_sd(figures[0], errors, between)
    return math.hypot(*errors)


def _figures() -> Iterator[tuple[str, tuple[str, ...], str, str]]:
    """Group, what is in it, the item of a Change, and the measure's name, of all figures that are compared."""
    for angle in ANGLES:
        yield "range_of_motion", (angle,), angle, "p05_p95"
    for group, names in MOVEMENTS.items():
        for name in names:
            for side in ("right", "left") if group == "arm_raises" else ("",):
                yield group, (side,) if side else (), FIGURES[name].label, name


def _known(row: Measure | None, name: str) -> float:
    """A measure's value or error; NaN where there is none."""
    stated = None if row is None else getattr(row, name)
    return float("nan") if stated is None else stated


def from_same_place(side: Side, reference: Side) -> bool:
    """Whether both runs were filmed from about the same place; False where that is not known."""
    if side.run is None or reference.run is None:
        return False
    return same_place(side.run.need("rectified"), reference.run.need("rectified"))


def summary(changes: list[Change], against: str) -> Iterator[str]:
    """Sentences on which figures differ, all tested at once, and why others are not judged. against: "B less A"."""
    tested = [change for change in changes if not change.reason]
    if tested:
        differ = sorted((change for change in tested if change.differs), key=lambda change: change.chance)
        named = [
            f"{change} {change.in_words} {change.unit}".rstrip().replace(" °", "°")
            for change in differ[:_MOST]
        ]
        named += [f"{len(differ) - _MOST} more"] * (len(differ) > _MOST)
        which = f"; {against}: {', '.join(named)}" if named else ""
        are = "differ" if len(differ) > 1 else "differs"
        yield f"{len(differ) or 'none'} of {how_many(len(tested), 'figure')} {are} by more than chance{which}"
    if reasons := Counter(change.reason for change in changes if change.reason):
        why = ", ".join(f"{WHY[code]} ({many})" for code, many in reasons.items())
        yield f"{how_many(reasons.total(), 'difference')} not judged: {why}"


def as_figures(changes: list[Change]) -> list[dict[str, Any]]:
    """For JSON: those that are told first."""
    listed = sorted(changes, key=lambda change: math.isnan(change.error) and change.reason != "another-part")
    return [{name: getattr(change, name) for name in _IN_FILES} for change in listed]
