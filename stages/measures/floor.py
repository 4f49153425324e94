"""The floor that the person walks on, by where the feet stand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...models.angle_error.repeatability import known_median
from ...models.gait.contact import SIDES
from ...models.gait.errors import own_covariance
from ...models.gait.foot_lock import flat_rows
from ...models.gait.gait import Gait
from ...models.gait.walked_floor import FEWEST, walked_floor
from ...models.place.airborne import no_place
from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.camera import ASSUMED_FOCAL_SD
from ...pipeline.core.measures import SD_90, Measure, Remark, Row, grouped, text, value
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.filters import breaks
from .figures import with_error

_STEEPEST_DEG = 45.0  # nobody walks on a steeper floor
_CROPPED = 2.0  # times as long as its lens says, where nobody says that: half of the image was cut out
_ANKLE = 0.039  # statures above the sole (Winter, Biomechanics and Motor Control, 4th ed. 2009, figure 4.1)


def floor(
    walking: Sequence[Row], gait: Gait, filtered: PoseSequence, rectified: Rectified, judged: bool
) -> list[Row]:
    """The group `floor`: height over where the path is counted from (the camera), slope along the walk, both with their
    errors, and `stairs`; or the reason why there are none. Of a path that no run has estimated the height has no
    error, nor the slope where an estimator made it. On the belt of a treadmill, and without a walk, feet stand in the
    same places again and again, which tells its height only. walking: the rows of the group `walking`. judged: whether
    the built-in lifter made the poses; what a run has estimated by others' has no errors."""
    if filtered.root is None:
        return [Remark("reason", no_place(rectified))]
    walked = grouped(walking)
    if text(walked, "reason"):
        return [Remark("reason", "it is found by steps, and whether there are any cannot be told")]
    ankles = {side: filtered.joint(f"{side}_ankle").astype(np.float64) for side in SIDES}
    flat = [
        (side, rows)
        for side, rows in flat_rows(gait.feet, is_finite(filtered.root), filtered.times, breaks(filtered))
        if np.isfinite(ankles[side][rows]).all()
    ]
    places = np.array([(filtered.root + ankles[side])[rows].mean(axis=0) for side, rows in flat])
    own, shared = _sds(filtered, rectified)
    up = rectified.up_error_deg[np.isfinite(rectified.up_error_deg)]
    up_sd_deg = float(np.median(up) / np.sqrt(2)) if len(up) else 0.0
    places = places.reshape(-1, 3)
    found = walked_floor(places, own, shared, up_sd_deg, _deeper(places, filtered, rectified))
    if found is None:
        return [Remark("reason", f"feet stand in fewer than {FEWEST} places")]
    if not abs(found.slope_deg) < _STEEPEST_DEG:
        slope = f"the floor would slope by {abs(found.slope_deg):.0f} degrees"
        return [Remark("reason", f"{slope}: up, the focal length or the camera's motion is wrong")]
    # Places that are measured are alike to a millimetre; where the ankles are above the soles is not known so well.
    stated = judged and filtered.root_covariance is not None
    height_sd = found.height_sd if stated else float("nan")
    # The path of others may rise by itself.
    known = len(up) and (stated or filtered.measured_root is not None)
    slope_sd_deg = found.slope_sd_deg if known else float("nan")
    height = found.height - _ANKLE * implied_stature(filtered.joints)
    rise: list[Row] = [
        with_error("slope", "deg", found.slope_deg, slope_sd_deg),
        Remark("stairs", found.stairs),
    ]
    if text(walked, "belt"):
        rise = [Remark("slope_reason", "the feet are carried by a belt")]
    elif not value(walked, "steps"):  # the places of one who stands lie beside one another too
        rise = [Remark("slope_reason", "no walk was found")]
    return [
        with_error("floor_height", "length", height, height_sd),
        *rise,
        Measure("places", len(places)),
    ]


def _deeper(places: np.ndarray, filtered: PoseSequence, rectified: Rectified) -> np.ndarray | float:
    """By how much places (N, 3) lie further along the camera's axis with the longest focal length that it may have; 0
    where the source itself knows the place."""
    if filtered.root_shared is None or rectified.R_source_from_level.ndim != 2:
        return 0.0
    axis, sd = rectified.R_source_from_level[2], filtered.root_shared[1]
    longest = (1 + SD_90 * sd) * (_CROPPED if sd >= ASSUMED_FOCAL_SD else 1.0)
    return (longest - 1) * (places @ axis)[:, None] * axis


def _sds(filtered: PoseSequence, rectified: Rectified) -> tuple[float, float]:
    """Standard deviations of the height of a foot's place, its own and that of all alike; 0, 0 where the source itself
    knows the place."""
    whole = filtered.root_covariance
    if filtered.root is None or whole is None or filtered.root_shared is None:
        return 0.0, 0.0
    own = own_covariance(filtered.root, whole, rectified.R_source_from_level[2], *filtered.root_shared)
    legs = 0.0
    if rectified.level.covariance is not None:
        index = filtered.layout.indices([f"{side}_ankle" for side in SIDES])
        legs = float(np.nanmedian(rectified.level.covariance[:, index, 2, 2]))
    own_variance, variance = (known_median(each[:, 2, 2]) for each in (own, whole))
    return float(np.sqrt(own_variance + legs)), float(np.sqrt(max(variance - own_variance, 0.0)))
