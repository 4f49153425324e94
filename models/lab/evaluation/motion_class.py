"""What a person in motion capture is doing, frame by frame, by formulas simple enough to be argued with.

The three that clinics film most; a frame may belong to several (walking bent low) or to none. Speed is taken over half
a second around the frame, less at a clip's ends; a clip of one frame has none.
"""

from __future__ import annotations

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import angle_deg
from ...common.canonical import R_world_from_body

_HALF_S = 0.25
_WALK, _RUN = 0.5, 2.0  # m/s of the pelvis; people change from walking to running at about 2
_LOW = 0.75  # of the leg's length; knees bent by about 80 degrees
_SEATED_M = 0.1  # the trunk's middle this far behind the ankles: nobody squats like that without falling
_SEATED_DEG = 45.0  # from the vertical, beyond which a trunk leans back or lies
_ON_SEAT_S = 0.5  # on it for at least so long, or somebody falls or jumps
_TO_SEAT_S = 1.0  # sitting down, standing up

CLASSES = ("walking", "squatting", "sitting")


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
