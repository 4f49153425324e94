"""How the walker moves: joint angles, heading and the path of the pelvis as functions of continuous time.

Gait: Fourier series of the thigh and the knee that stay within 3.5 degrees of the values at the ends of the eight
phases of the cycle in Perry & Burnfield, Gait Analysis: Normal and Pathological Function, 2nd ed. 2010 (thigh to
the vertical 20, 20, 0, -20, -10, 15, 25 and knee flexion 5, 15, 5, 5, 40, 60, 25 degrees at 0, 12, 31, 50, 62, 75
and 87 % of the cycle), fitted so that the standing foot stays within 4 mm of its place. The pelvis rises and
falls by 4 cm twice a stride and turns by 4 degrees against the shoulders; the arms swing from 24 degrees of
extension to 8 of flexion against the leg of their side (Perry & Burnfield, on the arms). The parts of the motion
are joined by minimum-jerk steps (Flash & Hogan, J Neurosci 1985), so accelerations are continuous.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...pipeline.core.anthropometry import ANKLE_HEIGHT, SEGMENTS
from .skeleton import UP, horizontal

# Fourier series over the gait cycle, which begins with the heel strike of the same side: the mean, then cosine
# and sine of the first harmonic, the second, ... Degrees; the pelvis in statures above the floor.
_Series = tuple[float, tuple[tuple[float, float], ...]]
_THIGH: _Series = (6.8, ((20.9, -4.2), (-3.5, -1.3), (-0.1, 1.8), (-1.0, -0.3)))
_KNEE: _Series = (20.8, ((-2.1, -19.5), (-14.1, 6.7), (0.2, 6.5), (-1.2, -0.1)))
_FOOT: _Series = (-12.6, ((19.9, 21.4), (12.4, -15.7), (-3.1, -3.3), (1.4, -0.2)))  # toes above heel
_SHOULDER: _Series = (-8.0, ((-16.0, 0.0),))
_ELBOW: _Series = (30.0, ((-12.0, 0.0),))
_PELVIS_TURN: _Series = (0.0, ((4.0, 0.0),))  # to the left, over the right leg's cycle
_PELVIS_HEIGHT: _Series = (0.5177, ((0.0, 0.0), (-0.0118, -0.0017)))
_STRIDE = 0.77  # statures; the length at which the standing foot stays put

# Degrees. Squat and arm raise are what is added to standing at their deepest and highest.
_STANDING = {"thigh": 2.0, "knee": 4.0, "trunk": 3.0, "shoulder": 3.0, "elbow": 12.0}
_SQUAT = {"thigh": 73.0, "knee": 96.0, "trunk": 37.0, "shoulder": 120.0}
_RAISE = {"shoulder": 167.0, "elbow": -6.0}
_HEAD_SHARE = 0.3  # of the trunk's lean that the head follows

_SHARES = {"walk": 0.45, "squat": 0.30, "arms": 0.25}  # of the take's length
_STOP_S = 1.0  # from full speed to standing


@dataclass(frozen=True)
class Motion:
    """One take; arguments as those of examples.walker.walk.walker. Times t are (T,) seconds."""

    seconds: float
    speed_mps: float
    stature_m: float
    heading_deg: float
    turn_deg: float

    @property
    def phases_s(self) -> dict[str, tuple[float, float]]:
        """Start and end of "walk", "squat" and "arms"."""
        times = (np.cumsum([0.0, *_SHARES.values()]) * self.seconds).tolist()
        return dict(zip(_SHARES, pairwise(times), strict=True))

    @property
    def stop_s(self) -> float:
        """When the walk begins to slow down; it ends with its phase."""
        end = self.phases_s["walk"][1]
        return end - min(_STOP_S, end / 2)

    @property
    def strides_hz(self) -> float:
        return self.speed_mps / (_STRIDE * self.stature_m)

    def heel_strikes_s(self, side: str) -> np.ndarray:
        """Times of one side's heel strikes at full speed."""
        times = self._first_strike_s(side) + np.arange(self.stop_s * self.strides_hz) / self.strides_hz
        return times[times < self.stop_s]

    def _first_strike_s(self, side: str) -> float:
        return 0.0 if side == "r" else 0.5 / self.strides_hz

    def angles(self, t: np.ndarray) -> dict[str, np.ndarray]:
        """(T,) degrees by name, as examples.walker.walk.Walk describes them."""
        walk = self._walking(t)
        squat, rise = self._there_and_back("squat", t), self._there_and_back("arms", t)

        def blend(part: str, gait: _Series, cycle: np.ndarray) -> np.ndarray:
            still = _STANDING[part]
            moved = squat * _SQUAT.get(part, 0.0) + rise * _RAISE.get(part, 0.0)
            return still + walk * (_evaluate(gait, cycle) - still) + moved

        lean = _STANDING["trunk"] + squat * _SQUAT["trunk"]
        angles = {
            "trunk_lean_deg": lean,
            "head_lean_deg": _HEAD_SHARE * lean,
            "pelvis_turn_deg": walk * _evaluate(_PELVIS_TURN, self._cycle("r", t)),
        }
        for side in "lr":
            cycle = self._cycle(side, t)
            angles |= {
                f"{side}_thigh_trunk_flexion_deg": blend("thigh", _THIGH, cycle) + lean,
                f"{side}_knee_flexion_deg": blend("knee", _KNEE, cycle),
                f"{side}_foot_pitch_deg": walk * _evaluate(_FOOT, cycle),
                f"{side}_shoulder_flexion_deg": blend("shoulder", _SHOULDER, cycle),
                f"{side}_elbow_flexion_deg": blend("elbow", _ELBOW, cycle),
            }
        return angles

    def heading(self, t: np.ndarray) -> np.ndarray:
        """(T,) degrees."""
        return self.heading_deg + self._bend() * self._to_go(t)

    def root(self, t: np.ndarray) -> np.ndarray:
        """(T, 3): along the path, and in a squat where the legs hold the pelvis over ankles that stay put."""
        squat = self._there_and_back("squat", t)
        forward, down = _leg(*(_STANDING[part] + squat * _SQUAT[part] for part in ("thigh", "knee")))
        still_forward, still_down = _leg(_STANDING["thigh"], _STANDING["knee"])
        lower = still_down + ANKLE_HEIGHT - _evaluate(_PELVIS_HEIGHT, self._cycle("r", t))
        # While the swing of the legs dies down the pelvis rises with the square of its amplitude.
        height = down + ANKLE_HEIGHT - self._walking(t) ** 2 * lower
        to_go = self._to_go(t)
        turned = self._bend() * to_go
        chord = to_go * np.sinc(turned / 360)  # of the arc
        path = chord[:, None] * horizontal(self.heading_deg + turned / 2)
        sway = (still_forward - forward)[:, None] * horizontal(self.heading(t))
        return path + self.stature_m * (sway + height[:, None] * UP)

    def _walking(self, t: np.ndarray) -> np.ndarray:
        """(T,) 1 at full speed, 0 when standing."""
        return 1 - _step(self._slowed(t))

    def _slowed(self, t: np.ndarray) -> np.ndarray:
        return (t - self.stop_s) / (self.phases_s["walk"][1] - self.stop_s)

    def _there_and_back(self, phase: str, t: np.ndarray) -> np.ndarray:
        """(T,) from 0 to 1 and back within the phase."""
        start, end = self.phases_s[phase]
        share = (t - start) / (end - start)
        return _step((share - 0.04) / 0.42) - _step((share - 0.54) / 0.42)

    def _cycle(self, side: str, t: np.ndarray) -> np.ndarray:
        """(T,) gait cycles since that leg's first heel strike."""
        return (t - self._first_strike_s(side)) * self.strides_hz

    def _to_go(self, t: np.ndarray) -> np.ndarray:
        """(T,) metres along the path, counted from where the walk ends: 0 there, negative before."""
        slowing = self.phases_s["walk"][1] - self.stop_s
        share = np.clip(self._slowed(t), 0, 1)
        slowed = share - (2.5 * share**4 - 3 * share**5 + share**6)  # integral of 1 - _step
        return self.speed_mps * (np.minimum(t - self.stop_s, 0) + slowing * (slowed - 0.5))

    def _bend(self) -> float:
        """Degrees to the left for each metre of the path."""
        return self.turn_deg / -float(self._to_go(np.zeros(1))[0])


def _evaluate(series: _Series, cycle: np.ndarray) -> np.ndarray:
    value, harmonics = series[0] + np.zeros_like(cycle), series[1]
    for n, (cosine, sine) in enumerate(harmonics, 1):
        turns = 2 * np.pi * n * cycle
        value = value + cosine * np.cos(turns) + sine * np.sin(turns)
    return value


def _step(share: np.ndarray) -> np.ndarray:
    """0 below 0, 1 above 1, and the minimum-jerk polynomial between."""
    share = np.clip(share, 0, 1)
    return share**3 * (10 - 15 * share + 6 * share**2)


def _leg(thigh_deg: np.ndarray | float, knee_deg: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """How far the ankle lies in front of and below the hip, in statures."""
    thigh, shank = np.radians(thigh_deg), np.radians(np.subtract(thigh_deg, knee_deg))
    lengths = SEGMENTS["l_hip", "l_knee"], SEGMENTS["l_knee", "l_ankle"]
    forward = lengths[0] * np.sin(thigh) + lengths[1] * np.sin(shank)
    return forward, lengths[0] * np.cos(thigh) + lengths[1] * np.cos(shank)
