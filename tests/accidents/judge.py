"""What became of an accident: refused, told, fine, or changed without a word."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.measures import Measure, Remark
from pcnet3d.pipeline.core.take import Take

from .edits import Edit
from .material import Bases, Given, run

SD_90 = 1.645
# Of figures without a stated error: as wide as those of the built-in lifter are on average.
_UNSTATED = {"deg": 20.0}
_UNSTATED_SHARE = 0.15
_FIGURES = ("cadence", "walking_speed", "mean_step_length", "mean_stance", "mean_step_time")
_ANGLES = (
    "knee_flexion",
    "thigh_trunk_flexion",
    "shoulder_elevation",
    "elbow_flexion",
    "trunk_lean_sagittal",
)

Figures = dict[str, tuple[float | str, float]]


@dataclass(frozen=True)
class Outcome:
    """refused: the refusal's code or "". codes: of notices that the take as it was has not. changed: figures that are
    off by more than their 90 % error."""

    edit: str
    refused: str
    codes: list[str]
    changed: list[str]
    told: bool
    fine: bool

    @property
    def ended(self) -> str:
        """In a word."""
        if self.refused:
            return f"refused: {self.refused}"
        if self.told:
            return "told"
        return "fine" if self.fine else "changed unsaid" if self.changed else "unchanged"

    def fields(self) -> dict[str, object]:
        """For a file."""
        return asdict(self)


def codes_of(take: Take) -> set[str]:
    """Of the notices that warn."""
    return {each.code for each in take.said if each.warns}


def figures(take: Take) -> Figures:
    """The stated figures that are compared, with half the width of their 90 % bars."""
    found: Figures = {}
    for row in take.measures or ():
        if isinstance(row, Remark) and row.group == ("walking",) and row.name == "gait":
            found["gait"] = (row.text, 0.0)
        if not isinstance(row, Measure) or row.number is not None:
            continue
        of_walk = row.group == ("walking",) and row.name in _FIGURES
        of_angle = row.group[:1] == ("range_of_motion",) and row.name in ("p05", "p95")
        if of_angle and not row.group[1].removeprefix("l_").removeprefix("r_").startswith(_ANGLES):
            continue
        if of_walk or of_angle:
            half = (
                SD_90 * row.error
                if row.error is not None
                else _UNSTATED.get(row.unit, _UNSTATED_SHARE * abs(row.value))
            )
            found["/".join((*row.group, row.name))] = (float(row.value), float(half))
    return found


def judged(edit: Edit, bases: Bases, before: dict[str, Take], folder: Path) -> Outcome:
    """Run it, and compare with the take as it was. before: runs of the bases so far, which grow."""
    if edit.base not in before:
        before[edit.base] = run(bases[edit.base], folder)
    was = before[edit.base]
    try:
        take = run(edit.make(bases[edit.base], bases), folder)
    except InputError as error:
        return Outcome(str(edit), error.code, [], [], False, not edit.codes)
    codes = codes_of(take) - codes_of(was)
    true, found = figures(was), figures(take)
    changed = [
        name for name, (value, half) in found.items() if name in true and _off(value, true[name][0], half)
    ]
    if "walking/gait" in true:
        changed += [name for name in true if name not in found]
    return Outcome(str(edit), "", sorted(codes), changed, bool(codes & set(edit.codes)), not edit.codes)


def _off(value: float | str, true: float | str, half: float) -> bool:
    if isinstance(value, str) or isinstance(true, str):
        return value != true
    return bool(np.abs(value - true) > half)


def shares(outcomes: list[Outcome]) -> tuple[int, int]:
    """(of edits that change a stated figure, refused ones among them, how many are refused or told; how many those
    are)."""
    asked = [each for each in outcomes if not each.fine and (each.refused or each.changed)]
    return sum(bool(each.refused or each.told) for each in asked), len(asked)


__all__ = ["Given", "Outcome", "codes_of", "figures", "judged", "shares"]
