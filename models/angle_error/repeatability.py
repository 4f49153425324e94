"""How wrong a difference may be: of the ends of a range, of right and left, of two takes. What a lifter errs alike in
both cancels.

repeatability.json was fitted by models/lab/refit.py on virtual visits of validation people, in which the true
difference is known: for every figure the factor on both errors, added as independent ones are, with which nine in ten
differences lie inside. Of two takes it is smaller where both were filmed from about the same place.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...pipeline.core.camera import pitch_roll_deg
from ...pipeline.core.measures import SD_90, Measure, Measures
from ...pipeline.core.pose import Rectified
from ...pipeline.core.rotations import is_finite, known_median, unit
from ...pipeline.signals.angles import ANGLES, near, of_both

REPEATABILITY_FILE = Path(__file__).with_name("repeatability.json")
# From about the same place: the person's facing, the camera's pitch.
SAME_FACING_DEG, SAME_PITCH_DEG = 15.0, 6.0
MOVEMENTS = {  # figures that do not follow from each other
    "walking": (
        "walking_speed", "cadence", "mean_step_length", "mean_step_width", "mean_stance", "mean_double_support",
    ),
    "knee_bends": ("mean_rise",),
    "arm_raises": ("mean_rise",),
}  # fmt: skip
# Of what a difference is: of two takes from about the same place or from others, or of sides.
Between = Literal["again", "elsewhere", "sides"]
FALSE = 0.1  # of the figures that are said to differ: those that do not
_BRIEF_S = 2.0  # so brief a take's ranges have twice a long one's variance; by folds of validation people
# Of a take's frames: from a difference of this much on, 60 to 80 % of unchanged figures are inside, 89 to 92 % below.
_ANOTHER_PART = 0.2
_T_90 = 2.3533634348018233  # to each side of Student's t of three degrees of freedom, holds nine in ten
_TURNING = 0.5  # mean resultant of the frames' facing, below which there is no one direction


def figure_of(row: Measure, gait: str) -> str | None:
    """What a figure is compared as, right and left alike: "range_of_motion.knee_flexion", "walking.cadence",
    "running.cadence"; None for one that two takes are not compared by. gait: that of the take's steps; those that are
    "walking or running" are compared as walking."""
    group, *inner = row.group or ("",)
    if group == "range_of_motion":
        named = row.name == "p05_p95" and inner[0] in ANGLES
        return f"range_of_motion.{of_both(inner[0])}" if named else None
    named = (
        row.name in MOVEMENTS.get(group, ()) and row.number is None and bool(inner) == (group == "arm_raises")
    )
    running = group == "walking" and gait == "running"
    return f"{'running' if running else group}.{row.name}" if named else None


def difference_sd(figure: str, errors: tuple[float, float], between: Between) -> float:
    """One standard deviation of the difference of two figures by the shipped lifter, of their stated errors.
    figure: of `figure_of`. One that was not fitted has independent errors."""
    return float(shipped()["factors"][between].get(figure, 1.0) * np.hypot(*errors))


def range_sd(angle: str, found_deg: float, ends_deg: float, lasts_s: float) -> float:
    """One standard deviation of an angle's range by the shipped lifter: a share of what independent errors of its ends
    come to (ends_deg), and one of the range itself, which a lifter finds too small; both larger in a take of few
    seconds (lasts_s), for a long one shows a movement more often. angle: of both sides, "knee_flexion"."""
    share, of_range = shipped()["ranges"].get(angle, (1.0, 0.0))
    return float(np.sqrt(1 + _BRIEF_S / lasts_s) * np.hypot(share * ends_deg, of_range * found_deg))


def ends(values_deg: np.ndarray, sd_deg: np.ndarray) -> tuple[tuple[float, float], tuple[float, float]]:
    """The 5th and 95th percentile of an angle (T,), of which some are finite, and the middle standard deviation of the
    frames at and beyond each, by the angle's own (T,); NaN where none is known."""
    low, high = np.percentile(values_deg[np.isfinite(values_deg)], [5, 95])
    return (float(low), float(high)), (
        known_median(sd_deg[values_deg <= low]),
        known_median(sd_deg[values_deg >= high]),
    )


