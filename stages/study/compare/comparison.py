"""What a comparison found, in words for the command line and in figures for compare.json."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....pipeline.core.messages import how_many
from ....pipeline.core.notices import Notice
from ....pipeline.core.rotations import turned
from ...drawing.words import spoken
from .accelerations import Accelerations
from .align import WEAK, Alignment
from .changes import Change, as_figures, told
from .cycles import Cycles
from .figures import JointAgreement
from .side import Side
from .wrists import Wrists


@dataclass(frozen=True, eq=False)
class Pair:
    """A side against the reference. shift_s and the rest as in Alignment, None for takes of different motions.

    times: (T,) the side's rows on the reference's clock. at_reference, sd: by angle (T,) the reference's value at the
    side's rows, and the standard error of the difference. agreement: of figures.agreement by angle. turn_deg, scale:
    what brought the side's LEVEL to the reference's. joints_mm: mean distance of the joints in LEVEL then. changes:
    of the measures of both. one_recording: whether both read the same one, so that their errors are not independent.
    same_place: whether both were filmed from about the same place, False where that is not known.
    """

    side: Side
    reference: Side
    alignment: Alignment | None
    times: np.ndarray
    at_reference: dict[str, np.ndarray]
    sd: dict[str, np.ndarray]
    agreement: dict[str, dict[str, float | int]]
    cycles: list[Cycles]
    turn_deg: float = 0.0
    scale: float = 1.0
    joints_mm: float | None = None
    joints: JointAgreement = field(default_factory=dict)
    wrists: Wrists | None = None
    accelerations: Accelerations | None = None
    changes: list[Change] = field(default_factory=list)
    one_recording: bool = False
    same_place: bool = False

    @property
    def level(self) -> np.ndarray:
        """(T, 17, 3) the side's joints in the heading and the size of the reference's LEVEL."""
        return self.scale * turned(self.side.level, self.turn_deg)


@dataclass(frozen=True, eq=False)
class Comparison:
    """spread, spread_unrectified: by angle the view-consistency of all runs, and what it would be if their cameras were
    taken as level, for angles that depend on gravity."""

    reference: Side
    pairs: tuple[Pair, ...]
    spread: dict[str, float]
    spread_unrectified: dict[str, float]
    notices: tuple[Notice, ...]


def as_text(comparison: Comparison) -> Iterator[str]:
    """The main figures, a line each."""
    for pair in comparison.pairs:
        if pair.alignment:
            yield (
                f"{pair.side.name} against {pair.reference.name}: {pair.alignment.how}, "
                f"{pair.alignment.shift_s:+.3f} s added, r {pair.alignment.r:.3f}"
            )
        if pair.agreement:
            yield f"{'angle':<26}{'bias':>8}{'limits of agreement':>22}{'RMSE':>8}{'r':>8}  (degrees)"
        for name, of in pair.agreement.items():
            limits = f"{of['lower_deg']:z.1f} to {of['upper_deg']:z.1f}"
            yield f"{name:<26}{of['bias_deg']:>z8.1f}{limits:>22}{of['rmse_deg']:>8.1f}{of['r']:>8.3f}"
        for method, wrists in pair.wrists.agreement.items() if pair.wrists else ():
            for wrist, axes in wrists.items():
                said = ", ".join(f"{a} {_r(v['r'])}RMSE {v['rmse_mm']:.0f} mm" for a, v in axes.items())
                if said:
                    yield f"{wrist}, {method}: {said}"
        for cycle in pair.cycles:
            of = cycle.agreement
            yield (
                f"{cycle.kind}, {cycle.angle}: {of['cycles']} and {how_many(int(of['cycles_reference']), 'cycle')}, "
                f"range {of['rom_deg']:.1f} against {of['rom_reference_deg']:.1f} degrees"
            )


def _r(r: float) -> str:
    """A correlation, which what does not move has none of."""
    return f"r {r:.3f} " if np.isfinite(r) else ""


def result(pair: Pair) -> Iterator[str]:
    """What came of a pair: whether they are treated as one motion, by how much their angles differ, also beside the
    errors that are stated, and which measures of two recordings differ by more than their errors."""
    against = f"{pair.side.name} against {pair.reference.name}"
    if pair.alignment is None or not pair.agreement:
        kinds = len({cycle.kind for cycle in pair.cycles})
        both = ["the ranges of motion"] * bool(pair.changes) + [how_many(kinds, "kind") + " of cycle"] * bool(
            kinds
        )
        yield f"{against}: treated as two motions; compared: {' and '.join(both) or 'nothing'}"
    else:
        yield f"{against}: {_of_one_motion(pair, pair.alignment)}"
        yield _angles_apart(pair)
    if not pair.one_recording:
        yield from told(pair.changes, f"{pair.side.name} minus {pair.reference.name}")


def _of_one_motion(pair: Pair, how: Alignment) -> str:
    """That both are compared as one motion; only of one recording it is known, for two takes may correlate as well."""
    alike = how.r >= WEAK
    taken = "one motion" if alike and pair.one_recording else "treated as one motion"
    though = "" if alike else " though their angles hardly correlate"
    # Motion capture is asked for as that of the take itself.
    way_out = (
        ""
        if pair.one_recording or pair.reference.run is None
        else "; if they are two takes, give --align cycles"
    )
    return f"{taken}{though}, shifted by {how.shift_s:+z.3f} s (correlation {how.r:.2f}){way_out}"


def _angles_apart(pair: Pair) -> str:
    rmse = {name: of["rmse_deg"] for name, of in pair.agreement.items()}
    worst = max(rmse, key=lambda name: rmse[name])
    inside = [of["within_band"] for of in pair.agreement.values() if "within_band" in of]
    allowed = ""
    if inside:
        share = 100 * np.mean(inside)
        allowed = f"; {share:.0f} % of the differences are within the stated errors (90 % expected)"
    return (
        f"{how_many(len(rmse), 'angle')} differ by {np.median(list(rmse.values())):.1f} degrees in the median, "
        f"{spoken(worst)} most, by {rmse[worst]:.1f} (root mean square){allowed}"
    )


def figures(comparison: Comparison) -> dict[str, Any]:
    """Everything but the curves, for JSON."""
    sides: Sequence[Side] = (comparison.reference, *(pair.side for pair in comparison.pairs))
    return {
        "reference": comparison.reference.name,
        "sides": {
            side.name: {
                "about": side.about,
                "inputs": list(side.sources),
                "angle_errors": side.run and side.run.angle_errors,
            }
            for side in sides
        },
        "pairs": {
            pair.side.name: {
                "alignment": None if pair.alignment is None else vars(pair.alignment),
                "turn_deg": pair.turn_deg,
                "scale": pair.scale,
                "joints_mm": pair.joints_mm,
                "joints": pair.joints,
                "angles": pair.agreement,
                "same_place": pair.same_place,
                "changes": as_figures(pair.changes),
                "cycles": [{"kind": c.kind, "angle": c.angle, **c.agreement} for c in pair.cycles],
                "accelerations": {} if pair.accelerations is None else pair.accelerations.agreement,
                "wrists": None
                if pair.wrists is None
                else {"size_m": pair.wrists.size_m, "methods": pair.wrists.agreement},
            }
            for pair in comparison.pairs
        },
        "view_spread_deg": comparison.spread,
        "view_spread_unrectified_deg": comparison.spread_unrectified,
        "notices": [each.as_dict() for each in comparison.notices],
    }
