"""What a person in motion capture is doing, frame by frame, by formulas simple enough to be argued with.

A frame may belong to several classes (running with an arm up) or to none (stepping slowly sideways). Speed and
turning are taken over half a second around the frame, less at a clip's ends; a clip of one frame has neither.
"""

from __future__ import annotations

import numpy as np

from ....pipeline.core.canonical import R_world_from_body
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import angle_deg

_HALF_S = 0.25
_SLOW, _WALK, _RUN = 0.2, 0.5, 2.0  # m/s of the pelvis; people change from walking to running at about 2
_BENT_DEG = 30.0
_LOW = 0.75  # of the leg's length; knees bent by about 80 degrees
_TURN_DEGPS = 60.0
_SEATED_M = 0.1  # the trunk's middle this far behind the ankles: nobody squats like that without falling
_SEATED_DEG = 45.0  # from the vertical, beyond which a trunk leans back or lies
_ON_SEAT_S = 0.5  # on it for at least so long, or somebody falls or jumps
_TO_SEAT_S = 1.0  # sitting down, standing up

CLASSES = (
    "standing", "walking", "running", "bending", "squatting", "sitting", "arms overhead", "turning",
)  # fmt: skip


def motion_classes(joints_world: np.ndarray, fps: float) -> dict[str, np.ndarray]:
    """{class: (T,) bool} for one take; joints (T, 17, 3) metres, H36M17, in a still world with +Z up.

    walking, running: the pelvis moves over the floor at 0.5 to 2 m/s, or faster, whatever the legs do.
    bending: the trunk, mid-hips to mid-shoulders, is more than 30 degrees from vertical, in any direction.
    squatting: the pelvis is less than 0.75 of the leg's length (thigh and shank) above the lower ankle, and the person
        is not seated; kneeling counts too.
    sitting: seated on a chair or the floor, and the second before and after, sitting down and standing up. Seated: for
        half a second or more the pelvis is as low and moves at less than 0.5 m/s, the trunk is upright, and its middle
        is more than 10 cm behind the ankles, so that something else bears it.
    arms overhead: a wrist is higher than the top of the head.
    turning: the heading (pipeline.core.canonical) changes by more than 60 degrees a second.
    standing: none of these, and the pelvis moves at less than 0.2 m/s.
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
    heading = np.arctan2(-back[:, 1], -back[:, 0])
    turned = np.abs(np.degrees(_rate(heading, fps, period=2 * np.pi)))
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
    wrists = np.maximum(at("l_wrist")[:, 2], at("r_wrist")[:, 2])
    classes = {
        "walking": (speed > _WALK) & (speed <= _RUN),
        "running": speed > _RUN,
        "bending": lean > _BENT_DEG,
        "squatting": low & ~seated,
        "sitting": maximum_filter1d(seated, 2 * round(_TO_SEAT_S * fps) + 1, mode="constant"),
        "arms overhead": wrists > at("head")[:, 2],
        "turning": turned > _TURN_DEGPS,
    }
    return {"standing": (speed < _SLOW) & ~np.any([*classes.values()], axis=0), **classes}


def _rate(values: np.ndarray, fps: float, period: float | None = None) -> np.ndarray:
    """Change per second over half a second around every frame of values (T, ...); of angles, the shorter way round."""
    frames = np.arange(len(values))
    half = max(round(_HALF_S * fps), 1)
    first, last = np.maximum(frames - half, 0), np.minimum(frames + half, len(values) - 1)
    change = values[last] - values[first]
    if period is not None:
        change = (change + period / 2) % period - period / 2
    seconds = (last - first) / fps
    return change / np.where(seconds > 0, seconds, np.nan).reshape(-1, *[1] * (values.ndim - 1))