def difference_chance(ratio: np.ndarray) -> np.ndarray:
    """(N,) how often figures of two takes between which nothing changed differ by as much, of differences over their
    standard deviations (N,): by Student's t, scaled so that 1.645 hold nine in ten, for differences have heavier tails
    than a Gaussian. It has three degrees of freedom, so that a tenth of the comparisons found a change where there was
    none among the first shipped lifter's visits; of three its distribution is a formula."""
    x = np.abs(ratio) * (_T_90 / SD_90 / np.sqrt(3))
    return 2 / np.pi * (np.arctan2(1, x) - x / (1 + x**2))


def differing(chances: np.ndarray) -> np.ndarray:
    """(N,) which of the figures (N,) of one comparison differ, by their `difference_chance`: of those that are said to,
    one in ten does not (Benjamini & Hochberg 1995)."""
    order = np.argsort(chances)
    ranks = np.arange(1, len(chances) + 1)
    below = np.flatnonzero(chances[order] <= FALSE * ranks / len(chances))
    differs = np.zeros(len(chances), bool)
    differs[order[: below.max(initial=-1) + 1]] = True
    return differs


@cache
def shipped() -> dict[str, Any]:
    """What repeatability.json holds: `lifter`, `factors` {Between: {figure: factor}}, and `ranges` {angle of
    both sides: (share of both ends, share of the range)}."""
    content: dict[str, Any] = json.loads(REPEATABILITY_FILE.read_text(encoding="utf-8"))
    return content


def same_part(first: Measures, second: Measures) -> bool:
    """Whether two figures, or those of both sides, rest on about as large a share of their frames: else one of them may
    have missed a part of the movement, which no error tells."""
    return same_shares(_unseen(first), _unseen(second))


def same_shares(first: float, second: float) -> bool:
    """Whether two shares of frames in which a figure was not seen are about alike."""
    return abs(first - second) < _ANOTHER_PART


def _unseen(group: Measures) -> float:
    """The share of the frames on which the figures of a group do not rest."""
    lost, judged = group.value("nan_share"), group.value("observable")
    if lost is not None:
        return lost
    return 0.0 if judged is None else 1 - judged / 100


def same_place(first: Rectified, second: Rectified) -> bool:
    """Whether two takes were filmed from about the same place, by the person's mean facing direction before the camera
    and the camera's pitch. False where one of them is not known."""
    views = [view_deg(each) for each in (first, second)]
    if views[0] is None or views[1] is None:
        return False
    (facing, pitch), (other_facing, other_pitch) = views[0], views[1]
    turned = float(near(np.array(facing - other_facing), 0.0))
    return abs(turned) <= SAME_FACING_DEG and abs(pitch - other_pitch) <= SAME_PITCH_DEG


def view_deg(rectified: Rectified) -> tuple[float, float] | None:
    """The angle about the vertical at which a person faces, on average, from the direction towards the camera (to their
    left is positive), and the camera's pitch. None of a camera that moves, poses in a world's axes, a take that could
    not be levelled, and a person who turns around."""
    if rectified.camera != "static" or not rectified.level_ok or rectified.R_source_from_level.ndim != 2:
        return None
    up = rectified.R_source_from_level[:, 2]
    facing = -rectified.R_source_from_body[:, :, 0]
    facing = facing[np.asarray(is_finite(facing))]
    towards = np.array([0.0, 0.0, -1.0])
    ahead = towards - (towards @ up) * up
    if not len(facing) or not np.isfinite(up).all() or np.linalg.norm(ahead) < 1e-3:
        return None
    ahead = unit(ahead)
    heading = facing @ ahead + 1j * (facing @ np.cross(up, ahead))
    mean = (heading / np.maximum(np.abs(heading), 1e-12)).mean()
    if abs(mean) < _TURNING:
        return None
    return float(np.degrees(np.angle(mean))), float(pitch_roll_deg(up)[0])
