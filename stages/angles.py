"""Joint and segment angles of a take, with their errors and rates, as columns of its kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..models.angle_error.rates import angle_rates
from ..models.angle_error.take_angles import take_angles
from ..models.common.spread import stated_spread
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA, LEVEL, change_frame, require
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence, Rectified
from ..pipeline.core.rotations import rotate
from ..pipeline.core.take import Take
from ..pipeline.signals.angles import FINE, REASONS
from ..pipeline.signals.filters import breaks
from ..pipeline.signals.foot_angles import ALL_ANGLES
from .trajectories import Smoother


@dataclass(frozen=True)
class Angles:
    """The stage. It takes the joints as `trajectories` has filtered them. smoother: as that of `trajectories`; of a
    classical filter rates are the derivatives of its angles."""

    smoother: Smoother = "auto"

    name: ClassVar[str] = "angles"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified", "filtered")
    gives: ClassVar[tuple[str, ...]] = ("kinematics",)

    def __call__(self, take: Take) -> Take:
        columns = joint_angles(
            take.need("poses"), take.need("rectified"), take.need("filtered"), self.smoother == "auto"
        )
        notices = _notices(columns)
        if why := errors_unknown(take.need("poses")):
            notices.append(why)
        return take.with_(kinematics={**(take.kinematics or {}), **columns}).saying(*notices)


def errors_unknown(poses: PoseSequence) -> Notice | None:
    """Why the errors of the angles of poses are not known; None where they are, or where the poses were measured."""
    if poses.lifted or poses.made_by.kind == "measured":
        return None
    if poses.made_by.kind == "unknown":
        return notice("angle-errors-unknown")
    by = f" by {poses.made_by.by}" if poses.made_by.by else ""
    return notice("angle-errors-unjudged", by=by)


def joint_angles(
    poses: PoseSequence, rectified: Rectified, filtered: PoseSequence, rates_by_error: bool = True
) -> dict[str, np.ndarray]:
    """Columns (T,) for every angle of pipeline.signals.angles.ANGLES, and of pipeline.signals.foot_angles.FOOT_ANGLES
    for
    poses with feet, whose errors are unknown: `<angle>_deg`, `<angle>_sd_deg`, `<angle>_degps`
    with its standard deviation `<angle>_sd_degps`, and `<angle>_reason` (int8, pipeline.signals.angles.REASONS); where
    that is not 0 the others are NaN.

    poses: what was rectified; rectified: the answer; filtered: its `level` through the low-pass
    (stages.trajectories.smooth). Rates are smoothed by the angles' errors (models/angle_error/rates.py), or, without
    rates_by_error, derivatives. Poses that are measured, and those in a world's axes, come without errors
    (PoseSequence.lifted): theirs are derivatives anyway. InputError for another layout or frame.
    """
    if poses.layout != H36M17:
        raise InputError(
            "wrong-content", f"Angles need joints in layout H36M17, got {poses.layout.name}; use remap first."
        )
    require(filtered.frame, LEVEL, "Angles' filtered joints")
    source = change_frame(poses, poses.frame.with_(origin="pelvis"))
    lifted = source.lifted
    # The noise of lifted joints is known in the camera's own axes.
    reference = CAMERA if source.frame.family == "camera" else source.frame
    R_reference_from_source = reference.basis @ source.frame.basis.T
    source = change_frame(source, reference.with_(origin="pelvis", unit=source.frame.unit))
    R_reference_from_level = R_reference_from_source @ rectified.R_source_from_level
    feet = None if filtered.feet is None else rotate(R_reference_from_level, filtered.feet.astype(np.float64))
    series = take_angles(
        source.joints,
        rotate(R_reference_from_level, filtered.joints.astype(np.float64)),
        R_reference_from_source @ rectified.R_source_from_body,
        level_ok=rectified.level_ok,
        lifted=lifted,
        error_deg=rectified.error_deg,
        up_error_deg=rectified.up_error_deg,
        unseen=poses.confidence == 0,
        stated=stated_spread(source),
        feet=source.feet,
        filtered_feet=feet,
    )
    rates = angle_rates(series, source.times, breaks(source), rates_by_error)
    columns = {}
    for name, angle in series.items():
        columns[f"{name}_deg"] = angle.value_deg
        columns[f"{name}_sd_deg"] = angle.sd_deg
        columns[f"{name}_degps"], columns[f"{name}_sd_degps"] = rates[name]
        columns[f"{name}_reason"] = angle.reason
    return columns


def _notices(columns: dict[str, np.ndarray]) -> list[Notice]:
    """A note for each reason that took values away: from which angles, and how many."""
    notices = []
    for code, words in REASONS.items():
        if code == FINE:
            continue
        reasons = {name: columns[f"{name}_reason"] for name in ALL_ANGLES if f"{name}_reason" in columns}
        lost = {name: int((reason == code).sum()) for name, reason in reasons.items()}
        worst = sorted((name for name in lost if lost[name]), key=lambda name: -lost[name])
        if worst:
            most = ", ".join(f"{name} ({lost[name]})" for name in worst[:3])
            more = f" and {len(worst) - 3} more" if len(worst) > 3 else ""
            values: dict[str, Any] = {"angles": most + more, "reason": words}
            notices.append(notice("angles-left-out", **values, frames=lost))
    return notices
