"""People who jump: with stiff legs, a known fall; and with a countermovement, off their toes."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.place.flights import SEGMENTS
from pcnet3d.pipeline import H36M17, LEVEL, PoseSequence
from pcnet3d.pipeline.core.pose import RootPath

STATURE_M = 1.7
HIGH_M = 0.35


def standing() -> np.ndarray:
    """(17, 3) metres, the pelvis as origin, z up."""
    walk = walker(seconds=1.0, stature_m=STATURE_M)
    return walk.world[0] - walk.root[0]


def jumping(slowed: float = 1.0, fps: float = 30.0, noise_m: float = 0.0) -> PoseSequence:
    """Two jumps in LEVEL with `root`: the pelvis stands at 0.9 m, flies 0.35 m high and stands again."""
    time_s = np.arange(0, 5 * slowed, 1 / fps)
    real = time_s / slowed
    z = 0.9 + sum(np.maximum(0.0, HIGH_M - 9.81 / 2 * (real - at) ** 2) for at in (1.5, 3.3))
    root = np.stack([0.3 * real, np.zeros_like(z), z], axis=-1)
    joints = np.repeat(standing()[None], len(z), axis=0)
    joints = joints + np.random.default_rng(3).normal(0, noise_m, joints.shape)
    return PoseSequence(joints, H36M17, LEVEL, time_s=time_s, path=RootPath(root))


SHANK_M, THIGH_M = 0.41, 0.41
FOOT_M = (0.14, 0.06)  # from the ball of a flat foot back to the ankle, and up
_HALVES_M = {"hip": 0.09, "shoulder": 0.17, "elbow": 0.20, "wrist": 0.20}  # from the body's middle
_TRUNK_M = {"pelvis": 0.0, "spine": 0.23, "thorax": 0.50, "nose": 0.62, "head": 0.78, "shoulder": 0.47, "elbow": 0.18,
            "wrist": -0.05}  # fmt: skip
_LEAN = 0.4  # of the trunk, as a share of how far shank and thigh lean
_STIFF_RAD = 0.15  # lean of shank and thigh in the air
_HEELS_S = 0.14  # in which the heels rise before the toes leave, and sink after a landing


@dataclass(frozen=True)
class ToeJump:
    """world: (T, 17, 3) metres, z up. off_s, land_s: when the toes leave the floor and meet it."""

    world: np.ndarray
    time_s: np.ndarray
    off_s: float
    land_s: float


def toe_jump(
    high_m: float = 0.3,
    deep_rad: float = 0.8,
    heels_rad: float = 1.0,
    fps: float = 30.0,
    phase_s: float = 0.0,
) -> ToeJump:
    """A jump with a countermovement. deep_rad: how far shank and thigh lean at its deepest, and after landing;
    heels_rad: how far the feet turn on their balls before these leave the floor: 1.0 lifts the ankles by 9 cm. They
    turn back by half in the air."""
    lowest, rest = _over_balls(deep_rad, 0.0), _over_balls(0.0, 0.0)
    highest = _over_balls(_STIFF_RAD, heels_rad) + high_m
    apex_s, sink_s, bodies = 2.0, 0.6, []
    turned = (heels_rad, heels_rad / 2)  # at the take-off, at the landing
    over = [_over_balls(_STIFF_RAD, heels) for heels in turned]
    air_s = [np.sqrt(2 * (highest - high) / 9.81) for high in over]
    time_s = np.arange(0, 4, 1 / fps) + phase_s
    for way in time_s - apex_s:
        end = int(way > 0)
        floor_s = abs(way) - air_s[end]  # since the balls of the feet are on the floor
        if floor_s <= 0:
            heels = np.interp(way, [-air_s[0], air_s[1]], turned)
            body = posed(_STIFF_RAD, heels)
            body[:, 2] += highest - 9.81 / 2 * way**2 - _centre(body)
            bodies.append(body)
            continue
        push_s = 2 * (over[end] - lowest) / (9.81 * air_s[end])
        if floor_s <= push_s:
            centre = lowest + (over[end] - lowest) * (1 - floor_s / push_s) ** 2
        else:
            centre = lowest + (rest - lowest) * (1 - np.cos(np.pi * min((floor_s - push_s) / sink_s, 1))) / 2
        heels = turned[end] * max(1 - floor_s / min(_HEELS_S, push_s / 2), 0)
        lean = brentq(lambda lean, heels=heels, centre=centre: _over_balls(lean, heels) - centre, 0, 1.4)
        bodies.append(posed(lean, heels))
    return ToeJump(np.array(bodies), time_s, apex_s - air_s[0], apex_s + air_s[1])


def posed(lean: float, heels: float) -> np.ndarray:
    """(17, 3) metres over the balls of the feet. lean: of shank and thigh from upright; heels: how far the feet are
    turned on their balls; radians."""
    back, up = FOOT_M
    ankle = np.array([up * np.sin(heels) - back * np.cos(heels), back * np.sin(heels) + up * np.cos(heels)])
    knee = ankle + SHANK_M * np.array([np.sin(lean), np.cos(lean)])
    pelvis = knee + THIGH_M * np.array([-np.sin(lean), np.cos(lean)])
    trunk = np.array([np.sin(_LEAN * lean), np.cos(_LEAN * lean)])
    places = {"ankle": ankle, "knee": knee, "hip": pelvis}
    places |= {part: pelvis + along * trunk for part, along in _TRUNK_M.items()}
    joints = []
    for joint in H36M17.joints:
        side, _, part = joint.rpartition("_")
        ahead, high = places[part]
        half = _HALVES_M.get(part, 0.0 if not side else _HALVES_M["hip"])
        joints.append([ahead + 0.06 * (part == "nose"), {"r": -half, "l": half, "": 0.0}[side], high])
    return np.array(joints)


def _centre(body: np.ndarray) -> float:
    """The height of the centre of mass of joints (17, 3), by the segments of models/place/flights.py."""
    shares = [
        share * ((1 - along) * body[H36M17.index(a)] + along * body[H36M17.index(b)])
        for a, b, share, along in SEGMENTS
    ]
    return float(np.sum(shares, axis=0)[2] / sum(share for _, _, share, _ in SEGMENTS))


def _over_balls(lean: float, heels: float) -> float:
    """How high the centre of mass is over the balls of the feet."""
    return _centre(posed(lean, heels))
