"""Joint and segment angles of a take, with their errors and rates, as columns of its kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..models.angle_error.disagreement import by_disagreement, far_off
from ..models.angle_error.joint_noise import (
    JointNoise,
    joint_covariance,
    made_by_the_built_in,
    read_noise,
    shipped_noise,
    turns_of,
)
from ..models.angle_error.take_angles import (
    AngleSeries,
    angle_rates,
    angle_series,
    in_reference,
    widened,
    without_exchanged,
)
from ..models.common.motion import in_doubt
from ..models.common.residuals import limb_scores, residuals_of
from ..models.lifter.builtin import close_networks
from ..pipeline.core.errors import InputError
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.core.take import AngleErrors, Take, in_single
from ..pipeline.signals.angles import ALL_ANGLES, FINE, REASONS
from ..pipeline.signals.filters import breaks
from .lift import Lift

THE_ANGLES = "the angles"  # what the notice `errors-unknown` says it of
# What else the built-in lifter needs to lift the same take.
_KEYPOINTS = "the video's keypoints too, or "
_SIZE = "the size of the video's images too (--set read.image_size=WIDTHxHEIGHT), or "


@dataclass(frozen=True)
class Angles:
    """The stage. It takes the joints that `trajectories` has filtered, and states their error where the lifter does
    (models/angle_error/joint_noise.py).

    Columns (T,) for every angle of signals.angles.ANGLES, and of FOOT_ANGLES there for poses with feet,
    whose errors are unknown: `<angle>_deg`, `_sd_deg`, `_degps`, its error `_sd_degps`, and `_reason` (int8,
    signals.angles.REASONS); where that is not 0 the others are NaN. errors: a file with the errors of the lifter
    that made the poses (pcnet3d lab evaluate errors --fit); it replaces what is known of that lifter."""

    errors: Path | None = None

    name: ClassVar[str] = "angles"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified", "filtered")
    gives: ClassVar[tuple[str, ...]] = ("kinematics", "filtered", "angle_errors")
    renews: ClassVar[tuple[str, ...]] = ("kinematics",)  # which hold: of `filtered` only the error changes
    reads: ClassVar[tuple[str, ...]] = Lift.reads  # it lifts a second time

    def __post_init__(self) -> None:
        """InputError for a file that holds no such errors, before a run has begun."""
        if self.errors is not None:
            read_noise(self.errors)

    def __call__(self, take: Take) -> Take:
        poses, rectified = take.need("poses"), take.need("rectified")
        filtered = take.need("filtered")
        noise = shipped_noise() if made_by_the_built_in(poses) else None
        if self.errors is not None and poses.lifted:
            noise = read_noise(self.errors)
        turning = None if noise is None else turns_of(take)
        series, speed = angle_series(poses, rectified, filtered, noise)
        basis: AngleErrors = "none" if noise is None else "file" if self.errors else "judged"
        far = far_off(poses, rectified) if noise is not None and rectified.level_ok else None
        if noise is None and poses.lifted and (second := _second(take)) is not None:
            far = far_off(poses, rectified, second)
            referred, R_camera_from_source = in_reference(poses)
            up = (R_camera_from_source @ rectified.R_source_from_level)[..., :, 2]
            by = by_disagreement(referred, series, second, up, rectified.up_error_deg, take.cutoff_hz)
            series, basis = (series, basis) if by is None else (by, "disagreement")
        if basis != "none":
            series = widened(series, residuals_of(take), limb_scores(take))
        series = without_exchanged(series, in_doubt(take))
        columns = _columns(series, poses, noise, speed)
        own = rectified.level.covariance
        if noise is not None and turning is not None and own is not None:
            filtered = filtered.with_(covariance=joint_covariance(own, filtered.joints, turning, noise))
        kinematics = {**(take.kinematics or {}), **columns}
        take = take.with_(kinematics=kinematics, filtered=filtered, angle_errors=basis)
        doubts = [] if far is None else [far]
        why = None
        if basis == "none" and self.errors is not None:
            reason = "the given file is for poses that were estimated in camera axes, and these were not"
            why = notice("errors-unknown", weight="warning", what=THE_ANGLES, reason=reason)
        elif basis == "none":
            why = errors_unknown(poses, _lacking(take))
        return take.saying(*doubts, *_notices(columns), *([why] if why else []))


def _lacking(take: Take) -> str:
    if take.keypoints is None:
        return _KEYPOINTS
    return _SIZE if take.image_size is None else ""


def errors_unknown(poses: PoseSequence, more: str = _KEYPOINTS) -> Notice | None:
    """Why the errors of these poses' angles are not known; None where the poses were measured. more: what would tell
    them, besides a file."""
    if poses.made_by.kind == "measured":
        return None
    if poses.made_by.kind == "unknown":
        why = (
            "say whether the poses were measured or estimated (-O made_by=measured, or -O made_by=estimated)"
        )
        return notice("errors-unknown", what=THE_ANGLES, reason=why)
    by = f" by {poses.made_by.by}" if poses.made_by.by else ""
    why = f"the poses were estimated{by}, and this estimator was not compared with ground truth"
    advice = f"; give {more}a file of its errors (--set angles.errors=FILE)" if poses.lifted else ""
    return notice("errors-unknown", what=THE_ANGLES, reason=why + advice)


def _second(take: Take) -> PoseSequence | None:
    """The built-in lifter's poses of the take's keypoints; None where it cannot lift them, as those of two people, or
    there are none."""
    if _lacking(take) or not take.need("rectified").level_ok:
        return None
    try:
        return Lift().poses_of(take.with_(poses=None))
    except InputError:  # no reason to end the run
        return None
    finally:
        close_networks()  # no later stage lifts


def _columns(
    series: dict[str, AngleSeries],
    poses: PoseSequence,
    noise: JointNoise | None,
    speed: np.ndarray,
) -> dict[str, np.ndarray]:
    rates = angle_rates(series, poses.times, breaks(poses), noise, speed)
    columns = {}
    for name, angle in series.items():
        rate, sd = rates.pop(name)
        columns |= in_single(
            {
                f"{name}_deg": angle.value_deg,
                f"{name}_sd_deg": angle.sd_deg,
                f"{name}_degps": rate,
                f"{name}_sd_degps": sd,
                f"{name}_reason": angle.reason,
            }
        )
    return columns


def _notices(columns: dict[str, np.ndarray]) -> list[Notice]:
    """A note for each reason that took values away: from which angles, and how many."""
    notices = []
    for code, why in REASONS.items():
        if code == FINE:
            continue
        reasons = {name: columns[f"{name}_reason"] for name in ALL_ANGLES if f"{name}_reason" in columns}
        lost = {name: int((reason == code).sum()) for name, reason in reasons.items()}
        worst = sorted((name for name in lost if lost[name]), key=lambda name: -lost[name])
        if worst:
            most = ", ".join(f"{name} ({lost[name]})" for name in worst[:3])
            more = f" and {len(worst) - 3} more" if len(worst) > 3 else ""
            values: dict[str, Any] = {"angles": most + more, "reason": why}
            notices.append(notice("angles-left-out", **values, frames=lost))
    return notices
