"""How well a lifter does where the truth is known:  pcnet3d lab evaluate lifter -o DIR

Virtual takes of people that it never saw, the focal length assumed; by posture, and by what clinics film most, in
formulas simple enough to be argued with. A frame may belong to several of these (walking bent low) or to none. p50 /
mean / p95 over frames, the scale aligned in each; mm of each person's own size; by person: the mean over frames, in
brackets 90 % of the means over people drawn anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import angle_deg
from ...common.canonical import R_world_from_body
from ...common.metrics import joint_error
from ...lifter.features import body_rays
from ..beds import BEDS, Configuration, LiftedTake, SeenTake, lifted
from ..cases import Cases, Row, column, figures, procrustes_error, scaled
from ..clips import subject_of

_HALF_S = 0.25
_WALK, _RUN = 0.5, 2.0  # m/s of the pelvis; people change from walking to running at about 2
_LOW = 0.75  # of the leg's length; knees bent by about 80 degrees
_SEATED_M = 0.1  # the trunk's middle this far behind the ankles: nobody squats like that without falling
_SEATED_DEG = 45.0  # from the vertical, beyond which a trunk leans back or lies
_ON_SEAT_S = 0.5  # on it for at least so long, or somebody falls or jumps
_TO_SEAT_S = 1.0  # sitting down, standing up


def rows(asked: Configuration) -> Iterator[Row]:
    """("beds", bed, "focal assumed", "SET GROUP", "lifter"): `lift_errors` of the frames of a group, a posture or a
    motion (`motion_classes`), of the takes that have such frames."""
    for bed in BEDS:
        for people in asked.sets:
            takes = [
                (groups_of(take.seen), lift_errors(take)) for take in lifted(replace(asked, bed=bed), people)
            ]
            for group in takes[0][0]:
                place = ("beds", bed, "focal assumed", f"{people.label} {group}", "lifter")
                yield from ((place, of.where(groups[group])) for groups, of in takes if groups[group].any())


def groups_of(seen: SeenTake) -> dict[str, np.ndarray]:
    """{group: (T,) bool}: "upright" or "lying", or upright and of a motion (`motion_classes`)."""
    of_motion = motion_classes(seen.world, seen.keypoints.fps)
    upright = {name: ~seen.lying & frames for name, frames in of_motion.items()}
    return {"upright": ~seen.lying, "lying": seen.lying, **upright}


def lift_errors(take: LiftedTake) -> Cases:
    """Errors of every frame in mm of the person's own size, the lift scaled to the truth in every frame (as for a
    lifter without a scale; N-MPJPE, Rhodin et al. 2018). depth, lateral, vertical: mean absolute error along the ray to
    the body, across it and level, and up."""
    truth, found = take.seen.truth, take.lifted.joints.astype(np.float64)
    fitted = scaled(found, truth)
    errors = {
        "MPJPE": 1000 * joint_error(fitted, truth),
        "PA-MPJPE": 1000 * procrustes_error(found, truth),
        **_along(fitted - truth, take.seen),
    }
    return Cases(subject_of(take.seen.clip), errors)


def summary(takes: Sequence[Cases]) -> dict[str, dict[str, Any]]:
    """Of `lift_errors`."""
    of = figures(takes, ("MPJPE", "PA-MPJPE"))
    frames = column(takes, "MPJPE")
    return {
        "by person": of.pop("by person"),
        "frame": of,
        "counts": {"frames": len(frames), "not lifted": int(np.isnan(frames).sum())},
    }


def _along(error: np.ndarray, seen: SeenTake) -> dict[str, np.ndarray]:
    """(T,) mean absolute error in mm along the ray to the body, along up made square to it, and across both."""
    depth = body_rays(seen.joints_camera)[..., 2]
    up = seen.up - (seen.up * depth).sum(-1, keepdims=True) * depth
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    axes = {"depth": depth, "lateral": np.cross(depth, up), "vertical": up}
    return {name: 1000 * np.abs(np.einsum("tji,ti->tj", error, axis)).mean(-1) for name, axis in axes.items()}


def motion_classes(joints_world: np.ndarray, fps: float) -> dict[str, np.ndarray]:
    """{class: (T,) bool} for one take; joints (T, 17, 3) metres, H36M17, in a still world with +Z up.

    walking: the pelvis moves over the floor at 0.5 to 2 m/s, whatever the legs do.
    squatting: the pelvis is less than 0.75 of the leg's length (thigh and shank) above the lower ankle, and the person
        is not seated; kneeling counts too.
    sitting: seated on a chair or the floor, and the second before and after, sitting down and standing up. Seated: for
        half a second or more the pelvis is as low and moves at less than 0.5 m/s, the trunk is upright, and its middle
        is more than 10 cm behind the ankles, so that something else bears it.
    """
    from scipy.ndimage import binary_opening, maximum_filter1d

    joints = joints_world.astype(np.float64)

    def at(name: str) -> np.ndarray:
        return joints[:, H36M17.index(name)]

    def middle(part: str) -> np.ndarray:
        return (at(f"l_{part}") + at(f"r_{part}")) / 2

    def length(a: str, b: str) -> np.ndarray:
        return np.linalg.norm(at(a) - at(b), axis=-1)

    speed = np.linalg.norm(_rate(at("pelvis")[:, :2], fps), axis=-1)
    back = R_world_from_body(joints)[..., 0]
    trunk = middle("shoulder") - middle("hip")
    leg = np.mean(
        [length(f"{s}_{a}", f"{s}_{b}") for s in "lr" for a, b in (("hip", "knee"), ("knee", "ankle"))], 0
    )
    height = at("pelvis")[:, 2] - np.minimum(at("l_ankle")[:, 2], at("r_ankle")[:, 2])
    low = height < _LOW * 2 * leg
    lean = angle_deg(trunk, np.broadcast_to([0.0, 0.0, 1.0], trunk.shape))
    behind = (((at("pelvis") + at("thorax")) / 2 - middle("ankle")) * back).sum(axis=-1)
    seated = low & (speed < _WALK) & (lean < _SEATED_DEG) & (behind > _SEATED_M)
    seated = np.asarray(binary_opening(seated, np.ones(max(round(_ON_SEAT_S * fps), 1))), dtype=bool)
    return {
        "walking": (speed > _WALK) & (speed <= _RUN),
        "squatting": low & ~seated,
        "sitting": maximum_filter1d(seated, 2 * round(_TO_SEAT_S * fps) + 1, mode="constant"),
    }


def _rate(values: np.ndarray, fps: float) -> np.ndarray:
    """(T, 2) change per second of values (T, 2) over half a second around every frame."""
    frames = np.arange(len(values))
    half = max(round(_HALF_S * fps), 1)
    first, last = np.maximum(frames - half, 0), np.minimum(frames + half, len(values) - 1)
    seconds = (last - first) / fps
    return (values[last] - values[first]) / np.where(seconds > 0, seconds, np.nan)[:, None]
